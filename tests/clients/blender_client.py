"""Blender, without a display, imports contours of fields from GLB files, also with colours, and a level set from a .vdb
file, and renders a picture."""

import json
import math
import shutil
import subprocess
import sys
from pathlib import Path

# Blender runs this file a second time, with its own interpreter, and the words after "--".
inside = "--" in sys.argv


def imported(file):
    """Returns the object that Blender makes of a GLB file, in an empty scene."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=file)
    return next(one for one in bpy.data.objects if one.type == "MESH")


def check_colors(file, expected):
    """Each corner of a triangle has one of the colours of the field's degrees, which are given in linear light."""
    mesh = imported(file).data
    colors = mesh.color_attributes[0].data
    worst = max(min(max(abs(a - b) for a, b in zip(one.color, known)) for known in expected) for one in colors)
    assert len(colors) > 1000 and worst < 0.01, worst


def aimed(name, data, position):
    """Adds a camera or a lamp at a position to the scene, which looks at the origin."""
    from mathutils import Vector
    added = bpy.data.objects.new(name, data)
    added.location = position
    added.rotation_euler = (-Vector(position)).to_track_quat("-Z", "Y").to_euler()
    bpy.context.scene.collection.objects.link(added)
    return added


def surface_of_volume(file):
    """Adds the surface of a level set to an empty scene, as Blender's modifier finds it."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.object.volume_import(filepath=file)
    volume = next(one for one in bpy.data.objects if one.type == "VOLUME")
    volume.rotation_euler.x = math.pi / 2  # Blender's z is upward, and it turns no .vdb
    volume.hide_render = True
    surface = bpy.data.objects.new("surface", bpy.data.meshes.new("surface"))
    bpy.context.scene.collection.objects.link(surface)
    modifier = surface.modifiers.new("surface", "VOLUME_TO_MESH")
    clay = bpy.data.materials.new("clay")
    clay.diffuse_color = (0.55, 0.25, 0.12, 1)
    surface.data.materials.append(clay)
    modifier.object, modifier.grid_name, modifier.threshold = volume, "surface", 0
    bpy.context.view_layer.update()
    found = surface.evaluated_get(bpy.context.evaluated_depsgraph_get())
    assert len(found.data.polygons) > 1000 and max(found.dimensions) < 2.1, found.dimensions


def draw(picture):
    """Renders the scene on the CPU, in the light of suns alone, so that the picture has no noise."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = 64
    scene.cycles.use_denoising = False
    scene.cycles.max_bounces = 0
    scene.view_settings.view_transform = "Standard"
    scene.render.resolution_x, scene.render.resolution_y = 400, 300
    scene.render.filepath = picture
    scene.render.image_settings.color_mode = "RGB"
    scene.render.image_settings.compression = 100
    scene.world = bpy.data.worlds.new("white")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs[0].default_value = (1, 1, 1, 1)
    scene.world.cycles_visibility.diffuse = scene.world.cycles_visibility.glossy = False
    for energy, position in ((3.0, (1, -2, 3)), (1.2, (2.5, -3.5, -0.5)), (1.0, (-3, -3, 1))):
        sun = bpy.data.lights.new("sun", "SUN")
        sun.energy, sun.angle = energy, 0
        aimed("sun", sun, position)
    camera = bpy.data.cameras.new("camera")
    camera.angle = 0.62
    scene.camera = aimed("camera", camera, (1.8, -4.0, 1.4))  # Blender's z is upward
    bpy.ops.render.render(write_still=True)


def linear(channel):
    """Converts a channel of an sRGB colour, 0 to 255, to linear light."""
    c = channel / 255
    return c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4


def linear_colors(ply):
    """Returns the colours of the vertices of a binary PLY file of ours, each once, in linear light."""
    header, _, body = Path(ply).read_bytes().partition(b"end_header\n")
    count = next(int(line.split()[2]) for line in header.splitlines() if line.startswith(b"element vertex"))
    width = 24 + 12 + 3  # position in double, normal in single precision, and the colour
    colors = {tuple(body[n * width + 36:n * width + 39]) for n in range(count)}
    return [[linear(channel) for channel in color] for color in colors]


if inside:
    import bpy
    import numpy

    # Debian 12's NumPy lacks a name that the importer of its Blender 3.4 uses.
    numpy.bool = bool
    glb, vdb, body, expected, picture, body_vdb, picture_of_vdb = sys.argv[sys.argv.index("--") + 1:]
    mesh = imported(glb).data
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
    check_colors(body, json.loads(expected))
    imported(body)
    draw(picture)
    if body_vdb != "none":
        surface_of_volume(body_vdb)
        draw(picture_of_vdb)
    print("Blender read all files")
else:
    from client import Program, check_picture, skip

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
    program.combine_body()
    body_vdb = "none" if volume == "none" else program.at("body.vdb")
    if body_vdb != "none":
        program.run("export", program.at("body.hpsdf"), "-o", body_vdb, "--voxel", "0.03")
    for name in ("body.glb", "body.ply"):
        program.run("contour", program.at("body.hpsdf"), "-o", program.at(name), "--tolerance", "0.3%", "--color", "degree")
    files = [program.at("torus.glb"), volume, program.at("body.glb"), json.dumps(linear_colors(program.at("body.ply"))),
             program.at("blender.png"), body_vdb, program.at("openvdb.png")]
    made = subprocess.run(["blender", "--background", "--factory-startup", "--python-exit-code", "1", "--python",
                           str(Path(__file__)), "--", *files], capture_output=True, text=True, timeout=100)
    assert made.returncode == 0 and "Blender read all files" in made.stdout, made.stdout[-2000:] + made.stderr[-2000:]
    check_picture(program.at("blender.png"), "blender.png")
    if body_vdb != "none":
        check_picture(program.at("openvdb.png"), "openvdb.png")
