"""Pages of several fields, pictures for browsers that cannot show fields, and the pages of other commands that show fields."""

import base64
import html
import os
import pathlib
import re
import subprocess
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from conftest import package, started
from pages import applied, complaints, opened, payload, rested

NAMES = ("torus", "box")


@pytest.fixture(scope="module")
def fields(tmp_path_factory: pytest.TempPathFactory, program: Callable[..., str]) -> list[pathlib.Path]:
    folder = tmp_path_factory.mktemp("gallery")
    for name in NAMES:
        program("build", f"builtin:{name}", "--target-error", "1e-3", "-o", folder / f"{name}.hpsdf")
    return [folder / f"{name}.hpsdf" for name in NAMES]


@pytest.fixture(scope="module")
def gallery(fields: list[pathlib.Path], program: Callable[..., str]) -> pathlib.Path:
    """A page of both fields, whose first view is a slice."""
    page = fields[0].with_name("gallery.html")
    program("page", *fields, "-o", page, "--view", "show slice; plane axis=x offset=0.125; color depth", "--cpu")
    return page


@pytest.fixture
def browser_without_scripts() -> Iterator[Any]:
    made = started()
    made.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": True})
    yield made
    made.quit()


def source_shown(browser: Any) -> str:
    """Returns what the shown field was made from, as the page tells it."""
    return str(browser.execute_script("return [...document.querySelectorAll('#figures dt')].find(t => t.textContent === 'made from').nextSibling.textContent"))


def seen_pictures(browser: Any) -> list[str]:
    """Returns the captions of the pictures that the browser could read and shows."""
    figures = browser.find_elements("css selector", "#pictures figure")
    seen = [figure for figure in figures if figure.is_displayed() and int(figure.find_element("tag name", "img").get_property("naturalWidth")) == 400]
    return [str(figure.find_element("tag name", "figcaption").text) for figure in seen]


def expected_captions() -> list[str]:
    return [f"{name}: {what}" for name in NAMES for what in ("the surface", "the polynomial degrees of the cells in a plane")]


def test_each_field_has_a_tab(browser: Any, gallery: pathlib.Path) -> None:
    opened(browser, gallery)
    tabs = browser.find_elements("css selector", "nav button")
    assert [tab.text for tab in tabs] == list(NAMES)
    assert source_shown(browser) == "builtin:torus"
    tabs[1].click()
    package("selenium.webdriver.support.ui").WebDriverWait(browser, 60).until(lambda page: source_shown(page) == "builtin:box")
    assert rested(browser) == "sharp"
    assert seen_pictures(browser) == []
    assert complaints(browser) == []


def test_the_first_view_is_the_one_that_was_asked_for(browser: Any, gallery: pathlib.Path) -> None:
    opened(browser, gallery)
    lines = browser.find_element("id", "script").get_attribute("value").splitlines()
    assert "show slice" in lines and "color depth of=slice" in lines
    assert any(line.startswith("plane axis=x offset=0.125") for line in lines)


def test_without_webgl_there_are_pictures(gallery: pathlib.Path) -> None:
    browser = started("--disable-3d-apis")
    try:
        opened(browser, gallery)
        assert "WebGL 2" in browser.find_element("id", "message").text
        assert seen_pictures(browser) == expected_captions()
    finally:
        browser.quit()


def test_without_scripts_there_are_pictures(browser_without_scripts: Any, gallery: pathlib.Path) -> None:
    browser_without_scripts.get(gallery.as_uri())
    assert seen_pictures(browser_without_scripts) == expected_captions()


@pytest.mark.parametrize("sandbox", ["", 'sandbox="allow-scripts"'])
def test_a_page_works_in_the_frame_of_a_notebook(browser: Any, gallery: pathlib.Path, tmp_path: pathlib.Path, sandbox: str) -> None:
    text = html.escape(gallery.read_text(encoding="utf-8"))
    notebook = tmp_path / "notebook.html"
    notebook.write_text(f'<!doctype html><meta charset="utf-8"><iframe srcdoc="{text}" {sandbox} width="600" height="400"></iframe>', encoding="utf-8")
    browser.get(notebook.as_uri())
    browser.switch_to.frame(browser.find_element("tag name", "iframe"))
    assert rested(browser) == "sharp"
    assert source_shown(browser) == "builtin:torus"
    assert complaints(browser) == []


def test_a_report_shows_its_field_live_and_prints_pictures(
    browser: Any, fields: list[pathlib.Path], program: Callable[..., str], tmp_path: pathlib.Path
) -> None:
    program("report", fields[0], "-o", tmp_path, "--samples", "1")
    browser.get((tmp_path / "index.html").as_uri())
    frame = browser.find_element("css selector", ".live iframe")
    assert frame.location["y"] < 260, "a reader sees it without scrolling"
    browser.switch_to.frame(frame)
    assert rested(browser) == "sharp"
    assert source_shown(browser) == "builtin:torus"
    browser.switch_to.default_content()
    assert browser.find_element("link text", "open alone").get_attribute("href") == (tmp_path / "explorer.html").as_uri()
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
    try:
        assert not frame.is_displayed()
        assert [picture.is_displayed() for picture in browser.find_elements("css selector", "figure img")] == [True] * 5
    finally:
        browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": ""})
    assert complaints(browser) == []


