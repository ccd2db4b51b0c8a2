"""An array of Slurm jobs builds a list of meshes, and one of the two nodes dies."""

import pathlib
import shutil

import pytest

import engines
import meshes

Plain = tuple[pathlib.Path, list[str], dict[str, str]]

for program in ("slurmctld", "slurmd", "munged"):
    if shutil.which(program, path="/usr/sbin:/usr/bin") is None:
        pytest.skip(f"{program} is not installed", allow_module_level=True)


def test_a_dead_node_loses_nothing(tmp_path: pathlib.Path, folder: pathlib.Path, plain: Plain) -> None:
    with engines.slurm(tmp_path / "slurm") as cluster:
        job = cluster.submit(folder, parts=40)
        engines.wait_until(lambda: engines.count_built(folder) > 40, "some fields are there")
        cluster.kill_node("two")
        engines.wait_until(lambda: cluster.is_done(job), "all tasks are done")
    assert "Nodes two not responding, setting DOWN" in (tmp_path / "slurm" / "controller.out").read_text()
    assert (folder / "slurm.log").read_text().count("1 of 5 meshes failed") > 1  # the task was queued again; two nodes write the log
    meshes.check(folder, *plain[1:])
