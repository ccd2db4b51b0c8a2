"""The types of the package: checked by mypy, and the same as those of the extension."""

import ast
import json
import os
import pathlib
import re
import subprocess
import sys
from collections.abc import Callable

import pytest

import hpsdf
from packages import package
from test_examples import NOTEBOOKS, ROOT, blocks_of_the_manual

PACKAGE = pathlib.Path(hpsdf.__file__).parent
STUB = ast.parse((PACKAGE / "_hpsdf.pyi").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def mypy(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., str]:
    """Returns a function that runs mypy and returns what it finds, in lines, or ''."""
    package("mypy")
    cache = str(tmp_path_factory.mktemp("mypy"))
    paths = {} if "-packages" in str(PACKAGE) else {"MYPYPATH": str(PACKAGE.parent)}  # an installed package is found

    def run(*words: object) -> str:
        command = [sys.executable, "-m", "mypy", "--strict", "--no-error-summary", "--cache-dir", cache, *map(str, words)]
        made = subprocess.run(command, env={**os.environ, **paths}, capture_output=True, text=True)
        assert made.returncode in (0, 1), made.stderr
        return made.stdout

    return run


def test_the_package_its_tests_and_examples(mypy: Callable[..., str], tmp_path: pathlib.Path) -> None:
    codes = {"manual": "\n".join(blocks_of_the_manual())}
    for notebook in NOTEBOOKS:
        cells = json.loads(notebook.read_text(encoding="utf-8"))["cells"]
        codes[notebook.stem] = "\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "code")
    for name, code in codes.items():
        # PyTorch 1.13 declares no types of Tensor.backward and others
        (tmp_path / f"{name}.py").write_text("# mypy: allow-untyped-calls\n" + code, encoding="utf-8")
    assert mypy("-p", "hpsdf") == ""
    assert mypy(*sorted((ROOT / "tests" / "python").glob("*.py")), *sorted(tmp_path.glob("*.py"))) == ""
    assert mypy(ROOT / "python" / "packaging" / "reference.py") == ""


def test_mistakes_are_found(mypy: Callable[..., str], tmp_path: pathlib.Path) -> None:
    mistakes = {
        "hpsdf.build(mesh, target_eror=1e-6)": "target_eror",
        "hpsdf.build(mesh, strategy='hpp')": "strategy",
        "hpsdf.build('bunny.obj')": "build",
        "field.contour(tolerance='fine')": "tolerance",
        "field.degrees()": "degrees",
    }
    file = tmp_path / "wrong.py"
    start = "import hpsdf\nmesh = hpsdf.load_mesh('a.obj')\nfield = hpsdf.build(mesh)\n"
    file.write_text(start + "\n".join(mistakes), encoding="utf-8")
    found = mypy(file).splitlines()
    for line, word in enumerate(mistakes.values(), start=4):
        assert any(f":{line}: error" in text and word in text for text in found), f"line {line} of {found}"


def parameters_of(function: ast.FunctionDef) -> dict[str, str | None]:
    """Returns the parameters of a function of the stub, each with the text of its default, or None."""
    arguments = function.args
    ordered = arguments.posonlyargs + arguments.args
    defaults = [None] * (len(ordered) - len(arguments.defaults)) + [ast.unparse(value) for value in arguments.defaults]
    named = dict(zip((argument.arg for argument in ordered), defaults))
    for argument, value in zip(arguments.kwonlyargs, arguments.kw_defaults):
        named[argument.arg] = None if value is None else ast.unparse(value)
    return named


def parameters_of_extension(docstring: str) -> dict[str, str | None]:
    """Returns the same from the signature that pybind11 writes into the first line of a docstring."""
    line = docstring.splitlines()[0]
    signature = ast.parse("def " + re.sub(r" -> .*", "", re.sub(r"<[^>]*>", "...", line)) + ": ...").body[0]
    assert isinstance(signature, ast.FunctionDef)
    return parameters_of(signature)


def settings_of(text: str) -> dict[str, tuple[list[str], str]]:
    """Returns the words and the default of each setting from the help of `build`."""
    lines = re.findall(r"^(\w+): (.*)$", text, flags=re.MULTILINE)
    return {name: (re.findall(r"'(\w+)'", line) if "|" in line else [], line.partition("; default ")[2]) for name, line in lines}


def functions_of_the_stub() -> list[tuple[str, ast.FunctionDef]]:
    """Returns the public functions and methods of the stub that are not properties, by their names."""
    found = []
    for node in STUB.body:
        if isinstance(node, ast.FunctionDef):
            found.append((node.name, node))
        elif isinstance(node, ast.ClassDef) and node.name != "Session":
            methods = [method for method in node.body if isinstance(method, ast.FunctionDef) and not method.decorator_list]
            found += [(f"{node.name}.{method.name}", method) for method in methods if not method.name.startswith("_repr")]
    return found


@pytest.mark.parametrize("name, function", functions_of_the_stub(), ids=[name for name, _ in functions_of_the_stub()])
def test_signatures_equal_those_of_the_extension(name: str, function: ast.FunctionDef) -> None:
    made: object = hpsdf._hpsdf
    for part in name.split("."):
        made = getattr(made, part)
    if name in ("Field.info", "TriangleMesh.report"):  # functions of Python
        assert callable(made)
        return
    ours, theirs = parameters_of(function), parameters_of_extension(str(made.__doc__))
    if name == "build":
        settings = settings_of(str(made.__doc__).split("The options of the construction:")[1])
        assert [key for key in ours if key not in theirs] == list(settings)
        for key, (words, default) in settings.items():
            assert ours[key] == "None" or str(ours[key]).strip("'").lower() == default, key
            declared = next(ast.unparse(argument) for argument in function.args.kwonlyargs if argument.arg == key)
            assert not words or re.findall(r"'(\w+)'", declared) == words, key
        ours = {key: value for key, value in ours.items() if key not in settings}
    same = [key for key, value in ours.items() if value not in (None, "...")]
    assert list(ours) == list(theirs) and {key: ours[key] for key in same} == {key: theirs[key] for key in same}


def test_classes_equal_those_of_the_extension() -> None:
    for node in STUB.body:
        if not isinstance(node, ast.ClassDef) or node.name == "Session":
            continue
        made = getattr(hpsdf._hpsdf, node.name)
        declared = {member.name for member in node.body if isinstance(member, ast.FunctionDef)}
        declared |= {member.target.id for member in node.body if isinstance(member, ast.AnnAssign) and isinstance(member.target, ast.Name)}
        public = {name for name in vars(made) if not name.startswith("_")} - {"__init__"}
        if issubclass(made, tuple):
            public = set(made._fields)
        assert {name for name in declared if not name.startswith("_") and name != "subject"} == public, node.name
