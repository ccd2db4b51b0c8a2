"""Slurm builds a list of meshes, as an array of jobs or for Snakemake, and one of the two nodes dies."""

import pathlib
import shutil
import subprocess

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


@pytest.mark.skipif(shutil.which("snakemake") is None, reason="Snakemake is not installed")
def test_jobs_of_snakemake_survive_a_dead_node(tmp_path: pathlib.Path, folder: pathlib.Path, plain: Plain) -> None:
    with engines.slurm(tmp_path / "slurm") as cluster, open(folder / "snakemake.log", "wb") as log:
        running = subprocess.Popen(engines.snakemake_by_slurm(parts=20), cwd=folder, env=cluster.environment, stdout=log, stderr=log)

        def has_ended() -> bool:
            cluster.start_queued()
            return running.poll() is not None

        try:
            engines.wait_until(lambda: engines.count_built(folder) > 40, "some fields are there")
            cluster.kill_node("two")
            engines.wait_until(has_ended, "Snakemake has ended")
        finally:
            engines.kill_tree(running.pid)
            running.wait()
    assert running.returncode == 0, (folder / "snakemake.log").read_text()
    assert "Nodes two not responding, setting DOWN" in (tmp_path / "slurm" / "controller.out").read_text()
    meshes.check(folder, *plain[1:])
    assert f"{len(plain[1])} meshes" in (folder / "fields" / "index.html").read_text()
