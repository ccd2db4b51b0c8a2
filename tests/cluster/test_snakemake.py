"""Snakemake builds a list of meshes, is killed with all of its jobs, and goes on."""

import pathlib
import shutil
import subprocess

import pytest

import engines
import meshes

Plain = tuple[pathlib.Path, list[str], dict[str, str]]

if shutil.which("snakemake") is None:
    pytest.skip("Snakemake is not installed", allow_module_level=True)


def run(folder: pathlib.Path, *words: str) -> str:
    made = subprocess.run([*engines.snakemake(parts=20), *words], cwd=folder, capture_output=True, text=True)
    assert made.returncode == 0, made.stderr
    return made.stderr


def test_a_killed_workflow_goes_on(folder: pathlib.Path, plain: Plain) -> None:
    with open(folder / "snakemake.log", "wb") as log:
        running = subprocess.Popen(engines.snakemake(parts=20), cwd=folder, stdout=log, stderr=log)
        engines.wait_until(lambda: engines.count_built(folder) > 40, "some fields are there")
        engines.kill_tree(running.pid)
        running.wait()
    assert engines.count_built(folder) < len(plain[2])
    run(folder, "--unlock")
    run(folder, "--rerun-incomplete")
    meshes.check(folder, *plain[1:])
    page = (folder / "fields" / "index.html").read_text()
    assert meshes.BAD in page and f"{len(plain[1])} meshes" in page
    # Comments, repetitions and a byte order mark are counted as the program counts them. A mesh that changes is built again, and so is its part alone.
    (folder / "tetrahedron4.obj").write_text(meshes.tetrahedron(3))
    log = run(folder)
    assert sum(line.startswith("rule part:") for line in log.splitlines()) == 1, log
    assert "Nothing to be done" in run(folder)
