"""How the page behaves: portions of work, fingers, fields beside each other, small windows, weak graphics, no network."""

import pathlib
import re
import zlib
from collections.abc import Callable, Iterator
from typing import Any

import numpy
import pytest

from conftest import package, started
from pages import applied, asked, complaints, opened, rested, shown_pixels


@pytest.fixture(scope="module")
def fields(tmp_path_factory: pytest.TempPathFactory, program: Callable[..., str]) -> list[pathlib.Path]:
    folder = tmp_path_factory.mktemp("viewer")
    files = [folder / "coarse.hpsdf", folder / "fine.hpsdf"]
    for file, target in zip(files, ("1e-3", "1e-6"), strict=True):
        program("build", "builtin:torus", "--target-error", target, "-o", file)
    program("page", *files, "-o", folder / "both.html", "--pictures=false")
    return files


@pytest.fixture
def both(fields: list[pathlib.Path], browser: Any) -> Any:
    """The browser, with a page of both fields open."""
    return opened(browser, fields[0].with_name("both.html"))


def cell_data(file: pathlib.Path) -> dict[str, Any]:
    """Returns the numbers of the leaves in a .vtu file, whose arrays are appended and compressed by zlib."""
    data = file.read_bytes()
    start = data.index(b"_", data.index(b"<AppendedData")) + 1
    types = {b"UInt8": numpy.uint8, b"Float32": numpy.float32}
    arrays = {}
    for kind, name, offset in re.findall(rb'type="(\w+)" Name="(\w+)"[^>]*offset="(\d+)"', data[data.index(b"<CellData") : start]):
        at = start + int(offset)
        blocks = int(numpy.frombuffer(data, numpy.uint64, 1, at)[0])
        sizes = numpy.frombuffer(data, numpy.uint64, blocks, at + 24)
        at += 24 + 8 * blocks
        parts = []
        for size in map(int, sizes):
            parts.append(zlib.decompress(data[at : at + size]))
            at += size
        arrays[name.decode()] = numpy.frombuffer(b"".join(parts), types[kind])
    return arrays


def test_leaves_and_their_errors_are_those_of_the_program(both: Any, fields: list[pathlib.Path], program: Callable[..., str], tmp_path: pathlib.Path) -> None:
    program("export", fields[0], "-o", tmp_path / "leaves.vtu")
    theirs = cell_data(tmp_path / "leaves.vtu")
    ours = numpy.array(
        asked(both, "const errors = cellErrors(field), leaves = []; forEachLeaf(field, (n, depth) => leaves.push([degreeOf(field, n), depth, errors[n]])); return leaves")
    )
    assert (ours[:, 0] == theirs["degree"]).all() and (ours[:, 1] == theirs["depth"]).all()
    numpy.testing.assert_allclose(ours[:, 2], theirs["error"], rtol=1e-5)
    assert theirs["error"].std() > 0.1 * theirs["error"].mean(), "the comparison would notice another order"
    before = shown_pixels(both)
    applied(both, "show surface; color cell-error")
    assert (shown_pixels(both) != before).mean() > 0.02


def test_the_sharp_picture_is_drawn_in_portions(both: Any) -> None:
    drawn = asked(
        both,
        """
        const {painter} = page.viewer, drawing = painter.drawing.bind(painter);
        window.drawn = [];
        painter.drawing = (view, scale, buffers) => {
          const made = drawing(view, scale, buffers);
          for (const job of made.jobs) {
            const draw = job.draw;
            job.draw = (first, count) => { drawn.push([scale, job.kind, first, count, job.size]); draw(first, count); };
          }
          return made;
        };
        page.view.orbit.azimuth += 10;
        page.changed();
        """,
    )
    assert drawn is None
    rested(both)
    drawn = both.execute_script("return drawn")
    for kind in ("surface", "colors"):
        portions = [(first, count, size) for scale, k, first, count, size in drawn if scale == 1 and k == kind]
        assert len(portions) >= 4, "no portion is more than a quarter"
        assert [first for first, _, _ in portions[1:]] == numpy.cumsum([count for _, count, _ in portions])[:-1].tolist()
        assert sum(count for _, count, _ in portions) == portions[0][2]


