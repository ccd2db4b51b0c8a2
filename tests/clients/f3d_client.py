"""f3d draws the contour of a field from a GLB file, without a display, and the silhouette is that of our own picture from the
same camera."""

import json
import math
import shutil
import subprocess

from client import EYE_OF_PICTURES, Program, check_picture, module, pixels, skip

numpy = module("numpy", "python3-numpy")

EYE = (2.0, -2.0, 2.0)


def run_f3d(program, file, picture, eye, *options):
    command = ["xvfb-run", "-a", "f3d", program.at(file), "--output", program.at(picture), "--camera-position",
               ",".join(map(str, eye)), "--camera-focal-point", "0,0,0", "--axis=0", "--grid=0", "--filename=0", *options]
    made = subprocess.run(command, capture_output=True, text=True, timeout=100)
    assert made.returncode == 0, made.stderr
    return program.at(picture)


def drawn_by_f3d(program, eye):
    """Returns which pixels of f3d's picture show the body."""
    picture = run_f3d(program, "torus.glb", "f3d.png", eye, "--resolution", "600,600", "--camera-view-up", "0,0,1",
                      "--camera-view-angle", "40", "--bg-color", "0,0,1")
    return (pixels(picture) != (0, 0, 255)).any(axis=2)


def check_colors(program):
    """A body of one colour has this hue in f3d's picture: the numbers of the file are taken as linear light. All slopes lie
    below the range, so that each vertex has the dark end of the colour map, whose red, green and blue are 84, 41, 126."""
    program.run("contour", program.at("torus.hpsdf"), "-o", program.at("dark.glb"), "--tolerance", "0.01", "--color", "slope",
                "--range", "10,20", "--scale", "linear")
    colors = pixels(run_f3d(program, "dark.glb", "dark.png", EYE, "--resolution", "300,300", "--bg-color", "0,1,0"))
    body = colors[(colors != (0, 255, 0)).any(axis=2)]
    red, green, blue = ((body.mean(axis=0) / 255) ** 2.2).tolist()
    print(f"linear green and red over blue are {green / blue:.3f} and {red / blue:.3f}")
    assert green / blue < 0.24 and 0.25 < red / blue < 0.6, (red, green, blue)


def draw_for_docs(program):
    program.combine_body()
    program.run("contour", program.at("body.hpsdf"), "-o", program.at("body.glb"), "--tolerance", "0.6%")
    check_picture(run_f3d(program, "body.glb", "body.png", EYE_OF_PICTURES, "--resolution", "400,300", "--up", "+Y",
                          "--camera-view-angle", "30", "--edges", "--bg-color", "1,1,1"), "f3d.png")


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
check_colors(program)
draw_for_docs(program)
