"""What the scripts beside this file share: scenes in Blender, their images, and files that come whole."""

import math
import struct
import time
import zlib
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector

Array = np.ndarray

CLOTH_SCALE = np.array([0.01, -0.01, -0.01])
"""From a sheet in mm to Blender's cloth, which wants units of some 100 mm."""


def spread(values: tuple[float, float], dice: np.random.Generator) -> float:
    """A number whose logarithm is uniform."""
    return math.exp(dice.uniform(math.log(values[0]), math.log(values[1])))


def faces(shape: tuple) -> tuple[Array, Array]:
    """Quadrangles and triangles of a grid, counter-clockwise from the front."""
    index = np.arange(shape[0] * shape[1]).reshape(shape[:2])
    a, b, c, d = (part.ravel() for part in (index[:-1, :-1], index[:-1, 1:], index[1:, :-1], index[1:, 1:]))
    return np.stack([a, c, d, b], 1), np.stack([a, c, d, a, d, b], 1).reshape(-1, 3)


def blender(points: Array) -> Array:
    """From our camera's frame, mm, to Blender's, whose camera looks along -z with y up, m."""
    return np.asarray(points) * [0.001, -0.001, -0.001]


def add(name: str, data) -> bpy.types.Object:
    thing = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(thing)
    return thing


def add_mesh(name: str, points: Array, polygons: Array) -> bpy.types.Object:
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(points.reshape(-1, 3).tolist(), [], polygons.tolist())
    mesh.polygons.foreach_set("use_smooth", np.ones(len(polygons), bool))
    return add(name, mesh)


def lay_texture(mesh: bpy.types.Mesh, uv: Array, triangles: Array) -> None:
    """Gives each corner of the triangles its vertex's texture coordinates (u, v), with v downwards."""
    corners = (uv * [1, -1] + [0, 1])[triangles.ravel()]
    mesh.uv_layers.new(name="uv").data.foreach_set("uv", corners.ravel().astype(np.float32))


def add_camera(focal: float) -> bpy.types.Camera:
    """A pinhole in the origin; `focal` is a fraction of the image's long side."""
    data = bpy.data.cameras.new("camera")
    data.sensor_fit, data.sensor_width, data.lens, data.clip_start = "AUTO", 36.0, 36.0 * focal, 0.01
    bpy.context.scene.camera = add("camera", data)
    return data


def shine(lamp: bpy.types.Light, way: Array) -> bpy.types.Object:
    """Adds a lamp; `way` is the unit vector towards it, in our frame."""
    shining = add(lamp.name, lamp)
    shining.rotation_euler = Vector(blender(-way)).to_track_quat("-Z", "Y").to_euler()
    shining.visible_camera = False
    return shining


def simulated(sheet: bpy.types.Object, modifier: bpy.types.ClothModifier, steps: int) -> Array:
    """The cloth's points after so many steps, mm."""
    modifier.point_cache.frame_start, modifier.point_cache.frame_end = 1, steps
    for step in range(1, steps + 1):
        bpy.context.scene.frame_set(step)
    return evaluated(sheet)


def evaluated(thing: bpy.types.Object) -> Array:
    """The points of what its modifiers make of a mesh in the cloth's units, mm."""
    moved = thing.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    points = np.empty(3 * len(moved.vertices), np.float32)
    moved.vertices.foreach_get("co", points)
    return points.reshape(-1, 3).astype(float) * [100, -100, -100]


