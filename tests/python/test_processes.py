"""Threads, processes and signals."""

import multiprocessing
import os
import signal
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy
import numpy.typing
import pytest

import hpsdf

Array = numpy.typing.NDArray[Any]

BOX = ((-1.2,) * 3, (1.2,) * 3)


def slow_sphere(points: Array) -> Any:
    time.sleep(0.01)
    return numpy.linalg.norm(points, axis=1) - 1


@pytest.mark.parametrize("surface", [slow_sphere, "builtin:torus"])
def test_ctrl_c_cancels_within_a_second(surface: Any) -> None:
    if isinstance(surface, str):
        surface = hpsdf.load_mesh(surface)
    sent = []

    def send() -> None:
        sent.append(time.monotonic())
        os.kill(os.getpid(), signal.SIGINT)

    timer = threading.Timer(1, send)
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        hpsdf.build(surface, box=BOX, target_error=1e-18, max_depth=20, strategy="h1")
    assert time.monotonic() - sent[0] < 1
    timer.join()


def test_ctrl_c_cancels_queries(exact: hpsdf.ExactDistance) -> None:
    timer = threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT))
    points = numpy.random.default_rng(1).uniform(-1, 1, (1_000_000, 3))
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        for _ in range(100):
            exact(points)
    timer.join()


def test_threads_query_one_field(field: hpsdf.Field, exact: hpsdf.ExactDistance, points: Array) -> None:
    expected, expected_gradient, closest = field(points), field.value_and_gradient(points)[1], exact.closest(points)

    def query(_: int) -> bool:
        for _ in range(50):
            assert numpy.array_equal(field(points), expected)
            assert numpy.array_equal(field.value_and_gradient(points)[1], expected_gradient)
            assert numpy.array_equal(exact.closest(points).point, closest.point)
        return True

    with ThreadPoolExecutor(8) as pool:
        assert all(pool.map(query, range(8)))


def test_other_threads_go_on_during_a_build(mesh: hpsdf.TriangleMesh) -> None:
    ticks, done = [], threading.Event()

    def tick() -> None:
        while not done.wait(0.005):
            ticks.append(time.monotonic())

    thread = threading.Thread(target=tick)
    thread.start()
    start = time.monotonic()
    hpsdf.build(mesh, target_error=1e-8)
    seconds = time.monotonic() - start
    done.set()
    thread.join()
    assert len(ticks) > 2 + 10 * seconds


def test_builds_in_threads(mesh: hpsdf.TriangleMesh, field: hpsdf.Field, points: Array) -> None:
    with ThreadPoolExecutor(4) as pool:
        tasks = [pool.submit(lambda: hpsdf.build(mesh, target_error=1e-5)(points)) for _ in range(4)]
        made = [task.result() for task in tasks]
    assert all(numpy.array_equal(values, field(points)) for values in made)


def values_in_child(field: hpsdf.Field, points: Array) -> tuple[Any, Any]:
    built = hpsdf.build(slow_sphere, box=BOX, max_steps=0, grid=1)
    return field(points), built([0, 0, 1.0])


@pytest.mark.parametrize("method", ["fork", "spawn"])
def test_other_processes(field: hpsdf.Field, points: Array, method: str) -> None:
    many = numpy.tile(points, (100, 1))
    field(many)  # the parent has threads of its own already
    with multiprocessing.get_context(method).Pool(2) as pool:
        made = pool.starmap_async(values_in_child, 4 * [(field, many)]).get(timeout=100)
    for values, _ in made:
        assert numpy.array_equal(values, field(many))
