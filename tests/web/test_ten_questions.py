"""The ten questions of docs/explorer.md, answered in the page alone, and by the lines of scripts that stand beside them."""

import json
import pathlib
import re
from collections.abc import Callable
from typing import Any

import numpy
import pytest

from conftest import package
from pages import applied, complaints, opened, rested

ROOT = pathlib.Path(__file__).parents[2]
Program = Callable[..., str]


def table() -> list[tuple[str, str]]:
    """Returns the questions, each with its line of a script."""
    text = (ROOT / "docs" / "explorer.md").read_text(encoding="utf-8")
    section = text[text.index("## Ten questions") :]
    rows = [row.strip("|\n ").split(" | ") for row in section.splitlines() if row.startswith("| ")]
    return [(row[0], row[2].strip(" `")) for row in rows[1:]]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, program: Program) -> pathlib.Path:
    made = tmp_path_factory.mktemp("questions")
    program("build", "builtin:torus", "--target-error", "1e-5", "-o", made / "torus.hpsdf")
    program("build", "builtin:torus", "--target-error", "1e-7", "-o", made / "fine.hpsdf")
    program("page", made / "torus.hpsdf", made / "fine.hpsdf", "-o", made / "torus.html", "--pictures=false")
    return made


@pytest.mark.parametrize(("question", "lines"), table(), ids=[question for question, _ in table()])
def test_scripts_answer(question: str, lines: str, folder: pathlib.Path, program: Program) -> None:
    there = re.sub(r"(output=|other=|beside )", rf"\1{folder}/", lines)
    program("run", "-e", f"load {folder}/torus.hpsdf; show surface size=640x400; {there}")
    for file in re.findall(r"output=([^\s;]+)", lines):
        assert (folder / file).stat().st_size > 1000, question


def rows(browser: Any, panel: str) -> dict[str, str]:
    script = "return Object.fromEntries([...document.querySelectorAll(`#${arguments[0]} dt`)].map(t => [t.textContent, t.nextSibling?.textContent.replaceAll('−', '-') ?? '']))"
    return dict(browser.execute_script(script, panel))


def canvas(browser: Any) -> Any:
    return next(found for found in browser.find_elements("tag name", "canvas") if found.is_displayed())


def choose(browser: Any, select: str, text: str) -> None:
    package("selenium.webdriver.support.ui").Select(browser.find_element("id", select)).select_by_visible_text(text)
    rested(browser)


def point_to(browser: Any, x: int, y: int, *, click: bool = False) -> None:
    actions = package("selenium.webdriver.common.action_chains").ActionChains(browser).move_to_element_with_offset(canvas(browser), x, y)
    (actions.click() if click else actions).perform()


def unfold(browser: Any, summary: str) -> None:
    script = "const s = [...document.querySelectorAll('summary')].find(s => s.textContent === arguments[0]); s.parentNode.open = true; s.scrollIntoView()"
    browser.execute_script(script, summary)


def slide(browser: Any, slider: str, value: float) -> None:
    script = "const s = document.getElementById(arguments[0]); s.value = arguments[1]; s.dispatchEvent(new Event('input'))"
    browser.execute_script(script, slider, value)
    rested(browser)


