"""Expressions of solids: meshes, fields, distances, callables and files as operands."""

import gc
import pathlib
from collections.abc import Callable
from typing import Any

import numpy
import numpy.typing
import pytest

import hpsdf

Array = numpy.typing.NDArray[Any]


def ball(points: Array) -> Any:
    return numpy.linalg.norm(points, axis=1) - 0.5


def test_expressions_of_all_kinds_of_operands(mesh: hpsdf.TriangleMesh, field: hpsdf.Field, exact: hpsdf.ExactDistance, points: Array) -> None:
    distance = hpsdf.combine("difference(a, b)", a=mesh, b=ball)
    assert numpy.array_equal(distance(points), numpy.maximum(exact(points), -ball(points)))
    assert distance([1.0, 0, 0]) == pytest.approx(distance(numpy.array([[1.0, 0, 0]]))[0]) and distance.boundary is None
    inner = points[abs(points).max(axis=1) < 1]
    operands: list[Any] = [field, exact, distance]
    for operand in operands:
        assert numpy.array_equal(hpsdf.combine("offset(a, 0.1)", a=operand)(inner), operand(inner) - 0.1)
    twice = hpsdf.combine("union(a, move(a, 3, 0, 0))", a=mesh)
    assert twice.exactness == "everywhere" and twice.boundary is not None and len(twice.boundary.triangles) == 2 * len(mesh.triangles)
    assert hpsdf.combine("smooth-union(a, b, 0.1)", a=mesh, b=mesh).exactness == "nowhere"


def test_fields_of_expressions_equal_those_of_the_program(mesh: hpsdf.TriangleMesh, program: Callable[..., str], tmp_path: pathlib.Path) -> None:
    expression = "union(builtin:torus, move(builtin:box, 1, 0, 0))"
    program("combine", expression, "-o", tmp_path / "program.hpsdf", "--target-error", "1e-4")
    field = hpsdf.build(hpsdf.combine(expression), target_error=1e-4)
    field.save(tmp_path / "python.hpsdf")
    assert (tmp_path / "python.hpsdf").read_bytes() == (tmp_path / "program.hpsdf").read_bytes()


def test_operands_live_as_long_as_the_distance(mesh: hpsdf.TriangleMesh, points: Array) -> None:
    operand = hpsdf.ExactDistance(mesh)
    expected = operand(points)
    combined = hpsdf.combine("offset(a, 0.1)", a=operand)
    del operand
    gc.collect()
    assert numpy.array_equal(combined(points), expected - 0.1)


def test_files_as_operands(field: hpsdf.Field, tmp_path: pathlib.Path, points: Array) -> None:
    field.save(tmp_path / "torus.hpsdf")
    inner = points[abs(points).max(axis=1) < 1]
    loaded = hpsdf.combine(f"offset('{tmp_path}/torus.hpsdf', 0.1)")
    assert numpy.array_equal(loaded(inner), field(inner) - 0.1)
    with pytest.raises(hpsdf.Error, match="column 8.*none.obj"):
        hpsdf.combine("offset(none.obj, 0.1)")


def test_mistakes(mesh: hpsdf.TriangleMesh) -> None:
    for wrong in ("union(a", "unite(a, a)", "offset(a, x)", "shell(a, -1)", ""):
        with pytest.raises(hpsdf.OptionError):
            hpsdf.combine(wrong, a=mesh)
    with pytest.raises(TypeError, match="'b', which the expression does not name"):
        hpsdf.combine("offset(a, 0.1)", a=mesh, b=mesh)
    with pytest.raises(TypeError, match="a: expected a mesh"):
        hpsdf.combine("offset(a, 0.1)", a=3)  # type: ignore[arg-type]
    with pytest.raises(ZeroDivisionError):
        hpsdf.combine("offset(a, 0.1)", a=lambda points: 1 / 0)([[0.0, 0, 0]])
