"""Fields in PyTorch: derivatives, fits and data sets. Skipped where python3-torch is not installed, but for CI."""

import subprocess
import sys
from typing import Any

import numpy
import numpy.typing
import pytest

import hpsdf
from packages import package

Array = numpy.typing.NDArray[Any]

package("torch")
import torch
from torch.autograd.gradcheck import gradcheck, gradgradcheck

import hpsdf.torch


@pytest.fixture(scope="module")
def blended() -> hpsdf.Field:
    """A field whose second derivatives are continuous nearly everywhere."""
    return hpsdf.build(hpsdf.load_mesh("builtin:torus"), target_error=1e-6, continuity="exact")


def tensor(points: Array, dtype: torch.dtype = torch.float64) -> torch.Tensor:
    return torch.tensor(points, dtype=dtype, requires_grad=True)


def test_values_and_gradients_equal_those_of_the_field(field: hpsdf.Field, points: Array) -> None:
    inputs = tensor(points)
    values = hpsdf.torch.distance(field, inputs)
    (gradients,) = torch.autograd.grad(values.sum(), inputs)
    expected = field.value_and_gradient(points)
    assert numpy.array_equal(values.detach().numpy(), expected[0])
    assert numpy.array_equal(gradients.numpy(), expected[1])
    single = hpsdf.torch.distance(field, torch.tensor([1.05, 0.0, 0.0]))
    assert single.shape == () and single.dtype == torch.float32
    assert hpsdf.torch.distance(field, torch.zeros(2, 0, 3)).shape == (2, 0)
    many = torch.as_tensor(points).reshape(5, 100, 3).transpose(0, 1)
    assert numpy.array_equal(hpsdf.torch.distance(field, many).numpy(), field(many.numpy()))


def test_second_derivatives_are_those_of_the_field(blended: hpsdf.Field, points: Array) -> None:
    inputs = tensor(points[:20])
    (gradients,) = torch.autograd.grad(hpsdf.torch.distance(blended, inputs).sum(), inputs, create_graph=True)
    hessians = blended.value_gradient_hessian(points[:20])[2]
    for axis in range(3):
        (row,) = torch.autograd.grad(gradients[:, axis].sum(), inputs, retain_graph=True)
        assert numpy.allclose(row.numpy(), hessians[:, axis], rtol=1e-12, atol=1e-12)


def test_second_derivatives_depend_on_what_they_are_multiplied_with(blended: hpsdf.Field, points: Array) -> None:
    inputs, weight = tensor(points[:20]), torch.tensor([2.0], dtype=torch.float64, requires_grad=True)
    values = weight * hpsdf.torch.distance(blended, inputs)
    (gradients,) = torch.autograd.grad(values.sum(), inputs, create_graph=True)
    (row,) = torch.autograd.grad(gradients[:, 0].sum(), inputs, create_graph=True)
    (slope,) = torch.autograd.grad(row.sum(), weight, retain_graph=True)
    assert slope.item() == pytest.approx(blended.value_gradient_hessian(points[:20])[2][:, 0].sum())
    with pytest.raises(NotImplementedError):
        torch.autograd.grad(row.sum(), inputs)


def test_gradcheck(blended: hpsdf.Field) -> None:
    inside = numpy.random.default_rng(3).uniform(-1, 1, (40, 3))
    radius = numpy.hypot(numpy.hypot(*inside.T[:2]) - 0.7, inside[:, 2])
    smooth = inside[(radius > 0.05) & (numpy.hypot(*inside.T[:2]) > 0.1)]
    function = lambda p: hpsdf.torch.distance(blended, p)
    assert len(smooth) > 20
    assert gradcheck(function, tensor(smooth), eps=1e-6, atol=1e-5)
    assert gradgradcheck(function, tensor(smooth), eps=1e-6, atol=1e-4)
    wrong = lambda p: hpsdf.torch.distance(blended, p) + hpsdf.torch.distance(blended, p.detach())
    with pytest.raises(RuntimeError):
        gradcheck(wrong, tensor(smooth), eps=1e-6, atol=1e-5)


