"""Exact distances and closest points: equal to those of C++, and what is refused."""

import numpy
import pytest

import hpsdf


def test_equal_those_of_the_program(mesh, exact, points, query):
    columns = query(points, "--closest", "builtin:torus")
    closest = exact.closest(points)
    assert numpy.array_equal(closest.distance, columns["distance"].astype(float))
    assert numpy.array_equal(closest.distance, exact(points))
    assert numpy.array_equal(closest.face, columns["face"].astype(int))
    for axis in range(3):
        assert numpy.array_equal(closest.point[:, axis], columns["p" + "xyz"[axis]].astype(float))
        assert numpy.array_equal(closest.barycentric[:, axis], columns[f"b{axis}"].astype(float))


def test_closest_points_agree_with_the_mesh(mesh, exact, points):
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


def test_inside_tests(mesh):
    assert hpsdf.ExactDistance(mesh).inside_test == "pseudonormal"
    assert hpsdf.ExactDistance(mesh, inside_test="winding").inside_test == "winding"
    shell = hpsdf.ExactDistance(mesh, inside_test="shell", thickness=0.1)
    assert shell([0, 0, 0]) == abs(hpsdf.ExactDistance(mesh)([0, 0, 0])) - 0.05
    with pytest.raises(hpsdf.OptionError, match="did you mean 'winding'") as caught:
        hpsdf.ExactDistance(mesh, inside_test="windin")
    assert isinstance(caught.value, ValueError) and caught.value.subject == "inside_test"
    with pytest.raises(hpsdf.Error):
        hpsdf.ExactDistance(mesh, inside_test="shell")
    with pytest.raises(TypeError):
        hpsdf.ExactDistance(mesh, "winding")
