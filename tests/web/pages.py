"""What the tests do with pages in a browser."""

import csv
import io
import pathlib
from collections.abc import Callable
from typing import Any

import numpy

from conftest import package


def opened(browser: Any, page: pathlib.Path) -> Any:
    """Opens a page and waits until its first sharp picture is drawn, or until it tells why it draws none."""
    browser.get(page.as_uri())
    rested(browser)
    return browser


def rested(browser: Any) -> str:
    """Waits for the sharp picture of the view, and returns the page's state."""
    wait = package("selenium.webdriver.support.ui").WebDriverWait(browser, 120)
    return str(wait.until(lambda page: page.execute_script("return ['sharp', 'failed'].find(s => s === document.body.dataset.state)")))


def applied(browser: Any, lines: str) -> None:
    """Shows the view that lines of a script describe, and waits for its sharp picture."""
    browser.execute_script("hpsdf.page.apply(arguments[0])", lines)
    rested(browser)
    assert browser.find_element("id", "message").text == ""


def asked(browser: Any, script: str, *arguments: Any) -> Any:
    """Runs a script with the page's functions."""
    return browser.execute_script("const {page, field, query, firstView, planeOf, raysOf, scriptOf, viewFrom, degreeOf, axisAlong, pickAt, add, scaled, cellErrors, forEachLeaf} = hpsdf;" + script, *arguments)


def complaints(browser: Any) -> list[str]:
    """What the browser logged, but for remarks on its software renderer."""
    remarks = ("software WebGL", "GPU stall due to ReadPixels")
    return [entry["message"] for entry in browser.get_log("browser") if not any(remark in entry["message"] for remark in remarks)]


def columns(text: str) -> dict[str, Any]:
    rows = list(csv.DictReader(io.StringIO(text)))
    return {name: numpy.array([float(row[name]) for row in rows]) for name in rows[0]}


def queried(program: Callable[..., str], field: pathlib.Path, points: Any, folder: pathlib.Path) -> dict[str, Any]:
    file = folder / "points.txt"
    file.write_text("\n".join(" ".join(repr(float(x)) for x in point) for point in points))
    return columns(program("query", field, file))


def payload(text: str) -> tuple[int, int]:
    """Where the first field stands in a page."""
    begin = text.index(">", text.index('class="field"')) + 1
    return begin, text.index("<", begin)


def shown_pixels(browser: Any) -> Any:
    """The colours of the canvas, from the bottom row up."""
    return numpy.array(
        asked(
            browser,
            """
            const {canvas, painter: {gl}} = page.viewer, bytes = new Uint8Array(4 * canvas.width * canvas.height);
            gl.bindFramebuffer(gl.FRAMEBUFFER, null);
            gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
            return [canvas.width, canvas.height, Array.from(bytes)];
            """,
        )[2]
    )
