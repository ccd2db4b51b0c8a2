"""Runs lists of meshes by GNU parallel, Snakemake, Slurm and Dask, each in the way that docs/batch.md tells."""

from __future__ import annotations

import contextlib
import getpass
import os
import pathlib
import secrets
import shutil
import signal
import socket
import subprocess
import time
from collections.abc import Callable, Iterator

from meshes import OPTIONS, PROGRAM, ROOT

kWait = 300  # seconds after which something that must happen has not happened


def wait_until(condition: Callable[[], bool], what: str) -> None:
    end = time.monotonic() + kWait
    while not condition():
        if time.monotonic() > end:
            raise TimeoutError(f"waited {kWait} s in vain until {what}")
        time.sleep(0.02)


def count_built(folder: pathlib.Path) -> int:
    fields = folder / "fields"
    return sum(1 for file in fields.iterdir() if file.suffix == ".hpsdf") if fields.is_dir() else 0


def step_of(process: int) -> int | None:
    """Returns the slurmstepd that has started a process, or None."""
    with contextlib.suppress(OSError):
        parent = int(pathlib.Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[1])
        if pathlib.Path(f"/proc/{parent}/comm").read_text().startswith("slurmstepd"):
            return parent
    return None


def children_of(process: int) -> list[int]:
    """Returns the processes that a process has started, and those that they have started."""
    found = []
    for entry in pathlib.Path("/proc").iterdir():
        with contextlib.suppress(OSError, ValueError):
            if entry.name.isdigit() and int((entry / "stat").read_text().rpartition(")")[2].split()[1]) == process:
                found += [int(entry.name), *children_of(int(entry.name))]
    return found


def workers_below(process: int) -> list[int]:
    """Returns the processes of the program among the children of a process."""
    found = []
    for child in children_of(process):
        with contextlib.suppress(OSError):
            if os.path.realpath(f"/proc/{child}/exe") == os.path.realpath(PROGRAM):
                found.append(child)
    return found


def kill_one(process: int) -> bool:
    """Kills one of the processes of the program among the children of a process. Returns false if there is none just now."""
    for worker in workers_below(process):
        with contextlib.suppress(ProcessLookupError):
            os.kill(worker, signal.SIGKILL)
            return True
    return False


def kill_tree(process: int) -> None:
    """Kills a process and all that it has started, none of which may end in order."""
    for victim in [process, *children_of(process)]:
        with contextlib.suppress(ProcessLookupError):
            os.kill(victim, signal.SIGKILL)


def parallel(parts: int) -> list[str]:
    """Returns the command line by which GNU parallel builds the list of the current folder in two processes."""
    job = [PROGRAM, "build", "--batch", "list.txt", "-o", "fields", "--part", "{}/" + str(parts), "--threads", "1", *OPTIONS]
    return ["parallel", "-j", "2", "--retries", "3", *job, ":::", *map(str, range(1, parts + 1))]


def snakemake(parts: int, where: tuple[str, ...] = ("--cores", "2")) -> list[str]:
    """Returns the command line by which Snakemake builds the list of the current folder, in two processes or as `where` tells."""
    return ["snakemake", "-s", str(ROOT / "workflow" / "Snakefile"), *where, "--config", "list=list.txt", f"parts={parts}",
            f"hpsdf={PROGRAM}", "options=" + " ".join(OPTIONS), "memory=1000"]  # fmt: skip


def snakemake_by_slurm(parts: int) -> list[str]:
    """Returns the command line by which Snakemake submits the list of the current folder to Slurm."""
    submit = "sbatch --parsable --requeue --cpus-per-task={threads} --mem={resources.mem_mb}"
    status = str(ROOT / "workflow" / "slurm-status")
    return snakemake(parts, ("--jobs", "4", "--cluster", submit, "--cluster-status", status))


def free_ports(count: int) -> list[int]:
    """Returns ports of this machine at which nobody listens."""
    with contextlib.ExitStack() as stack:
        sockets = [stack.enter_context(socket.socket()) for _ in range(count)]
        for one in sockets:
            one.bind(("127.0.0.1", 0))
        return [one.getsockname()[1] for one in sockets]


