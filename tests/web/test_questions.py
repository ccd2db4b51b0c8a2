"""The page's answers to questions about a field: jumps between cells, the field along a line, lengths. They equal those of the program."""

import csv
import io
import json
import pathlib
from collections.abc import Callable
from typing import Any

import numpy
import pytest

from conftest import package
from pages import applied, columns, complaints, opened, queried, rested

Program = Callable[..., str]


def asked(browser: Any, script: str, *arguments: Any) -> Any:
    """Runs a script with the page's functions."""
    names = "page, field, query, Jumps, FaceMeter, sampleLine, thicknessAt, distanceBetween"
    return browser.execute_script(f"const {{{names}}} = hpsdf;{script}", *arguments)


def measured(browser: Any) -> None:
    """Measures all jumps of the page's field, which stand in `window.jumps` then."""
    asked(browser, "window.jumps = new Jumps(field)")
    while not asked(browser, "return jumps.run(3000)"):
        pass


def interfaces(program: Program, field: pathlib.Path, folder: pathlib.Path) -> dict[str, Any]:
    """Returns the columns of the program's table of interfaces. The degrees of exact cells have no number."""
    table = folder / "interfaces.csv"
    program("jumps", field, "-o", table)
    return columns(table.read_text().replace("exact", "31"))


def vectors(table: dict[str, Any], names: tuple[str, str, str]) -> Any:
    return numpy.stack([table[name] for name in names], axis=1)


def at_surface(program: Program, field: pathlib.Path, table: dict[str, Any], folder: pathlib.Path, browser: Any) -> tuple[Any, Any]:
    """Returns which interfaces jump most at the surface, and which are torn, by the program's rules."""
    points = vectors(table, ("worst_x", "worst_y", "worst_z"))
    size, edge = asked(browser, "return [field.size, field.size[0] / field.grid[0]]")
    across = 1e-9 * numpy.array(size) * (numpy.arange(3) == table["axis"][:, None])
    at, below, above = (queried(program, field, points + step, folder)["distance"] for step in (0, -across, across))
    torn = (below * above < 0) & (table["value_max"] >= 1e-7 * numpy.array(size)[table["axis"].astype(int)])
    tenth = 0.1 * edge / 2 ** numpy.maximum(table["depth0"], table["depth1"])
    return (abs(at) <= tenth) | torn, torn


def test_jumps_equal_those_of_the_program(browser: Any, field: pathlib.Path, program: Program, tmp_path: pathlib.Path) -> None:
    opened(browser, field.with_suffix(".html"))
    measured(browser)
    rows = asked(browser, "return jumps.axes.map((_, n) => { const f = jumps.at(n); return [...f.cells, f.axis, f.value, f.gradient, ...f.worst, +f.isAtSurface, +f.isTorn]; })")
    ours = numpy.array(rows)
    theirs = interfaces(program, field, tmp_path)
    assert (ours[:, :3] == vectors(theirs, ("cell0", "cell1", "axis"))).all(), "the same interfaces in the same order"
    assert abs(ours[:, 3] - theirs["value_max"]).max() < 1e-6
    assert abs(ours[:, 4] - theirs["gradient_max"]).max() < 1e-5
    assert abs(ours[:, 3] - numpy.roll(theirs["value_max"], 1)).max() > 1e-3, "the comparison would notice other jumps"
    same = (abs(ours[:, 5:8] - vectors(theirs, ("worst_x", "worst_y", "worst_z"))) < 1e-9).all(axis=1)
    assert same.mean() > 0.97, "all but those where rounding decides between two points"
    near, torn = at_surface(program, field, theirs, tmp_path, browser)
    assert (ours[same, 8] == near[same]).mean() > 0.999 and (ours[same, 9] == torn[same]).mean() > 0.999
    assert 0 < near.mean() < 1

    nodes = asked(browser, "return ['value', 'gradient'].map(kind => Array.from(jumps.ofCells[kind]))")
    for kind, numbers in zip(("value_max", "gradient_max"), nodes):
        expected = numpy.zeros(len(numbers))
        for cell in ("cell0", "cell1"):
            numpy.maximum.at(expected, theirs[cell].astype(int), theirs[kind])
        assert abs(numpy.array(numbers) - expected).max() < 1e-5


