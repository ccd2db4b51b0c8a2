"""The page of a field, in a browser: its values against the program's, its controls by real events, and what is said of damage."""

import pathlib
import re
import subprocess
from collections.abc import Callable
from typing import Any

import numpy
import pytest

from conftest import package, started
from pages import applied, asked, complaints, opened, payload, queried, rested, shown_pixels

ROOT = pathlib.Path(__file__).parents[2]
SIZE = (400, 300)


def points_in(browser: Any, count: int) -> Any:
    lower, upper = asked(browser, "return [field.lower, field.upper]")
    return numpy.random.default_rng(1).uniform(lower, upper, (count, 3))


def test_values_and_gradients_equal_those_of_the_program(
    browser: Any, field: pathlib.Path, program: Callable[..., str], tmp_path: pathlib.Path
) -> None:
    opened(browser, field.with_suffix(".html"))
    points = points_in(browser, 500)
    ours = asked(browser, "return arguments[0].map(p => { const q = query(field, p); return [q.value, ...q.gradient]; })", points.tolist())
    theirs = queried(program, field, points, tmp_path)
    expected = numpy.stack([theirs[name] for name in ("distance", "gx", "gy", "gz")], axis=1)
    assert abs(numpy.array(ours) - expected).max() < 1e-5
    assert abs(numpy.array(ours)[:, 0] - numpy.roll(expected[:, 0], 1)).max() > 0.1, "the comparison would notice other values"


def pixels(browser: Any, view: str) -> tuple[Any, Any]:
    """Returns the buffers of a view: integers of the shape (height, width, 4), and their bits as floats."""
    script = f"""
        const [width, height] = [{SIZE[0]}, {SIZE[1]}];
        return Array.from(page.viewer.painter.renderer.{view}.read());
    """
    integers = numpy.array(asked(browser, script), dtype=numpy.uint32).reshape(SIZE[1], SIZE[0], 4)
    return integers, integers.view(numpy.float32)