def answers(browser: Any, folder: pathlib.Path, program: Program) -> dict[str, bool]:
    """Asks the page each question by its controls alone, and tells whether it gave the program's answer."""
    ask = lambda point: [float(x) for x in program("query", folder / "torus.hpsdf", ",".join(map(str, point))).splitlines()[-1].split(",")]
    found: dict[str, bool] = {}

    choose(browser, "kind", "slice")
    point_to(browser, -90, -20)
    told = rows(browser, "readout")
    place = [float(x) for x in told["position"].split(",")]
    found["Which cell is here?"] = told["cell"].isdigit() and float(told["value"]) == pytest.approx(ask(place)[3], abs=1e-4)

    legend = [row.text.split()[0] for row in browser.find_elements("css selector", "#legend .level")]
    found["What is its degree, and why?"] = told["degree"] in legend

    choose(browser, "color", "depth")
    depths = [row.text.split()[0] for row in browser.find_elements("css selector", "#legend .level")]
    choose(browser, "kind", "surface")
    choose(browser, "cells", f"depth {depths[0]}")
    found["Where was refined?"] = told["depth"] in depths and f"depths={depths[0]}" in browser.find_element("id", "script").get_attribute("value")
    choose(browser, "cells", "none")

    measured = json.loads(program("info", folder / "torus.hpsdf", "--json"))["measured"]
    told = rows(browser, "figures")
    found["How wrong is the field?"] = float(told["RMS error near"]) == pytest.approx(measured["near"]["rms"], rel=1e-3) and float(
        told["greatest error"]
    ) == pytest.approx(measured["domain"]["max"], rel=1e-3)

    unfold(browser, "worst interfaces")
    choose(browser, "worst-on", "surface")
    package("selenium.webdriver.support.ui").WebDriverWait(browser, 60).until(lambda page: page.find_elements("css selector", "#worst-list button"))
    first = browser.find_element("css selector", "#worst-list button")
    place = [float(x.replace("−", "-")) for x in first.find_element("tag name", "small").text.split(", ")]
    first.click()
    rested(browser)
    found["Where is it torn, where do cells disagree?"] = abs(ask(place)[3]) < 0.1 and browser.find_element("css selector", ".mark").is_displayed()

    applied(browser, "show surface; camera 0,0,1.1; surface clip=none offset=0; plane axis=z offset=0 zoom=1 target=center; worst mark=none")
    choose(browser, "cut", "z")
    point_to(browser, round(projected(browser, [0.7, 0.05, 0])[0]), round(projected(browser, [0.7, 0.05, 0])[1]))
    found["What is inside?"] = float(rows(browser, "readout")["value"]) < -0.1
    choose(browser, "cut", "none")

    slide(browser, "offset", 0.05)
    point_to(browser, round(projected(browser, [0.7, 0, 0.35])[0]), round(projected(browser, [0.7, 0, 0.35])[1]))
    found["Where is the surface moved by 0.05?"] = float(rows(browser, "readout")["value"]) == pytest.approx(0.05, abs=1e-4)
    slide(browser, "offset", 0)

    unfold(browser, "line probe")
    for end, text in (("from", "-1,0,0"), ("to", "1,0,0")):
        box = browser.find_element("id", f"probe-{end}")
        box.clear()
        box.send_keys(text, "\n")
    found["How does the field run along a line?"] = len(browser.find_elements("css selector", "#probe-plot svg path.value")) == 1

    unfold(browser, "measure")
    browser.find_element("id", "measure-thickness").click()
    point_to(browser, round(projected(browser, [0.7, 0, 0.3])[0]), round(projected(browser, [0.7, 0, 0.3])[1]), click=True)
    found["How thick is the body here, how far is it to there?"] = float(rows(browser, "lengths")["thickness"]) == pytest.approx(0.6, abs=0.01)

    choose(browser, "beside", "fine")
    package("selenium.webdriver.support.ui").WebDriverWait(browser, 60).until(lambda page: len([c for c in page.find_elements("tag name", "canvas") if c.is_displayed()]) == 2)
    rested(browser)
    choose(browser, "kind", "slice")
    point_to(browser, 30, 40)
    told = rows(browser, "readout")
    found["What changed between two fields?"] = 0 < abs(float(told["difference"])) < 0.05
    return found


def projected(browser: Any, point: list[float]) -> Any:
    """Returns where the picture shows a point, in pixels from its middle."""
    script = "const {viewer} = hpsdf.page; const {clientWidth, clientHeight} = viewer.canvas; const [x, y] = viewer.project(arguments[0]); return [x - clientWidth / 2, y - clientHeight / 2]"
    return numpy.array(browser.execute_script(script, point))


def test_the_page_answers_all(browser: Any, folder: pathlib.Path, program: Program) -> None:
    opened(browser, folder / "torus.html")
    found = answers(browser, folder, program)
    assert [question for question, _ in table()] == list(found)
    assert [question for question, is_right in found.items() if not is_right] == []
    assert complaints(browser) == []
