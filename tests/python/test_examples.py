"""The examples in docstrings, in docs/python.md and in examples/ do what they say."""

import doctest
import importlib
import importlib.util
import os
import pathlib
import re
import sys
import types
import zipfile
from collections.abc import Iterator
from typing import Any

import numpy
import numpy.typing
import pytest

import hpsdf
from packages import package

Array = numpy.typing.NDArray[Any]

ROOT = pathlib.Path(__file__).parents[2]
NOTEBOOKS = sorted((ROOT / "examples").glob("*.ipynb"))


def modules() -> Iterator[types.ModuleType]:
    yield hpsdf
    yield hpsdf._pictures
    yield importlib.import_module("hpsdf.dataset")
    try:
        yield importlib.import_module("hpsdf.torch")
    except ImportError:
        return


@pytest.mark.parametrize("module", modules(), ids=str)
def test_docstrings(module: types.ModuleType) -> None:
    result = doctest.testmod(module, extraglobs={"hpsdf": hpsdf}, verbose=False)
    assert result.attempted > 0 and result.failed == 0


def packaging(name: str) -> Any:
    """Returns a script of python/packaging as a module."""
    spec = importlib.util.spec_from_file_location(name, ROOT / "python" / "packaging" / f"{name}.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_reference_is_up_to_date() -> None:
    package("torch")
    reference = packaging("reference")
    assert reference.FILE.read_text(encoding="utf-8") == reference.text(), "run python/packaging/reference.py"


def test_the_wheel_contains_the_package(tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The wheel of this very package, not built anew: tools/python builds one from nothing."""
    backend = packaging("hpsdf_wheel")
    folder = pathlib.Path(hpsdf.__file__).parent
    monkeypatch.setattr(backend, "_built_package", lambda: folder)
    name = backend.build_wheel(tmp_path)
    with zipfile.ZipFile(tmp_path / name) as wheel:
        files = {file.filename: wheel.read(file) for file in wheel.infolist()}
    sources = {f"hpsdf/{file.name}" for file in (ROOT / "python" / "hpsdf").iterdir() if file.is_file()}
    extensions = {file for file in files if file.endswith(".so")}
    info = {f"hpsdf-{hpsdf.__version__}.dist-info/{file}" for file in ("METADATA", "LICENSE", "WHEEL", "RECORD")}
    assert len(extensions) == 1 and set(files) == sources | extensions | info
    extension = files[extensions.pop()]
    assert b"#version 450" in extension and b"DejaVu" in extension, "shaders and font are in it"
    for place in {str(ROOT), str(pathlib.Path.home())}:
        assert not [file for file, content in files.items() if place.encode() in content], f"the wheel names {place}"


def blocks_of_the_manual() -> list[str]:
    text = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
    return re.findall(r"```python\n(.*?)```", text, flags=re.DOTALL)


@pytest.fixture(scope="module")
def made_by_the_manual(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """Runs the examples of the manual, one after the other, and returns the folder of the files that they write."""
    package("torch")
    folder = tmp_path_factory.mktemp("manual")
    before, names = pathlib.Path.cwd(), dict[str, object]()
    os.chdir(folder)
    try:
        for block in blocks_of_the_manual():
            exec(compile(block, "docs/python.md", "exec"), names)
    finally:
        os.chdir(before)
    return folder


def test_examples_of_the_manual_run(made_by_the_manual: pathlib.Path) -> None:
    assert len(blocks_of_the_manual()) > 5
    assert hpsdf.load(made_by_the_manual / "torus.hpsdf").nbytes > 1000


def pixels_of(path: pathlib.Path) -> Array:
    with package("PIL.Image").open(path) as opened:
        return numpy.asarray(opened.convert("RGB")).astype(int)


def share_of_other_pixels(one: Array, other: Array) -> float:
    """Returns the share of the pixels that differ visibly."""
    return 1.0 if one.shape != other.shape else float((abs(one - other).max(axis=2) > 8).mean())


def test_pictures_of_the_manual(made_by_the_manual: pathlib.Path) -> None:
    text = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
    names = sorted(pathlib.Path(name).name for name in re.findall(r"!\[[^]]+\]\((.*?)\)", text))
    assert names == sorted(file.name for file in made_by_the_manual.glob("*.png"))
    kept = {name: pixels_of(ROOT / "docs" / "python" / name) for name in names}
    for name in names:
        # what a network learns depends on the processor
        allowed = 0.3 if name == "learnt.png" else 0.005
        made = made_by_the_manual / name
        difference = share_of_other_pixels(pixels_of(made), kept[name])
        assert difference < allowed, f"{made} differs from docs/python/{name}: if it is right, copy it there"
        blank = numpy.full_like(kept[name], 250)
        assert share_of_other_pixels(blank, kept[name]) > allowed, "the comparison would not notice an empty picture"


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda notebook: str(notebook.stem))
def test_notebooks(notebook: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Runs a notebook as nbconvert does. No cell may fail or warn, and there are pictures, which are not empty, and text."""
    package("ipykernel")
    processors, clients, nbformat = package("nbconvert.preprocessors"), package("jupyter_client"), package("nbformat")
    if "torch" in notebook.read_text(encoding="utf-8"):
        package("torch")
    monkeypatch.delenv("PYTEST_CURRENT_TEST", raising=False)
    monkeypatch.setenv("PYTHONWARNINGS", "ignore:IProgress not found")  # PyTorch's, where tqdm is there without widgets
    book = nbformat.read(notebook, as_version=4)
    assert all(not cell.get("outputs") for cell in book.cells), "notebooks are kept without their outputs"
    words = [len(cell.source.split()) for cell in book.cells if cell.cell_type == "markdown"]
    assert len(words) > 3 and min(words) > 8, "each step is explained"
    kernel = clients.AsyncKernelManager(kernel_name="python3")
    kernel.kernel_cmd = [sys.executable, "-m", "ipykernel_launcher", "-f", "{connection_file}"]
    processors.ExecutePreprocessor(timeout=300).preprocess(book, {"metadata": {"path": str(ROOT)}}, km=kernel)
    outputs = [output for cell in book.cells for output in cell.get("outputs", [])]
    assert not [output.text for output in outputs if output.get("name") == "stderr"]
    pictures = [output.data["image/png"] for output in outputs if "image/png" in output.get("data", {})]
    assert len(pictures) > 0 and all(len(picture) > 10_000 for picture in pictures)
    assert any(output.get("name") == "stdout" for output in outputs)