def test_the_worst_interfaces_equal_those_of_the_program(browser: Any, field: pathlib.Path, program: Program, tmp_path: pathlib.Path) -> None:
    if field.stem != "torus":
        pytest.skip("one field suffices")
    opened(browser, field.with_suffix(".html"))
    measured(browser)
    table = interfaces(program, field, tmp_path)
    near, _ = at_surface(program, field, table, tmp_path, browser)
    for kind in ("value", "gradient"):
        report = json.loads(program("jumps", field, "--by", kind, "--worst", 20, "--json"))
        worst = [face[kind]["max"] for face in report["worst"]]
        script = "return jumps.worst(arguments[0], arguments[1], 20).map(n => jumps.at(n)[arguments[0]])"
        assert asked(browser, script, kind, False) == pytest.approx(worst, abs=1e-6)
        assert asked(browser, script, kind, True) == pytest.approx(sorted(table[f"{kind}_max"][near])[:-21:-1], abs=1e-6)
    assert asked(browser, "return jumps.worst('value', false, 0)") == []


def test_jumps_are_measured_in_portions(browser: Any, field: pathlib.Path) -> None:
    if field.stem != "box":
        pytest.skip("one field suffices")
    opened(browser, field.with_suffix(".html"))
    script = "const part = new Jumps(field), seen = new Set(); for (let n = 0; n < 1e5 && part.share < 1; ++n) { part.run(1); seen.add(part.share); } return [...seen]"
    shares = asked(browser, script)
    assert len(shares) > 3 and shares == sorted(shares) and shares[-1] == 1


def test_the_jump_at_the_nearest_face_is_that_of_the_program(browser: Any, field: pathlib.Path, program: Program, tmp_path: pathlib.Path) -> None:
    opened(browser, field.with_suffix(".html"))
    lower, upper, grid = (numpy.array(x) for x in asked(browser, "return [field.lower, field.upper, field.grid]"))
    points = numpy.random.default_rng(2).uniform(lower, upper, (60, 3))
    script = "const m = new FaceMeter(field); return arguments[0].map(p => { const j = m.jumpsNear(p); return [query(field, p).leaf.node, j.value, j.gradient]; })"
    ours = numpy.array(asked(browser, script, points.tolist()))
    table = interfaces(program, field, tmp_path)
    half = 0.5 * (upper - lower) / grid / 2 ** numpy.maximum(table["depth0"], table["depth1"])[:, None]
    half[numpy.arange(len(half)), table["axis"].astype(int)] = 0
    beyond = numpy.maximum(abs(points[:, None] - vectors(table, ("x", "y", "z"))) - half, 0)
    distances = numpy.sqrt((beyond**2).sum(axis=2))
    node = ours[:, :1]
    distances[(table["cell0"] != node) & (table["cell1"] != node)] = numpy.inf
    nearest = distances.argmin(axis=1)
    assert abs(ours[:, 1] - table["value_max"][nearest]).max() < 1e-6
    assert abs(ours[:, 2] - table["gradient_max"][nearest]).max() < 1e-5
    assert abs(ours[:, 1] - numpy.roll(table["value_max"][nearest], 1)).max() > 1e-4


LINES = {
    "through": ([-1.3, -0.4, 0.1], [1.2, 0.5, -0.35]),
    "along a face": ([-0.9, 0.55, 0.1], [0.6, 0.55, 0.1]),
    "short": ([0.3, 0.31, 0.32], [0.34, 0.31, 0.3]),
    "outside": ([-2.0, 2.0, 0.0], [2.0, 2.0, 0.3]),
}


def probed(browser: Any, line: tuple[list[float], list[float]]) -> Any:
    script = """
        const line = sampleLine(field, arguments[0], arguments[1], 200);
        return line.samples.map(({t, piece, point, value, gradient, slope}) => {
          const {leaf} = line.pieces[piece];
          return [t, t * line.length, ...point, leaf?.node ?? -1, leaf?.depth ?? -1, value, ...gradient, slope];
        });
    """
    return numpy.array(asked(browser, script, *line))


