"""The examples in docstrings and in docs/python.md do what they say."""

import doctest
import importlib
import pathlib
import re

import pytest

import hpsdf

ROOT = pathlib.Path(__file__).parents[2]


def modules():
    yield hpsdf
    yield hpsdf._pictures
    try:
        yield importlib.import_module("hpsdf.torch")
    except ImportError:
        return


@pytest.mark.parametrize("module", modules(), ids=lambda module: module.__name__)
def test_docstrings(module):
    result = doctest.testmod(module, extraglobs={"hpsdf": hpsdf}, verbose=False)
    assert result.attempted > 0 and result.failed == 0


def test_examples_of_the_manual_run(tmp_path, monkeypatch):
    text = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```python\n(.*?)```", text, flags=re.DOTALL)
    assert len(blocks) > 2
    monkeypatch.chdir(tmp_path)
    names = {}
    for block in blocks:
        if "torch" in block:
            pytest.importorskip("torch")
        exec(compile(block, "docs/python.md", "exec"), names)
