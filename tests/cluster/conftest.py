"""The meshes of the tests, and what a plain loop makes of them."""

import pathlib
import shutil

import pytest

import meshes


@pytest.fixture(scope="session")
def plain(tmp_path_factory: pytest.TempPathFactory) -> tuple[pathlib.Path, list[str], dict[str, str]]:
    """Returns a folder with the list and its files, the lines of the list, and the hashes of the fields of a plain loop."""
    folder = tmp_path_factory.mktemp("plain")
    lines = meshes.write_list(folder)
    return folder, lines, meshes.plain_loop(folder, lines)


@pytest.fixture
def folder(tmp_path: pathlib.Path, plain: tuple[pathlib.Path, list[str], dict[str, str]]) -> pathlib.Path:
    """Returns a folder with the list and its files, in which no field has been built."""
    shutil.copytree(plain[0], tmp_path / "set", ignore=shutil.ignore_patterns("*.hpsdf"))
    return tmp_path / "set"