def test_a_change_ends_what_is_under_way(both: Any) -> None:
    asked(
        both,
        """
        const {painter} = page.viewer, drawing = painter.drawing.bind(painter);
        window.sharp = [];
        painter.drawing = (view, scale, buffers) => {
          const made = drawing(view, scale, buffers);
          if (scale !== 1) return made;
          const number = sharp.push(0) - 1, draw = made.jobs[0].draw;
          made.jobs[0].draw = (first, count) => {
            sharp[number] += count / made.jobs[0].size;
            draw(first, count);
            if (number === 0) { page.turnView(20, 0); page.changed(); } // while the first sharp picture is drawn
          };
          return made;
        };
        page.turnView(20, 0);
        page.changed();
        """,
    )
    rested(both)
    shares = both.execute_script("return sharp")
    assert len(shares) == 2 and shares[0] < 0.3 and shares[1] == pytest.approx(1)


def test_fields_stand_beside_each_other(both: Any) -> None:
    package("selenium.webdriver.support.ui").Select(both.find_element("id", "beside")).select_by_visible_text("fine")
    package("selenium.webdriver.support.ui").WebDriverWait(both, 60).until(lambda page: len([c for c in page.find_elements("tag name", "canvas") if c.is_displayed()]) == 2)
    rested(both)
    first, second = (canvas for canvas in both.find_elements("tag name", "canvas") if canvas.is_displayed())
    left, right = sorted((first, second), key=lambda canvas: canvas.location["x"])
    actions = package("selenium.webdriver.common.action_chains").ActionChains
    actions(both).move_to_element(right).click_and_hold().move_by_offset(30, 0).release().perform()
    rested(both)
    azimuths = both.execute_script("return hpsdf.page.viewers.map(v => v.shown.view.orbit.azimuth)")
    assert azimuths == [pytest.approx(18)] * 2, "the cameras are linked"
    applied(both, "show slice; plane axis=z offset=0.01")
    actions(both).move_to_element_with_offset(left, 20, 15).perform()
    rows = dict(
        both.execute_script("return [...document.querySelectorAll('#readout dt')].map(t => [t.textContent, t.nextSibling.textContent.replaceAll('−', '-')])")
    )
    assert float(rows["value in fine"]) - float(rows["value"]) == pytest.approx(float(rows["difference"]), abs=2e-4)
    assert float(rows["difference"]) != 0
    assert complaints(both) == []


def touches(browser: Any, kind: str, *points: tuple[float, float]) -> None:
    browser.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [{"x": x, "y": y, "id": n} for n, (x, y) in enumerate(points)]})


def test_fingers_turn_and_zoom(both: Any) -> None:
    box = next(canvas for canvas in both.find_elements("tag name", "canvas") if canvas.is_displayed()).rect
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    orbit = lambda: both.execute_script("return hpsdf.page.view.orbit")
    before = orbit()
    touches(both, "touchStart", (x, y))
    touches(both, "touchMove", (x + 40, y + 10))
    touches(both, "touchEnd")
    turned = orbit()
    assert turned["azimuth"] == pytest.approx(before["azimuth"] - 16) and turned["elevation"] == pytest.approx(before["elevation"] + 4)
    touches(both, "touchStart", (x - 20, y), (x + 20, y))
    touches(both, "touchMove", (x - 40, y), (x + 40, y))
    touches(both, "touchEnd")
    nearer = orbit()
    assert nearer["azimuth"] == turned["azimuth"]
    assert nearer["distance"] == pytest.approx(turned["distance"] / 2, rel=1e-3)
    rested(both)


def test_keys_lead_the_view(both: Any) -> None:
    canvas = next(canvas for canvas in both.find_elements("tag name", "canvas") if canvas.is_displayed())
    keys = package("selenium.webdriver.common.keys").Keys
    lines = lambda: both.find_element("id", "script").get_attribute("value")
    canvas.send_keys("s", "x")
    assert "show slice" in lines() and "plane axis=x offset=0 " in lines()
    canvas.send_keys(keys.PAGE_UP)
    assert re.search(r"plane axis=x offset=0\.0\d+ ", lines())
    canvas.send_keys("s", keys.ARROW_LEFT)
    assert "show surface" in lines() and "camera 35,20" in lines()
    canvas.send_keys(keys.HOME)
    assert "camera 30,20" in lines()
    rested(both)


