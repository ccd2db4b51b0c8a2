"""Fields as differentiable functions of PyTorch, and samples as an iterable data set.

>>> import torch, hpsdf.torch
>>> field = hpsdf.build(hpsdf.load_mesh("builtin:torus"), target_error=1e-5)
>>> points = torch.tensor([[1.05, 0.0, 0.0]], dtype=torch.float64, requires_grad=True)
>>> hpsdf.torch.distance(field, points).sum().backward()
>>> bool((points.grad.norm() - 1).abs() < 0.1)
True
"""

import numpy as np

from . import _hpsdf

try:
    import torch
except ImportError as error:
    raise ImportError("hpsdf.torch needs PyTorch, Debian's package python3-torch") from error

__all__ = ["Samples", "distance"]


def distance(field, points):
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
    return _Distance.apply(points, field)


def _numbers(tensor):
    """Returns the numbers of a tensor as an array, which shares its memory if it is C-contiguous float64."""
    return np.ascontiguousarray(tensor.detach().numpy(), dtype=np.float64)


class _Distance(torch.autograd.Function):
    """The value f(x). Its derivative is the function below, so that it can be differentiated again."""

    @staticmethod
    def forward(context, points, field):
        context.field = field
        context.save_for_backward(points)
        values = np.asarray(field(_numbers(points)))  # a float for a single point
        return torch.from_numpy(values).to(points.dtype)

    @staticmethod
    def backward(context, upstream):
        (points,) = context.saved_tensors
        return _Gradient.apply(points, upstream, context.field), None


class _Gradient(torch.autograd.Function):
    """The product of an upstream derivative with the gradient: g ∇f(x). Its derivatives are g H(x) and ∇f(x)."""

    @staticmethod
    def forward(context, points, upstream, field):
        context.field = field
        _, gradients = field.value_and_gradient(_numbers(points))
        context.save_for_backward(points, upstream)
        return upstream[..., None] * torch.from_numpy(gradients).to(points.dtype)

    @staticmethod
    def backward(context, direction):
        points, upstream = context.saved_tensors
        hessian = _Hessian.apply(points, context.field)
        to_points = upstream[..., None] * (hessian @ direction[..., None])[..., 0]  # the Hessian is symmetric
        gradient = _Gradient.apply(points, torch.ones_like(upstream), context.field)
        return to_points, (gradient * direction).sum(-1), None


class _Hessian(torch.autograd.Function):
    """The Hessian H(x), which has no derivative here."""

    @staticmethod
    def forward(context, points, field):
        _, _, hessians = field.value_gradient_hessian(_numbers(points))
        return torch.from_numpy(hessians).to(points.dtype)

    @staticmethod
    def backward(context, upstream):
        raise NotImplementedError("hpsdf.torch.distance has no third derivatives")


class Samples(torch.utils.data.IterableDataset):
    """Batches of random points of a mesh with their exact distances, as tensors (points, distances), for a DataLoader.

    mesh, surface, edge, near, uniform: as of `hpsdf.sample`; the numbers are those of one batch. batches: the number of
    batches. dtype: the type of the tensors. Batch i depends on the seed and on i alone, so that the same batches come
    from any number of workers of a DataLoader, which takes batch_size=None.
    """

    def __init__(self, mesh, *, batches, seed=0, dtype=torch.float32, **counts):
        super().__init__()
        unknown = set(counts) - {"surface", "edge", "near", "uniform"}
        if unknown:
            raise TypeError(f"Samples() has no option '{unknown.pop()}': it takes surface, edge, near and uniform")
        if seed < 0:
            raise ValueError(f"seed: expected a number from 0, got {seed}")
        if batches < 0:
            raise ValueError(f"batches: expected a number from 0, got {batches}")
        self._mesh, self._batches, self._seed, self._dtype = mesh, batches, seed, dtype
        self._counts = {"surface": 0, "edge": 0, "near": 0, "uniform": 0, **counts}

    def __len__(self):
        return self._batches

    def __iter__(self):
        worker = torch.utils.data.get_worker_info()
        first, step = (0, 1) if worker is None else (worker.id, worker.num_workers)
        for batch in range(first, self._batches, step):
            # a sum of seed and batch would repeat batches under the next seed
            seed = int(np.random.SeedSequence((self._seed, batch)).generate_state(1, np.uint64)[0])
            drawn = _hpsdf.sample(self._mesh, seed=seed, **self._counts)
            yield torch.from_numpy(drawn.points).to(self._dtype), torch.from_numpy(drawn.distances).to(self._dtype)
