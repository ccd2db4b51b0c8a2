"""Pictures, figures and scripts: the commands of the program `hpsdf`, with fields, meshes and arrays of Python."""

from __future__ import annotations

import json as _json
import os
import re
import shutil
import sys
import tempfile
import weakref
from collections.abc import Callable
from typing import Any, Iterable, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _hpsdf
from ._types import Mesh, Path, Progress


class Picture(NDArray[np.uint8]):
    """A picture: an array of uint8 of shape (height, width, 3) in sRGB, rows from top to bottom.

    It shows itself in a notebook. Everything else is as of any array; `np.asarray(picture)` is a plain one.
    """

    def save(self, path: Path) -> None:
        """Writes the picture as a PNG file, whole or not at all.

        Raises ValueError for what is no picture any more, such as one channel, and FileError (an OSError).
        """
        if not self._is_picture():
            raise ValueError(f"expected uint8 of shape (height, width, 3), got {self.dtype} of shape {self.shape}")
        _hpsdf.save_png(self, path)

    def _is_picture(self) -> bool:
        return self.dtype == np.uint8 and self.ndim == 3 and self.shape[2] == 3 and self.size > 0

    def _repr_png_(self) -> bytes | None:
        return _hpsdf.png_of(self) if self._is_picture() else None


class Session:
    """The commands of the program `hpsdf` on a current field, which is kept from call to call with what was computed of it.

    `render`, `slice`, `verify` and the other functions of the module make a session for one call. One that is kept draws
    the next picture of the field faster. It holds a copy of the field.

    Options are those of the program's commands, with underscores for dashes and, after a name that Python reserves, one
    more: `from_`. Numbers, points and sizes are numbers and sequences; a mesh is the name of a file, a TriangleMesh or an
    object with .vertices and .faces; a field is the name of a file or a Field. `help(hpsdf.render)` lists the options of
    a picture, and `hpsdf help COMMAND` those of every command.

    Several threads may use one session: one at a time works. Ctrl-C cancels constructions and measurements within seconds;
    a picture that is being drawn is finished first. All methods raise OptionError (a ValueError) for options that are not
    accepted, and take progress= as `hpsdf.build` does.
    """

    def __init__(self, field: _hpsdf.Field | None = None) -> None:
        self._session = _hpsdf.Session()
        self._folder: str | None = None
        if field is not None:
            if not isinstance(field, _hpsdf.Field):
                raise TypeError(f"field: expected a Field, got {type(field).__name__}; hpsdf.build makes one")
            self._session.set_field(field, "field")

    @property
    def field(self) -> _hpsdf.Field | None:
        """A copy of the current field, or None."""
        return self._session.field()

    def render(self, *, progress: Progress = None, **options: Any) -> Picture:
        """Draws the surface of the field by sphere tracing, as `hpsdf render` does. Returns a Picture."""
        return self._draw("render", options, progress)

    def slice(self, *, progress: Progress = None, **options: Any) -> Picture:
        """Draws a plane through the field, as `hpsdf slice` does. Returns a Picture."""
        return self._draw("slice", options, progress)

    def probe(self, start: ArrayLike, end: ArrayLike, *, progress: Progress = None, **options: Any) -> Picture:
        """Plots the field along the line from `start` to `end`, as `hpsdf probe` does. Returns a Picture."""
        return self._draw("probe", {"from": start, "to": end, **options}, progress)

    def frame(self, *, progress: Progress = None) -> Picture:
        """Draws the explorer's frame with its panels, as the script command `shot` does. Returns a Picture.

        Script commands change what it shows: `session.run("show slice; plane x 0.1")`.
        """
        return self._draw("shot", {}, progress)

    def pick(self, x: int, y: int) -> Any:
        """Tells what the pixel in column `x` and row `y` of the session's last picture shows.

        Returns a dict with position, value, cell, degree, depth, gradient and slope, or None where the pixel shows no
        part of the field.
        """
        return self.perform("pick", pixel=(x, y))

    def perform(self, command: str, *, progress: Progress = None, **options: Any) -> Any:
        """Runs a command of the program. Returns its report as `hpsdf COMMAND --json` writes it, as dicts and lists.

        An option that may be repeated is a list of strings. A command that writes several reports returns a list of
        them, one that writes none returns None.
        """
        reports = _documents(self._perform(command, {**options, "json": True}, progress))
        return reports[0] if len(reports) == 1 else reports or None

    def run(self, script: Path, *, json: bool = False, progress: Progress = None, **variables: Any) -> Any:
        """Runs the commands of a script: a text, or a pathlib.Path of a file. docs/scripts.md describes the language.

        Returns the text that the commands print or, if `json` is true, a list of their reports. In the script, $name
        stands for a variable; a variable may be a mesh or a Field too. Raises ExpectationError where `expect` does not
        hold.
        """
        name = "script"
        if isinstance(script, os.PathLike):
            name = os.fspath(script)
            with open(name, encoding="utf-8") as stream:
                script = stream.read()
        words = [(key, self._word(key, value)) for key, value in variables.items()]
        try:
            text = self._session.run(name, script, words, bool(json), progress)
        finally:
            self._show_notes()
        return _documents(text) if json else text

    def _perform(self, command: str, options: dict[str, Any], progress: Progress) -> str:
        try:
            return self._session.perform(command, self._words(options), progress)
        finally:
            self._show_notes()

    def _draw(self, command: str, options: dict[str, Any], progress: Progress) -> Picture:
        try:
            return self._session.draw(command, self._words(options), progress).view(Picture)
        finally:
            self._show_notes()

    def _show_notes(self) -> None:
        notes = self._session.take_notes()
        if notes and sys.stderr is not None:
            sys.stderr.write(notes)

    def _words(self, options: dict[str, Any]) -> list[tuple[str, str]]:
        named = ((re.sub("_$", "", name).replace("_", "-"), value) for name, value in options.items())
        words = []
        for name, value in named:
            is_repeated = isinstance(value, (list, tuple)) and value and all(isinstance(one, (str, os.PathLike)) for one in value)
            for one in value if is_repeated else [value]:
                if one is not None:
                    words.append((name, self._word(name, one)))
        return words

    def _word(self, name: str, value: Any) -> str:
        """Returns the value of an option as a script would write it."""
        if isinstance(value, (bool, np.bool_)):
            return "true" if value else "false"
        if isinstance(value, (str, os.PathLike)):
            return os.fspath(value)
        if isinstance(value, _hpsdf.Field):
            return self._file_of(name, value)
        if isinstance(value, _hpsdf.TriangleMesh) or (hasattr(value, "vertices") and hasattr(value, "faces")):
            self._session.set_mesh(name, value)
            return name
        numbers = np.asarray(value)
        if numbers.dtype.kind not in "iuf":
            raise TypeError(f"{name}: expected a number, a sequence of numbers, a string, a mesh or a field, got {value!r}")
        return ("x" if name == "size" else ",").join(repr(number) for number in numbers.ravel().tolist())

    def _file_of(self, name: str, field: _hpsdf.Field) -> str:
        """Returns the name of a file that holds the field for as long as the session lives."""
        if self._folder is None:
            self._folder = tempfile.mkdtemp(prefix="hpsdf-")
            weakref.finalize(self, _remove, self._folder, os.getpid())
        file = os.path.join(self._folder, name + ".hpsdf")
        field.save(file)
        return file


