"""What the tests of other programs share: a field, the program's commands, and how a test is skipped."""

import importlib
import subprocess
import sys
import tempfile
from pathlib import Path

# The torus of the tests: around the z axis, with these radii.
MAJOR, MINOR = 0.7, 0.25
SHAPE = f"analytic:torus,major={MAJOR},minor={MINOR}"

SKIPPED = 77


def skip(reason):
    print(f"skipped: {reason}")
    sys.exit(SKIPPED)


def module(name, package):
    """Returns a module, or skips the test if the Debian package that has it is not installed."""
    try:
        return importlib.import_module(name)
    except ImportError as error:
        skip(f"{package} is not installed ({error})")


class Program:
    """Runs the program in a folder of its own, with a field of the torus in torus.hpsdf."""

    def __init__(self):
        self.program = Path(sys.argv[1]).resolve()
        self._folder = tempfile.TemporaryDirectory(prefix="hpsdf-client-")
        self.folder = Path(self._folder.name)
        self.run("build", SHAPE, "-o", self.at("torus.hpsdf"), "--tolerance", "0.001")

    def at(self, name):
        return str(self.folder / name)

    def run(self, *words):
        made = subprocess.run([str(self.program), *words], capture_output=True, text=True)
        assert made.returncode == 0, made.stderr
        return made.stdout

    def export(self, name, *options):
        """Exports the torus and returns the path of the file."""
        self.run("export", self.at("torus.hpsdf"), "-o", self.at(name), *options)
        return self.at(name)

    def build(self, name, *options):
        """Builds a field from a grid and checks that it is that of the torus."""
        self.run("build", self.at(name), "-o", self.at("again.hpsdf"), "--target-error", "1e-5", *options)
        points = [[0.7, 0.1, 0.2], [-0.5, 0.4, 0.1], [0.0, -0.9, -0.05], [0.1, 0.65, -0.2]]
        check_near(self.values(points, "again.hpsdf"), [distance(*p) for p in points], 0.01, f"field from {name}")

    def values(self, points, field="torus.hpsdf"):
        """Returns the field's values at points."""
        lines = "\n".join(" ".join(repr(float(x)) for x in point) for point in points)
        Path(self.at("points.txt")).write_text(lines)
        rows = self.run("query", self.at(field), self.at("points.txt")).splitlines()[1:]
        return [float(row.split(",")[3]) for row in rows]


def distance(x, y, z):
    """Returns the signed distance to the torus."""
    return ((((x * x + y * y) ** 0.5) - MAJOR) ** 2 + z * z) ** 0.5 - MINOR


def check_near(actual, expected, tolerance, what):
    worst = max(abs(float(a) - float(b)) for a, b in zip(actual, expected))
    assert worst <= tolerance, f"{what}: differs by {worst}, more than {tolerance}"
