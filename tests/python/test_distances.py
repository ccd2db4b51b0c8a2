"""Exact distances and closest points: equal to those of C++, and what is refused."""

import pathlib
from collections.abc import Callable
from typing import Any

import numpy
import numpy.typing
import pytest

import hpsdf

Array = numpy.typing.NDArray[Any]


def test_equal_those_of_the_program(mesh: hpsdf.TriangleMesh, exact: hpsdf.ExactDistance, points: Array, query: Callable[..., dict[str, Array]]) -> None:
    columns = query(points, "--closest", "builtin:torus")
    closest = exact.closest(points)
    assert numpy.array_equal(closest.distance, columns["distance"].astype(float))
    assert numpy.array_equal(closest.distance, exact(points))
    assert numpy.array_equal(closest.face, columns["face"].astype(int))
    for axis in range(3):
        assert numpy.array_equal(closest.point[:, axis], columns["p" + "xyz"[axis]].astype(float))
        assert numpy.array_equal(closest.barycentric[:, axis], columns[f"b{axis}"].astype(float))


def test_closest_points_agree_with_the_mesh(mesh: hpsdf.TriangleMesh, exact: hpsdf.ExactDistance, points: Array) -> None:
    closest = exact.closest(points.reshape(10, 50, 3))
    assert isinstance(closest, hpsdf.ClosestPoints) and closest.face.shape == (10, 50)
    corners = mesh.vertices[mesh.faces[closest.face]]
    weighted = (closest.barycentric[..., None] * corners).sum(axis=2)
    assert abs(weighted - closest.point).max() < 1e-12
    lengths = numpy.linalg.norm(points.reshape(10, 50, 3) - closest.point, axis=2)
    assert abs(lengths - abs(closest.distance)).max() < 1e-12
    single = exact.closest(points[7])
    assert isinstance(single.distance, float) and isinstance(single.face, int)
    assert single.point.shape == single.barycentric.shape == (3,)


def equal(ours: hpsdf.Samples, theirs: hpsdf.Samples) -> bool:
    return all(numpy.array_equal(one, other) for one, other in zip(ours._asdict().values(), theirs._asdict().values()))


def test_samples_equal_those_of_the_program(
    mesh: hpsdf.TriangleMesh, exact: hpsdf.ExactDistance, program: Callable[..., str], tmp_path: pathlib.Path
) -> None:
    samples = hpsdf.sample(mesh, surface=100, near=300, uniform=50, seed=7)
    words = ("--surface", 100, "--near", 300, "--uniform", 50, "--seed", 7)
    arrays = tmp_path / "torus.npz"
    program("sample", "builtin:torus", "-o", arrays, *words, "--double")
    theirs = numpy.load(arrays)
    assert samples.points.shape == (450, 3)
    for name in ("points", "distances", "gradients", "kinds"):
        assert numpy.array_equal(getattr(samples, name), theirs[name]), name
    assert numpy.array_equal(samples.distances[100:], exact(samples.points[100:]))
    assert numpy.array_equal(samples.faces, exact.closest(samples.points).face)
    assert equal(samples, hpsdf.sample(mesh, surface=100, near=300, uniform=50, seed=7, threads=1))
    assert equal(samples, hpsdf.sample(exact, mesh=mesh, surface=100, near=300, uniform=50, seed=7))
    narrow = hpsdf.sample(
        mesh, surface=100, near=300, uniform=50, seed=7, widths=(0.01, 0.001), enlargement=0.5, float_points=True
    )
    program("sample", "builtin:torus", "-o", arrays, *words, "--widths", "0.01,0.001", "--enlargement", 0.5)
    theirs = numpy.load(arrays)
    assert numpy.array_equal(narrow.points, theirs["points"].astype(float))
    assert numpy.array_equal(narrow.distances.astype(numpy.float32), theirs["distances"])
    edges = hpsdf.sample(hpsdf.load_mesh("builtin:box"), surface=0, near=0, uniform=0, edge=50, sharp_angle=80)
    assert (edges.kinds == 1).all()
    with pytest.raises(hpsdf.Error, match="edge"):
        hpsdf.sample(hpsdf.load_mesh("builtin:box"), edge=50, sharp_angle=100)


