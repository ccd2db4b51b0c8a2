"""The types of arguments that several functions take."""

import os
from collections.abc import Callable
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray


class Mesh(Protocol):
    """An object with an array of vertices and one of the indices of its triangles, such as a TriangleMesh."""

    @property
    def vertices(self) -> Any: ...

    @property
    def faces(self) -> Any: ...


Path = str | os.PathLike[str]
Distance = Callable[[NDArray[np.float64]], Any]  # it returns what NumPy converts to an array
Progress = Callable[[str, float], object] | bool | None
InsideTest = Literal["automatic", "pseudonormal", "winding", "shell", "outer_hull"]
Share = float | str  # a length, or a percentage of the mesh's longest side such as "0.02%"
