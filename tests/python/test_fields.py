"""Fields: equal to those of C++, files, cells and pickling."""

import pathlib
import pickle
from collections.abc import Callable
from typing import Any

import numpy
import numpy.typing
import pytest

import hpsdf

Array = numpy.typing.NDArray[Any]


def test_values_and_gradients_equal_those_of_the_program(field: hpsdf.Field, points: Array, query: Callable[..., dict[str, Array]], tmp_path: pathlib.Path) -> None:
    field.save(tmp_path / "torus.hpsdf")
    columns = query(points, tmp_path / "torus.hpsdf")
    value, gradient = field.value_and_gradient(points)
    assert numpy.array_equal(value, columns["distance"].astype(float))
    assert numpy.array_equal(field(points), value)
    for axis in range(3):
        assert numpy.array_equal(gradient[:, axis], columns["g" + "xyz"[axis]].astype(float))


def test_hessians_are_the_differences_of_gradients(mesh: hpsdf.TriangleMesh, field: hpsdf.Field, points: Array) -> None:
    blended = hpsdf.build(mesh, target_error=1e-4, continuity="exact")
    for each in (field, blended):
        value, gradient, hessian = each.value_gradient_hessian(points)
        assert numpy.array_equal(value, each(points)) and numpy.array_equal(gradient, each.value_and_gradient(points)[1])
        assert numpy.array_equal(hessian, hessian.transpose(0, 2, 1))
        step = 1e-6
        for axis, move in enumerate(step * numpy.eye(3)):
            above, below = (each.value_and_gradient(points + m)[1] for m in (move, -move))
            error = numpy.linalg.norm((above - below) / (2 * step) - hessian[:, :, axis], axis=1)
            scale = 1 + numpy.linalg.norm(hessian, axis=(1, 2))
            assert numpy.quantile(error / scale, 0.99) < 1e-6  # a face of a cell may come between


def test_files(field: hpsdf.Field, points: Array, tmp_path: pathlib.Path) -> None:
    file = tmp_path / "torus.hpsdf"
    field.save(file)
    again = hpsdf.load(str(file))
    field.save(tmp_path / "small.hpsdf", compress=True)
    small = hpsdf.load(tmp_path / "small.hpsdf")
    assert (tmp_path / "small.hpsdf").stat().st_size < file.stat().st_size
    file.unlink()  # the field does not need its file
    assert numpy.array_equal(again(points), field(points)) and numpy.array_equal(small(points), field(points))