def test_samples_of_fields(field: hpsdf.Field, mesh: hpsdf.TriangleMesh, program: Callable[..., str], tmp_path: pathlib.Path) -> None:
    file, arrays = tmp_path / "torus.hpsdf", tmp_path / "torus.npz"
    field.save(file)
    counts: dict[str, Any] = {"surface": 50, "near": 200, "uniform": 50}
    words = ("--surface", 50, "--near", 200, "--uniform", 50, "--double")
    for given, option in ((mesh, ("builtin:torus",)), (None, ())):
        samples = hpsdf.sample(field, mesh=given, **counts)
        program("sample", file, *option, "-o", arrays, *words)
        theirs = numpy.load(arrays)
        for name in ("points", "distances", "gradients", "kinds"):
            assert numpy.array_equal(getattr(samples, name), theirs[name]), name
        assert numpy.array_equal(samples.distances, field(samples.points))
        assert samples.closest.shape == (0, 3) and samples.faces.shape == (0,)


def test_samples_of_what_cannot_be_sampled(mesh: hpsdf.TriangleMesh, exact: hpsdf.ExactDistance) -> None:
    with pytest.raises(hpsdf.OptionError, match="near: expected a number of points from 0"):
        hpsdf.sample(mesh, near=-1)
    with pytest.raises(TypeError, match="source: expected a TriangleMesh.* got 'str'"):
        hpsdf.sample("builtin:torus")  # type: ignore[arg-type]
    with pytest.raises(hpsdf.OptionError, match="widths"):
        hpsdf.sample(mesh, widths=(0.1, 0.0))
    with pytest.raises(TypeError, match="mesh: give the mesh"):
        hpsdf.sample(exact)
    with pytest.raises(TypeError, match="mesh: expected none"):
        hpsdf.sample(mesh, mesh=mesh)
    with pytest.raises(hpsdf.Error, match="not the mesh"):
        hpsdf.sample(exact, mesh=hpsdf.load_mesh("builtin:box"))
    outside = hpsdf.build(lambda points: numpy.full(len(points), 1.0), box=((-1,) * 3, (1,) * 3), target_error=1e-3)
    with pytest.raises(hpsdf.FieldError, match="no surface to sample"):
        hpsdf.sample(outside)


def test_samples_of_a_field_that_its_domain_cuts() -> None:
    half_space = hpsdf.build(lambda points: points[:, 2], box=((-1,) * 3, (1,) * 3), target_error=1e-6)
    samples = hpsdf.sample(half_space, surface=1000, near=0, uniform=0)
    assert abs(samples.points[:, 2]).max() < 1e-3, "the walls of the domain are no surface"


def test_inside_tests(mesh: hpsdf.TriangleMesh) -> None:
    assert hpsdf.ExactDistance(mesh).inside_test == "pseudonormal"
    assert hpsdf.ExactDistance(mesh, inside_test="winding").inside_test == "winding"
    shell = hpsdf.ExactDistance(mesh, inside_test="shell", thickness=0.1)
    assert shell([0, 0, 0]) == abs(hpsdf.ExactDistance(mesh)([0, 0, 0])) - 0.05
    with pytest.raises(hpsdf.OptionError, match="did you mean 'winding'") as caught:
        hpsdf.ExactDistance(mesh, inside_test="windin")  # type: ignore[arg-type]
    assert isinstance(caught.value, ValueError) and caught.value.subject == "inside_test"
    with pytest.raises(hpsdf.Error):
        hpsdf.ExactDistance(mesh, inside_test="shell")
    with pytest.raises(TypeError):
        hpsdf.ExactDistance(mesh, "winding")  # type: ignore[misc]
