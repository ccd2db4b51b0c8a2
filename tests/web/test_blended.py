"""Pages of blended fields, one of which has exact leaves."""

import base64
import pathlib
import zlib
from collections.abc import Callable, Iterator
from typing import Any

import numpy
import pytest

import test_page
import test_questions
from conftest import package, started
from pages import asked, opened, payload, queried, rested
from test_page import pixels, points_in

FIELDS: dict[str, tuple[str, ...]] = {
    "polynomials": ("builtin:torus", "--strategy", "hp", "--target-error", "1e-5", "--grid", "3"),
    "exact": ("builtin:box", "--target-error", "1e-2", "--grid", "3", "--exact-triangles", "4"),
}


@pytest.fixture(scope="module", params=FIELDS)
def field(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory, program: Callable[..., str]) -> pathlib.Path:
    """The file of a blended field with leaves of several sizes, beside which stands its page."""
    file = tmp_path_factory.mktemp("blended") / f"{request.param}.hpsdf"
    program("build", *FIELDS[request.param], "--continuity", "exact", "--coefficients", "double", "-o", file)
    program("page", file, "-o", file.with_suffix(".html"))
    return file


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """A browser with a small window: pictures of exact leaves in blend zones take long on a processor."""
    made = started("--window-size=500,320")
    yield made
    made.quit()


@pytest.fixture(autouse=True)
def small_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(test_page, "SIZE", (160, 120))


def values(browser: Any, points: Any) -> Any:
    return numpy.array(asked(browser, "return arguments[0].map(p => { const q = query(field, p); return [q.value, ...q.gradient]; })", points.tolist()))


def test_values_differ_from_those_of_the_program_by_rounding_alone(
    browser: Any, field: pathlib.Path, program: Callable[..., str], tmp_path: pathlib.Path
) -> None:
    opened(browser, field.with_suffix(".html"))
    depths = asked(browser, "return page.viewer.painter.depths.map(d => d.level)")
    kinds = asked(browser, "return page.viewer.painter.degrees.map(d => d.level)")
    assert len(depths) > 1 and len(kinds) > 1 and (31 in kinds) == (field.stem == "exact")
    points = points_in(browser, 3000)
    theirs = queried(program, field, points, tmp_path)
    expected = numpy.stack([theirs[name] for name in ("distance", "gx", "gy", "gz")], axis=1)
    assert abs(values(browser, points) - expected).max() < 1e-12
    asked(browser, "field.blend *= 1 + 1e-6")
    assert abs(values(browser, points) - expected).max() > 1e-9, "the comparison would notice other blend zones"


def test_leaves_that_were_built_without_blending_have_the_values_of_the_program(browser: Any, program: Callable[..., str], tmp_path: pathlib.Path) -> None:
    """The lists of such exact leaves lack triangles beyond the leaf, so that it matters which are searched."""
    program("build", "builtin:gear", "--target-error", "1e-3", "--coefficients", "double", "-o", tmp_path / "jumping.hpsdf")
    field = tmp_path / "wide.hpsdf"
    program("blend", tmp_path / "jumping.hpsdf", "--width", "0.25", "-o", field)
    program("page", field, "--pictures=false", "-o", field.with_suffix(".html"))
    browser.get(field.with_suffix(".html").as_uri())
    wait = package("selenium.webdriver.support.ui").WebDriverWait(browser, 120)
    wait.until(lambda page: page.execute_script("return Boolean(window.hpsdf)"))  # its picture takes long
    points = points_in(browser, 6000)
    theirs = queried(program, field, points, tmp_path)
    expected = numpy.stack([theirs[name] for name in ("distance", "gx", "gy", "gz")], axis=1)
    assert abs(values(browser, points) - expected).max() < 1e-12


def test_pictures_show_the_blended_field(browser: Any, field: pathlib.Path) -> None:
    opened(browser, field.with_suffix(".html"))
    test_page.check_slice(browser, "through=0.1,0,0,1,2,0.5")
    test_page.test_surfaces_lie_where_the_field_has_the_offset(browser, field)


def test_questions_are_answered_by_the_blended_field(browser: Any, field: pathlib.Path, program: Callable[..., str], tmp_path: pathlib.Path) -> None:
    if field.stem == "exact":
        pytest.skip("one field suffices")
    opened(browser, field.with_suffix(".html"))
    test_questions.check_line(browser, field, program, tmp_path, "through")
    greatest = "const all = new hpsdf.Jumps(field); all.run(1e9); return Math.max(...all.axes.map((_, n) => all.at(n).value))"
    assert asked(browser, greatest) < 1e-12
    thickness = "return hpsdf.thicknessAt(field, page.viewer.painter.renderer.bounds, [1, 0, 0], 0)"
    assert asked(browser, thickness) == pytest.approx(0.6, abs=3 * asked(browser, "return field.measured.nearMax"))
    asked(browser, "field.blend = 0")
    assert asked(browser, greatest) > 1e-3


def test_rays_that_take_many_steps_arrive_in_later_passes(browser: Any, field: pathlib.Path) -> None:
    if field.stem == "polynomials":
        pytest.skip("its longest rays miss the surface")
    opened(browser, field.with_suffix(".html"))
    view = "surface(raysOf(firstView(field).orbit, field, width / height), width, height, 0)"
    in_all = pixels(browser, view)[0]
    asked(browser, "page.viewer.painter.renderer.isAnyUnderWay = () => false")
    in_one_pass = pixels(browser, view)[0]
    hits = in_one_pass[..., 0] != 0xFFFFFFFF
    assert (in_all[hits] == in_one_pass[hits]).all()
    assert (in_all[~hits][:, 0] != 0xFFFFFFFF).any()


@pytest.mark.parametrize("damage", ["short", "no number"])
def test_pages_with_damaged_bounds_say_so(browser: Any, field: pathlib.Path, tmp_path: pathlib.Path, damage: str) -> None:
    if field.stem == "exact":
        pytest.skip("one field suffices")
    text = field.with_suffix(".html").read_text(encoding="utf-8")
    begin, end = payload(text)
    data = zlib.decompress(base64.b64decode(text[begin:end]))
    wrong = {"short": data[:-4], "no number": data[:-4] + b"\xff\xff\xff\xff"}
    page = tmp_path / "damaged.html"
    page.write_text(text[:begin] + base64.b64encode(zlib.compress(wrong[damage])).decode() + text[end:], encoding="utf-8")
    browser.get(page.as_uri())
    assert rested(browser) == "failed"
    assert "the field is damaged" in browser.find_element("id", "message").text
