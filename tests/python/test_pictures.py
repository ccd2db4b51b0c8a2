"""Pictures, figures and scripts: equal to those of the program, with fields and meshes of Python."""

import json
import multiprocessing
import pathlib
import threading
import time
import warnings
from collections.abc import Callable
from typing import Any

import numpy
import pytest

import hpsdf

SIZE = (320, 200)


@pytest.fixture(scope="module")
def session(field: hpsdf.Field) -> hpsdf.Session:
    return hpsdf.Session(field)


@pytest.fixture
def named(tmp_path: pathlib.Path, program: Callable[..., str]) -> Callable[..., None]:
    """Returns a function that compares a picture with the one that the program draws with these words."""

    def compare(picture: hpsdf.Picture, *words: object) -> None:
        file = tmp_path / "program.png"
        program(*words, "-o", file)
        assert picture._repr_png_() == file.read_bytes()

    return compare


@pytest.fixture(scope="module")
def file(field: hpsdf.Field, tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    made = tmp_path_factory.mktemp("fields") / "torus.hpsdf"
    field.save(made)
    return made


def test_pictures_equal_those_of_the_program(file: pathlib.Path, mesh: hpsdf.TriangleMesh, named: Callable[..., None]) -> None:
    hidden: dict[str, Any] = {"surface": False, "cells": "lines"}
    loaded = hpsdf.Session()
    loaded.run("load $file", file=file)  # captions name the file
    words = ("--size", "320x200")
    named(loaded.render(size=SIZE, color="degree", camera=(30, 20, 1.1)), "render", file, *words, "--color", "degree")
    named(loaded.render(size=SIZE, cpu=True, **hidden), "render", file, *words, "--cpu", "--surface=false", "--cells", "lines")
    named(loaded.slice(size=SIZE, axis="x", offset=numpy.float32(0.25)), "slice", file, *words, "--axis", "x", "--offset", "0.25")
    named(loaded.probe((-1, 0, 0), [1, 0, 0], size=SIZE), "probe", file, *words, "--from=-1,0,0", "--to", "1,0,0")
    error = loaded.slice(size=SIZE, color="error", mesh=mesh)
    named(error, "slice", file, *words, "--color", "error", "--mesh", "builtin:torus")
    assert (error != loaded.slice(size=SIZE, color="degree")).any(), "the comparison would not notice another picture"


def test_pictures_are_arrays(field: hpsdf.Field, session: hpsdf.Session, tmp_path: pathlib.Path) -> None:
    picture = hpsdf.render(field, size=SIZE)
    assert isinstance(picture, numpy.ndarray) and picture.shape == (200, 320, 3) and picture.dtype == numpy.uint8
    assert numpy.array_equal(picture, session.render(size=SIZE))
    assert picture[:, :, 0].std() > 10, "the picture shows something"
    picture.save(tmp_path / "picture.png")
    assert (tmp_path / "picture.png").read_bytes() == picture._repr_png_()
    assert picture[0, 0]._repr_png_() is None
    assert (picture / 2.0).view(hpsdf.Picture)._repr_png_() is None
    assert hpsdf.slice(field, size=SIZE).shape == hpsdf.probe(field, (-1, 0, 0), (1, 0, 0), size=SIZE).shape


def test_frames_and_pixels(session: hpsdf.Session, field: hpsdf.Field) -> None:
    session.run("show slice; plane axis=x offset=0.1")
    frame = session.frame()
    assert frame.shape == (720, 1280, 3)
    found = session.pick(640, 360)
    assert found["position"][0] == pytest.approx(0.1) and found["value"] == pytest.approx(field(found["position"]), abs=1e-5)
    assert session.pick(1, 1) is None
    with pytest.raises(hpsdf.Error, match="no picture"):
        hpsdf.Session(field).pick(1, 1)


def test_options_that_are_not_accepted(session: hpsdf.Session, field: hpsdf.Field) -> None:
    mistakes: list[tuple[dict[str, Any], str]] = [
        ({"color": "deg"}, "degree"),
        ({"colour": "degree"}, "color"),
        ({"camera": (1, 2)}, "3 numbers"),
        ({"size": (4, 4)}, "16384"),
        ({"output": "x.png"}, "output"),
        ({"samples": 0}, "from 1"),
        ({"camera": ["a", "b", "c"]}, "given 3 times"),
    ]
    for wrong, word in mistakes:
        with pytest.raises(hpsdf.OptionError, match=word):
            session.render(**wrong)
    others: list[dict[str, Any]] = [{"color": {}}, {"camera": object()}]
    for wrong in others:
        with pytest.raises(TypeError):
            session.render(**wrong)
    with pytest.raises(hpsdf.Error, match="no field"):
        hpsdf.Session().render()
    with pytest.raises(TypeError):
        hpsdf.Session("field.hpsdf")  # type: ignore[arg-type]


def test_another_mesh_takes_the_place_of_the_one_before(field: hpsdf.Field, mesh: hpsdf.TriangleMesh) -> None:
    session, ball = hpsdf.Session(field), hpsdf.load_mesh("builtin:sphere")
    first = session.slice(size=SIZE, color="error", mesh=mesh)
    second = session.slice(size=SIZE, color="error", mesh=ball)
    assert (first != second).any() and numpy.array_equal(second, hpsdf.slice(field, size=SIZE, color="error", mesh=ball))
    assert numpy.array_equal(first, session.slice(size=SIZE, color="error", mesh=mesh))


def test_files_of_pictures(field: hpsdf.Field, tmp_path: pathlib.Path) -> None:
    picture, file = hpsdf.render(field, size=SIZE), tmp_path / "picture.png"
    picture.save(file)
    before = file.read_bytes()
    for wrong in (picture[..., 0].view(hpsdf.Picture), (picture / 2.0).view(hpsdf.Picture)):
        with pytest.raises(ValueError, match="expected uint8"):
            wrong.save(file)
    assert file.read_bytes() == before
    with pytest.raises(hpsdf.FileError):
        picture.save(tmp_path / "no folder" / "picture.png")


def draw_in_a_fork(field: hpsdf.Field, how: Any, answers: Any) -> None:
    try:
        answers.put(hpsdf.render(field, size=SIZE, **how).shape)
    except hpsdf.Error as error:
        answers.put(str(error))


def test_forked_processes_draw_by_the_cpu(field: hpsdf.Field) -> None:
    hpsdf.render(field, size=SIZE)
    fork = multiprocessing.get_context("fork")
    answers = fork.Queue()
    for how, expected in (({"cpu": True}, (200, 320, 3)), ({}, "forked")):
        child = fork.Process(target=draw_in_a_fork, args=(field, how, answers))
        child.start()
        answer = answers.get(timeout=60)
        child.join(60)
        assert answer == expected or expected in answer


def test_notes_are_no_progress(capfd: pytest.CaptureFixture[str]) -> None:
    hpsdf.run("build builtin:gear target-error=1e-9")
    assert "%" not in capfd.readouterr().err


def test_several_reports(field: hpsdf.Field) -> None:
    session = hpsdf.Session(field)
    assert len(session.perform("run", execute=["info", "info; info"])) == 3
    assert session.perform("run", execute="info")["leaves"] == len(field.cells())


def test_differences_of_two_fields(mesh: hpsdf.TriangleMesh, field: hpsdf.Field, file: pathlib.Path, session: hpsdf.Session) -> None:
    other = hpsdf.build(mesh, target_error=1e-3)
    picture = session.slice(size=SIZE, color="difference", other=other)
    assert (picture != session.slice(size=SIZE, color="difference", other=field)).any()
    with pytest.raises(OSError):
        session.slice(color="difference", other=pathlib.Path("none.hpsdf"))


def test_figures_equal_those_of_the_program(mesh: hpsdf.TriangleMesh, field: hpsdf.Field, file: pathlib.Path, program: Callable[..., str]) -> None:
    figures = hpsdf.verify(field, mesh, points=2000)
    expected = json.loads(program("verify", file, "builtin:torus", "--points", 2000, "--json"))
    for part in ("uniform", "near_surface", "jumps", "steps", "worst"):
        assert figures[part] == expected[part]
    with pytest.raises(AssertionError, match="max-rms") as caught:
        hpsdf.verify(field, mesh, points=2000, max_rms=1e-9)
    assert isinstance(caught.value, hpsdf.ExpectationError) and isinstance(caught.value, hpsdf.Error)
    with pytest.raises(hpsdf.Error, match="made from builtin:torus, not from mesh"):
        hpsdf.verify(field, hpsdf.load_mesh("builtin:sphere"), points=2000)
    info = json.loads(program("info", file, "--json"))
    assert {**field.info(), "file_bytes": None} == {**info, "file_bytes": None}
    assert mesh.report() == {**json.loads(program("mesh", "builtin:torus", "--json")), "name": "mesh"}


def test_scripts(mesh: hpsdf.TriangleMesh, field: hpsdf.Field, tmp_path: pathlib.Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = hpsdf.run("build $shape target-error=1e-4; expect stats.leaves > 10", shape="builtin:torus")
    assert "leaves" in text
    reports = hpsdf.run("build $shape target-error=1e-5; info", shape=mesh, json=True)
    assert len(reports) == 2 and reports[1]["leaves"] == len(field.cells())
    assert hpsdf.run("load $it; info", it=field, json=True)[1]["leaves"] == len(field.cells())
    assert hpsdf.run("", json=True) == []
    script = tmp_path / "torus.hps"
    script.write_text("build builtin:torus target-error=1e-4\nexpect stats.leaves > 1e6\n")
    with pytest.raises(hpsdf.ExpectationError, match=r"torus\.hps:2:1: expected"):
        hpsdf.run(script)
    with pytest.raises(hpsdf.Error, match="script:1:1: .*'buidl'.*'build'"):
        hpsdf.run("buidl builtin:torus")
    with pytest.raises(hpsdf.FileError, match="none.hpsdf"):
        hpsdf.run("load none.hpsdf")
    for wrong in ("slice output=q.png colour=degree", "build builtin:sphere target-error=-1"):
        with pytest.raises(hpsdf.OptionError, match="script:1:"):
            hpsdf.run(wrong)
    with pytest.raises(OSError):
        hpsdf.run(tmp_path / "none.hps")
    session = hpsdf.Session()
    session.run("build builtin:torus target-error=1e-4")
    assert isinstance(session.field, hpsdf.Field) and hpsdf.Session().field is None


def test_scripts_are_cancelled_by_their_progress() -> None:
    def stop(task: str, fraction: float) -> None:
        raise InterruptedError

    session = hpsdf.Session()
    start = time.monotonic()
    with pytest.raises(InterruptedError):
        session.run("build builtin:gear target-error=1e-13", progress=stop)
    assert time.monotonic() - start < 60
    assert "torus" in session.run("build builtin:torus target-error=1e-4"), "the session goes on"


def test_one_session_in_several_threads(field: hpsdf.Field, session: hpsdf.Session) -> None:
    expected = [session.slice(size=SIZE, offset=0.05 * n) for n in range(4)]
    found: list[hpsdf.Picture | None] = [None] * 4

    def draw(n: int) -> None:
        found[n] = session.slice(size=SIZE, offset=0.05 * n)

    threads = [threading.Thread(target=draw, args=(n,)) for n in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(one is not None and numpy.array_equal(one, other) for one, other in zip(found, expected))


def test_notebooks_show_fields_and_meshes(mesh: hpsdf.TriangleMesh, field: hpsdf.Field) -> None:
    png = field._repr_png_()
    assert png.startswith(b"\x89PNG") and len(png) > 5000
    shown = field._repr_html_()
    assert f"<td>{len(field.cells()):,}</td>" in shown and "error near the surface" in shown and "base64" in shown
    report = mesh._repr_html_()
    assert "32,768" in report and "<td>closed</td>" in report
    open_mesh = hpsdf.TriangleMesh(mesh.vertices, mesh.triangles[:-1], name="<script>")
    assert "not closed" in open_mesh._repr_html_() and "<script>" not in open_mesh._repr_html_()
    function = hpsdf.build(lambda p: numpy.linalg.norm(p, axis=1) - 0.5, box=((-1,) * 3, (1,) * 3), target_error=1e-3)
    assert "a function" in function._repr_html_()
    bundle = field._repr_mimebundle_()
    assert bundle == {"image/png": png, "text/html": shown, "text/plain": repr(field)}
    empty = hpsdf.TriangleMesh(numpy.zeros((3, 3)), numpy.zeros((0, 3), dtype=int), name="nothing")
    assert "nothing" in empty._repr_html_() and "<td>3, 0</td>" in empty._repr_html_()


def test_help_lists_the_options() -> None:
    assert "camera: " in str(hpsdf.render.__doc__) and "max_rms: " in str(hpsdf.verify.__doc__)
    assert "title: " in str(hpsdf.show.__doc__)
    for function in (hpsdf.render, hpsdf.slice, hpsdf.probe, hpsdf.verify, hpsdf.show):
        assert "\noutput: " not in str(function.__doc__) and "    field: " not in str(function.__doc__)