def check_slice(browser: Any, plane: str) -> None:
    """Checks the cells and values of a slice of the page's field."""
    made = f"planeOf(viewFrom('plane {plane} zoom=1.3', firstView(field), field).view, field, {SIZE[0]}, {SIZE[1]})"
    integers, floats = pixels(browser, f"slice({made}, width, height)")
    script = f"""
        const plane = {made};
        const found = [];
        for (let y = 0; y < {SIZE[1]}; y += 3) for (let x = 0; x < {SIZE[0]}; x += 3) {{
          const u = (2 * x + 1 - {SIZE[0]}) / {SIZE[0]}, v = ({SIZE[1]} - 2 * y - 1) / {SIZE[1]};
          const q = query(field, add(plane.origin, add(scaled(plane.right, u), scaled(plane.up, v))));
          found.push(q ? [q.leaf.node, degreeOf(field, q.leaf.node), q.leaf.depth, q.value] : [4294967295, 0, 0, 0]);
        }}
        return found;
    """
    expected = numpy.array(asked(browser, script)).reshape(SIZE[1] // 3, -1, 4)
    ours, values = integers[::3, ::3], floats[::3, ::3, 3]
    same = (ours[..., :3] == expected[..., :3]).all(axis=2)
    assert same.mean() > 0.999, f"{plane}: all but pixels on a face, whose positions round otherwise"
    assert abs(values - expected[..., 3])[same].max() < 1e-5
    assert not (ours[..., :3] == numpy.roll(expected[..., :3], 5, axis=0)).all(axis=2).mean() > 0.999


def test_slices_show_the_cells_of_the_field(browser: Any, field: pathlib.Path) -> None:
    opened(browser, field.with_suffix(".html"))
    for plane in ("axis=x", "axis=y offset=0.1", "axis=z", "through=0.1,0,0,1,2,0.5"):
        check_slice(browser, plane)


def test_surfaces_lie_where_the_field_has_the_offset(browser: Any, field: pathlib.Path) -> None:
    opened(browser, field.with_suffix(".html"))
    for offset in (0, 0.1):
        view = f"surface(raysOf(firstView(field).orbit, field, width / height), width, height, {offset})"
        integers, floats = pixels(browser, view)
        hits = integers[..., 0] != 0xFFFFFFFF
        assert 0.02 < hits.mean() < 0.9
        cracks = integers[..., 1] >> 16 & 1 == 1
        values = floats[..., 2]
        assert abs(values[hits & ~cracks] - offset).max() < 1e-4
        assert cracks[hits].mean() < 0.05


def test_the_pointer_reads_out_the_field(browser: Any, field: pathlib.Path, program: Callable[..., str], tmp_path: pathlib.Path) -> None:
    opened(browser, field.with_suffix(".html"))
    actions = package("selenium.webdriver.common.action_chains").ActionChains
    canvas = browser.find_element("tag name", "canvas")
    package("selenium.webdriver.support.ui").Select(browser.find_element("id", "kind")).select_by_value("slice")
    rested(browser)
    actions(browser).move_to_element_with_offset(canvas, 60, 40).perform()
    rows = asked(browser, "return Object.fromEntries([...document.querySelectorAll('#readout dt')].map(t => [t.textContent, t.nextSibling.textContent]))")
    position = [float(x.replace("−", "-")) for x in rows["position"].split(", ")]
    theirs = queried(program, field, [position], tmp_path)
    assert float(rows["value"].replace("−", "-")) == pytest.approx(theirs["distance"][0], abs=1e-3)
    assert complaints(browser) == []


def test_the_view_follows_mouse_wheel_and_keys(browser: Any, field: pathlib.Path) -> None:
    if field.stem != "torus":
        pytest.skip("one field suffices")
    opened(browser, field.with_suffix(".html"))
    actions = package("selenium.webdriver.common.action_chains").ActionChains
    canvas = browser.find_element("tag name", "canvas")
    orbit = lambda: asked(browser, "return page.view.orbit")
    before = orbit()
    actions(browser).move_to_element(canvas).click_and_hold().move_by_offset(50, 25).release().perform()
    turned = orbit()
    assert turned["azimuth"] == pytest.approx(before["azimuth"] - 20) and turned["elevation"] == pytest.approx(before["elevation"] + 10)
    canvas.send_keys("+")
    assert orbit()["distance"] == pytest.approx(0.8 * before["distance"])
    rested(browser)
    script = browser.find_element("id", "script").get_attribute("value")
    assert "show surface" in script and "camera 10,30,0.88" in script
    assert complaints(browser) == []


VIEWS = {
    "surface": "show surface; camera 50,10,0.9; surface offset=0.05; color depth of=surface",
    "cut": "show surface; surface clip=z clip-offset=0.1; color degree; cells lines depths=1",
    "plane": "show surface; plane axis=x offset=-0.1 in-space=true; color depth; camera 70,30,1.2 up=z projection=orthographic",
    "slice": "show slice; plane axis=y offset=0.05 zoom=2 target=0.1,0,0.2; color distance",
    "oblique": "show slice; plane through=0,0.1,0,1,2,3; color depth; worst mark=0,0.1,0",
}


def test_the_copied_view_is_a_script_of_the_program(browser: Any, field: pathlib.Path, program: Callable[..., str], tmp_path: pathlib.Path) -> None:
    opened(browser, field.with_suffix(".html"))
    for name, given in VIEWS.items():
        lines = asked(browser, "return scriptOf(viewFrom(arguments[0], firstView(field), field).view, field)", given)
        assert asked(browser, "return scriptOf(viewFrom(arguments[0], firstView(field), field).view, field)", lines) == lines
        script = tmp_path / f"{name}.hps"
        script.write_text(f"load {field}\n{lines}\nshow size=320x240\nshot output={tmp_path}/{name}.png\n")
        program("run", script)
        assert (tmp_path / f"{name}.png").stat().st_size > 10_000


def test_the_page_reads_the_views_that_the_program_copies(browser: Any, field: pathlib.Path, program: Callable[..., str]) -> None:
    opened(browser, field.with_suffix(".html"))
    for name, given in VIEWS.items():
        printed = program("run", "-e", f"load {field}; {given}; copy-view")
        copied = printed[printed.index("\nshow ") :]
        theirs, ours = (asked(browser, "return scriptOf(viewFrom(arguments[0], firstView(field), field).view, field)", text) for text in (copied, given))
        assert theirs == ours, name


def test_lines_that_the_page_does_not_understand_are_named(browser: Any, field: pathlib.Path) -> None:
    if field.stem != "torus":
        pytest.skip("one field suffices")
    opened(browser, field.with_suffix(".html"))
    for wrong in ("fly 3", "camera 1,2", "plane through=0,0,0,0,0,0", "show nothing", "color slope", "surface clip=w", "camera 1,2,x", "cells lines depths=x", "cells boxes"):
        browser.execute_script("hpsdf.page.apply(arguments[0])", wrong)
        assert wrong in browser.find_element("id", "message").text
    browser.execute_script("hpsdf.page.apply('color slope; camera 11,12,1.3; cells lines depths=0-2')")
    assert "color slope" in browser.find_element("id", "message").text
    lines = browser.find_element("id", "script").get_attribute("value")
    assert "camera 11,12,1.3" in lines and "depths=0,1,2" in lines, "the other lines are shown"


def test_cuts_planes_and_cells_stand_in_the_picture_of_a_surface(browser: Any, field: pathlib.Path) -> None:
    opened(browser, field.with_suffix(".html"))
    before = shown_pixels(browser)
    for lines in ("surface clip=z", "surface clip=none; plane axis=x in-space=true", "plane in-space=false; cells lines"):
        applied(browser, "show surface; color degree; " + lines)
        after = shown_pixels(browser)
        assert (after != before).mean() > 0.02, lines
        before = after
    assert complaints(browser) == []


@pytest.mark.parametrize("damage", ["cut", "changed", "empty"])
def test_damaged_pages_say_so(browser: Any, field: pathlib.Path, tmp_path: pathlib.Path, damage: str) -> None:
    if field.stem != "torus":
        pytest.skip("one field suffices")
    text = field.with_suffix(".html").read_text(encoding="utf-8")
    begin, end = payload(text)
    data = text[begin:end]
    half = len(data) // 2
    wrong = {"cut": data[: half - half % 4], "changed": data[:half] + ("AAAA" if data[half : half + 4] != "AAAA" else "BBBB") + data[half + 4 :], "empty": ""}
    page = tmp_path / "damaged.html"
    page.write_text(text[:begin] + wrong[damage] + text[end:], encoding="utf-8")
    browser.get(page.as_uri())
    assert rested(browser) == "failed"
    assert "The field cannot be shown: " in browser.find_element("id", "message").text


def test_without_webgl_the_page_says_so(field: pathlib.Path) -> None:
    if field.stem != "torus":
        pytest.skip("one field suffices")
    browser = started("--disable-3d-apis")
    try:
        opened(browser, field.with_suffix(".html"))
        assert "WebGL 2" in browser.find_element("id", "message").text
    finally:
        browser.quit()


def test_the_page_loads_nothing(field: pathlib.Path) -> None:
    text = field.with_suffix(".html").read_text(encoding="utf-8")
    assert "default-src 'none'" in text and "http://" not in text and "https://" not in text


def test_the_page_is_small(field: pathlib.Path) -> None:
    text = field.with_suffix(".html").read_text(encoding="utf-8")
    begin, end = payload(text)
    pictures = sum(map(len, re.findall("data:image/png;base64,[^\"]*", text)))
    assert pictures > 10_000
    assert len(text) - (end - begin) - pictures < 150_000


def test_types_of_the_modules() -> None:
    files = sorted(map(str, (ROOT / "web" / "page").rglob("*.js")))
    words = "--noEmit --allowJs --checkJs --strict --target es2022 --module es2022 --moduleResolution node --lib dom,dom.iterable,es2022"
    try:
        made = subprocess.run(["tsc", *words.split(), *files], capture_output=True, text=True)
    except FileNotFoundError:
        pytest.skip("node-typescript is not installed")
    assert made.stdout == ""
