"""NanoVDB's program nanovdb_validate checks .nvdb, and nanovdb_print finds the grid in it."""

import shutil
import subprocess

from client import Program, skip

for name in ("nanovdb_validate", "nanovdb_print"):
    if shutil.which(name) is None:
        skip(f"libnanovdb-tools is not installed ({name})")

program = Program()
file = program.export("torus.nvdb", "--voxel", "0.02")
validated = subprocess.run(["nanovdb_validate", "--verbose", file], capture_output=True, text=True)
assert validated.returncode == 0, validated.stdout + validated.stderr
assert "passed" in validated.stdout, validated.stdout
printed = subprocess.run(["nanovdb_print", file], capture_output=True, text=True)
assert printed.returncode == 0 and "surface" in printed.stdout and "SDF" in printed.stdout, printed.stdout
