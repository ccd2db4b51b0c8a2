"""The types of the extension. tests/python/test_typing.py compares the names and defaults with the extension's own."""

from collections.abc import Sequence
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._types import Distance, InsideTest, Mesh, Path, Progress, Share

__version__: str

class Error(Exception):
    subject: str
class FileError(Error, OSError): ...
class OptionError(Error, ValueError): ...
class MeshError(Error, ValueError): ...
class FieldError(Error, ValueError): ...
class LimitError(Error, MemoryError): ...
class ExpectationError(Error, AssertionError): ...

class TriangleMesh:
    def __init__(self, vertices: ArrayLike, triangles: ArrayLike, name: str = "") -> None: ...
    @property
    def vertices(self) -> NDArray[np.float64]: ...
    @property
    def triangles(self) -> NDArray[np.uint32]: ...
    @property
    def faces(self) -> NDArray[np.uint32]: ...
    @property
    def name(self) -> str: ...
    def cleaned(self) -> TriangleMesh: ...
    def save(self, path: Path) -> None: ...
    def report(self) -> dict[str, Any]: ...
    def _repr_html_(self) -> str: ...

class ClosestPoints(NamedTuple):
    distance: Any  # an array, or a float for one point
    point: NDArray[np.float64]
    face: Any  # an array, or an int for one point
    barycentric: NDArray[np.float64]

class ExactDistance:
    def __init__(
        self,
        mesh: Mesh,
        *,
        inside_test: InsideTest = "automatic",
        thickness: float = 0.0,
        threads: int = 0,
        progress: Progress = None,
    ) -> None: ...
    # an array, or a float for one point
    def __call__(self, points: ArrayLike, out: NDArray[np.float64] | None = None) -> Any: ...
    def closest(self, points: ArrayLike) -> ClosestPoints: ...
    @property
    def inside_test(self) -> InsideTest: ...

class CombinedDistance:
    # an array, or a float for one point
    def __call__(self, points: ArrayLike, out: NDArray[np.float64] | None = None) -> Any: ...
    @property
    def exactness(self) -> Literal["everywhere", "outside", "inside", "nowhere"]: ...
    @property
    def boundary(self) -> TriangleMesh | None: ...

class Field:
    # an array, or a float for one point
    def __call__(self, points: ArrayLike, out: NDArray[np.float64] | None = None) -> Any: ...
    # the first is an array, or a float for one point
    def value_and_gradient(
        self, points: ArrayLike, out: Sequence[NDArray[np.float64]] | None = None
    ) -> tuple[Any, NDArray[np.float64]]: ...
    # the first is an array, or a float for one point
    def value_gradient_hessian(
        self, points: ArrayLike, out: Sequence[NDArray[np.float64]] | None = None
    ) -> tuple[Any, NDArray[np.float64], NDArray[np.float64]]: ...
    def save(self, path: Path, *, compress: bool = False) -> None: ...
    def cells(self) -> NDArray[np.void]: ...
    def contour(
        self,
        *,
        offset: float = 0.0,
        tolerance: float = 0.0,
        domain_cut: Literal["wall", "open"] = "wall",
        simplify: bool = False,
        keep_jumps: bool = False,
        threads: int = 0,
        progress: Progress = None,
    ) -> TriangleMesh: ...
    def info(self) -> dict[str, Any]: ...
    @property
    def nodes(self) -> NDArray[np.uint64]: ...
    @property
    def coefficients(self) -> NDArray[Any]: ...
    @property
    def domain(self) -> NDArray[np.float64]: ...
    @property
    def nbytes(self) -> int: ...
    def _repr_html_(self) -> str: ...
    def _repr_png_(self) -> bytes: ...
    def _repr_mimebundle_(self, include: Any = None, exclude: Any = None) -> dict[str, Any]: ...

class Samples(NamedTuple):
    points: NDArray[np.float64]
    distances: NDArray[np.float64]
    gradients: NDArray[np.float64]
    kinds: NDArray[np.uint8]
    closest: NDArray[np.float64]
    faces: NDArray[np.int64]
    normals: NDArray[np.float64]

def load_mesh(path: Path, *, progress: Progress = None) -> TriangleMesh: ...
def load(path: Path, *, mapped: bool = False) -> Field: ...
def build(
    surface: Mesh | ExactDistance | CombinedDistance | Distance,
    *,
    box: ArrayLike | Literal["cube", "box"] = "cube",
    margin: float = 0.1,
    inside_test: InsideTest = "automatic",
    thickness: float = 0.0,
    progress: Progress = None,
    tolerance: Share | None = None,
    within: Share | None = None,
    certified: bool = False,
    target_error: float | None = None,
    grid: int | Sequence[int] | str = 6,
    nearness: float | None = None,
    nearness_kind: Literal["polynomial", "exponential"] | None = None,
    near_error: float | None = None,
    far_error: float | None = None,
    near_distance: float | None = None,
    max_error: float | None = None,
    max_bytes: float | None = None,
    memory_limit: float | None = None,
    estimator: Literal["embedded", "residual", "checked"] | None = None,
    criterion: Literal["paper", "optimal"] = "paper",
    max_degree: int = 30,
    max_depth: int = 10,
    max_steps: int | None = None,
    strategy: Literal["hp", "h1", "h2", "hpx", "auto"] = "auto",
    exact_within: float | None = None,
    exact_tolerance: float | None = None,
    exact_triangles: int | None = None,
    coefficients: Literal["auto", "float", "double", "quantized"] = "auto",
    quadrature: int = 3,
    cubature: Literal["compact", "product", "gradients"] | None = None,
    band: float | None = None,
    enrich: bool = False,
    continuity: Literal["none", "weak", "exact", "both"] = "none",
    continuity_weight: float | None = None,
    blend_width: float | None = None,
    bounds: bool = False,
    threads: int = 0,
) -> Field: ...
def combine(
    expression: str,
    /,
    *,
    inside_test: InsideTest = "automatic",
    threads: int = 0,
    progress: Progress = None,
    **operands: Mesh | Field | ExactDistance | CombinedDistance | Distance,
) -> CombinedDistance: ...
def jumps(field: Field, *, threads: int = 0, progress: Progress = None) -> NDArray[np.void]: ...
def sample(
    source: Mesh | ExactDistance | Field,
    *,
    mesh: Mesh | None = None,
    surface: int = 250000,
    edge: int = 0,
    near: int = 470000,
    uniform: int = 30000,
    widths: Sequence[float] = ...,
    sharp_angle: float = 30.0,
    enlargement: float = 0.1,
    float_points: bool = False,
    seed: int = 1,
    threads: int = 0,
    progress: Progress = None,
) -> Samples: ...

class Session:
    """The program's commands, of which `hpsdf.Session` is made."""

    def set_field(self, field: Field, name: str) -> None: ...
    def set_mesh(self, name: str, mesh: Mesh) -> None: ...
    def field(self) -> Field | None: ...
    def perform(self, command: str, options: list[tuple[str, str]], progress: Progress) -> str: ...
    def run(
        self, name: str, script: str, variables: list[tuple[str, str]], json: bool, progress: Progress
    ) -> str: ...
    def draw(self, command: str, options: list[tuple[str, str]], progress: Progress) -> NDArray[np.uint8]: ...
    def take_output(self) -> str: ...
    def take_notes(self) -> str: ...

def png_of(pixels: NDArray[np.uint8]) -> bytes: ...
def save_png(pixels: NDArray[np.uint8], path: Path) -> None: ...
def options_of(command: str) -> list[tuple[str, str, str, str]]: ...
