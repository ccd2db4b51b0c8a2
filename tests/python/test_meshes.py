"""Meshes: from files, from arrays and from objects of other libraries."""

import pathlib
import pickle
import types
from typing import Any

import numpy
import numpy.typing
import pytest

import hpsdf

Array = numpy.typing.NDArray[Any]

CORNERS = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
FACES = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]


def test_arrays_are_read_only_views(mesh: hpsdf.TriangleMesh) -> None:
    assert mesh.vertices.shape[1] == 3 and mesh.vertices.dtype == numpy.float64
    assert mesh.triangles.shape[1] == 3 and mesh.triangles.dtype == numpy.uint32
    assert numpy.array_equal(mesh.faces, mesh.triangles)
    assert numpy.shares_memory(mesh.vertices, mesh.vertices)  # none of the two is a copy
    with pytest.raises(ValueError):
        mesh.vertices[0] = 0
    vertices = hpsdf.TriangleMesh(CORNERS, FACES).vertices  # outlives its mesh
    assert numpy.array_equal(vertices, CORNERS)


@pytest.mark.parametrize("number_type", [numpy.int8, numpy.uint8, numpy.int32, numpy.uint32, numpy.int64, numpy.uint64])
def test_meshes_from_arrays(number_type: Any) -> None:
    mesh = hpsdf.TriangleMesh(numpy.array(CORNERS, dtype=numpy.float32), numpy.array(FACES, dtype=number_type), "tetra")
    assert mesh.name == "tetra" and repr(mesh) == "<hpsdf.TriangleMesh: 4 vertices, 4 triangles>"
    assert numpy.array_equal(mesh.vertices, CORNERS) and numpy.array_equal(mesh.triangles, FACES)


@pytest.mark.parametrize(
    "vertices, faces, error, text",
    [
        (CORNERS, [[0, 1, 4]], hpsdf.MeshError, "triangles: row 0 refers to the vertex 4, but the mesh has 4 vertices"),
        (CORNERS, [[0, 1, 2], [0, -1, 2]], hpsdf.MeshError, "triangles: row 1 refers to the vertex -1"),
        (CORNERS, numpy.array([[0, 1, 2**63]], dtype=numpy.uint64), hpsdf.MeshError, "triangles: row 0"),
        (CORNERS, [[0, 1, 2.0]], TypeError, "triangles: expected an array of whole numbers, got one of float64"),
        (CORNERS, [[0, 1]], ValueError, r"triangles: expected an array of shape \(n, 3\), got \(1, 2\)"),
        (CORNERS, [0, 1, 2], ValueError, r"got \(3,\)"),
        ([[0, 0], [1, 0]], FACES, ValueError, r"vertices: expected an array of shape \(\.\.\., 3\), got \(2, 2\)"),
        ([0, 0, 0], FACES, ValueError, r"vertices: expected an array of shape \(n, 3\), got \(3,\)"),
        ([[0, 0, numpy.nan]], [[0, 0, 0]], hpsdf.MeshError, "vertices: row 0 is not finite"),
        ("abc", FACES, TypeError, "vertices: expected an array of real numbers"),
    ],
)
def test_wrong_arrays_are_refused(vertices: Any, faces: Any, error: Any, text: str) -> None:
    with pytest.raises(error, match=text):
        hpsdf.TriangleMesh(vertices, faces)


def test_a_mesh_without_triangles_has_no_distance() -> None:
    empty = hpsdf.TriangleMesh(numpy.empty((0, 3)), numpy.empty((0, 3), dtype=int))
    assert len(empty.vertices) == 0
    with pytest.raises(hpsdf.Error):
        hpsdf.ExactDistance(empty)
    with pytest.raises(hpsdf.Error):
        hpsdf.build(empty)
    with pytest.raises(hpsdf.Error):
        empty.cleaned()


def test_objects_of_other_libraries(mesh: hpsdf.TriangleMesh, field: hpsdf.Field, exact: hpsdf.ExactDistance, points: Array) -> None:
    other = types.SimpleNamespace(vertices=mesh.vertices.tolist(), faces=mesh.faces.astype(numpy.int64))
    assert numpy.array_equal(hpsdf.ExactDistance(other)(points), exact(points))
    assert numpy.array_equal(hpsdf.build(other, target_error=1e-5)(points), field(points))
    mistakes: list[Any] = [3, "bunny.obj", types.SimpleNamespace(vertices=CORNERS)]
    for wrong in mistakes:
        with pytest.raises(TypeError, match="expected"):
            hpsdf.ExactDistance(wrong)


def test_cleaning_joins_vertices() -> None:
    soup = hpsdf.TriangleMesh(numpy.array(CORNERS)[numpy.array(FACES)].reshape(-1, 3), numpy.arange(12).reshape(4, 3))
    assert len(soup.vertices) == 12 and len(soup.cleaned().vertices) == 4
    assert hpsdf.ExactDistance(soup.cleaned()).inside_test == "pseudonormal"


def test_files(mesh: hpsdf.TriangleMesh, tmp_path: pathlib.Path) -> None:
    mesh.save(tmp_path / "torus.ply")
    again = hpsdf.load_mesh(str(tmp_path / "torus.ply"))
    assert len(again.triangles) == len(mesh.triangles)
    for wrong in (tmp_path / "none.obj", tmp_path):
        with pytest.raises(OSError) as caught:
            hpsdf.load_mesh(wrong)
        assert isinstance(caught.value, hpsdf.FileError) and caught.value.subject == str(wrong)
    with pytest.raises(hpsdf.FileError):
        mesh.save(tmp_path / "no folder" / "torus.ply")


def test_pickling(mesh: hpsdf.TriangleMesh) -> None:
    again = pickle.loads(pickle.dumps(mesh))
    assert again.name == mesh.name
    assert numpy.array_equal(again.vertices, mesh.vertices) and numpy.array_equal(again.triangles, mesh.triangles)
