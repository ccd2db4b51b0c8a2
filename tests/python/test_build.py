"""Constructions: options as of the program, what is refused, and progress."""

import pathlib
from collections.abc import Callable
from typing import Any

import numpy
import numpy.typing
import pytest

import hpsdf

Array = numpy.typing.NDArray[Any]


@pytest.mark.parametrize(
    "options",
    [
        {"target_error": 1e-4, "grid": 4},
        {"target_error": 1e-4, "strategy": "hp", "estimator": "residual", "coefficients": "double"},
        {"target_error": 1e-3, "grid": (3, 4, 5), "continuity": "both", "max_degree": 3, "bounds": True},
        {"tolerance": "0.5%"},
    ],
)
def test_fields_equal_those_of_the_program(mesh: hpsdf.TriangleMesh, points: Array, program: Callable[..., str], query: Callable[..., dict[str, Array]], tmp_path: pathlib.Path, options: dict[str, Any]) -> None:
    built = hpsdf.build(mesh, **options)
    words = []
    for name, value in options.items():
        text = ",".join(map(str, value)) if isinstance(value, tuple) else str(value)
        words += ["--" + name.replace("_", "-")] + ([] if value is True else [text])
    program("build", "builtin:torus", "-o", tmp_path / "torus.hpsdf", *words)
    theirs = hpsdf.load(tmp_path / "torus.hpsdf")
    assert numpy.array_equal(built.cells(), theirs.cells())
    assert numpy.array_equal(built(points), theirs(points))
    assert numpy.array_equal(built(points), query(points, tmp_path / "torus.hpsdf")["distance"].astype(float))


def test_distances_and_threads_give_the_same_field(mesh: hpsdf.TriangleMesh, exact: hpsdf.ExactDistance, field: hpsdf.Field, points: Array) -> None:
    assert numpy.array_equal(hpsdf.build(exact, target_error=1e-5)(points), field(points))
    assert numpy.array_equal(hpsdf.build(mesh, target_error=1e-5, threads=1, blend_width=None)(points), field(points))


def test_domains(mesh: hpsdf.TriangleMesh) -> None:
    cube = hpsdf.build(mesh, target_error=1e-2, margin=0.5).domain
    box = hpsdf.build(mesh, target_error=1e-2, box="box").domain
    assert numpy.ptp(cube[1] - cube[0]) < 1e-12 and cube[1, 0] > 1.4
    assert box[1, 2] - box[0, 2] < 0.7
    corners = numpy.array([[-2, -2, -1], [2, 2.5, 1]])
    assert numpy.array_equal(hpsdf.build(mesh, target_error=1e-2, box=corners).domain, corners)


@pytest.mark.parametrize(
    "options, error, text",
    [
        ({"target_eror": 1e-5}, TypeError, "build\\(\\) has no option 'target_eror': did you mean 'target_error'\\?"),
        ({"target_error": -1}, hpsdf.OptionError, "target_error: expected a number above 0, got -1"),
        ({"target_error": "1%"}, hpsdf.OptionError, "target_error: expected a number, got '1%'"),
        ({"target_error": numpy.nan}, hpsdf.OptionError, "target_error: expected a number above 0, got nan"),
        ({"target_error": [1]}, TypeError, "target_error: expected a number"),
        ({"max_depth": 1.5}, hpsdf.OptionError, "max_depth: expected a whole number from 0 up to 20, got 1.5"),
        ({"grid": "1,2"}, hpsdf.OptionError, "grid: expected one number or three"),
        ({"grid": (1, 2)}, hpsdf.OptionError, "grid: expected one number or three"),
        ({"strategy": "hpp"}, hpsdf.OptionError, "strategy: there is no 'hpp': did you mean 'hp'"),
        ({"strategy": 3}, TypeError, "strategy: expected a string"),
        ({"bounds": 1}, TypeError, "bounds: expected True or False"),
        ({"tolerance": "1 mm"}, hpsdf.OptionError, "tolerance: expected a number or a percentage"),
        ({"tolerance": "-1%"}, hpsdf.OptionError, "tolerance: expected a number above 0, got -0.01"),
        ({"tolerance": 0.01, "target_error": 1}, hpsdf.OptionError, "tolerance: cannot be given together with target"),
        ({"tolerance": 0.01, "strategy": "hp"}, hpsdf.OptionError, "strategy: has no effect with a tolerance"),
        ({"certified": True}, hpsdf.OptionError, "certified: has no effect without tolerance"),
        ({"near_error": 0.01}, hpsdf.OptionError, "near error and far error belong together"),
        ({"box": "sphere"}, hpsdf.OptionError, "box: expected 'cube', 'box' or two corners, got 'sphere'"),
        ({"box": (0, 0, 0)}, ValueError, "box: expected two corners"),
        ({"box": ((1, 1, 1), (0, 0, 0))}, hpsdf.OptionError, "the domain is empty, flat or not finite"),
        ({"memory_limit": 1000}, hpsdf.LimitError, "memory"),
        ({"progress": 3}, TypeError, "progress: expected a callable"),
    ],
)
def test_wrong_options_are_refused(mesh: hpsdf.TriangleMesh, options: dict[str, Any], error: Any, text: str) -> None:
    with pytest.raises(error, match=text):
        hpsdf.build(mesh, **options)


def test_classes_of_errors() -> None:
    assert issubclass(hpsdf.OptionError, (hpsdf.Error, ValueError)) and issubclass(hpsdf.OptionError, hpsdf.Error)
    for special, common in [
        (hpsdf.FileError, OSError),
        (hpsdf.MeshError, ValueError),
        (hpsdf.OptionError, ValueError),
        (hpsdf.FieldError, ValueError),
        (hpsdf.LimitError, MemoryError),
    ]:
        assert issubclass(special, hpsdf.Error) and issubclass(special, common)
    assert issubclass(hpsdf.Error, Exception) and not issubclass(hpsdf.Error, ValueError)


def test_progress_is_reported(mesh: hpsdf.TriangleMesh) -> None:
    calls = []
    hpsdf.build(mesh, target_error=1e-8, progress=lambda task, fraction: calls.append((task, fraction)))
    assert calls and all(isinstance(task, str) and 0 <= fraction <= 1 for task, fraction in calls)


def test_a_bar_shows_progress(mesh: hpsdf.TriangleMesh, capsys: pytest.CaptureFixture[str]) -> None:
    hpsdf.build(mesh, target_error=1e-8, progress=True)
    assert "%" in capsys.readouterr().err
    hpsdf.build(mesh, target_error=1e-3, progress=False)
    assert capsys.readouterr().err == ""


def test_exceptions_of_progress_cancel(mesh: hpsdf.TriangleMesh) -> None:
    class Enough(Exception):
        pass

    def stop(task: str, fraction: float) -> None:
        raise Enough(task)

    with pytest.raises(Enough):
        hpsdf.build(mesh, target_error=1e-9, progress=stop)


def test_all_options_are_described() -> None:
    for word in ("target_error: float, in ", "strategy: 'hp' | 'h1' | 'h2' | 'hpx' | 'auto'; default auto", "threads: int"):
        assert word in str(hpsdf.build.__doc__)
    assert "--" not in str(hpsdf.build.__doc__) and "max-error" not in str(hpsdf.build.__doc__)
