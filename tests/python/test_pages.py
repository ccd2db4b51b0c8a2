"""Pages that show fields in a browser and in notebooks."""

import html
import pathlib
import re
from collections.abc import Callable

import pytest

import hpsdf


def names_in(page: str) -> list[str]:
    """Returns the names of the fields that a page holds."""
    return [html.unescape(name) for name in re.findall('class="field" data-name="([^"]*)"', page)]


def test_the_page_is_that_of_the_program(field: hpsdf.Field, program: Callable[..., str], tmp_path: pathlib.Path) -> None:
    field.save(tmp_path / "field.hpsdf")
    view = "show slice\nplane axis=x offset=0.1\ncolor depth"
    program("page", tmp_path / "field.hpsdf", "-o", tmp_path / "theirs.html", "--view", view, "--cpu")
    page = hpsdf.show(field, view=view, cpu=True)
    page.save(tmp_path / "ours.html")
    assert (tmp_path / "ours.html").read_bytes() == (tmp_path / "theirs.html").read_bytes()
    assert hpsdf.show(field, view="show surface", cpu=True).html != page.html


def test_several_fields_in_memory(field: hpsdf.Field) -> None:
    ball = hpsdf.build(lambda p: (p**2).sum(axis=1) ** 0.5 - 0.5, box=((-1,) * 3, (1,) * 3), target_error=1e-3)
    without_pictures = hpsdf.show(field, ball, pictures=False)
    assert names_in(without_pictures.html) == ["field 1", "field 2"] and "<figure>" not in without_pictures.html
    page = hpsdf.show(field, ball, names=["<torus>", "ball & co"], title="two", cpu=True)
    assert names_in(page.html) == ["<torus>", "ball & co"]
    assert "<title>two</title>" in page.html and page.html.count("<figure>") == 4


def test_a_notebook_shows_the_page_in_a_frame(field: hpsdf.Field) -> None:
    page = hpsdf.show(field, pictures=False, height=321)
    frame = page._repr_html_()
    shown = re.fullmatch(r'<iframe srcdoc="([^"]*)"( [a-z]+="[^"]*")*></iframe>', frame)
    assert shown and html.unescape(shown[1]) == page.html
    assert "height: 321px" in frame and "sandbox" not in frame and " src=" not in frame


def test_what_cannot_be_shown(field: hpsdf.Field) -> None:
    with pytest.raises(TypeError, match="expected a Field, got str"):
        hpsdf.show("torus.hpsdf")  # type: ignore[arg-type]
    with pytest.raises(hpsdf.OptionError, match="name: given 1 times for 2 fields"):
        hpsdf.show(field, field, names=["one"])
    with pytest.raises(hpsdf.Error, match="view:1:6"):
        hpsdf.show(field, view="show nothing")
    with pytest.raises(hpsdf.OptionError, match="unknown option 'colour'"):
        hpsdf.show(field, colour="degree")