def test_planes_move_and_tilt_under_the_mouse(both: Any) -> None:
    applied(both, "show surface; plane axis=z offset=0 in-space=true")
    canvas = next(canvas for canvas in both.find_elements("tag name", "canvas") if canvas.is_displayed())
    actions = package("selenium.webdriver.common.action_chains").ActionChains
    keys = package("selenium.webdriver.common.keys").Keys
    plane = lambda: both.execute_script("return [hpsdf.page.view.point, hpsdf.page.view.normal]")
    actions(both).key_down(keys.CONTROL).move_to_element(canvas).click_and_hold().move_by_offset(0, -30).release().key_up(keys.CONTROL).perform()
    point, normal = plane()
    assert point[2] > 0.05 and normal == [0, 0, 1]
    actions(both).key_down(keys.ALT).move_to_element(canvas).click_and_hold().move_by_offset(25, 0).release().key_up(keys.ALT).perform()
    point, normal = plane()
    assert numpy.linalg.norm(normal) == pytest.approx(1) and 0.5 < normal[2] < 0.999
    assert "plane through=" in both.find_element("id", "script").get_attribute("value")
    rested(both)


def test_lines_in_the_panel_are_shown(both: Any) -> None:
    box = both.find_element("id", "script")
    box.clear()
    box.send_keys("show slice\nplane axis=y offset=0.1\ncolor depth")
    both.find_element("id", "apply").click()
    assert rested(both) == "sharp"
    assert asked(both, "return [page.view.kind, page.view.point[1], page.view.sliceColor]") == ["slice", 0.1, "depth"]


@pytest.fixture
def other_browser(request: pytest.FixtureRequest) -> Iterator[Any]:
    """A browser of its own, with these arguments."""
    made = started(*getattr(request, "param", ()))
    yield made
    made.quit()


@pytest.mark.parametrize("other_browser", [("--window-size=400,300",), ("--force-device-scale-factor=2",)], indirect=True, ids=["small", "zoomed"])
def test_windows_of_any_size_hold_picture_and_controls(other_browser: Any, fields: list[pathlib.Path]) -> None:
    opened(other_browser, fields[0].with_name("both.html"))
    assert other_browser.execute_script("return document.body.dataset.state") == "sharp"
    canvas = other_browser.find_element("tag name", "canvas")
    assert canvas.size["width"] >= 200 and canvas.size["height"] >= 100
    pixels = shown_pixels(other_browser)
    assert len({tuple(pixel) for pixel in pixels.reshape(-1, 4)[::7]}) > 20, "the field is in the picture"
    assert other_browser.execute_script("return document.documentElement.scrollWidth <= innerWidth && document.documentElement.scrollHeight <= innerHeight")
    assert complaints(other_browser) == []


def test_a_graphics_card_that_is_too_small_is_named(other_browser: Any, fields: list[pathlib.Path]) -> None:
    script = """
        const ask = WebGL2RenderingContext.prototype.getParameter;
        WebGL2RenderingContext.prototype.getParameter = function (name) { return name === this.MAX_TEXTURE_SIZE ? 2 : ask.call(this, name); };
    """
    other_browser.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": script})
    opened(other_browser, fields[1].with_name("both.html"))
    assert other_browser.execute_script("return document.body.dataset.state") == "failed"
    assert "too large for this graphics card" in other_browser.find_element("id", "message").text
    assert other_browser.find_element("id", "pictures").is_displayed()


def test_a_lost_graphics_card_is_named(other_browser: Any, fields: list[pathlib.Path]) -> None:
    opened(other_browser, fields[0].with_name("both.html"))
    other_browser.execute_script("hpsdf.page.viewer.painter.gl.getExtension('WEBGL_lose_context').loseContext()")
    wait = package("selenium.webdriver.support.ui").WebDriverWait(other_browser, 60)
    wait.until(lambda page: "graphics card was lost" in page.find_element("id", "message").text)
    assert other_browser.execute_script("return document.body.dataset.state") == "failed"


def test_the_page_works_without_a_network(both: Any, fields: list[pathlib.Path], browser: Any) -> None:
    browser.execute_cdp_cmd("Network.enable", {})
    browser.execute_cdp_cmd("Network.emulateNetworkConditions", {"offline": True, "latency": 0, "downloadThroughput": 0, "uploadThroughput": 0})
    try:
        opened(browser, fields[0].with_name("both.html"))
        assert browser.execute_script("return document.body.dataset.state") == "sharp"
        assert browser.execute_script("return performance.getEntriesByType('resource').map(r => r.name)") == []
        refused = browser.execute_async_script("const done = arguments[0]; fetch('data:,x').then(() => done('sent'), () => done('refused'))")
        assert refused == "refused", "the page's content security policy forbids scripts to load anything"
    finally:
        browser.execute_cdp_cmd("Network.emulateNetworkConditions", {"offline": False, "latency": 0, "downloadThroughput": -1, "uploadThroughput": -1})
        browser.get_log("browser")
