"""Arrays as points and results: shapes, types and strides."""

from collections.abc import Callable
from typing import Any

import numpy
import numpy.typing
import pytest

import hpsdf

Array = numpy.typing.NDArray[Any]


def test_any_leading_shape(field: hpsdf.Field, points: Array) -> None:
    expected = field(points)
    assert expected.shape == (500,) and expected.dtype == numpy.float64
    assert numpy.array_equal(field(points.reshape(5, 100, 3)), expected.reshape(5, 100))
    single = field(points[0])
    assert isinstance(single, float) and single == expected[0]
    assert field(numpy.empty((0, 3))).shape == (0,)
    assert field(numpy.empty((4, 0, 3))).shape == (4, 0)
    value, gradient = field.value_and_gradient(points.reshape(5, 100, 3))
    assert value.shape == (5, 100) and gradient.shape == (5, 100, 3)
    value, gradient = field.value_and_gradient(points[0])
    assert isinstance(value, float) and gradient.shape == (3,)
    value, gradient, hessian = field.value_gradient_hessian(points.reshape(5, 100, 3))
    assert value.shape == (5, 100) and gradient.shape == (5, 100, 3) and hessian.shape == (5, 100, 3, 3)
    value, gradient, hessian = field.value_gradient_hessian(points[0])
    assert isinstance(value, float) and gradient.shape == (3,) and hessian.shape == (3, 3)
    assert field.value_gradient_hessian(numpy.empty((4, 0, 3)))[2].shape == (4, 0, 3, 3)


def test_other_numbers_are_converted(field: hpsdf.Field, points: Array) -> None:
    narrow = points.astype(numpy.float32)
    assert numpy.array_equal(field(narrow), field(narrow.astype(numpy.float64)))
    assert field([1, 0, 0]) == field(numpy.array([1.0, 0, 0]))
    assert field([[1, 0, 0], [0, 1, 0]]).shape == (2,)
    swapped = points.astype(points.dtype.newbyteorder())
    assert numpy.array_equal(field(swapped), field(points))


def test_strides_do_not_matter(field: hpsdf.Field, exact: hpsdf.ExactDistance, points: Array) -> None:
    expected = field(points)
    assert numpy.array_equal(field(numpy.asfortranarray(points)), expected)
    assert numpy.array_equal(field(points[::-1]), expected[::-1])
    wide = numpy.zeros((500, 7))
    wide[:, 2:5] = points
    assert numpy.array_equal(field(wide[:, 2:5]), expected)
    assert numpy.array_equal(exact(wide[:, 2:5]), exact(points))
    bytes_of_points = b"x" + points.tobytes()
    unaligned = numpy.frombuffer(bytes_of_points, dtype=numpy.float64, offset=1).reshape(500, 3)
    assert not unaligned.flags.aligned
    assert numpy.array_equal(field(unaligned), expected)


@pytest.mark.parametrize("shape", [(), (0,), (2,), (3, 2), (3, 4), (3, 1)])
def test_other_shapes_are_refused(field: hpsdf.Field, exact: hpsdf.ExactDistance, shape: Any) -> None:
    queries: list[Callable[[Any], Any]] = [field, field.value_and_gradient, field.value_gradient_hessian, exact, exact.closest]
    for query in queries:
        with pytest.raises(ValueError, match=r"points: expected an array of shape \(\.\.\., 3\), got \("):
            query(numpy.zeros(shape))


@pytest.mark.parametrize("wrong", ["abc", None, {}, [[1j, 0, 0]], numpy.array([["a", "b", "c"]]), [True, False, True]])
def test_other_types_are_refused(field: hpsdf.Field, exact: hpsdf.ExactDistance, wrong: Any) -> None:
    queries: list[Callable[[Any], Any]] = [field, field.value_and_gradient, field.value_gradient_hessian, exact, exact.closest]
    for query in queries:
        with pytest.raises(TypeError, match="points: expected an array of real numbers"):
            query(wrong)


def test_ragged_lists_are_refused(field: hpsdf.Field) -> None:
    with pytest.raises((TypeError, ValueError), match="points: expected an array of"):
        field([[1, 2, 3], [4, 5]])


def test_points_that_are_not_finite(field: hpsdf.Field, exact: hpsdf.ExactDistance) -> None:
    wild = numpy.array([[numpy.nan, 0, 0], [numpy.inf, 0, 0], [1e300, 0, 0], [-1e308, 1e308, 0]])
    assert not numpy.isfinite(field(wild[:2])).any()
    assert not numpy.isfinite(exact(wild[:2])).any()
    field.value_and_gradient(wild)
    field.value_gradient_hessian(wild)
    exact.closest(wild)