def check_line(browser: Any, field: pathlib.Path, program: Program, folder: pathlib.Path, line: str) -> None:
    """Checks the samples of a line through the page's field."""
    ours = probed(browser, LINES[line])
    if line == "outside":
        assert (ours[:, 5] == -1).all() and (ours[:, 7] > 0.5).all(), "the program refuses this line; the page shows the continuation"
        return
    table = folder / "line.csv"
    start, end = (",".join(map(str, point)) for point in LINES[line])
    program("probe", field, "--from", start, "--to", end, "--samples", 200, "-o", table)
    names = ("t", "s", "x", "y", "z", "cell", "depth", "value", "gx", "gy", "gz", "slope_along")
    rows = csv.DictReader(io.StringIO(table.read_text()))
    theirs = numpy.array([[float(row[name] or -1) for name in names] for row in rows])  # outside there is no cell
    assert (ours[:, 5:7] == theirs[:, 5:7]).all(), "cells and depths"
    assert abs(ours[:, :5] - theirs[:, :5]).max() < 1e-12
    assert abs(ours - theirs).max() < 1e-5
    assert abs(ours[:, 7] - theirs[::-1, 7]).max() > 1e-3, "the comparison would notice another line"


def test_lines_equal_those_of_the_program(browser: Any, field: pathlib.Path, program: Program, tmp_path: pathlib.Path) -> None:
    opened(browser, field.with_suffix(".html"))
    for line in LINES:
        check_line(browser, field, program, tmp_path, line)


@pytest.fixture(scope="module")
def smooth(tmp_path_factory: pytest.TempPathFactory, program: Program) -> pathlib.Path:
    """A field of a torus that no triangles disturb, beside which stands its page."""
    file = tmp_path_factory.mktemp("smooth") / "ring.hpsdf"
    program("build", "analytic:torus", "--target-error", "1e-8", "-o", file)
    program("page", file, "-o", file.with_suffix(".html"))
    return file


def test_the_thickness_of_a_ring_is_its_tube(browser: Any, smooth: pathlib.Path) -> None:
    opened(browser, smooth.with_suffix(".html"))
    error = asked(browser, "return field.measured.nearMax")
    around, along = numpy.random.default_rng(3).uniform(0, 2 * numpy.pi, (2, 300))
    for offset in (0.0, -0.1, 0.05):
        radius = 0.3 + offset
        away = 0.7 + radius * numpy.cos(along)
        points = numpy.stack([away * numpy.cos(around), away * numpy.sin(around), radius * numpy.sin(along)], axis=1)
        script = "return arguments[0].map(p => thicknessAt(field, page.viewer.painter.renderer.bounds, p, arguments[1]))"
        ours = numpy.array(asked(browser, script, points.tolist(), offset))
        assert abs(ours - 2 * radius).max() < 2 * error, "the errors at both ends"
    assert error < 1e-3


def test_the_thickness_of_a_box(browser: Any, field: pathlib.Path) -> None:
    if field.stem != "box":
        pytest.skip("this is about the box")
    opened(browser, field.with_suffix(".html"))
    script = "return thicknessAt(field, page.viewer.painter.renderer.bounds, arguments[0], arguments[1])"
    for point, thickness in (([1, 0.1, 0.05], 2), ([-0.3, -0.75, 0.1], 1.5), ([0.3, 0.2, 0.5], 1)):
        assert asked(browser, script, point, 0) == pytest.approx(thickness, abs=1e-3)
    assert asked(browser, script, [1, 0.1, 0.05], 10) is None, "the way leaves the domain within the body"
    assert asked(browser, script, [3, 0, 0], 0) is None, "a point outside of the domain"


def waited(browser: Any, condition: str) -> Any:
    """Waits until a condition of the page holds, and returns its value."""
    wait = package("selenium.webdriver.support.ui").WebDriverWait(browser, 120)
    return wait.until(lambda page: page.execute_script(f"const {{page: thePage}} = hpsdf; return {condition}"))


