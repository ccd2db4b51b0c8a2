"""What the tests of other programs share: a field, the program's commands, and how a test is skipped."""

import importlib
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

# The torus of the tests: around the z axis, with these radii.
MAJOR, MINOR = 0.7, 0.25
SHAPE = f"analytic:torus,major={MAJOR},minor={MINOR}"

# The body of the pictures of docs/pipelines.md: a gear with a spherical recess, and from where it is seen.
BODY = "difference(builtin:gear, move(builtin:sphere,radius=0.5, 0.55, 0.5, 0.35))"
EYE_OF_PICTURES = (1.8, 1.4, 4.0)  # y is upward

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

    def combine_body(self):
        """Builds the field of the body in pictures, body.hpsdf."""
        self.run("combine", BODY, "-o", self.at("body.hpsdf"), "--target-error", "1e-6")

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


def pixels(file):
    """Returns the colours of a picture, the lowest row first."""
    reader = module("vtkmodules.vtkIOImage", "python3-vtk9").vtkPNGReader()
    reader.SetFileName(str(file))
    reader.Update()
    image = reader.GetOutput()
    width, height, _ = image.GetDimensions()
    colors = module("vtkmodules.util.numpy_support", "python3-vtk9").vtk_to_numpy(image.GetPointData().GetScalars())
    return colors.reshape(height, width, -1)[:, :, :3].astype(int)


def check_picture(file, name):
    """Checks that a picture is about that of docs/pictures: versions of programs and devices light it a bit differently. If
    the environment variable HPSDF_PICTURES names a folder, the picture is copied there, to become the new one of docs."""
    if "HPSDF_PICTURES" in os.environ:
        shutil.copy(file, Path(os.environ["HPSDF_PICTURES"]) / name)
    actual, expected = pixels(file), pixels(Path(__file__).parents[2] / "docs/pictures" / name)
    assert actual.shape == expected.shape, (name, actual.shape, expected.shape)
    difference = abs(actual - expected).mean()
    moved = abs(actual - expected[:, ::-1]).mean()  # a mirrored picture must be noticed
    print(f"{name} differs by {difference:.2f} of 255, its mirror image by {moved:.2f}")
    assert difference < 4 < moved, (name, difference, moved)


def distance(x, y, z):
    """Returns the signed distance to the torus."""
    return ((((x * x + y * y) ** 0.5) - MAJOR) ** 2 + z * z) ** 0.5 - MINOR


def check_near(actual, expected, tolerance, what):
    worst = max(abs(float(a) - float(b)) for a, b in zip(actual, expected))
    assert worst <= tolerance, f"{what}: differs by {worst}, more than {tolerance}"