def _remove(folder: str, process: int) -> None:
    """Removes the temporary folder of a session, unless this process was forked from the one that made it."""
    if os.getpid() == process:
        shutil.rmtree(folder, ignore_errors=True)


def _documents(text: str) -> list[Any]:
    """Returns the JSON documents that follow each other in a text."""
    found: list[Any] = []
    decoder, end = _json.JSONDecoder(), 0
    while start := re.compile(r"\S").search(text, end):
        document, end = decoder.raw_decode(text, start.start())
        found.append(document)
    return found


def render(field: _hpsdf.Field, *, progress: Progress = None, **options: Any) -> Picture:
    """Draws the surface of a field by sphere tracing, with a legend and a caption. Returns a Picture, an array.

    >>> field = hpsdf.build(hpsdf.load_mesh("builtin:torus"), target_error=1e-5)
    >>> hpsdf.render(field, color="degree", camera=(30, 20, 1.1), size=(320, 200), cpu=True).shape
    (200, 320, 3)

    Raises OptionError (a ValueError) for options that are not accepted, and Error where OpenGL cannot draw; cpu=True
    draws without it, more slowly.
    """
    return Session(field).render(progress=progress, **options)


def slice(field: _hpsdf.Field, *, progress: Progress = None, **options: Any) -> Picture:
    """Draws a plane through a field, coloured by degree, depth, distance, jumps or errors. Returns a Picture, an array.

    >>> field = hpsdf.build(hpsdf.load_mesh("builtin:torus"), target_error=1e-5)
    >>> hpsdf.slice(field, axis="y", color="distance", size=(320, 200), cpu=True).shape
    (200, 320, 3)
    """
    return Session(field).slice(progress=progress, **options)


