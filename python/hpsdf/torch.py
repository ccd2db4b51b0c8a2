"""Fields as differentiable functions of PyTorch, and samples as an iterable data set.

>>> import torch, hpsdf.torch
>>> field = hpsdf.build(hpsdf.load_mesh("builtin:torus"), target_error=1e-5)
>>> points = torch.tensor([[1.05, 0.0, 0.0]], dtype=torch.float64, requires_grad=True)
>>> hpsdf.torch.distance(field, points).sum().backward()
>>> bool((points.grad.norm() - 1).abs() < 0.1)
True
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from . import _hpsdf
from ._types import Mesh

try:
    import torch
except ImportError as error:
    raise ImportError("hpsdf.torch needs PyTorch, Debian's package python3-torch") from error

__all__ = ["Samples", "distance"]


def distance(field: _hpsdf.Field, points: torch.Tensor) -> torch.Tensor:
    """Returns the values of a field at points, a tensor of shape (..., 3), as a tensor of shape (...).

    points: a tensor of float64 or float32 on the CPU; C-contiguous float64 is read without a copy. The values have its
    type; they are computed in double precision. They can be differentiated twice: the first derivative is that of
    `Field.value_and_gradient`, the second that of `Field.value_gradient_hessian`. Between the cells of a field that is not
    blended, all three jump.

    Raises TypeError for anything but a Field and a tensor of these types on the CPU, ValueError for another shape, and
    NotImplementedError for third derivatives.
    """
    if not isinstance(field, _hpsdf.Field):
        raise TypeError(f"field: expected a Field, got {type(field).__name__}")
    if not isinstance(points, torch.Tensor):
        raise TypeError(f"points: expected a tensor, got {type(points).__name__}")
    if points.device.type != "cpu":
        raise TypeError(f"points: expected a tensor on the CPU, got one on {points.device}: use points.cpu()")
    if points.dtype not in (torch.float32, torch.float64):
        raise TypeError(f"points: expected a tensor of float32 or float64, got {points.dtype}")
    if points.ndim == 0 or points.shape[-1] != 3:
        raise ValueError(f"points: expected a tensor of shape (..., 3), got {tuple(points.shape)}")
    return cast(torch.Tensor, _Distance.apply(points, field))


def _numbers(tensor: torch.Tensor) -> NDArray[np.float64]:
    """Returns the numbers of a tensor as an array, which shares its memory if it is C-contiguous float64."""
    return np.ascontiguousarray(tensor.detach().numpy(), dtype=np.float64)


class _Distance(torch.autograd.Function):
    """The value f(x). Its derivative is the function below, so that it can be differentiated again."""

    @staticmethod
    def forward(context: Any, points: torch.Tensor, field: _hpsdf.Field) -> Any:  # type: ignore[override]
        context.field = field
        context.save_for_backward(points)
        values = np.asarray(field(_numbers(points)))  # a float for a single point
        return torch.from_numpy(values).to(points.dtype)

    @staticmethod
    def backward(context: Any, upstream: torch.Tensor) -> Any:  # type: ignore[override]
        (points,) = context.saved_tensors
        return _Gradient.apply(points, upstream, context.field), None


class _Gradient(torch.autograd.Function):
    """The product of an upstream derivative with the gradient: g ∇f(x). Its derivatives are g H(x) and ∇f(x)."""

    @staticmethod
    def forward(context: Any, points: torch.Tensor, upstream: torch.Tensor, field: _hpsdf.Field) -> Any:  # type: ignore[override]
        context.field = field
        _, gradients = field.value_and_gradient(_numbers(points))
        context.save_for_backward(points, upstream)
        return upstream[..., None] * torch.from_numpy(gradients).to(points.dtype)

    @staticmethod
    def backward(context: Any, direction: torch.Tensor) -> Any:  # type: ignore[override]
        points, upstream = context.saved_tensors
        hessian = _Hessian.apply(points, context.field)
        to_points = upstream[..., None] * (hessian @ direction[..., None])[..., 0]  # the Hessian is symmetric
        gradient = _Gradient.apply(points, torch.ones_like(upstream), context.field)
        return to_points, (gradient * direction).sum(-1), None


class _Hessian(torch.autograd.Function):
    """The Hessian H(x), which has no derivative here."""

    @staticmethod
    def forward(context: Any, points: torch.Tensor, field: _hpsdf.Field) -> Any:  # type: ignore[override]
        _, _, hessians = field.value_gradient_hessian(_numbers(points))
        return torch.from_numpy(hessians).to(points.dtype)

    @staticmethod
    def backward(context: Any, upstream: torch.Tensor) -> Any:  # type: ignore[override]
        raise NotImplementedError("hpsdf.torch.distance has no third derivatives")


class Samples(torch.utils.data.IterableDataset[tuple[torch.Tensor, torch.Tensor]]):
    """Batches of random points with their distances, as tensors (points, distances), for a DataLoader.

    source, mesh, widths, sharp_angle and enlargement: as of `hpsdf.sample`; the exact distance of a mesh is prepared once in
    each process. surface, edge, near, uniform: the numbers of points of one batch. batches: the number of batches; each pass
    over the data set gives the same ones. dtype: the type of the tensors, torch.float32 or torch.float64; distances are those
    of the rounded points. Batch i depends on the seed and on i alone, so that the same batches come from any number of
    workers of a DataLoader, which takes batch_size=None.
    """

    def __init__(
        self,
        source: Mesh | _hpsdf.ExactDistance | _hpsdf.Field,
        *,
        batches: int,
        mesh: Mesh | None = None,
        surface: int = 0,
        edge: int = 0,
        near: int = 0,
        uniform: int = 0,
        widths: Sequence[float] | None = None,
        sharp_angle: float = 30.0,
        enlargement: float = 0.1,
        seed: int = 0,
        dtype: torch.dtype = torch.float32,
    ) -> None:
        super().__init__()
        counts = {"surface": surface, "edge": edge, "near": near, "uniform": uniform}
        for name, number in {"batches": batches, "seed": seed, **counts}.items():
            if not isinstance(number, (int, np.integer)):
                raise TypeError(f"{name}: expected a whole number, got {number!r}")
            if number < 0:
                raise ValueError(f"{name}: expected a number from 0, got {number}")
        if not any(counts.values()):
            raise ValueError("no points are asked for: give the number of one kind, surface, edge, near or uniform")
        if dtype not in (torch.float32, torch.float64):
            raise TypeError(f"dtype: expected torch.float32 or torch.float64, got {dtype}")
        self._source, self._mesh, self._batches, self._seed, self._dtype = source, mesh, batches, seed, dtype
        self._options: dict[str, Any] = {**counts, "sharp_angle": sharp_angle, "enlargement": enlargement}
        if widths is not None:
            self._options["widths"] = widths
        self._prepared: _hpsdf.ExactDistance | None = None

    def __len__(self) -> int:
        return self._batches

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_prepared": None}  # each process prepares its own

    def __iter__(self) -> Iterator[tuple[torch.Tensor, torch.Tensor]]:
        source: _hpsdf.ExactDistance | _hpsdf.Field
        mesh = self._mesh
        if isinstance(self._source, (_hpsdf.ExactDistance, _hpsdf.Field)):
            source = self._source
        else:
            source = self._prepared = self._prepared or _hpsdf.ExactDistance(self._source)
            mesh = self._source
        worker = torch.utils.data.get_worker_info()  # type: ignore[no-untyped-call]
        first, step = (0, 1) if worker is None else (worker.id, worker.num_workers)
        for batch in range(first, self._batches, step):
            # a sum of seed and batch would repeat batches under the next seed
            seed = int(np.random.SeedSequence((self._seed, batch)).generate_state(1, np.uint64)[0])
            drawn = _hpsdf.sample(
                source, mesh=mesh, seed=seed, float_points=self._dtype == torch.float32, **self._options
            )
            yield torch.from_numpy(drawn.points).to(self._dtype), torch.from_numpy(drawn.distances).to(self._dtype)
