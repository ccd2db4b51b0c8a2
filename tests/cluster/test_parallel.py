"""GNU parallel builds a list of meshes, and one of its processes is killed."""

import pathlib
import shutil
import subprocess

import pytest

import engines
import meshes

Plain = tuple[pathlib.Path, list[str], dict[str, str]]

if shutil.which("parallel") is None:
    pytest.skip("GNU parallel is not installed", allow_module_level=True)


def test_a_killed_process_is_started_again(folder: pathlib.Path, plain: Plain) -> None:
    with open(folder / "parallel.log", "wb") as log:
        running = subprocess.Popen(engines.parallel(parts=20), cwd=folder, stdout=log, stderr=log)
        engines.wait_until(lambda: engines.count_built(folder) > 20, "some fields are there")
        engines.wait_until(lambda: engines.kill_one(running.pid), "a process is killed")
        assert running.wait() == 1  # the number of jobs that failed three times: the one with the bad mesh
    meshes.check(folder, *plain[1:])