def test_mapped_files(field: hpsdf.Field, points: Array, tmp_path: pathlib.Path) -> None:
    file = tmp_path / "torus.hpsdf"
    field.save(file)
    mapped = hpsdf.load(file, mapped=True)
    assert numpy.array_equal(mapped(points), field(points))
    assert numpy.array_equal(mapped.coefficients, field.coefficients)
    mapped.save(tmp_path / "small.hpsdf", compress=True)
    large = hpsdf.build(hpsdf.load_mesh("builtin:torus"), target_error=1e-8, coefficients="double", strategy="hp")
    large.save(tmp_path / "large.hpsdf")
    content = bytearray((tmp_path / "large.hpsdf").read_bytes())
    content[len(content) // 2] ^= 1
    (tmp_path / "large.hpsdf").write_bytes(content)
    damaged = hpsdf.load(tmp_path / "large.hpsdf", mapped=True)
    with pytest.raises(hpsdf.FileError, match="its checksum of the block"):
        damaged.coefficients  # noqa: B018 reads all
    with pytest.raises(hpsdf.FileError, match="cannot be mapped, because it is compressed"):
        hpsdf.load(tmp_path / "small.hpsdf", mapped=True)
    with pytest.raises(TypeError):
        hpsdf.load(file, True)  # type: ignore[misc]


def test_files_that_cannot_be_read(field: hpsdf.Field, tmp_path: pathlib.Path) -> None:
    (tmp_path / "wrong.hpsdf").write_bytes(b"no field")
    for wrong in (tmp_path / "none.hpsdf", tmp_path / "wrong.hpsdf", tmp_path):
        with pytest.raises(OSError) as caught:
            hpsdf.load(wrong)
        assert isinstance(caught.value, hpsdf.FileError) and str(wrong) in str(caught.value)
    with pytest.raises(hpsdf.FileError):
        field.save(tmp_path / "no folder" / "torus.hpsdf")
    with pytest.raises(TypeError):
        hpsdf.load(3)  # type: ignore[arg-type]


def test_cells_fill_the_domain(field: hpsdf.Field) -> None:
    cells = field.cells()
    assert cells.dtype.names == ("box", "degree", "depth", "error")
    assert cells["box"].shape == (len(cells), 2, 3) and repr(field).startswith(f"<hpsdf.Field: {len(cells)} cells, ")
    volumes = (cells["box"][:, 1] - cells["box"][:, 0]).prod(axis=1)
    domain = field.domain
    assert domain.shape == (2, 3)
    assert abs(volumes.sum() / (domain[1] - domain[0]).prod() - 1) < 1e-12
    assert (cells["degree"] >= 1).all() and (cells["depth"] <= 10).all() and (cells["error"] >= 0).all()
    assert field.nbytes > 0


def test_jumps(mesh: hpsdf.TriangleMesh, field: hpsdf.Field) -> None:
    jumps = hpsdf.jumps(field)
    assert jumps.shape[0] > len(field.cells()) and (jumps["max"] >= jumps["rms"] / 1.001).all() and jumps["max"].any()
    for face in jumps[:50]:
        at = face["worst"] + 1e-6 * (face["center"] - face["worst"])  # off the edges of the face
        step = 1e-9 * numpy.eye(3)[face["axis"]]
        assert abs(abs(field(at + step) - field(at - step)) - face["max"]) < 1e-5
    blended = hpsdf.build(mesh, target_error=1e-4, continuity="exact")
    assert hpsdf.jumps(blended, threads=1)["max"].max() < 1e-12
    with pytest.raises(TypeError):
        hpsdf.jumps(mesh)  # type: ignore[arg-type]


def test_contours_equal_those_of_the_program(field: hpsdf.Field, program: Callable[..., str], tmp_path: pathlib.Path) -> None:
    field.save(tmp_path / "torus.hpsdf")

    def compare(contour: hpsdf.TriangleMesh, *words: str) -> None:
        program("contour", tmp_path / "torus.hpsdf", "-o", tmp_path / "torus.ply", "--tolerance", 0.01, *words)
        theirs = hpsdf.load_mesh(tmp_path / "torus.ply")
        assert numpy.array_equal(contour.vertices, theirs.vertices)
        assert numpy.array_equal(contour.triangles, theirs.triangles)

    contour, with_jumps = field.contour(tolerance=0.01), field.contour(tolerance=0.01, keep_jumps=True)
    compare(contour)
    compare(with_jumps, "--keep-jumps")
    assert not numpy.array_equal(contour.vertices, with_jumps.vertices)
    assert abs(field(contour.vertices)).max() < 0.01
    rough = hpsdf.build(hpsdf.load_mesh("builtin:gear"), target_error=1e-2, strategy="hp", continuity="none")
    with pytest.warns(RuntimeWarning, match="misses the tolerance in [0-9]+ places"):
        rough.contour(tolerance=0.05, keep_jumps=True)
    simple = field.contour(tolerance=0.01, offset=0.05, simplify=True)
    assert 0 < len(simple.faces) < len(contour.faces)
    with pytest.raises(hpsdf.OptionError, match="domain_cut: expected 'wall' or 'open', got 'walls'"):
        field.contour(domain_cut="walls")  # type: ignore[arg-type]
    with pytest.raises(hpsdf.Error):
        field.contour(tolerance=-1)


def test_pickling(field: hpsdf.Field, points: Array) -> None:
    again = pickle.loads(pickle.dumps(field))
    assert numpy.array_equal(again(points), field(points))
    assert numpy.array_equal(again.cells(), field.cells())


def test_no_field_without_build_or_load() -> None:
    with pytest.raises(TypeError):
        hpsdf.Field()