def unfolded(browser: Any, panel: str) -> None:
    """Opens one panel and closes the others, so that it can be clicked."""
    browser.execute_script("document.querySelectorAll('details').forEach((panel) => (panel.open = false))")
    browser.find_element("css selector", f"#{panel} > summary").click()


def test_a_click_flies_to_a_worst_interface(browser: Any, smooth: pathlib.Path, program: Program, tmp_path: pathlib.Path) -> None:
    opened(browser, smooth.with_suffix(".html"))
    unfolded(browser, "worst")
    waited(browser, "document.querySelectorAll('#worst-list li').length === 8")
    worst = json.loads(program("jumps", smooth, "--worst", 9, "--json"))["worst"]
    shown = [float(row.text.split(",")[0].split("\n")[0]) for row in browser.find_elements("css selector", "#worst-list button")]
    assert shown == pytest.approx([face["value"]["max"] for face in worst[:8]], rel=1e-4)
    applied(browser, "show slice")
    browser.find_element("css selector", "#worst-list button").click()
    rested(browser)
    view = asked(browser, "return page.view")
    at = view["mark"]
    assert min(abs(numpy.array(at) - face["worst"]).max() for face in worst if face["value"]["max"] > 0.999 * worst[0]["value"]["max"]) < 1e-6
    middle = asked(browser, "const [x, y] = page.viewer.project(page.view.mark); return [x / page.viewer.canvas.clientWidth, y / page.viewer.canvas.clientHeight]")
    assert middle == pytest.approx([0.5, 0.5], abs=1e-6)
    assert view["zoom"] > 1 and view["point"] == pytest.approx(at)
    browser.find_element("id", "worst-next").click()
    assert browser.find_element("id", "worst-list").get_attribute("start") == "9"
    assert complaints(browser) == []


@pytest.mark.parametrize("kind", ["value", "gradient"])
def test_cells_are_coloured_by_their_jumps(browser: Any, smooth: pathlib.Path, kind: str) -> None:
    opened(browser, smooth.with_suffix(".html"))
    applied(browser, f"show slice; plane axis=z offset=0.013; color {kind}-jump")
    waited(browser, f"thePage.viewer.painter.cellNumbers.has('{kind}-jump') && document.body.dataset.state === 'sharp'")
    measured(browser)
    script = """
        const {viewer} = page, {canvas} = viewer, {gl} = viewer.painter;
        const box = canvas.getBoundingClientRect(), pixel = new Uint8Array(4), rows = [];
        for (let x = 2; x < box.width; x += 3) for (let y = 2; y < box.height; y += 3) {
          const pick = viewer.pick(box.left + x + 0.5, box.top + y + 0.5);
          if (!pick || pick.leaf.local.some((u, a) => a < 2 && Math.abs(u) > 0.7)) continue; // not on outlines
          gl.readPixels(x, canvas.height - 1 - y, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
          rows.push([jumps.ofCells[arguments[0]][pick.leaf.node], pick.value, ...pixel]);
        }
        return rows;
    """
    rows = numpy.array(asked(browser, script, kind))
    jumps, red, green = rows[:, 0], rows[:, 2], rows[:, 3]
    inner = (abs(rows[:, 1]) > 0.02) & (jumps > 0)
    order = numpy.argsort(jumps[inner])
    lightness = (0.5 * red + green)[inner][order]
    assert len(lightness) > 500
    steps = numpy.diff(lightness)
    assert (steps >= -2).mean() > 0.99, "greater jumps are lighter"
    assert numpy.ptp(lightness) > 60
    ends = [span.text for span in browser.find_elements("css selector", "#legend .ends span")]
    assert len(ends) >= 2 and all(end.startswith("1e") for end in ends)


def clicked(browser: Any, places: list[tuple[int, int]]) -> list[list[float]]:
    """Clicks at places of the picture, counted in pixels from its middle, and returns the points that are marked then."""
    actions = package("selenium.webdriver.common.action_chains").ActionChains
    canvas = browser.find_element("css selector", "canvas:not([hidden])")
    points = []
    for x, y in places:
        actions(browser).move_to_element_with_offset(canvas, x, y).click().perform()
        points.append(asked(browser, "return page.view.mark"))
    return points


