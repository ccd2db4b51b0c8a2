"""Hierarchical hp-adaptive signed distance fields of triangle meshes and of functions.

>>> import hpsdf
>>> field = hpsdf.build(hpsdf.load_mesh("builtin:torus"), target_error=1e-5)
>>> abs(field([1.05, 0, 0]) - 0.05) < 0.01
True
"""

import copyreg as _copyreg
import os as _os
import tempfile as _tempfile
from collections.abc import Callable as _Callable

from ._hpsdf import (
    ClosestPoints,
    CombinedDistance,
    Error,
    ExactDistance,
    ExpectationError,
    Field,
    FieldError,
    FileError,
    LimitError,
    MeshError,
    OptionError,
    Samples,
    TriangleMesh,
    __version__,
    build,
    combine,
    jumps,
    load,
    load_mesh,
    sample,
)
from . import _notebook
from ._pages import Page, show
from ._pictures import Picture, Session, probe, render, run, verify
from ._pictures import slice as slice

# `from hpsdf import *` leaves out `slice`, which is a name of Python's own.
__all__ = [
    "ClosestPoints",
    "CombinedDistance",
    "Error",
    "ExactDistance",
    "ExpectationError",
    "Field",
    "FieldError",
    "FileError",
    "LimitError",
    "MeshError",
    "OptionError",
    "Page",
    "Picture",
    "Samples",
    "Session",
    "TriangleMesh",
    "__version__",
    "build",
    "combine",
    "jumps",
    "load",
    "load_mesh",
    "probe",
    "render",
    "run",
    "sample",
    "show",
    "verify",
]

_notebook.attach()

# Names of the extension are shown, and pickled, as names of the package.
for _name in __all__:
    if hasattr(globals()[_name], "__module__"):
        try:
            globals()[_name].__module__ = "hpsdf"
        except (AttributeError, TypeError):
            pass  # built-in functions keep theirs
del _name


def _field_from_bytes(content: bytes) -> Field:
    """Returns the field of a .hpsdf file with this content."""
    with _tempfile.TemporaryDirectory(prefix="hpsdf-") as folder:
        file = _os.path.join(folder, "field.hpsdf")
        with open(file, "wb") as stream:
            stream.write(content)
        return load(file)


def _reduce_field(field: Field) -> tuple[_Callable[[bytes], Field], tuple[bytes]]:
    """Returns what pickle stores of a field: the bytes of its .hpsdf file."""
    with _tempfile.TemporaryDirectory(prefix="hpsdf-") as folder:
        file = _os.path.join(folder, "field.hpsdf")
        field.save(file)
        with open(file, "rb") as stream:
            return _field_from_bytes, (stream.read(),)


_copyreg.pickle(Field, _reduce_field)
