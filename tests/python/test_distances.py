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


def test_samples_equal_those_of_the_program(mesh, exact, program, tmp_path):
    samples = hpsdf.sample(mesh, surface=100, near=300, uniform=50, seed=7)
    words = ("--surface", 100, "--near", 300, "--uniform", 50, "--seed", 7, "--double")
    program("sample", "builtin:torus", "-o", tmp_path / "torus.npz", *words)
    theirs = numpy.load(tmp_path / "torus.npz")
    assert samples.points.shape == (450, 3)
    for name in ("points", "distances", "gradients", "kinds"):
        assert numpy.array_equal(getattr(samples, name), theirs[name]), name
    assert numpy.array_equal(samples.distances[100:], exact(samples.points[100:]))
    assert numpy.array_equal(samples.faces, exact.closest(samples.points).face)
    alone = hpsdf.sample(mesh, surface=100, near=300, uniform=50, seed=7, threads=1)
    assert all(numpy.array_equal(ours, same) for ours, same in zip(samples, alone))
    with pytest.raises(TypeError):
        hpsdf.sample(mesh, near=-1)


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
