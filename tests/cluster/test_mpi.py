"""Processes that mpirun starts build one field together, which is that of one process, byte for byte."""

import os
import pathlib
import shutil
import signal
import subprocess
import time

import pytest

import engines
import meshes

BOWL = "builtin:structured-bowl,cells=12,bumps=3"

if shutil.which("mpirun") is None:
    pytest.skip("openmpi-bin is not installed", allow_module_level=True)


def build(mesh: str, output: pathlib.Path, *options: str) -> list[str]:
    return [meshes.PROGRAM, "build", mesh, "-o", str(output), "--threads", "1", *options]


def by_ranks(count: int, command: list[str]) -> list[str]:
    start = ["mpirun", "--quiet", "--oversubscribe", "-n", str(count)]
    return [*start, *(["--allow-run-as-root"] if os.geteuid() == 0 else []), *command]


def environment() -> dict[str, str]:
    """Returns the environment without the limits that an mpirun around this test may have set."""
    return {name: value for name, value in os.environ.items() if not name.startswith(("OMPI_", "PMIX_", "PMI_"))}


@pytest.mark.parametrize(
    "options",
    [
        ("--target-error", "1e-7"),
        ("--target-error", "1e-6", "--criterion", "optimal"),
        ("--target-error", "1e-6", "--band", "0.1", "--bounds"),
        ("--target-error", "1e-5", "--coefficients", "double", "--checkpoint", "--checkpoint-seconds", "0"),
    ],
)
def test_fields_are_those_of_one_process(tmp_path: pathlib.Path, options: tuple[str, ...]) -> None:
    subprocess.run(build(BOWL, tmp_path / "alone.hpsdf", *options), check=True)
    for count in (2, 5):
        field = tmp_path / f"{count}.hpsdf"
        subprocess.run(by_ranks(count, build(BOWL, field, *options)), check=True, env=environment())
        assert field.read_bytes() == (tmp_path / "alone.hpsdf").read_bytes()
    assert {file.suffix for file in tmp_path.iterdir()} == {".hpsdf"}


def test_ranks_share_the_parts_of_a_mesh_on_the_disk(tmp_path: pathlib.Path) -> None:
    parts = tmp_path / "parts"
    parts.mkdir()
    options = ("--target-error", "1e-5", "--out-of-core", str(parts))
    for count in (3, 2):
        field = tmp_path / f"{count}.hpsdf"
        subprocess.run(by_ranks(count, build(BOWL, field, *options)), check=True, env=environment())
    subprocess.run(build(BOWL, tmp_path / "alone.hpsdf", *options), check=True)
    for field in (tmp_path / "3.hpsdf", tmp_path / "2.hpsdf"):
        assert field.read_bytes() == (tmp_path / "alone.hpsdf").read_bytes()
    assert len(list(parts.iterdir())) == 1


def test_a_mesh_that_cannot_be_divided_ends_all_ranks(tmp_path: pathlib.Path) -> None:
    options = ("--out-of-core", str(tmp_path / "missing"))
    command = by_ranks(3, build(BOWL, tmp_path / "field.hpsdf", *options))
    done = subprocess.run(command, env=environment(), capture_output=True, text=True)
    assert done.returncode != 0
    assert done.stderr.count("is not a folder") == 1
    assert not (tmp_path / "field.hpsdf").exists()


def test_a_killed_rank_ends_all_and_the_checkpoint_goes_on(tmp_path: pathlib.Path) -> None:
    options = ("--target-error", "1e-8", "--checkpoint", "--checkpoint-seconds", "0.1")
    subprocess.run(build(BOWL, tmp_path / "alone.hpsdf", *options), check=True)
    field, state = tmp_path / "field.hpsdf", tmp_path / "field.hpsdf.checkpoint"
    resumed = False
    for number in range(3):
        command = by_ranks(2 + number % 2, build(BOWL, field, *options))
        with open(tmp_path / "log", "w+b") as log:
            running = subprocess.Popen(command, stdout=log, stderr=log, env=environment())
            before = state.stat().st_mtime_ns if state.exists() else 0
            engines.wait_until(
                lambda: running.poll() is not None or (state.exists() and state.stat().st_mtime_ns > before),
                "a state is saved",
            )
            workers = engines.workers_below(running.pid)
            if workers:
                os.kill(workers[number % len(workers)], signal.SIGKILL)
            assert running.wait() != 0
            log.seek(0)
            resumed = resumed or b"going on from" in log.read()
        assert not field.exists()
    assert resumed
    time.sleep(0.1)
    subprocess.run(by_ranks(2, build(BOWL, field, *options)), check=True, env=environment())
    assert field.read_bytes() == (tmp_path / "alone.hpsdf").read_bytes()
    assert not state.exists()


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (["build", "missing.obj", "-o", "field.hpsdf"], "missing.obj: no such file"),
        (["info", "missing.hpsdf"], "several processes build one field together"),
        (["build", "--batch", "list.txt", "-o", "fields"], "several processes build one field together"),
        (["build", "builtin:torus", "-o", "field.hpsdf", "--tolerance", "0.1"], "several processes cannot build"),
    ],
)
def test_errors_are_one_line(tmp_path: pathlib.Path, words: list[str], why: str) -> None:
    result = subprocess.run(
        by_ranks(3, [meshes.PROGRAM, *words]), cwd=tmp_path, env=environment(), capture_output=True, text=True
    )
    assert result.returncode == 2
    assert why in result.stderr
    assert result.stderr.count("\n") == 1
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif("HPSDF_MPI_MESSAGES" not in os.environ, reason="sanitizers do not go with limits of memory")
def test_a_rank_without_room_for_a_message_fails_on_all() -> None:
    program = os.environ["HPSDF_MPI_MESSAGES"]
    result = subprocess.run(by_ranks(3, [program]), env=environment(), capture_output=True, text=True, timeout=120)
    assert result.returncode == 0, result.stderr
