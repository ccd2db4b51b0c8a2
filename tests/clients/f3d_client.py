"""f3d draws the contour of a field from a GLB file, without a display, and the silhouette is that of our own picture from the
same camera."""

import json
import math
import shutil
import subprocess

from client import Program, module, skip

numpy = module("numpy", "python3-numpy")
vtk_image = module("vtkmodules.vtkIOImage", "python3-vtk9")
vtk_arrays = module("vtkmodules.util.numpy_support", "python3-vtk9")

EYE = (2.0, -2.0, 2.0)


def pixels(file):
    """Returns the colours of a picture, the lowest row first."""
    reader = vtk_image.vtkPNGReader()
    reader.SetFileName(file)
    reader.Update()
    image = reader.GetOutput()
    width, height, _ = image.GetDimensions()
    colors = vtk_arrays.vtk_to_numpy(image.GetPointData().GetScalars())
    return colors.reshape(height, width, -1)[:, :, :3].astype(int)


def drawn_by_f3d(program, eye):
    """Returns which pixels of f3d's picture show the body."""
    command = ["xvfb-run", "-a", "f3d", program.at("torus.glb"), "--output", program.at("f3d.png"), "--resolution", "600,600",
               "--camera-position", ",".join(map(str, eye)), "--camera-focal-point", "0,0,0", "--camera-view-up", "0,0,1",
               "--camera-view-angle", "40", "--axis=0", "--grid=0", "--filename=0", "--bg-color", "0,0,1"]
    made = subprocess.run(command, capture_output=True, text=True, timeout=100)
    assert made.returncode == 0, made.stderr
    return (pixels(program.at("f3d.png")) != (0, 0, 255)).any(axis=2)


def drawn_by_us(program, eye):
    """Returns which pixels of our picture show the body, which is orange before a bluish background."""
    x, y, z = eye
    info = json.loads(program.run("info", program.at("torus.hpsdf"), "--json"))
    low, high = numpy.array(info["domain"][0]), numpy.array(info["domain"][1])
    distance = math.hypot(x, y, z) / numpy.linalg.norm(high - low)
    azimuth, elevation = math.degrees(math.atan2(x, -y)), math.degrees(math.atan2(z, math.hypot(x, y)))
    program.run("render", program.at("torus.hpsdf"), "-o", program.at("ours.png"), "--size", "900x600", "--up", "z",
                "--target", "0,0,0", "--camera", f"{azimuth},{elevation},{distance}")
    colors = pixels(program.at("ours.png"))
    return colors[:, :, 0] > colors[:, :, 2] + 10


def silhouette(mask):
    """Returns 200 × 200 samples of the body's box, so that the scale of the picture does not matter, and its aspect."""
    rows, columns = numpy.flatnonzero(mask.any(axis=1)), numpy.flatnonzero(mask.any(axis=0))
    box = mask[rows[0]:rows[-1] + 1, columns[0]:columns[-1] + 1]
    places = [((numpy.arange(200) + 0.5) / 200 * n).astype(int) for n in box.shape]
    return box[numpy.ix_(*places)], box.shape[1] / box.shape[0]


def likeness(one, other):
    """Returns the common part of two silhouettes over their union, and the ratio of their aspects."""
    (first, first_aspect), (second, second_aspect) = silhouette(one), silhouette(other)
    return (first & second).sum() / (first | second).sum(), first_aspect / second_aspect


for name, package in (("xvfb-run", "xvfb"), ("f3d", "f3d")):
    if not shutil.which(name):
        skip(f"{package} is not installed")
program = Program()
program.run("contour", program.at("torus.hpsdf"), "-o", program.at("torus.glb"), "--tolerance", "0.002")
ours = drawn_by_us(program, EYE)
overlap, aspect = likeness(drawn_by_f3d(program, EYE), ours)
print(f"f3d and our picture overlap by {overlap:.4f}, aspects {aspect:.4f}")
assert overlap > 0.98 and abs(aspect - 1) < 0.01, (overlap, aspect)
# The comparison must see another camera.
overlap, aspect = likeness(drawn_by_f3d(program, (2.0, -2.0, 1.6)), ours)
print(f"from another camera by {overlap:.4f}, {aspect:.4f}")
assert overlap < 0.95 or abs(aspect - 1) > 0.05, (overlap, aspect)
