"""SVG files in a browser: the same picture as the PNG file of the same command."""

import base64
import io
import pathlib
import sys
import xml.etree.ElementTree
from collections.abc import Callable
from typing import Any

import numpy
import pytest

from conftest import package

sys.path.insert(0, str(pathlib.Path(__file__).parents[1] / "clients"))
from near_edges import share_unlike  # noqa: E402

MOST = 0.002  # of the pixels: crossings of lines, and places where the surface touches a border of cells
SIZE = (900, 506)
SVG = "{http://www.w3.org/2000/svg}"

FIGURES: dict[str, tuple[str, ...]] = {
    "degree": ("slice",),
    "oblique": ("slice", "--plane", "0,0,0,1,0.7,0.4", "--color", "depth"),
    "distance": ("slice", "--color", "distance"),
    "jumps": ("slice", "--color", "value-jump"),
    "arrows": ("slice", "--arrows", "40"),
    "line": ("probe", "--from", "-1,0.1,0", "--to", "1,0.2,0.1"),
    "surface": ("render", "--color", "degree"),
}


@pytest.fixture(scope="module")
def gear(tmp_path_factory: pytest.TempPathFactory, program: Callable[..., str]) -> pathlib.Path:
    file = tmp_path_factory.mktemp("figures") / "gear.hpsdf"
    program("build", "builtin:gear", "-o", file, "--target-error", "1e-5")
    return file


def pixels(png: Any) -> Any:
    return numpy.asarray(package("PIL.Image").open(png).convert("RGB")).astype(int)


def written(program: Callable[..., str], gear: pathlib.Path, name: str) -> tuple[pathlib.Path, pathlib.Path]:
    """Writes a figure as SVG and as PNG."""
    command, *options = FIGURES[name]
    files = gear.with_name(f"{name}.svg"), gear.with_name(f"{name}.png")
    for file in files:
        program(command, gear, "-o", file, "--size", f"{SIZE[0]}x{SIZE[1]}", *options)
    return files


def shown(browser: Any, svg: pathlib.Path) -> Any:
    """Returns what the browser shows of a file."""
    browser.get(svg.as_uri())
    clip = {"x": 0, "y": 0, "width": SIZE[0], "height": SIZE[1], "scale": 1}
    made = browser.execute_cdp_cmd("Page.captureScreenshot", {"format": "png", "clip": clip, "captureBeyondViewport": True})
    return pixels(io.BytesIO(base64.b64decode(made["data"])))


@pytest.mark.parametrize("name", FIGURES)
def test_the_browser_shows_the_picture(browser: Any, program: Callable[..., str], gear: pathlib.Path, name: str) -> None:
    svg, png = written(program, gear, name)
    share = share_unlike(pixels(png), shown(browser, svg))
    print(f"{name}: {100 * share:.3f} % of the pixels are unlike")
    assert share <= MOST


@pytest.mark.parametrize("layer", ["cells", "outlines", "surface", "legend"])
def test_a_picture_without_a_layer_is_noticed(browser: Any, program: Callable[..., str], gear: pathlib.Path, layer: str) -> None:
    svg, png = written(program, gear, "degree")
    damaged = svg.with_name(f"without-{layer}.svg")
    text = svg.read_text()
    damaged.write_text(text.replace(f'<g id="{layer}"', f'<g display="none" id="{layer}"'))
    assert damaged.read_text() != text
    assert share_unlike(pixels(png), shown(browser, damaged)) > MOST


def test_the_file_is_xml_with_areas_and_texts(program: Callable[..., str], gear: pathlib.Path) -> None:
    svg, _ = written(program, gear, "degree")
    root = xml.etree.ElementTree.parse(svg).getroot()
    assert root.tag == SVG + "svg"
    texts = [element.text for element in root.iter(SVG + "text")]
    assert {"polynomial degree", "builtin:gear"} <= set(texts)
    layers = {group.get("id"): group for group in root.iter(SVG + "g")}
    fills = [path.get("fill") for path in layers["cells"].iter(SVG + "path") if path.get("fill") != "none"]
    assert len(fills) == len(set(fills)) > 1
