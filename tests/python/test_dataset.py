"""Data sets: the field of one mesh in a folder, the records of all, and their table."""

import json
import multiprocessing
import os
import pathlib
import pickle
from collections.abc import Callable
from typing import Any

import numpy
import pytest

import hpsdf
import hpsdf.dataset as dataset

OPTIONS: dict[str, Any] = {"target_error": 1e-3, "grid": 2}


def test_the_files_are_those_of_the_program(tmp_path: pathlib.Path, program: Callable[..., str]) -> None:
    record = dataset.build("builtin:torus", tmp_path / "python", **OPTIONS)
    (tmp_path / "list.txt").write_text("builtin:torus\n")
    line = json.loads(program("build", "--batch", tmp_path / "list.txt", "-o", tmp_path / "program", "--target-error", "1e-3", "--grid", "2"))
    files = [pathlib.Path(str(one["output"])) for one in (record, line)]
    assert files[0].name == files[1].name and files[0].read_bytes() == files[1].read_bytes()
    assert {**record, "output": "", "seconds": 0} == {**line, "output": "", "seconds": 0}
    assert dataset.build("builtin:torus", tmp_path / "program", **OPTIONS)["status"] == "skipped"
    assert dataset.build("builtin:torus", tmp_path / "python", target_error=1e-4)["status"] == "built"


def test_a_bad_mesh_raises_nothing(tmp_path: pathlib.Path, capfd: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "bad.obj").write_text("this is no mesh\n")
    record = dataset.build(tmp_path / "bad.obj", tmp_path / "fields", **OPTIONS)
    assert record["status"] == "failed" and "bad.obj" in record["error"] and record["leaves"] is None
    missed = dataset.build("analytic:sphere", tmp_path / "fields", max_error=0.01, max_depth=1, max_degree=2, target_error=1e-2, grid=2)
    assert missed["status"] == "built" and "max-error" in missed["missed"]
    assert capfd.readouterr() == ("", "")
    assert sorted(one["status"] for one in dataset.records(tmp_path / "fields")) == ["built", "failed"]


def test_what_concerns_all_meshes_is_raised(tmp_path: pathlib.Path) -> None:
    with pytest.raises(hpsdf.OptionError, match="target-eror"):
        dataset.build("builtin:box", tmp_path / "fields", target_eror=1e-3)
    with pytest.raises(hpsdf.Error, match="near error"):
        dataset.build("builtin:box", tmp_path / "fields", near_error=1e-3)
    with pytest.raises(hpsdf.Error, match="none.hps: no such file"):
        dataset.build("builtin:box", tmp_path / "fields", then=tmp_path / "none.hps")
    for wrong in ("", " ", " a.obj", "a.obj\r", "\ufeffa.obj", "#a.obj", "a.obj\nb.obj", "a\0b"):
        with pytest.raises(ValueError, match="mesh: "):
            dataset.build(wrong, tmp_path / "fields")
    with pytest.raises(TypeError, match="output, part: not an option"):
        dataset.build("builtin:box", tmp_path / "fields", output="other", part="1/2")
    assert not (tmp_path / "fields").exists()


def test_a_script_runs_for_the_field(tmp_path: pathlib.Path) -> None:
    (tmp_path / "then.hps").write_text("contour output=$name.ply\n")
    record = dataset.build("builtin:torus", tmp_path, then=tmp_path / "then.hps", **OPTIONS)
    assert pathlib.Path(record["output"]).with_suffix(".ply").exists()


def _built(mesh: str, folder: str) -> str:
    return str(dataset.build(mesh, folder, threads=1, **OPTIONS)["status"])


def test_processes_build_at_once(tmp_path: pathlib.Path) -> None:
    assert pickle.loads(pickle.dumps(dataset.build)) is dataset.build
    meshes = [f"builtin:box,width={1 + n / 10}" for n in range(8)]
    with multiprocessing.get_context("spawn").Pool(2) as pool:
        statuses = pool.starmap(_built, [(mesh, os.fspath(tmp_path)) for mesh in meshes])
    assert statuses == ["built"] * 8
    assert len(dataset.records(tmp_path)) == 8


def test_lists_are_read_as_the_program_reads_them(tmp_path: pathlib.Path) -> None:
    (tmp_path / "list.txt").write_bytes(b"\xef\xbb\xbf# a list\n\n a.obj\t\r\nb c.obj\na.obj\n\xff.obj\n./#d.obj")
    assert dataset.meshes(tmp_path / "list.txt") == ["a.obj", "b c.obj", os.fsdecode(b"\xff.obj"), "./#d.obj"]


def test_tables_are_read_by_numpy(tmp_path: pathlib.Path) -> None:
    (tmp_path / "bad.obj").write_text("this is no mesh\n")
    for mesh in ("builtin:torus", "analytic:sphere", str(tmp_path / "bad.obj")):
        dataset.build(mesh, tmp_path / "fields", **OPTIONS)
    (tmp_path / "fields" / "notes.json").write_text('{"status": "built"}')
    (tmp_path / "fields" / "notes-0123456789abcdef.json").write_text("[1]")
    half = tmp_path / "fields" / "half-0123456789abcdef.json"
    half.write_text('{"status": ')
    assert {record["status"]: record["output"] for record in dataset.records(tmp_path / "fields")}["begun"] == str(half)[:-5] + ".hpsdf"
    half.unlink()
    table = dataset.table(dataset.records(tmp_path / "fields"))
    numpy.save(tmp_path / "table.npy", table)
    again = numpy.load(tmp_path / "table.npy")
    assert again.dtype == table.dtype and len(again) == 3
    by_file = {row["file"]: row for row in again}
    torus, bad = by_file["builtin:torus"], by_file[str(tmp_path / "bad.obj")]
    assert torus["leaves"] > 1 and 0 < torus["near_rms"] < torus["near_max"] and torus["error"] == ""
    assert bad["leaves"] == -1 and numpy.isnan(bad["near_rms"]) and bad["status"] == "failed" and "bad.obj" in bad["error"]
    assert dataset.table([]).shape == (0,)
