"""What the tests of the Python module share: a mesh, its field, random points, and the values of the program."""

import csv
import io
import os
import pathlib
import subprocess
from collections.abc import Callable
from typing import Any

import numpy
import numpy.typing
import pytest

import hpsdf

Array = numpy.typing.NDArray[Any]


@pytest.fixture(scope="session")
def mesh() -> hpsdf.TriangleMesh:
    return hpsdf.load_mesh("builtin:torus")


@pytest.fixture(scope="session")
def field(mesh: hpsdf.TriangleMesh) -> hpsdf.Field:
    return hpsdf.build(mesh, target_error=1e-5)


@pytest.fixture(scope="session")
def exact(mesh: hpsdf.TriangleMesh) -> hpsdf.ExactDistance:
    return hpsdf.ExactDistance(mesh)


@pytest.fixture(scope="session")
def points() -> Array:
    return numpy.random.default_rng(1).uniform(-1.3, 1.3, (500, 3))


@pytest.fixture
def query(tmp_path: pathlib.Path) -> Callable[..., dict[str, Array]]:
    """Returns a function that runs 'hpsdf query', with the C++ library's own values, and returns its columns."""
    program = os.environ.get("HPSDF_PROGRAM", "")
    if not program:
        pytest.skip("the program hpsdf is not built")

    def columns(points: Array, *words: object) -> dict[str, Array]:
        file = tmp_path / "points.txt"
        file.write_text("\n".join(" ".join(repr(float(x)) for x in point) for point in points))
        made = subprocess.run([program, "query", *map(str, words), str(file)], capture_output=True, text=True)
        assert made.returncode == 0, made.stderr
        rows = list(csv.DictReader(io.StringIO(made.stdout)))
        return {name: numpy.array([row[name] for row in rows]) for name in rows[0]}

    return columns


@pytest.fixture
def program() -> Callable[..., str]:
    """Returns a function that runs the program with these words."""
    path = os.environ.get("HPSDF_PROGRAM", "")
    if not path:
        pytest.skip("the program hpsdf is not built")
    return lambda *words: subprocess.run([path, *map(str, words)], capture_output=True, text=True, check=True).stdout
