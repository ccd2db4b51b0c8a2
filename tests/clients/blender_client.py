"""Blender, without a display, imports the contour of a field from a GLB file and a level set from a .vdb file."""

import math
import shutil
import subprocess
import sys
from pathlib import Path

# Blender runs this file a second time, with its own interpreter, and the words after "--".
inside = "--" in sys.argv

if inside:
    import bpy
    import numpy

    # Debian 12's NumPy lacks a name that the importer of its Blender 3.4 uses.
    numpy.bool = bool
    glb, vdb = sys.argv[sys.argv.index("--") + 1:]
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=glb)
    mesh = next(one for one in bpy.data.objects if one.type == "MESH").data
    edges = {}
    for polygon in mesh.polygons:
        for key in polygon.edge_keys:
            edges[key] = edges.get(key, 0) + 1
    assert len(mesh.polygons) > 1000 and set(edges.values()) == {2}, "the contour is closed"
    # Blender's z is what glTF calls upward, y, and the torus of the tests lies around the z of the file.
    for vertex in mesh.vertices:
        x, y, z = vertex.co.x, vertex.co.z, -vertex.co.y
        assert abs(math.hypot(math.hypot(x, y) - 0.7, z) - 0.25) < 0.003, tuple(vertex.co)
    if vdb != "none":
        bpy.ops.object.volume_import(filepath=vdb)
        volume = next(one for one in bpy.data.objects if one.type == "VOLUME").data
        volume.grids.load()
        assert [grid.name for grid in volume.grids] == ["surface"], [grid.name for grid in volume.grids]
    print("Blender read all files")
else:
    from client import Program, skip

    if not shutil.which("blender"):
        skip("blender is not installed")
    program = Program()
    program.run("contour", program.at("torus.hpsdf"), "-o", program.at("torus.glb"), "--tolerance", "0.002")
    try:
        volume = program.export("torus.vdb", "--voxel", "0.02")
    except AssertionError as error:
        if "without OpenVDB" not in str(error):
            raise
        volume = "none"
    made = subprocess.run(["blender", "--background", "--factory-startup", "--python-exit-code", "1", "--python",
                           str(Path(__file__)), "--", program.at("torus.glb"), volume], capture_output=True, text=True,
                          timeout=100)
    assert made.returncode == 0 and "Blender read all files" in made.stdout, made.stdout[-2000:] + made.stderr[-2000:]