class Slurm:
    """A controller and two nodes of Slurm on this machine, with folders, ports and a key of their own."""

    NODES = ("one", "two")

    def __init__(self, folder: pathlib.Path, cpus: int = 1) -> None:
        self.folder = folder
        self.environment = {**os.environ, "SLURM_CONF": str(folder / "slurm.conf")}
        (folder / "state").mkdir(parents=True)
        key = folder / "munge.key"
        key.write_bytes(secrets.token_bytes(128))
        key.chmod(0o400)
        controller, *nodes = free_ports(1 + len(self.NODES))
        settings = {
            "ClusterName": "test", "SlurmctldHost": "localhost", "SlurmctldPort": controller, "AuthType": "auth/munge",
            "AuthInfo": f"socket={folder}/munge.socket", "SlurmUser": getpass.getuser(), "SlurmdUser": getpass.getuser(),
            "StateSaveLocation": folder / "state", "SlurmdSpoolDir": folder / "spool-%n",
            "SlurmctldPidFile": folder / "controller.pid", "SlurmdPidFile": folder / "%n.pid",
            "ProctrackType": "proctrack/linuxproc", "TaskPlugin": "task/none", "SwitchType": "switch/none", "MpiDefault": "none",
            "JobAcctGatherType": "jobacct_gather/none", "SelectType": "select/cons_tres", "SelectTypeParameters": "CR_Core",
            # a node that has been silent for so many seconds is down, and its jobs are queued again
            "SlurmdTimeout": 10, "ReturnToService": 2, "JobRequeue": 1, "MinJobAge": 2,
            "SchedulerParameters": "batch_sched_delay=0,sched_min_interval=0", "SlurmdParameters": "config_overrides",
        }  # fmt: skip
        lines = [f"{name}={value}" for name, value in settings.items()]
        lines += [f"NodeName={name} NodeHostname=localhost NodeAddr=127.0.0.1 Port={port} CPUs={cpus} RealMemory=2000" for name, port in zip(self.NODES, nodes)]
        lines.append("PartitionName=main Nodes=ALL Default=YES State=UP")
        (folder / "slurm.conf").write_text("\n".join(lines) + "\n")
        self.daemons: dict[str, subprocess.Popen[bytes]] = {}
        files = {name: f"{folder}/munge.{name}" for name in ("socket", "pid", "log", "seed")}
        self._start("munge", "munged", "--foreground", "--force", f"--key-file={key}", f"--socket={files['socket']}",
                    f"--pid-file={files['pid']}", f"--log-file={files['log']}", f"--seed-file={files['seed']}")  # fmt: skip
        wait_until(pathlib.Path(files["socket"]).exists, "munge listens")
        self._start("controller", "slurmctld", "-D")
        for name in self.NODES:
            self._start(name, "slurmd", "-D", "-N", name)
        wait_until(lambda: self.run("sinfo", "-h", "-t", "idle", "-o", "%D").strip() == "2", "both nodes are idle")

    def _start(self, name: str, program: str, *words: str) -> None:
        log = open(self.folder / f"{name}.out", "wb")
        found = shutil.which(program, path=os.environ.get("PATH", "") + ":/usr/sbin")
        self.daemons[name] = subprocess.Popen([found or program, *words], env=self.environment, stdout=log, stderr=log, start_new_session=True)

    def run(self, *words: str, folder: pathlib.Path | None = None) -> str:
        """Runs a command of Slurm. Returns what it prints."""
        made = subprocess.run(words, env=self.environment, cwd=folder, capture_output=True, text=True)
        return made.stdout if made.returncode == 0 else f"{made.stdout}{made.stderr}"

    def submit(self, folder: pathlib.Path, parts: int) -> str:
        """Submits the list of a folder as an array of jobs. Returns the number of the job."""
        environment = f"--export=ALL,HPSDF={PROGRAM}"
        script = str(ROOT / "workflow" / "array.sbatch")
        text = self.run("sbatch", "--parsable", environment, f"--array=1-{parts}", "--output=slurm.log", script, "list.txt", "fields", *OPTIONS, folder=folder)
        assert text.strip().isdigit(), text
        return text.strip()

    def is_done(self, job: str) -> bool:
        """Returns true if no task of the job waits or runs. Tasks that were queued again start at once."""
        tasks = self.start_queued("-j", job)
        return tasks.strip() == "" or "Invalid job id" in tasks

    def start_queued(self, *which: str) -> str:
        """Starts those jobs that were queued again, which Slurm would let wait for two minutes. Returns the list of jobs."""
        tasks = self.run("squeue", "-h", "-r", *which, "-o", "%i %t %r")
        for task in tasks.splitlines():
            if task.endswith(" PD BeginTime"):
                self.run("scontrol", "update", f"JobId={task.split()[0]}", "StartTime=now")
        return tasks

    def kill_node(self, name: str) -> None:
        """Ends a node at once, with what runs on it, as if it had lost its power."""
        kill_tree(self.daemons[name].pid)
        # The processes of jobs are children of slurmstepd, which is none of the node's daemon. It is killed first: it would
        # tell the controller how its job has ended.
        jobs = []
        for entry in pathlib.Path("/proc").iterdir():
            with contextlib.suppress(OSError):
                if entry.name.isdigit() and f"SLURMD_NODENAME={name}\0" in (entry / "environ").read_text(errors="replace"):
                    jobs.append(int(entry.name))
        for process in [*(parent for parent in map(step_of, jobs) if parent is not None), *jobs]:
            with contextlib.suppress(OSError):
                os.kill(process, signal.SIGKILL)
        self.daemons[name].wait()

    def stop(self) -> None:
        for daemon in reversed(self.daemons.values()):
            kill_tree(daemon.pid)
            daemon.wait()


@contextlib.contextmanager
def slurm(folder: pathlib.Path, cpus: int = 1) -> Iterator[Slurm]:
    cluster = Slurm(folder, cpus)
    try:
        yield cluster
    finally:
        cluster.stop()


class Dask:
    """A scheduler and two workers of Dask, each a process of its own."""

    def __init__(self, folder: pathlib.Path) -> None:
        self.folder = folder
        (self.port,) = free_ports(1)
        self.address = f"tcp://127.0.0.1:{self.port}"
        self.log = open(folder / "dask.log", "wb")
        common = {"stdout": self.log, "stderr": self.log, "cwd": folder, "start_new_session": True}
        self.scheduler = subprocess.Popen(["dask-scheduler", "--host", "127.0.0.1", "--port", str(self.port), "--no-dashboard"], **common)
        worker = ["dask-worker", self.address, "--nthreads", "1", "--nworkers", "1", "--no-dashboard", "--local-directory", str(folder / "work")]
        self.workers = [subprocess.Popen(worker, **common) for _ in range(2)]

    def stop(self) -> None:
        for process in [*self.workers, self.scheduler]:
            kill_tree(process.pid)
            process.wait()
        self.log.close()


@contextlib.contextmanager
def dask(folder: pathlib.Path) -> Iterator[Dask]:
    cluster = Dask(folder)
    try:
        yield cluster
    finally:
        cluster.stop()