def test_a_line_is_picked_and_plotted(browser: Any, smooth: pathlib.Path, program: Program, tmp_path: pathlib.Path) -> None:
    opened(browser, smooth.with_suffix(".html"))
    applied(browser, "show slice; plane axis=z offset=0.013")
    unfolded(browser, "probe")
    browser.find_element("id", "probe-pick").click()
    start, end = clicked(browser, [(-100, -30), (80, 40)])
    rested(browser)
    ends = [[float(x) for x in browser.find_element("id", f"probe-{name}").get_attribute("value").split(",")] for name in ("from", "to")]
    assert ends == [start, end]
    svg = browser.find_element("css selector", "#probe-plot svg")
    assert len(svg.find_elements("css selector", "path.value")) == 1 and len(svg.find_elements("css selector", "path.border")) > 3
    actions = package("selenium.webdriver.common.action_chains").ActionChains
    browser.execute_script("arguments[0].scrollIntoView()", svg)
    actions(browser).move_to_element(svg).perform()
    told = waited(browser, "document.querySelector('.plot output').textContent.startsWith('at ') && document.querySelector('.plot output').textContent")
    mark = asked(browser, "return page.view.mark")
    value = float(told.split("value ")[1].split(",")[0].replace("−", "-"))
    assert asked(browser, "return query(field, arguments[0]).value", mark) == pytest.approx(value, abs=1e-2)
    line = browser.execute_script("return document.getElementById('probe-script').textContent")
    script = tmp_path / "probe.hps"
    script.write_text(f"load {smooth}\n{line.replace('line.png', str(tmp_path / 'line.png'))}\n")
    program("run", script)
    assert (tmp_path / "line.png").stat().st_size > 10_000
    assert complaints(browser) == []


def rows_of(browser: Any, panel: str) -> dict[str, str]:
    script = "return Object.fromEntries([...document.querySelectorAll(`#${arguments[0]} dt`)].map(t => [t.textContent, t.nextSibling.textContent.replaceAll('−', '-')]))"
    return dict(browser.execute_script(script, panel))


def test_lengths_are_measured_between_clicks(browser: Any, smooth: pathlib.Path) -> None:
    opened(browser, smooth.with_suffix(".html"))
    applied(browser, "show slice; plane axis=z offset=0.013")
    browser.execute_script("document.querySelectorAll('details').forEach((panel) => (panel.open = panel.querySelector('#lengths') !== null))")
    browser.find_element("id", "measure-distance").click()
    start, end = clicked(browser, [(-60, -30), (90, 50)])
    shown = rows_of(browser, "lengths")
    assert float(shown["distance"]) == pytest.approx(numpy.linalg.norm(numpy.subtract(end, start)), rel=1e-4)

    browser.find_element("id", "measure-thickness").click()
    assert "surface" in browser.find_element("id", "message").text
    applied(browser, "show surface; camera 0,90,1.1 up=z")
    browser.find_element("id", "measure-thickness").click()
    width = asked(browser, "return page.viewer.project([0.7, 0, 0.3])[0] - page.viewer.canvas.clientWidth / 2")
    clicked(browser, [(round(width), 0)])
    assert float(rows_of(browser, "lengths")["thickness"]) == pytest.approx(0.6, abs=0.01)
    assert complaints(browser) == []


def test_the_pointer_reads_out_the_jump(browser: Any, smooth: pathlib.Path) -> None:
    opened(browser, smooth.with_suffix(".html"))
    applied(browser, "show slice; plane axis=z offset=0.013")
    clicked(browser, [(-60, -31)])
    shown = rows_of(browser, "readout")
    point = [float(x) for x in shown["position"].split(",")]
    jumps = asked(browser, "return new FaceMeter(field).jumpsNear(arguments[0])", point)
    assert float(shown["jump at nearest face"]) == pytest.approx(jumps["value"], rel=1e-4)
    assert float(shown["jump of gradient"]) == pytest.approx(jumps["gradient"], rel=1e-4)