@pytest.fixture
def failed_check(tmp_path: pathlib.Path) -> pathlib.Path:
    """The page of a check in which a slice fails, because its plane lies elsewhere than that of its baseline."""
    script = tmp_path / "pictures" / "scripts" / "looks.hps"
    script.parent.mkdir(parents=True)
    script.write_text("build builtin:torus target-error=1e-3; slice axis=y offset=$at color=depth size=160x120 cpu=true output=$out/a.png")

    def run(status: int, *words: object) -> None:
        made = subprocess.run([os.environ["HPSDF_PROGRAM"], *map(str, words)], capture_output=True, cwd=tmp_path)
        assert made.returncode == status

    run(1, "check", "pictures", "at=0.125")
    run(0, "accept", "pictures", "looks/a.png")
    run(1, "check", "pictures", "at=0.25")
    return tmp_path / "check-results" / "index.html"


def test_a_failed_check_lets_one_look_into_the_field(browser: Any, failed_check: pathlib.Path) -> None:
    browser.get(failed_check.as_uri())
    details = browser.find_element("css selector", "details.live")
    assert browser.find_elements("tag name", "iframe") == [], "nothing is loaded before it is asked for"
    details.find_element("tag name", "summary").click()
    frame = package("selenium.webdriver.support.ui").WebDriverWait(browser, 60).until(lambda page: page.find_element("css selector", "details.live iframe"))
    browser.execute_script("arguments[0].scrollIntoView()", details)
    browser.switch_to.frame(frame)
    assert rested(browser) == "sharp"
    assert source_shown(browser) == "builtin:torus"
    lines = browser.find_element("id", "script").get_attribute("value")
    assert "show slice" in lines and "plane axis=y offset=0.25" in lines and "color depth of=slice" in lines
    assert complaints(browser) == []


def test_a_lens_shows_the_pixels_of_a_failed_check(browser: Any, failed_check: pathlib.Path) -> None:
    browser.get(failed_check.as_uri())
    row = browser.find_element("xpath", "//tr[th[starts-with(., 'The worst')]]/following-sibling::tr[1]")
    place, baseline, actual, _ = [cell.text for cell in row.find_elements("tag name", "td")]
    x, y = (int(word) for word in re.findall(r"\d+", place))
    image = browser.find_elements("css selector", ".pictures img")[1]
    image.click()  # shows it as wide as the page, so that a pixel of it is several of the window
    browser.execute_script("arguments[0].scrollIntoView({block: 'center'})", image)
    size = image.size
    across = (x + 0.5) / 160 * (size["width"] - 2) + 1 - size["width"] / 2
    down = (y + 0.5) / 120 * (size["height"] - 2) + 1 - size["height"] / 2
    package("selenium.webdriver.common.action_chains").ActionChains(browser).move_to_element_with_offset(image, round(across), round(down)).perform()
    lens = browser.find_element("class name", "lens")
    assert lens.text.split()[:4] == ["x", str(x), "y", str(y)]
    assert [caption.text for caption in lens.find_elements("tag name", "figcaption")][:2] == [baseline, actual]
    assert baseline != actual
    assert complaints(browser) == []


BUNNY = pathlib.Path("/usr/share/glmark2/models/bunny.obj")
PICTURE = pathlib.Path(__file__).parents[2] / "docs" / "page.png"


def difference(browser: Any, one: bytes, other: bytes) -> float:
    """Returns the mean difference of two pictures of one size, from 0 to 255, after averaging squares of 8 × 8 pixels."""
    script = """
        const [one, other, done] = arguments;
        const pixels = async (text) => {
          const image = await createImageBitmap(await (await fetch(`data:image/png;base64,${text}`)).blob());
          const canvas = new OffscreenCanvas(Math.ceil(image.width / 8), Math.ceil(image.height / 8)), context = canvas.getContext("2d");
          context.imageSmoothingQuality = "high";
          context.drawImage(image, 0, 0, canvas.width, canvas.height);
          return [`${image.width} ${image.height}`, context.getImageData(0, 0, canvas.width, canvas.height).data];
        };
        Promise.all([pixels(one), pixels(other)]).then(([[size, a], [otherSize, b]]) =>
          done(size === otherSize ? a.reduce((sum, x, n) => sum + Math.abs(x - b[n]), 0) / a.length : 255));
    """
    browser.get("about:blank")
    return float(browser.execute_async_script(script, base64.b64encode(one).decode(), base64.b64encode(other).decode()))