def probe(
    field: _hpsdf.Field, start: ArrayLike, end: ArrayLike, *, progress: Progress = None, **options: Any
) -> Picture:
    """Plots a field along the line from `start` to `end` with its cells. Returns a Picture, an array.

    >>> field = hpsdf.build(hpsdf.load_mesh("builtin:torus"), target_error=1e-5)
    >>> hpsdf.probe(field, (-1, 0, 0), (1, 0, 0), size=(320, 200)).shape
    (200, 320, 3)
    """
    return Session(field).probe(start, end, progress=progress, **options)


def verify(field: _hpsdf.Field, mesh: Path | Mesh, *, progress: Progress = None, **options: Any) -> dict[str, Any]:
    """Compares a field with the exact distance of a mesh at random points. Returns a dict, as `hpsdf verify --json`.

    mesh: the name of a file or shape, a TriangleMesh, or an object with .vertices and .faces.

    >>> torus = hpsdf.load_mesh("builtin:torus")
    >>> figures = hpsdf.verify(hpsdf.build(torus, target_error=1e-5), torus, points=10_000)
    >>> figures["near_surface"]["error"]["rms"] < 0.01
    True

    Raises ExpectationError if a limit (max_rms, max_error, ...) is exceeded, and Error for a mesh from which the field
    was not made, unless any_mesh=True.
    """
    return cast(dict[str, Any], Session(field).perform("verify", mesh=mesh, progress=progress, **options))


def run(script: Path, *, json: bool = False, progress: Progress = None, **variables: Any) -> Any:
    """Runs a script of the program's commands in a new Session. Returns what they print, as of `Session.run`.

    >>> hpsdf.run("build builtin:torus target-error=1e-4; expect stats.leaves > 10")[:13]
    'builtin:torus'
    """
    return Session().run(script, json=json, progress=progress, **variables)


def _in_python(text: str) -> str:
    """Returns a text of the program with options as Python writes them."""
    return re.sub(r"--([a-z][a-z-]*)", lambda option: str(option.group(1)).replace("-", "_"), text)


def _add_options(function: Callable[..., Any], command: str, left: Iterable[str] = ()) -> None:
    """Appends the options of the program's command to the docstring of a function."""
    lines = ["", "Options:", ""]
    for name, values, default, text in _hpsdf.options_of(command):
        if name in ("field", *left):
            continue
        lines.append(f"{name.replace('-', '_')}: {values}" + (f"; default {default}" if default else ""))
        lines.append(f"    {_in_python(text)}\n")
    indented = "\n".join("    " + line if line else "" for line in "\n".join(lines).split("\n"))
    function.__doc__ = f"{function.__doc__}{indented}\n"


_add_options(render, "render")
_add_options(slice, "slice")
_add_options(probe, "probe", ("from", "to"))
_add_options(verify, "verify", ("mesh",))
