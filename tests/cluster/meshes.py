"""The list of meshes that all engines build, what a plain loop makes of it, and what must be true of a finished folder."""

import hashlib
import json
import os
import pathlib
import subprocess

COUNT = 200
OPTIONS = ["--target-error", "1e-4", "--grid", "3"]
BAD = "bad.obj"

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = os.environ.get("HPSDF_PROGRAM", "")


def tetrahedron(height: float) -> str:
    return f"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 {height}\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"


def write_list(folder: pathlib.Path, count: int = COUNT) -> list[str]:
    """Writes list.txt and the mesh files that it names into a folder. One of the files is no mesh. Returns its lines."""
    lines = []
    for number in range(count):
        if number == count // 2:
            (folder / BAD).write_text("this is no mesh\n")
            lines.append(BAD)
        elif number % 4 == 0:
            name = f"tetrahedron{number}.obj"
            (folder / name).write_text(tetrahedron(1 + number / count))
            lines.append(name)
        elif number % 4 == 1:
            lines.append(f"builtin:box,width={1 + number / count}")
        else:
            lines.append(f"builtin:gear,teeth={4 + number // 4},segments={1 + number % 2}")
    assert len(set(lines)) == count
    # a byte order mark, comments, blanks and repetitions are passed over
    (folder / "list.txt").write_text("\ufeff# the meshes of a test\n" + "\n\n".join([lines[0], *lines]) + "\r\n# their end\n")
    return lines


def plain_loop(folder: pathlib.Path, lines: list[str]) -> dict[str, str]:
    """Builds each mesh by a process of its own, without a batch. Returns the hash of each field by its mesh."""
    hashes = {}
    for line in lines:
        if line != BAD:
            subprocess.run([PROGRAM, "build", line, "-o", "plain.hpsdf", "--threads", "1", *OPTIONS], cwd=folder, check=True, capture_output=True)
            hashes[line] = hash_of(folder / "plain.hpsdf")
    return hashes


def hash_of(file: pathlib.Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()


def records_of(fields: pathlib.Path) -> list[dict]:
    """Returns the records of all meshes in a folder of fields."""
    return [json.loads(file.read_text()) for file in sorted(fields.glob("*.json"))]


def check(folder: pathlib.Path, lines: list[str], expected: dict[str, str]) -> None:
    """Asserts that the folder "fields" holds every field once, none damaged, and with the bytes of a plain loop, that the
    failure is listed, and that nothing half-written is left."""
    fields = folder / "fields"
    records = {record["file"]: record for record in records_of(fields)}
    assert sorted(records) == sorted(lines)
    assert [line for line in lines if records[line]["status"] != "built"] == [BAD]
    assert records[BAD]["status"] == "failed" and BAD in records[BAD]["error"]
    files = sorted(file.name for file in fields.iterdir() if file.suffix == ".hpsdf")
    assert files == sorted(pathlib.Path(records[line]["output"]).name for line in expected)
    for line, digest in expected.items():
        assert hash_of(folder / records[line]["output"]) == digest, line
    assert not [file.name for file in fields.iterdir() if ".part-" in file.name or file.name.endswith(".checkpoint")]
