"""Fields of many meshes: a function for one mesh that engines such as Dask call, and a table of what came of all.

>>> import tempfile, hpsdf.dataset
>>> folder = tempfile.mkdtemp()
>>> record = hpsdf.dataset.build("builtin:torus", folder, target_error=1e-4)
>>> record["status"], hpsdf.dataset.build("builtin:torus", folder, target_error=1e-4)["status"]
('built', 'skipped')
>>> hpsdf.dataset.table(hpsdf.dataset.records(folder))["leaves"].shape
(1,)
"""

from __future__ import annotations

import json
import os
import re
import tempfile
from collections.abc import Iterable
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from . import _hpsdf
from ._pictures import Session
from ._types import Path

__all__ = ["build", "meshes", "records", "table"]


def meshes(file: Path) -> list[str]:
    """Returns the meshes of a list, a file with a mesh a line, without comments, empty lines and repetitions."""
    with open(file, "rb") as stream:
        text = stream.read().removeprefix(b"\xef\xbb\xbf")
    lines = (line.strip(_BLANKS) for line in text.split(b"\n"))
    return [os.fsdecode(line) for line in dict.fromkeys(lines) if line and not line.startswith(b"#")]


def build(mesh: Path, folder: Path, *, then: Path | None = None, **options: Any) -> dict[str, Any]:
    """Builds the field of one mesh into a folder, unless it is there already. Returns what came of it, as a dict.

    mesh: the name of a file, builtin:SHAPE or analytic:SHAPE. then: file of a script that runs for the field, as of
    `hpsdf build --then`. options: those of `hpsdf build`, such as target_error=1e-6, threads=1, memory_limit=4e9 or
    checkpoint=True. Names that are not absolute are looked for from the folder of the process that works.

    The function is that of `hpsdf build --batch` for a list of one mesh: it writes the same files, and a field that was
    made of the same contents with the same options is skipped. It may be pickled, called by any process of any machine,
    and called again for a mesh whose process has died. A mesh that cannot be built raises nothing: the dict has the
    status "failed" and its error then. Raises Error for a folder that cannot be written and OptionError for options,
    which concern all meshes alike, and ValueError for a mesh that a list cannot name.

    >>> client.map(hpsdf.dataset.build, meshes, folder="fields", target_error=1e-6, threads=1)  # doctest: +SKIP
    """
    surface = os.fsencode(mesh)
    if not surface or surface.strip(_BLANKS) != surface or b"\n" in surface or b"\0" in surface or surface.startswith((b"#", b"\xef\xbb\xbf")):
        raise ValueError(f"mesh: {os.fsdecode(surface)!r} cannot be a line of a list; begin a name of a file with ./")
    if own := {"batch", "output", "part", "mesh", "json"} & options.keys():
        raise TypeError(f"{', '.join(sorted(own))}: not an option of hpsdf.dataset.build, which sets it itself")
    session = Session()
    with tempfile.NamedTemporaryFile(suffix=".txt") as listed:  # the list of this one mesh
        listed.write(surface + b"\n")
        listed.flush()
        words = session._words({"batch": listed.name, "output": os.fspath(folder), "then": then, **options})
        try:
            line = session._session.perform("build", words, None)
        except _hpsdf.ExpectationError:  # the mesh failed, or its field misses an error that was asked for
            line = session._session.take_output()
    return cast(dict[str, Any], json.loads(line))


def records(folder: Path) -> list[dict[str, Any]]:
    """Returns what came of each mesh of a folder, as `build` returned it, in the order of the names of their files.

    The status is "begun" for a mesh that a process is at work on, or at which one died. A record that is cut off, because
    the process died while it wrote it, has no other key but output.
    """
    with os.scandir(folder) as entries:
        files = sorted(entry.path for entry in entries if _NAME.search(entry.name))
    found = []
    for file in files:
        record = _record(file)
        if isinstance(record, dict) and "status" in record:
            found.append({key: value for key, value in record.items() if key not in ("made_from", "then")})
    return found


def _record(file: str) -> Any:
    """Returns the contents of a record, or None if it has gone meanwhile."""
    try:
        with open(file, encoding="utf-8", errors="replace") as stream:
            return json.load(stream)
    except FileNotFoundError:
        return None
    except json.JSONDecodeError:
        return {"output": file.removesuffix(".json") + ".hpsdf", "status": "begun"}


_BLANKS = b" \t\r\n\v\f"
_NAME = re.compile(r"-[0-9a-f]{16}\.json$")

# The columns of the table: name, type of NumPy, and the keys that lead to the value in a record.
_COLUMNS: list[tuple[str, str, tuple[str, ...]]] = [
    ("file", "U", ("file",)),
    ("output", "U", ("output",)),
    ("status", "U", ("status",)),
    ("seconds", "f8", ("seconds",)),
    ("leaves", "i8", ("leaves",)),
    ("bytes", "i8", ("bytes",)),
    ("file_bytes", "i8", ("file_bytes",)),
    ("near_rms", "f8", ("measured", "near", "rms")),
    ("near_max", "f8", ("measured", "near", "max")),
    ("domain_rms", "f8", ("measured", "domain", "rms")),
    ("domain_max", "f8", ("measured", "domain", "max")),
    ("torn_share", "f8", ("measured", "torn_share")),
    ("wrong_signs", "i8", ("measured", "wrong_signs")),
    ("sign", "U", ("sign",)),
    ("missed", "U", ("missed",)),
    ("error", "U", ("error",)),
]


def table(records: Iterable[dict[str, Any]]) -> NDArray[np.void]:
    """Returns records as a structured array of NumPy with a row for each mesh, which numpy.save writes and numpy.load reads.

    Missing numbers are NaN, or -1 where they count something; missing texts are empty.
    """
    rows = list(records)
    columns = []
    for name, kind, keys in _COLUMNS:
        missing: Any = {"U": "", "f8": np.nan, "i8": -1}[kind]
        values = [_value(record, keys, missing) for record in rows]
        columns.append((name, np.array(values, dtype=kind) if values else np.empty(0, dtype=kind)))
    array = np.empty(len(rows), dtype=[(name, column.dtype) for name, column in columns])
    for name, column in columns:
        array[name] = column
    return array


def _value(record: Any, keys: tuple[str, ...], missing: Any) -> Any:
    """Returns the value to which keys lead in a record, or `missing` if there is none."""
    for key in keys:
        record = record.get(key) if isinstance(record, dict) else None
    return missing if record is None else record
