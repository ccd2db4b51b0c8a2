"""Callables of Python as distances: values, exceptions and wrong results."""

from typing import Any

import numpy
import numpy.typing
import pytest

import hpsdf

Array = numpy.typing.NDArray[Any]

BOX = ((-1.2,) * 3, (1.2,) * 3)


def sphere(points: Array) -> Any:
    return numpy.linalg.norm(points, axis=1) - 1


def test_the_field_of_a_sphere(points: Array) -> None:
    field = hpsdf.build(sphere, box=BOX, target_error=1e-8)
    inside = points[(abs(points) < 1.2).all(axis=1) & (numpy.linalg.norm(points, axis=1) > 0.3)]
    assert abs(field(inside) - sphere(inside)).max() < 2e-3
    again = hpsdf.build(sphere, box=BOX, target_error=1e-8, threads=1)
    assert numpy.array_equal(again(points), field(points))


def test_points_may_be_kept_and_results_converted(points: Array) -> None:
    kept = []

    def keeping(points: Array) -> Any:
        assert points.flags.owndata and points.dtype == numpy.float64 and points.shape[1] == 3
        kept.append((points, points.copy()))
        return sphere(points).astype(numpy.float32)[::-1].tolist()[::-1]

    hpsdf.build(keeping, box=BOX, target_error=1e-3)
    assert kept and all(numpy.array_equal(points, copy) for points, copy in kept)


def test_a_callable_may_query_other_fields(field: hpsdf.Field, exact: hpsdf.ExactDistance, points: Array) -> None:
    offset = hpsdf.build(lambda points: field(points) - 0.1, box=BOX, target_error=1e-5)
    assert abs(offset(points) - field(points) + 0.1).max() < 0.05
    hpsdf.build(lambda points: exact(points) - 0.1, box=BOX, target_error=1e-3)

    def nested(points: Array) -> Any:
        return hpsdf.build(sphere, box=BOX, max_steps=1, target_error=None)(points)

    hpsdf.build(nested, box=BOX, max_steps=1, grid=1)


@pytest.mark.parametrize("threads", [1, 0])
def test_exceptions_pass_through(threads: int) -> None:
    class Broken(Exception):
        pass

    error = Broken("no distance")

    def broken(points: Array) -> Array:
        raise error

    with pytest.raises(Broken) as caught:
        hpsdf.build(broken, box=BOX, threads=threads)
    assert caught.value is error
    calls = []

    def broken_later(points: Array) -> Any:
        calls.append(len(points))
        if len(calls) > 300:
            raise Broken
        return sphere(points)

    with pytest.raises(Broken):
        hpsdf.build(broken_later, box=BOX, target_error=1e-9, threads=threads)


@pytest.mark.parametrize(
    "result, error, text",
    [
        (lambda points: points, ValueError, r"expected an array of shape \(\d+,\) for points of shape \(\d+, 3\), got"),
        (lambda points: 0.0, ValueError, r"expected an array of shape .* got \(\)"),
        (lambda points: sphere(points)[1:], ValueError, "expected an array of shape"),
        (lambda points: sphere(points)[:, None], ValueError, "expected an array of shape"),
        (lambda points: None, TypeError, "the result of the callable: expected an array of real numbers"),
        (lambda points: sphere(points) + 0j, TypeError, "the result of the callable: .* got one of complex128"),
        (lambda: 0.0, TypeError, "argument"),
        (lambda points: sphere(points) * numpy.nan, hpsdf.Error, "not finite|finite"),
    ],
)
def test_wrong_results_are_refused(result: Any, error: Any, text: str) -> None:
    with pytest.raises(error, match=text):
        hpsdf.build(result, box=BOX)


def test_a_callable_needs_corners() -> None:
    with pytest.raises(hpsdf.OptionError, match="box: expected the two corners of the domain"):
        hpsdf.build(sphere)
    with pytest.raises(TypeError, match="surface: expected a mesh, an ExactDistance, a CombinedDistance or a callable, got 'int'"):
        hpsdf.build(3, box=BOX)  # type: ignore[arg-type]
