"""The page of a set of meshes: its table, its search, its choice and its order."""

import pathlib
import subprocess
from collections.abc import Callable
from typing import Any
from urllib.parse import unquote, urlparse

import pytest

from pages import complaints

MESHES = ("builtin:torus", "builtin:box", "missing.obj", "builtin:gear")


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory, program: Callable[..., str], browser: Any) -> Any:
    """A browser with the page of four meshes, one of which is missing."""
    folder = tmp_path_factory.mktemp("set")
    (folder / "list.txt").write_text("\n".join(MESHES) + "\n")
    meshes = ["--batch", folder / "list.txt"]
    for words in (["build", *meshes, "-o", folder / "fields", "--target-error", "1e-4"], ["index", folder / "fields", *meshes]):
        with pytest.raises(subprocess.CalledProcessError) as raised:
            program(*words)
        assert raised.value.returncode == 3  # one mesh is missing
    browser.get((folder / "fields" / "index.html").as_uri())
    return browser


def rows(page: Any) -> list[list[str]]:
    """Returns the texts of the table's cells without its head."""
    return page.execute_script("return [...document.querySelectorAll('#meshes tr')].slice(1).map((row) => [...row.cells].map((cell) => cell.innerText))")


def names(page: Any) -> list[str]:
    return [row[1].split("\n")[0] for row in rows(page)]


def figures(page: Any) -> list[int]:
    """Returns the numbers of cells, from the first row to the last one."""
    return [int(row[3].replace(",", "")) for row in rows(page) if row[3] != "–"]


def sort_by(page: Any, title: str) -> None:
    next(button for button in page.find_elements("css selector", "#meshes th button") if button.text.startswith(title)).click()


def search(page: Any, words: str) -> None:
    page.execute_script("const field = document.getElementById('search'); field.value = arguments[0]; field.oninput()", words)


def choose(page: Any, status: str) -> None:
    page.execute_script("const field = document.getElementById('only'); field.value = arguments[0]; field.onchange()", status)


def test_meshes_stand_in_rows_that_can_be_read(page: Any) -> None:
    assert names(page) == sorted(MESHES)
    failed = rows(page)[names(page).index("missing.obj")]
    assert "no such file" in failed[1] and failed[2] == "failed" and failed[3] == "–"
    torus = rows(page)[names(page).index("builtin:torus")]
    assert torus[2] == "built" and int(torus[3].replace(",", "")) > 0 and float(torus[5]) > 0
    assert page.find_element("id", "count").text == "1 to 4 of 4"
    # No file, status or figure is broken into two lines.
    lines = page.execute_script("return [...document.querySelectorAll('#meshes .files a, #meshes td.number, #meshes td.told')].map((e) => {"
                                " const range = document.createRange(); range.selectNodeContents(e);"
                                " return new Set([...range.getClientRects()].map((place) => place.top)).size; })")  # fmt: skip
    assert len(lines) > 20 and set(lines) == {1}
    assert not complaints(page)


def test_links_lead_to_files(page: Any) -> None:
    links = page.execute_script("return [...document.querySelectorAll('#meshes .files a')].map((link) => link.href)")
    assert len(links) == 7  # three fields and their records, and the record of the mesh that is missing
    assert all(pathlib.Path(unquote(urlparse(link).path)).exists() for link in links)


def test_what_is_searched_chosen_and_sorted_is_shown(page: Any) -> None:
    search(page, "BUILTIN r")
    assert names(page) == ["builtin:gear", "builtin:torus"]
    search(page, "no such file")
    assert names(page) == ["missing.obj"]
    search(page, "nowhere")
    assert names(page) == [] and page.find_element("id", "count").text == "none found"
    search(page, "")
    choose(page, "failed")
    assert names(page) == ["missing.obj"]
    choose(page, "")
    cells = sorted(figures(page))
    assert len(cells) == 3 and len(set(cells)) > 1
    sort_by(page, "cells")
    assert figures(page) == cells and names(page)[-1] == "missing.obj"
    sort_by(page, "cells")
    assert figures(page) == cells[::-1] and names(page)[-1] == "missing.obj"
    sort_by(page, "mesh")
    assert names(page) == sorted(MESHES)