def test_results_in_given_arrays(field: hpsdf.Field, exact: hpsdf.ExactDistance, points: Array) -> None:
    expected, expected_gradient = field.value_and_gradient(points)
    out = numpy.full(500, 7.0)
    assert field(points, out=out) is out and numpy.array_equal(out, expected)
    assert exact(points, out=out) is out and numpy.array_equal(out, exact(points))
    gradient = numpy.full((500, 3), 7.0)
    results = field.value_and_gradient(points, out=(out, gradient))
    assert results[0] is out and results[1] is gradient
    assert numpy.array_equal(out, expected) and numpy.array_equal(gradient, expected_gradient)
    hessian = numpy.full((500, 3, 3), 7.0)
    all_results = field.value_gradient_hessian(points, out=[out, gradient, hessian])
    assert all_results[0] is out and all_results[1] is gradient and all_results[2] is hessian
    assert numpy.array_equal(hessian, field.value_gradient_hessian(points)[2])
    rows = numpy.zeros((2, 500))
    field(points, out=rows[1])
    assert numpy.array_equal(rows[1], expected) and not rows[0].any()


def test_results_may_overwrite_points(field: hpsdf.Field, points: Array) -> None:
    expected, expected_gradient = field.value_and_gradient(points)
    both = points.copy()
    field.value_and_gradient(both, out=(numpy.empty(500), both))
    assert numpy.array_equal(both, expected_gradient)
    both = numpy.zeros((500, 3, 3))
    both.reshape(-1, 3)[:500] = points
    expected_hessian = field.value_gradient_hessian(points)[2]
    field.value_gradient_hessian(both.reshape(-1, 3)[:500], out=(numpy.empty(500), numpy.empty((500, 3)), both))
    assert numpy.array_equal(both, expected_hessian)
    both = points.copy()
    field(both, out=both.reshape(-1)[:500])
    assert numpy.array_equal(both.reshape(-1)[:500], expected)


def test_wrong_arrays_for_results_are_refused(field: hpsdf.Field, exact: hpsdf.ExactDistance, points: Array) -> None:
    read_only = numpy.empty(500)
    read_only.flags.writeable = False
    queries: list[Any] = [field, exact]
    for query in queries:
        with pytest.raises(TypeError, match="out: expected an array of float64, got one of float32"):
            query(points, out=numpy.empty(500, dtype=numpy.float32))
        with pytest.raises(TypeError, match="out: expected an array of float64, got 'list'"):
            query(points, out=[0.0] * 500)
        with pytest.raises(ValueError, match=r"with the shape \(500,\), got \(499,\)"):
            query(points, out=numpy.empty(499))
        with pytest.raises(ValueError, match="C-contiguous"):
            query(points, out=numpy.empty(1000)[::2])
        with pytest.raises(ValueError, match="aligned"):
            query(points, out=numpy.frombuffer(bytearray(4001), dtype=numpy.float64, offset=1))
        with pytest.raises(ValueError, match="read-only"):
            query(points, out=read_only)
    with pytest.raises(TypeError, match="out: expected two arrays"):
        field.value_and_gradient(points, out=numpy.empty(500))  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"out\[1\]: expected .* \(500, 3\), got \(3, 500\)"):
        field.value_and_gradient(points, out=(numpy.empty(500), numpy.empty((3, 500))))
    with pytest.raises(TypeError, match="out: expected three arrays"):
        field.value_gradient_hessian(points, out=(numpy.empty(500), numpy.empty((500, 3))))
    with pytest.raises(ValueError, match=r"out\[2\]: expected .* \(500, 3, 3\), got \(500, 9\)"):
        field.value_gradient_hessian(points, out=(numpy.empty(500), numpy.empty((500, 3)), numpy.empty((500, 9))))


def test_large_queries_equal_small_ones(field: hpsdf.Field, exact: hpsdf.ExactDistance) -> None:
    many = numpy.random.default_rng(2).uniform(-1.2, 1.2, (1_200_000, 3))
    some = slice(1_040_000, 1_060_000)  # across the pieces of a query
    assert numpy.array_equal(field(many)[some], field(many[some]))
    value, gradient = field.value_and_gradient(many)
    expected = field.value_and_gradient(many[some])
    assert numpy.array_equal(value[some], expected[0]) and numpy.array_equal(gradient[some], expected[1])
    some = slice(40_000, 41_000)
    assert numpy.array_equal(
        field.value_gradient_hessian(many[:100_000])[2][some], field.value_gradient_hessian(many[some])[2]
    )
    part = many[:150_000]
    assert numpy.array_equal(exact(part)[-40_000:], exact(part[-40_000:]))
    assert numpy.array_equal(exact.closest(part).point[-40_000:], exact.closest(part[-40_000:]).point)