def test_the_pose_of_a_sphere_is_fitted_by_adam(capsys: pytest.CaptureFixture[str]) -> None:
    field = hpsdf.build(hpsdf.load_mesh("builtin:sphere"), target_error=1e-8)
    radius = 0.5 * numpy.ptp(hpsdf.load_mesh("builtin:sphere").vertices[:, 0])
    normals = torch.nn.functional.normalize(torch.randn(500, 3, generator=torch.Generator().manual_seed(1), dtype=torch.float64), dim=1)
    measured = radius * normals + torch.tensor([0.12, -0.08, 0.05], dtype=torch.float64)
    shift = torch.zeros(3, dtype=torch.float64, requires_grad=True)
    optimizer = torch.optim.Adam([shift], lr=0.05)
    decay = torch.optim.lr_scheduler.ExponentialLR(optimizer, 0.95)
    for _ in range(50):
        optimizer.zero_grad()
        hpsdf.torch.distance(field, measured + shift).square().mean().backward()  # type: ignore[no-untyped-call]
        optimizer.step()
        decay.step()
    residual = hpsdf.torch.distance(field, measured + shift).square().mean().sqrt().item()
    with capsys.disabled():
        print(f"\nresidual of the fit: {residual:.2e}")
    assert residual <= 1e-3


def test_wrong_tensors(field: hpsdf.Field) -> None:
    mistakes: list[Any] = [numpy.zeros((2, 3)), torch.zeros(2, 3, dtype=torch.int64), torch.zeros(2, 3, device="meta")]
    for wrong in mistakes:
        with pytest.raises(TypeError, match="points: expected a tensor"):
            hpsdf.torch.distance(field, wrong)
    with pytest.raises(TypeError, match="field: expected a Field"):
        hpsdf.torch.distance(hpsdf.ExactDistance(hpsdf.load_mesh("builtin:box")), torch.zeros(2, 3))  # type: ignore[arg-type]
    for wrong in (torch.zeros(2, 2), torch.zeros(())):
        with pytest.raises(ValueError, match="shape"):
            hpsdf.torch.distance(field, wrong)


def test_samples_are_the_same_for_any_number_of_workers(mesh: hpsdf.TriangleMesh, exact: hpsdf.ExactDistance) -> None:
    data = hpsdf.torch.Samples(mesh, batches=3, near=200, seed=5, dtype=torch.float64)
    alone = list(data)
    assert len(data) == len(alone) == 3 and alone[0][0].shape == (200, 3) and alone[0][1].shape == (200,)
    assert numpy.array_equal(alone[1][1].numpy(), exact(alone[1][0].numpy()))
    assert not torch.equal(alone[0][0], alone[1][0])
    shared = list(torch.utils.data.DataLoader(data, batch_size=None, num_workers=2, multiprocessing_context="spawn"))
    key = lambda batch: batch[0][0, 0].item()
    assert all(torch.equal(a[0], b[0]) for a, b in zip(sorted(alone, key=key), sorted(shared, key=key)))
    prepared = list(hpsdf.torch.Samples(exact, mesh=mesh, batches=3, near=200, seed=5, dtype=torch.float64))
    assert all(torch.equal(a[0], b[0]) and torch.equal(a[1], b[1]) for a, b in zip(alone, prepared))
    others = list(hpsdf.torch.Samples(mesh, batches=3, near=200, seed=6, dtype=torch.float64))
    assert not any(torch.equal(a[0], b[0]) for a in alone for b in others)
    mistakes: list[tuple[dict[str, Any], type[Exception]]] = [
        ({"batches": -1}, ValueError),
        ({"batches": 1, "seed": -1}, ValueError),
        ({"batches": 1, "nearr": 2}, TypeError),
        ({"batches": 1, "near": 2, "dtype": torch.float16}, TypeError),
        ({"batches": 2.5, "near": 2}, TypeError),
        ({"batches": 1, "near": -2}, ValueError),
        ({"batches": 1}, ValueError),
    ]
    for wrong, error in mistakes:
        with pytest.raises(error):
            hpsdf.torch.Samples(mesh, **wrong)


def test_the_package_does_not_import_torch() -> None:
    code = "import sys, hpsdf; sys.exit('torch' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
