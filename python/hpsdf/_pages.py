"""Pages that show fields in a browser and in notebooks, as the command `hpsdf page` writes them."""

from __future__ import annotations

import html as _html
import os
import pathlib
import tempfile
from collections.abc import Sequence
from typing import Any

from . import _hpsdf
from ._pictures import Session, _add_options
from ._types import Path, Progress


class Page:
    """A page with fields that can be turned, sliced and asked in a browser, as `show` makes it.

    In a notebook it shows itself as a frame of `height` pixels, without a network. `html` is the text of the page.
    """

    def __init__(self, html: str, height: int) -> None:
        self.html = html
        self.height = height

    def save(self, path: Path) -> None:
        """Writes the page as an HTML file, which any browser opens."""
        pathlib.Path(path).write_text(self.html, encoding="utf-8")

    def _repr_html_(self) -> str:
        style = f"width: 100%; height: {self.height}px; border: 0"
        return f'<iframe srcdoc="{_html.escape(self.html)}" style="{style}" allow="clipboard-write" title="the field"></iframe>'

    def __repr__(self) -> str:
        return f"hpsdf.Page of {len(self.html):,} characters; save('page.html') writes it for a browser"


def show(
    field: _hpsdf.Field,
    *others: _hpsdf.Field,
    names: Sequence[str] | None = None,
    view: str | None = None,
    height: int = 600,
    progress: Progress = None,
    **options: Any,
) -> Page:
    """Shows one or more fields, so that they can be turned, sliced and asked. Returns a Page, which a notebook shows.

    names: a name for each field, under which the page shows it. view: lines of a script that tell what the page shows
    first, as its button `copy view` copies them. height: of the frame in a notebook, in pixels.

    >>> field = hpsdf.build(hpsdf.load_mesh("builtin:torus"), target_error=1e-4)
    >>> page = hpsdf.show(field, view="show slice; plane axis=x; color depth", cpu=True)
    >>> page.html.count("<figure>")  # for browsers without WebGL
    2

    Two fields stand under a tab each:

    >>> fine = hpsdf.build(hpsdf.load_mesh("builtin:torus"), target_error=1e-6)
    >>> hpsdf.show(field, fine, names=["coarse", "fine"], cpu=True).html.count("<figure>")
    4

    Raises OptionError (a ValueError) for options that are not accepted, and FieldError for a field that pages cannot show.
    """
    fields = [field, *others]
    for one in fields:
        if not isinstance(one, _hpsdf.Field):
            raise TypeError(f"field: expected a Field, got {type(one).__name__}; hpsdf.build makes one")
    if names is None:
        names = ["field"] if len(fields) == 1 else [f"field {number}" for number in range(1, len(fields) + 1)]
    with tempfile.TemporaryDirectory(prefix="hpsdf-") as folder:
        files = [os.path.join(folder, f"{number}.hpsdf") for number in range(len(fields))]
        for one, file in zip(fields, files):
            one.save(file)
        output = os.path.join(folder, "page.html")
        Session().perform("page", field=files, name=list(names), view=view, output=output, progress=progress, **options)
        return Page(pathlib.Path(output).read_text(encoding="utf-8"), height)


_add_options(show, "page", ("name", "view"))