def surface_of(looks: bpy.types.Material, roughness=0.7, specular=0.3, coat=0.0, color=(0.85, 0.85, 0.82)):
    """The shader of a material with these values."""
    if not looks.node_tree:
        looks.use_nodes = True  # Before Blender 5.
    shader = next(node for node in looks.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    values = {"Base Color": (*color, 1), "Roughness": roughness, "Specular IOR Level": specular, "Coat Weight": coat}
    for name, value in values.items():
        shader.inputs[name].default_value = value
    return shader


def with_white_back(looks: bpy.types.Material, front) -> None:
    """Lets the shader `front` be seen from the front alone; the back is white and matt."""
    nodes, links = looks.node_tree.nodes, looks.node_tree.links
    side, back, mixed = (nodes.new("ShaderNode" + kind) for kind in ("NewGeometry", "BsdfDiffuse", "MixShader"))
    links.new(side.outputs["Backfacing"], mixed.inputs[0])
    links.new(front.outputs[0], mixed.inputs[1])
    links.new(back.outputs[0], mixed.inputs[2])
    links.new(mixed.outputs[0], output_of(looks).inputs["Surface"])


def output_of(looks: bpy.types.Material):
    return next(node for node in looks.node_tree.nodes if node.type == "OUTPUT_MATERIAL")


def textured(looks: bpy.types.Material, shader, picture) -> None:
    """Lays a picture on the surface, by its texture coordinates."""
    image = looks.node_tree.nodes.new("ShaderNodeTexImage")
    image.image, image.interpolation, image.extension = picture, "Cubic", "EXTEND"
    looks.node_tree.links.new(image.outputs["Color"], shader.inputs[0])


def patterned(dice: np.random.Generator, scale: float) -> bpy.types.Material:
    """A material of two or three colours in a pattern with details of `scale` per metre."""
    looks = bpy.data.materials.new("pattern")
    shader = surface_of(looks, roughness=dice.uniform(0.3, 1.0))
    nodes, links = looks.node_tree.nodes, looks.node_tree.links
    kind = str(dice.choice(["TexNoise", "TexVoronoi", "TexWave", "TexChecker", "TexMagic"]))
    place, pattern, ramp = (nodes.new("ShaderNode" + kind) for kind in ("TexCoord", kind, "ValToRGB"))
    pattern.inputs["Scale"].default_value = scale
    for name, value in {"Detail": 6.0, "Distortion": 4.0 if kind == "TexWave" else 0.5}.items():
        if name in pattern.inputs:
            pattern.inputs[name].default_value = value
    ramp.color_ramp.elements.new(0.5)
    for element in ramp.color_ramp.elements:
        element.color = (*dice.uniform(0.03, 0.8, 3), 1)
    links.new(place.outputs["Object"], pattern.inputs["Vector"])
    links.new(next(o for o in pattern.outputs if o.name in ("Fac", "Factor", "Distance")), ramp.inputs[0])
    links.new(ramp.outputs["Color"], shader.inputs["Base Color"])
    return looks


def rendered(camera: dict, options, seed: int, file: Path) -> Array:
    """The image as linear light, (rows, columns, 3)."""
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.device, scene.cycles.seed = "CYCLES", "CPU", seed
    scene.cycles.samples, scene.cycles.max_bounces = options.samples, 4
    scene.cycles.use_denoising, scene.cycles.denoiser = True, "OPENIMAGEDENOISE"
    scene.render.threads_mode, scene.render.threads = "FIXED", options.threads
    scene.render.resolution_x, scene.render.resolution_y = camera["width"], camera["height"]
    scene.render.resolution_percentage = 100
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.render.filepath = str(file)
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(str(file))
    values = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(values)
    file.unlink()
    return values.reshape(camera["height"], camera["width"], -1)[::-1, :, :3]


def srgb(light: Array) -> Array:
    """Linear light from 0 to 1, clipped, as sRGB of 8 bits."""
    light = np.clip(light, 0, 1)
    return np.round(255 * np.where(light < 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)).astype(np.uint8)


def put(file: Path, content: bytes) -> None:
    """Writes a file beside its place, then renames it."""
    partial = file.with_name(f".{file.name}.partial")
    partial.write_bytes(content)
    partial.rename(file)


def png(pixels: Array) -> bytes:
    """The PNG file of (rows, columns[, 3]) pixels of 8 or 16 bits."""
    height, width = pixels.shape[:2]
    values = pixels.astype(">u2") if pixels.dtype == np.uint16 else pixels
    lines = values.reshape(height, -1).view(np.uint8)
    rows = np.concatenate([np.zeros((height, 1), np.uint8), lines], 1)

    def chunk(name: bytes, content: bytes) -> bytes:
        return struct.pack(">I", len(content)) + name + content + struct.pack(">I", zlib.crc32(name + content))

    header = struct.pack(">IIBBBBB", width, height, 8 * values.itemsize, 0 if pixels.ndim == 2 else 2, 0, 0, 0)
    parts = chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows.tobytes(), 6)) + chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + parts


def reported(jobs: list):
    """The jobs one after the other, and after each a line on how far they are. The first item of a job is its name."""
    began = time.monotonic()
    for done, job in enumerate(jobs, 1):
        yield job
        seconds = (time.monotonic() - began) / done
        left = seconds * (len(jobs) - done) / 60
        print(f"{done} of {len(jobs)}: {job[0]}, {seconds:.1f} s a frame, {left:.0f} min left", flush=True)