def test_the_manuals_picture_is_that_of_the_page(program: Callable[..., str], tmp_path: pathlib.Path) -> None:
    """HPSDF_UPDATE=1 writes the picture anew. Browsers differ in their letters, so that the comparison is loose."""
    if not BUNNY.exists():
        pytest.skip("glmark2-data is not installed")
    program("build", BUNNY, "-o", tmp_path / "bunny.hpsdf")
    program("page", tmp_path / "bunny.hpsdf", "-o", tmp_path / "bunny.html", "--pictures=false")
    browser = started("--window-size=1180,760")
    try:
        opened(browser, tmp_path / "bunny.html")
        applied(browser, "show surface; camera 24,14,0.95; surface clip=z clip-offset=0.05; color degree")
        canvas = browser.find_element("tag name", "canvas")
        package("selenium.webdriver.common.action_chains").ActionChains(browser).move_to_element_with_offset(canvas, -40, 60).perform()
        made = browser.get_screenshot_as_png()
        applied(browser, "color depth")
        wrong = browser.get_screenshot_as_png()
        if os.environ.get("HPSDF_UPDATE") == "1":
            PICTURE.write_bytes(made)
        kept = PICTURE.read_bytes()
        assert difference(browser, kept, made) < 4
        assert difference(browser, kept, wrong) > 4, "the comparison would notice other colours"
    finally:
        browser.quit()


def pressed(browser: Any, name: str) -> str:
    """Shows a field by its tab, waits until its picture is sharp or it has failed, and returns the page's state."""
    browser.execute_script("document.body.dataset.state = 'asked'")
    next(tab for tab in browser.find_elements("css selector", "nav button") if tab.text == name).click()
    return rested(browser)


def test_there_may_be_more_fields_than_graphics_contexts(browser: Any, fields: list[pathlib.Path], program: Callable[..., str]) -> None:
    names = [f"number {n}" for n in range(8)]
    page = fields[0].with_name("many.html")
    given = [word for name in names for word in ("--name", name)]
    program("page", *[fields[1]] * len(names), *given, "-o", page, "--pictures=false")
    opened(browser, page)
    assert [pressed(browser, name) for name in [*names, names[0]]] == ["sharp"] * (len(names) + 1)
    assert browser.execute_script("return document.querySelectorAll('canvas').length") <= 6
    assert complaints(browser) == []


def test_a_damaged_field_leaves_the_others(browser: Any, gallery: pathlib.Path, tmp_path: pathlib.Path) -> None:
    text = gallery.read_text(encoding="utf-8")
    begin, _ = payload(text)
    page = tmp_path / "damaged.html"
    page.write_text(text[: begin + 200] + "!" + text[begin + 201 :], encoding="utf-8")
    opened(browser, page)
    assert "cannot be shown: its text is damaged" in browser.find_element("id", "message").text
    assert seen_pictures(browser) == expected_captions()
    assert pressed(browser, "box") == "sharp"
    assert browser.find_element("id", "message").text == "" and seen_pictures(browser) == []
    assert pressed(browser, "torus") == "failed"
    assert "cannot be shown: its text is damaged" in browser.find_element("id", "message").text


def test_an_incomplete_page_says_so(browser: Any, gallery: pathlib.Path, tmp_path: pathlib.Path) -> None:
    text = gallery.read_text(encoding="utf-8")
    page = tmp_path / "cut.html"
    page.write_text(text[: payload(text)[0] + 500], encoding="utf-8")
    browser.get(page.as_uri())
    assert "the page is incomplete" in browser.find_element("id", "message").text
    assert seen_pictures(browser) == expected_captions()
    assert not browser.find_element("id", "kind").is_displayed()


def test_pictures_beside_each_other_share_their_colours(browser: Any, gallery: pathlib.Path) -> None:
    opened(browser, gallery)
    package("selenium.webdriver.support.ui").Select(browser.find_element("id", "beside")).select_by_visible_text("box")
    wait = package("selenium.webdriver.support.ui").WebDriverWait(browser, 60)
    wait.until(lambda page: page.execute_script("return hpsdf.page.viewers.length === 2 && document.body.dataset.state === 'sharp'"))
    ours, others = browser.execute_script("return hpsdf.page.viewers.map(({painter}) => [painter.degrees, painter.depths].map(all => all.map(({level, color}) => [level, color])))")
    assert ours == others and len(ours[0]) > 1
    own = browser.execute_script("return hpsdf.page.viewers.map(({painter}) => [...painter.shares.degree.keys()])")
    assert set(own[0]) != set(own[1]), "these fields would have other colours alone"


def test_fields_at_other_places_stand_in_the_middle(browser: Any, fields: list[pathlib.Path], program: Callable[..., str], tmp_path: pathlib.Path) -> None:
    program("combine", f"move({fields[0]}, 10, 0, 0)", "-o", tmp_path / "far.hpsdf", "--target-error", "1e-3")
    program("page", fields[0], tmp_path / "far.hpsdf", "-o", tmp_path / "places.html", "--pictures=false")
    opened(browser, tmp_path / "places.html")
    hits = "const {hits} = hpsdf.page.viewer.shown, cells = hits.read(); return cells.filter((x, n) => n % 4 === 0 && x !== 0xffffffff).length / (cells.length / 4)"
    shares = []
    for lines in ("show surface", "show slice; plane axis=x offset=0.3"):
        applied(browser, lines)
        here = browser.execute_script(hits)
        assert pressed(browser, "far") == "sharp"
        shares.append((here, browser.execute_script(hits)))
        assert pressed(browser, "torus") == "sharp"
    assert all(there == pytest.approx(here, rel=0.05) and here > 0.05 for here, there in shares), shares
