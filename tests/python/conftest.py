"""What the tests of the Python module share: a mesh, its field, random points, and the values of the program."""

import csv
import io
import os
import subprocess

import numpy
import pytest

import hpsdf


@pytest.fixture(scope="session")
def mesh():
    return hpsdf.load_mesh("builtin:torus")


@pytest.fixture(scope="session")
def field(mesh):
    return hpsdf.build(mesh, target_error=1e-5)


@pytest.fixture(scope="session")
def exact(mesh):
    return hpsdf.ExactDistance(mesh)


@pytest.fixture(scope="session")
def points():
    return numpy.random.default_rng(1).uniform(-1.3, 1.3, (500, 3))


@pytest.fixture
def query(tmp_path):
    """Returns a function that runs 'hpsdf query', with the C++ library's own values, and returns its columns."""
    program = os.environ.get("HPSDF_PROGRAM")
    if not program:
        pytest.skip("the program hpsdf is not built")

    def columns(points, *words):
        file = tmp_path / "points.txt"
        file.write_text("\n".join(" ".join(repr(float(x)) for x in point) for point in points))
        made = subprocess.run([program, "query", *map(str, words), str(file)], capture_output=True, text=True)
        assert made.returncode == 0, made.stderr
        rows = list(csv.DictReader(io.StringIO(made.stdout)))
        return {name: numpy.array([row[name] for row in rows]) for name in rows[0]}

    return columns


@pytest.fixture
def program():
    """Returns a function that runs the program with these words."""
    path = os.environ.get("HPSDF_PROGRAM")
    if not path:
        pytest.skip("the program hpsdf is not built")
    return lambda *words: subprocess.run([path, *map(str, words)], capture_output=True, text=True, check=True).stdout
