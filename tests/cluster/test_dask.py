"""Dask builds a list of meshes by hpsdf.dataset, and one of its two workers is killed."""

import os
import pathlib

import numpy
import pytest

import engines
import meshes

Plain = tuple[pathlib.Path, list[str], dict[str, str]]

distributed = pytest.importorskip("distributed")
dataset = pytest.importorskip("hpsdf.dataset")


def test_a_killed_worker_loses_nothing(folder: pathlib.Path, plain: Plain, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    with engines.dask(folder) as cluster, distributed.Client(cluster.address) as client:
        client.wait_for_workers(2, timeout=60)
        futures = client.map(dataset.build, dataset.meshes("list.txt"), folder=str(folder / "fields"), target_error=1e-4, grid=3, threads=1, pure=False)
        engines.wait_until(lambda: engines.count_built(folder) > 20, "some fields are there")
        engines.kill_tree(cluster.workers[0].pid)
        records = client.gather(futures)
    meshes.check(folder, *plain[1:])
    assert [record["file"] for record in records if record["status"] == "failed"] == [meshes.BAD]
    table = dataset.table(dataset.records("fields"))
    assert len(table) == len(plain[1]) and (table["status"] == "failed").sum() == 1
    numpy.save("table.npy", table)
    again = numpy.load("table.npy")
    assert (again["leaves"] == table["leaves"]).all() and again["leaves"].max() > 1
    assert os.path.getsize("table.npy") > 0
