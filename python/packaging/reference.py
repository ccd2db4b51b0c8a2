"""Writes the reference of the Python module, docs/python-reference.md, from its docstrings and the types of its sources:

PYTHONPATH=out/release/python /usr/bin/python3 python/packaging/reference.py
"""

import ast
import importlib
import inspect
import pathlib
import re

import hpsdf

FILE = pathlib.Path(__file__).resolve().parents[2] / "docs" / "python-reference.md"
PACKAGE = pathlib.Path(hpsdf.__file__).parent

GROUPS = {
    "Meshes and exact distances": ["load_mesh", "TriangleMesh", "ExactDistance", "ClosestPoints", "combine", "CombinedDistance"],
    "Fields": ["build", "load", "Field", "jumps", "verify"],
    "Samples": ["sample", "Samples"],
    "Pictures and scripts": ["render", "slice", "probe", "show", "Page", "Picture", "Session", "run"],
    "Errors": ["Error", "OptionError", "FileError", "MeshError", "FieldError", "LimitError", "ExpectationError"],
}

START = """# Reference of the Python module

This page is made from the docstrings of the module by `python/packaging/reference.py`; [python.md](python.md) is the manual. `Mesh` is
an object with `.vertices` and `.faces`, `Path` the name of a file, `Progress` a callable that takes a task and the fraction done,
True for a bar, or None, and `Distance` a callable that maps points, shape (n, 3), to distances, shape (n,).
"""


def text() -> str:
    """Returns the text of the page."""
    named = {name for names in GROUPS.values() for name in names}
    left = {*hpsdf.__all__, "slice"} - named - {"__version__"}
    if left:
        raise SystemExit(f"reference.py: no group has {', '.join(sorted(left))}")
    declared = {**_declared("_pictures.py"), **_declared("_pages.py"), **_declared("_hpsdf.pyi"), **_declared("_pictures.py", "Session", "Picture")}
    parts = [START]
    for title, names in GROUPS.items():
        parts.append(f"## {title}\n")
        parts += [_entry(f"hpsdf.{name}", getattr(hpsdf, name), declared.get(name)) for name in names]
    for title, name in {"Data sets": "dataset", "PyTorch": "torch"}.items():
        module, types = importlib.import_module(f"hpsdf.{name}"), _declared(f"{name}.py")
        parts.append(f"## {title}\n")
        parts += [_entry(f"hpsdf.{name}.{made}", getattr(module, made), types[made]) for made in types if made in module.__all__]
    return "\n".join(parts)


def _declared(file: str, *names: str) -> dict[str, ast.ClassDef | ast.FunctionDef]:
    """Returns the classes and functions that a file of the package declares, or those of these names."""
    nodes = ast.parse((PACKAGE / file).read_text(encoding="utf-8")).body
    found = {node.name: node for node in nodes if isinstance(node, (ast.ClassDef, ast.FunctionDef))}
    return {name: node for name, node in found.items() if not names or name in names}


def _entry(name: str, made: object, node: ast.AST | None) -> str:
    if isinstance(node, ast.FunctionDef):
        return f"### {name}\n\n{_signature(name, node)}{_doc(made)}"
    if not isinstance(node, ast.ClassDef):
        raise SystemExit(f"reference.py: no types of {name}")
    if isinstance(made, type) and issubclass(made, BaseException):
        parents = " and ".join(f"`{parent.__name__}`" for parent in made.__bases__)
        return f"### {name}\n\nA subclass of {parents}. {_doc(made)}"
    parts = [f"### {name}\n\n{_doc(made)}"]
    short = name.split(".")[-1]
    fields = [f"`{member.target.id}`" for member in node.body if isinstance(member, ast.AnnAssign) and isinstance(member.target, ast.Name)]
    if fields:
        parts = [f"### {name}\n\nA named tuple of {', '.join(fields)}.\n"]
    for member in node.body:
        if not isinstance(member, ast.FunctionDef) or (member.name.startswith("_") and member.name not in ("__init__", "__call__")):
            continue
        inner = inspect.getattr_static(made, member.name)
        if member.decorator_list:
            returned = ast.unparse(member.returns) if member.returns else ""
            parts.append(f"**{short}.{member.name}**: `{returned}`\n\n{_doc(inner)}")
        else:
            words = {"__init__": name, "__call__": "field" if short == "Field" else "distance"}
            parts.append(_signature(words.get(member.name, f"{short}.{member.name}"), member) + _doc(inner))
    return "\n".join(parts)


def _signature(name: str, node: ast.FunctionDef) -> str:
    arguments = ast.unparse(node.args).removeprefix("self, ").removeprefix("self").replace("_hpsdf.", "")
    returned = "" if node.returns is None or node.name == "__init__" else f" -> {ast.unparse(node.returns)}"
    line = f"{name}({arguments}){returned}".replace("_hpsdf.", "")
    if len(line) > 110:  # a parameter a line
        pieces = re.split(r", (?=\*{0,2}\w+: |[*/](?:,|$))", arguments)
        line = f"{name}(\n    " + ",\n    ".join(pieces) + f"\n){returned}"
    return f"```python\n{line}\n```\n\n"


def _doc(made: object) -> str:
    """Returns the docstring without the signature that pybind11 writes above it, with options as code."""
    doc = inspect.cleandoc(str(made.__doc__)) if made.__doc__ else ""
    doc = re.sub(r"\A__?\w+\(.*\n+|\A\w+\(.*\) -> .*\n+", "", doc)
    blocks = []
    for block in doc.split("\n\n"):
        row = re.match(r"(.*)\n    (.*)\Z", block, flags=re.DOTALL)
        if row:
            named = re.match(r"(\w+): (.*)", row.group(1))
            shown = f"`{named.group(1)}`: {named.group(2)}. " if named else f"`{row.group(1)}`: "
            blocks.append(f"* {shown}{' '.join(row.group(2).split())}")
        elif block.startswith(">>>"):
            blocks.append(f"```python\n{block}\n```")
        else:
            blocks.append(block)
    return re.sub(r"(\n\* .*)\n(?=\n\* )", r"\1", "\n\n".join(blocks)).strip() + "\n"


if __name__ == "__main__":
    FILE.write_text(text(), encoding="utf-8")
