"""OpenVDB's module for Python and its program vdb_print read .vdb: class, transform, background, band, values."""

import shutil
import subprocess

from client import Program, check_near, distance, module, skip

vdb = module("pyopenvdb", "python3-openvdb")
numpy = module("numpy", "python3-numpy")
if shutil.which("vdb_print") is None:
    skip("libopenvdb-tools is not installed (vdb_print)")

VOXEL, BAND = 0.02, 3
program = Program()
file = program.export("torus.vdb", "--voxel", str(VOXEL), "--band", str(BAND))

metadata = vdb.readGridMetadata(file, "surface")
assert metadata["class"] == "level set", metadata
grid = vdb.read(file, "surface")
assert grid.gridClass == vdb.GridClass.LEVEL_SET
assert grid.transform.voxelSize() == (VOXEL, VOXEL, VOXEL)
assert abs(grid.background - VOXEL * BAND) < 1e-6

active = [item.min for item in grid.iterOnValues()]
assert len(active) == grid.activeVoxelCount() > 10000
values = [grid.getConstAccessor().getValue(index) for index in active[::37]]
points = [[VOXEL * x for x in index] for index in active[::37]]
check_near(values, program.values(points), 1e-6, "values of .vdb")
assert max(abs(distance(*p)) for p in points) < VOXEL * BAND + 0.002

# The band is complete, and all other voxels have the sign of the solid.
accessor = grid.getConstAccessor()
generator = numpy.random.default_rng(1)
for index in generator.integers(-60, 60, (3000, 3)).tolist():
    exact = distance(*(VOXEL * x for x in index))
    value, is_active = accessor.probeValue(tuple(index))
    if abs(exact) < VOXEL * BAND - 0.002:
        assert is_active, index
    if abs(exact) > VOXEL * BAND + 0.002:
        assert not is_active and value == (grid.background if exact > 0 else -grid.background), (index, value)

printed = subprocess.run(["vdb_print", "-l", file], capture_output=True, text=True)
assert printed.returncode == 0 and "level set" in printed.stdout, printed.stdout + printed.stderr

# The same grid makes the same file.
first = open(file, "rb").read()
again = program.export("again.vdb", "--voxel", str(VOXEL), "--band", str(BAND), "--threads", "1")
assert open(again, "rb").read() == first

# Fields are built from what OpenVDB writes, too: a level set of a mesh.
vertices, quads = grid.convertToQuads()
written = vdb.FloatGrid.createLevelSetFromPolygons(vertices, quads=quads, transform=grid.transform, halfWidth=3)
written.name = "written"
vdb.write(program.at("written.vdb"), grids=[written])
program.build("written.vdb")
