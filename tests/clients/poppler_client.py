"""Poppler draws our PDF files as our PNG files are, reads their text, and finds the font in them."""

import shutil
import subprocess

from client import Program, module, skip

numpy = module("numpy", "python3-numpy")
image_module = module("PIL.Image", "python3-pil")

from near_edges import share_unlike  # noqa: E402

MOST = 0.001  # of the pixels: crossings of lines, and places where the surface touches a border of cells

FIGURES = {
    "degree": ("slice", "gear.hpsdf", "--axis", "z", "--offset", "0.013"),
    "oblique": ("slice", "gear.hpsdf", "--plane", "0,0,0,1,0.7,0.4", "--color", "depth"),
    "zoomed": ("slice", "gear.hpsdf", "--zoom", "6", "--target", "0.6,0.3,0"),
    "distance": ("slice", "gear.hpsdf", "--color", "distance"),
    "jumps": ("slice", "gear.hpsdf", "--color", "value-jump"),
    "slope": ("slice", "gear.hpsdf", "--color", "slope", "--range", "1e-3,1"),
    "arrows": ("slice", "gear.hpsdf", "--arrows", "40"),
    "outlines": ("slice", "gear.hpsdf", "--operands", "union(builtin:gear,builtin:sphere)"),
    "line": ("probe", "gear.hpsdf", "--from", "-1,0.1,0", "--to", "1,0.2,0.1"),
    "surface": ("render", "gear.hpsdf", "--color", "degree"),
}


def run(*words):
    return subprocess.run(list(map(str, words)), capture_output=True, text=True, check=True).stdout


def drawn(program, name, words, *options):
    """Returns our picture and poppler's picture of our PDF file, as arrays."""
    field = [program.at(word) if word.endswith(".hpsdf") else word for word in words]
    for kind in ("png", "pdf"):
        program.run(*field, "-o", program.at(f"{name}.{kind}"), *options)
    run("pdftoppm", "-r", "96", "-png", "-singlefile", program.at(f"{name}.pdf"), program.at(f"{name}-poppler"))
    return [pixels(program.at(file)) for file in (f"{name}.png", f"{name}-poppler.png")]


def pixels(file):
    return numpy.asarray(image_module.open(file).convert("RGB")).astype(int)


def check_wrong_pictures(ours, theirs):
    """Pictures that are moved by two pixels, without lines, or with another colour are noticed."""
    moved = numpy.roll(theirs, 2, axis=1)
    assert share_unlike(ours, moved) > MOST
    colors, counts = numpy.unique(ours.reshape(-1, 3), axis=0, return_counts=True)
    common = colors[numpy.argsort(-counts)]
    recolored = theirs.copy()
    recolored[(theirs == common[2]).all(axis=2)] += 12
    assert share_unlike(ours, recolored) > MOST
    without_lines = ours.copy()
    without_lines[:, 1:][(ours[:, 1:] != ours[:, :-1]).any(axis=2)] = common[1]
    assert share_unlike(ours, without_lines) > MOST


if not shutil.which("pdftoppm"):
    skip("poppler-utils is not installed")

program = Program()
program.run("build", "builtin:gear", "-o", program.at("gear.hpsdf"), "--target-error", "1e-5")
refused = subprocess.run([program.program, "slice", program.at("gear.hpsdf"), "-o", program.at("try.pdf")], capture_output=True, text=True)
if "libcairo2-dev" in refused.stderr:
    skip("the program was built without libcairo2-dev")
assert refused.returncode == 0, refused.stderr

for name, words in FIGURES.items():
    ours, theirs = drawn(program, name, words)
    share = share_unlike(ours, theirs)
    print(f"{name}: {100 * share:.3f} % of the pixels are unlike")
    assert share <= MOST, name
    if name == "degree":
        check_wrong_pictures(ours, theirs)

text = run("pdftotext", program.at("degree.pdf"), "-")
for words in ("polynomial degree", "share of the volume", "builtin:gear", "slice z = 0.013", "τ = 1e-5", "·"):
    assert words in text, (words, text)
assert "−0.5" in run("pdftotext", program.at("line.pdf"), "-")
fonts = run("pdffonts", program.at("degree.pdf"))
assert all("DejaVuSans" in line and " yes yes yes" in line for line in fonts.splitlines()[2:]), fonts

# The resolution changes the number of pixels and leaves the physical size.
small, large = (drawn(program, f"dpi{dpi}", FIGURES["degree"], "--size", "640x360", "--dpi", dpi)[0] for dpi in ("96", "192"))
assert large.shape == (720, 1280, 3) and small.shape == (360, 640, 3)
for dpi in ("96", "192"):
    assert "480 x 270 pts" in run("pdfinfo", program.at(f"dpi{dpi}.pdf"))
