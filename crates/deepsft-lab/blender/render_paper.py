"""Renders the synthetic data of the paper's section 5.1 with the tool it names, as a data set that `deepsft` reads.

    python3.11 -m venv ENV && ENV/bin/pip install bpy "numpy<2"
    ENV/bin/python render_paper.py TEMPLATE --count 700 --seed 1 --out DIR
    deepsft eval --model MODEL --data DIR

TEMPLATE is the folder of a template. A sheet is a simulated cloth, moved by anchors and forces at random places. An object
with a volume bends at the joints of a rig made by hand, which --rig names: a JSON file of its bones.

    {"BONE": {"parent": "OTHER", "head": [x, y, z], "tail": [x, y, z], "bend_deg": 20}}  mm, template frame

Reflectance is Lambert with Blender's Cook-Torrance, under one distant light. The ranges are the paper's; where it gives none
they are those of `deepsft synth --images paper`. Depth, registration and mask are cast as rays through the pixels' centres.

A sample follows from TEMPLATE, options and its number. Samples that are in DIR/samples are kept, so that a command goes on
where it was ended. At the end --count samples from --first on are packed into shards, also where more are there."""

import argparse
import hashlib
import io
import json
import math
import tarfile
from pathlib import Path
from typing import NamedTuple

import bpy
import numpy as np
from mathutils import Quaternion, Vector
from mathutils.bvhtree import BVHTree

from rendering import CLOTH_SCALE, Array, add, add_camera, add_mesh, blender, evaluated, faces, lay_texture, output_of
from rendering import patterned, png, put, rendered, reported, shine, simulated, spread, srgb, surface_of, textured
from rendering import with_white_back

CAMERA = {"width": 480, "height": 270, "fx": 380.0, "fy": 380.0, "cx": 240.0, "cy": 135.0}
"""The training camera."""

CENTRE = np.array([CAMERA["cx"], CAMERA["cy"]])
IMAGE = np.array([CAMERA["width"], CAMERA["height"]])


class Protocol(NamedTuple):
    """What is varied, and how far. Pairs are ranges, drawn uniformly."""

    max_rotation: float = math.pi / 4
    """About each axis of the camera."""
    max_shift_mm: float = 150.0
    """Of the centroid, to either side and up and down."""
    depth_mm: tuple = (400.0, 900.0)
    """Of the centroid: the paper's 100 to 600 mm, counted from 300 mm."""
    max_light_angle: float = math.pi / 18
    """From the optical axis."""
    white: float = 0.9
    """Of white paper that faces the light, before the gain; 1 saturates."""
    gain: tuple = (0.9, 1.1)
    roughness: tuple = (0.4, 0.7)
    specular: tuple = (0.0, 0.25)
    """Blender's level; 0.5 is the full reflection of a dielectric."""
    max_discs: int = 4
    disc_px: tuple = (1.0, 10.0)
    """Diameters."""
    cells: int = 39
    """Along each side of the cloth: the paper's 1521 faces."""
    steps: int = 30
    max_anchors: int = 4
    anchor_radius: tuple = (0.03, 0.08)
    anchor_shift: tuple = (0.0, 0.25)
    """Fractions of the sheet's diagonal."""
    anchor_turn: tuple = (0.0, 0.6)
    max_forces: int = 3
    force: tuple = (1.0, 5.0)
    gravity: tuple = (0.0, 9.8)
    stiffness: float = 200.0
    bending_stiffness: tuple = (10.0, 200.0)
    """In Blender's units, uniform in its logarithm."""
    most_stretch: tuple = (0.01, 0.03)
    most_stretch_of_solids: tuple = (0.02, 0.10)
    """Relative change of the edges' lengths, median and 95th percentile: what stretches more is drawn again."""
    least_vertices: float = 0.4
    """In the image."""
    least_distance_mm: float = 60.0
    least_pixels: int = 1500
    """Of the front, before occluders."""
    max_view_angle: float = math.radians(75)
    """Between the sheet's axis and the ray to its centroid."""


PAPER = Protocol()

FINER = 3
"""Parts of a side of the cloth's cells, as the sheet is rendered."""

SHARD_SIZE = 500
ENTRIES = ("rgb.png", "depth.png", "uv.png", "json")


class Template(NamedTuple):
    """The mesh `deepsft` makes of a template, mm, x right, y down, the front at -z, and its texture's file."""

    size: Array
    vertices: Array
    uv: Array
    faces: Array
    picture: Path
    is_sheet: bool

    def sha256(self) -> str:
        pixels, (width, height) = pixels_of(self.picture)
        picture = fingerprint([width, height, hashlib.sha256(pixels.tobytes()).hexdigest()])
        return fingerprint([self.vertices.tolist(), self.uv.tolist(), self.faces.tolist(), picture])


class Shape(NamedTuple):
    """A deformed object, mm: the surface that is rendered, and the template's own vertices."""

    points: Array
    uv: Array
    triangles: Array
    vertices: Array


def compact(value) -> str:
    """JSON without spaces, in which floats look as serde_json writes them."""
    if isinstance(value, list):
        return f"[{','.join(map(compact, value))}]"
    if isinstance(value, float) and "e-" in repr(value):
        digits, exponent = repr(value).split("e")
        decimals = 4 + len(digits.strip("-").replace(".", ""))
        return f"{value:.{decimals}f}" if exponent == "-05" else f"{digits}e{int(exponent)}"
    return json.dumps(value, separators=(",", ":"))


def fingerprint(value) -> str:
    return hashlib.sha256(compact(value).encode()).hexdigest()


def pixels_of(picture: Path) -> tuple[Array, tuple[int, int]]:
    """The 8-bit colours of a picture, from its top left corner, and its size."""
    image = bpy.data.images.load(str(picture))
    width, height = image.size
    values = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(values)
    bpy.data.images.remove(image)
    return np.round(255 * values.reshape(height, width, -1)[::-1, :, :3]).astype(np.uint8), (width, height)


def read_json(file: Path) -> dict:
    try:
        return json.loads(file.read_bytes())
    except (OSError, ValueError) as error:
        raise SystemExit(f"{file}: {error}")


def read_template(folder: Path) -> Template:
    about = read_json(folder / "template.json")
    picture = (folder / about["texture"]).absolute()
    if "mesh" in about:
        return mesh_template(folder / about["mesh"], picture)
    return sheet_template(np.array([about["width_mm"], about["height_mm"]], float), picture)


def sheet_template(size: Array, picture: Path) -> Template:
    columns, rows = (min(max(math.ceil(side * 36 / np.hypot(*size)), 2), 64) for side in size)
    u, v = np.meshgrid(np.arange(columns + 1) / columns, np.arange(rows + 1) / rows)
    uv = np.stack([u, v], -1).reshape(-1, 2)
    vertices = np.column_stack([(uv - 0.5) * size, np.zeros(len(uv))])
    i, j = (index.ravel() for index in np.meshgrid(np.arange(columns), np.arange(rows)))
    a = j * (columns + 1) + i
    b, c, d = a + 1, a + columns + 1, a + columns + 2
    even, odd = np.stack([a, c, d, a, d, b], 1), np.stack([a, c, b, b, c, d], 1)
    triangles = np.where(((i + j) % 2 == 0)[:, None], even, odd).reshape(-1, 3)
    return Template(size, vertices, uv, triangles, picture, True)


def mesh_template(file: Path, picture: Path) -> Template:
    lines = [line.split() for line in file.read_text().splitlines()]
    vertices = np.array([line[1:] for line in lines if line[:1] == ["v"]], float) * [1, -1, -1]
    uv = np.array([line[1:] for line in lines if line[:1] == ["vt"]], float)
    uv = np.clip(np.column_stack([uv[:, 0], 1 - uv[:, 1]]), 0, 1)
    triangles = np.array([[corner.split("/")[0] for corner in line[1:]] for line in lines if line[:1] == ["f"]], int) - 1
    return Template(texture_scale(vertices, uv, triangles), vertices, uv, triangles, picture, False)


def texture_scale(vertices: Array, uv: Array, triangles: Array) -> Array:
    """Medians over the surface of the millimetres that a difference of 1 in u and in v covers."""
    (a, b, c), (p, q, r) = np.moveaxis(vertices[triangles], 1, 0), np.moveaxis(uv[triangles], 1, 0)
    e, f, s, t = b - a, c - a, (q - p)[:, :, None], (r - p)[:, :, None]
    area = s[:, 0] * t[:, 1] - s[:, 1] * t[:, 0]
    sides = (e * t[:, 1] - f * s[:, 1]) / area, (f * s[:, 0] - e * t[:, 0]) / area, np.cross(e, f)
    scales = np.stack([np.sqrt(x * x + y * y + z * z) for x, y, z in (side.T for side in sides)], 1)[area[:, 0] != 0]
    medians = []
    for axis in (0, 1):
        scales = scales[np.argsort(scales[:, axis], kind="stable")]
        below = np.cumsum(scales[:, 2])
        medians.append(scales[np.searchsorted(below, below[-1] / 2), axis])
    return np.array(medians)


def between(fractions: Array, count: int) -> Array:
    """Weights of `count` equidistant points at fractions of their line: Catmull-Rom, straight beyond the ends."""
    place = fractions * (count - 1)
    cell = np.minimum(place.astype(int), count - 2)
    t = (place - cell)[:, None]
    four = np.hstack([-t + 2 * t**2 - t**3, 2 - 5 * t**2 + 3 * t**3, t + 4 * t**2 - 3 * t**3, t**3 - t**2]) / 2
    extended = np.zeros((len(place), count + 2))
    np.put_along_axis(extended, cell[:, None] + np.arange(4), four, 1)
    weights = extended[:, 1:-1]
    weights[:, :2] += extended[:, :1] * [2, -1]
    weights[:, -2:] += extended[:, -1:] * [-1, 2]
    return weights


def direction(dice: np.random.Generator) -> Array:
    way = dice.normal(size=3)
    return way / np.linalg.norm(way)


class Anchor(NamedTuple):
    """A part of the sheet that is held: its centre, its vertices, its way and its turn (Blender's frame)."""

    centre: Array
    held: Array
    way: Array
    turn: Quaternion


def draw_anchors(flat: Array, size: Array, dice: np.random.Generator) -> list[Anchor]:
    """Parts apart from each other at corners, sides and inside, which end no farther apart than on the flat sheet."""
    diagonal, anchors = np.hypot(*size), []
    for _ in range(dice.integers(1, PAPER.max_anchors + 1)):
        fixed = dice.choice([0, 1, 2], p=[0.2, 0.45, 0.35])  # sides that it lies on
        centre = dice.uniform(-0.5, 0.5, 3)
        centre[dice.permutation(2)[:fixed]] = dice.choice([-0.5, 0.5], fixed)
        centre *= [*size, 0]
        held = np.flatnonzero(np.linalg.norm(flat - centre, axis=-1) <= dice.uniform(*PAPER.anchor_radius) * diagonal)
        way = direction(dice) * dice.uniform(*PAPER.anchor_shift) * diagonal
        turn = Quaternion(Vector(direction(dice)), dice.uniform(*PAPER.anchor_turn))
        if len(held) and all(np.linalg.norm(centre - other.centre) > 0.25 * diagonal for other in anchors):
            anchors.append(Anchor(centre, held, way, turn))
    for _ in range(40):
        for number, one in enumerate(anchors):
            for other in anchors[:number]:
                rest = np.linalg.norm(one.centre - other.centre)
                apart = one.centre + one.way - other.centre - other.way
                length = np.linalg.norm(apart)
                shift = apart * ((np.clip(length, 0.35 * rest, 0.97 * rest) / length - 1) / 2)
                one.way[:], other.way[:] = one.way + shift, other.way - shift
    return anchors


def cloth(size: Array, dice: np.random.Generator) -> Array:
    """A stiff cloth that begins flat, at the end of its simulation, (rows, columns, 3) in mm."""
    fractions = np.linspace(-0.5, 0.5, PAPER.cells + 1)
    flat = np.stack(np.meshgrid(fractions * size[0], fractions * size[1], 0.0), -1).reshape(-1, 3)
    sheet = add_mesh("cloth", flat * CLOTH_SCALE, faces((PAPER.cells + 1, PAPER.cells + 1))[0])
    pinned = sheet.vertex_groups.new(name="pin")
    for anchor in draw_anchors(flat, size, dice):
        hand = add("hand", None)
        hand.rotation_mode, hand.location = "QUATERNION", anchor.centre * CLOTH_SCALE
        bpy.context.view_layer.update()
        hook = sheet.modifiers.new("hand", "HOOK")
        hook.object, hook.matrix_inverse = hand, hand.matrix_world.inverted()
        hook.vertex_indices_set(anchor.held.tolist())
        pinned.add(anchor.held.tolist(), 1.0, "REPLACE")
        moved = (anchor.centre + anchor.way) * CLOTH_SCALE
        for step, place, turn in ((1, hand.location.copy(), Quaternion()), (0.6 * PAPER.steps, moved, anchor.turn)):
            hand.location, hand.rotation_quaternion = place, turn
            hand.keyframe_insert("location", frame=step)
            hand.keyframe_insert("rotation_quaternion", frame=step)
    bpy.context.scene.gravity = direction(dice) * dice.uniform(*PAPER.gravity)
    for _ in range(dice.integers(0, PAPER.max_forces + 1)):
        near = flat[dice.integers(len(flat))] + direction(dice) * dice.uniform(0.1, 0.4) * np.hypot(*size)
        bpy.ops.object.effector_add(type="FORCE", location=near * CLOTH_SCALE)
        field = bpy.context.object.field
        field.strength, field.falloff_power = dice.choice([-1, 1]) * dice.uniform(*PAPER.force), 1.0
    modifier = sheet.modifiers.new("cloth", "CLOTH")
    settings = modifier.settings
    settings.quality, settings.air_damping, settings.vertex_group_mass = 4, 2.0, "pin"
    for kind in ("tension", "compression", "shear"):
        setattr(settings, f"{kind}_stiffness", PAPER.stiffness)
        setattr(settings, f"{kind}_damping", 25.0)
    settings.bending_stiffness = spread(PAPER.bending_stiffness, dice)
    return simulated(sheet, modifier, PAPER.steps).reshape(PAPER.cells + 1, PAPER.cells + 1, 3)


def keeps_lengths(template: Template, vertices: Array) -> bool:
    """Whether the edges of a deformed mesh have about the lengths that they have at rest."""
    edges = np.unique(np.sort(template.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)), axis=0)
    now, rest = (np.linalg.norm(np.diff(points[edges], axis=1), axis=-1) for points in (vertices, template.vertices))
    most = PAPER.most_stretch if template.is_sheet else PAPER.most_stretch_of_solids
    return bool((np.quantile(np.abs(now / rest - 1), [0.5, 0.95]) <= most).all())


def touches_itself(points: Array, cell: float) -> bool:
    """Whether parts of a sheet's grid that are not neighbours are within two cells of each other."""
    every = points[::2, ::2].reshape(-1, 3)
    numbers = np.indices(points[::2, ::2].shape[:2]).reshape(2, -1)
    neighbours = np.abs(numbers[:, :, None] - numbers[:, None]).max(0) <= 2
    squares = (every**2).sum(1)
    distances = squares[:, None] + squares - 2 * every @ every.T
    return bool((distances[~neighbours] < 4 * cell**2).any())


def bent_sheet(template: Template, dice: np.random.Generator) -> Shape | None:
    """A sheet after a simulation; none if it touches itself, which the simulation does not keep it from."""
    points = cloth(template.size, dice)
    if touches_itself(points, template.size.min() / PAPER.cells):
        return None
    fine = np.linspace(0, 1, FINER * PAPER.cells + 1)

    def surface(u: Array, v: Array) -> Array:
        across, down = between(u, PAPER.cells + 1), between(v, PAPER.cells + 1)
        return np.einsum("ri,ijk,cj->rck", down, points, across).reshape(-1, 3)

    uv = np.stack(np.meshgrid(fine, fine), -1).reshape(-1, 2)
    vertices = surface(np.unique(template.uv[:, 0]), np.unique(template.uv[:, 1]))
    return Shape(surface(fine, fine), uv, faces((len(fine), len(fine)))[1], vertices)


def rigged(template: Template, rig: dict, dice: np.random.Generator) -> Shape:
    """A solid with random angles of its rig's joints, any side before the viewer. Blender's bone heat weighs its vertices."""
    points, copies = np.unique(template.vertices, axis=0, return_inverse=True)
    solid = add_mesh("solid", points * CLOTH_SCALE, copies.reshape(-1)[template.faces])
    skeleton = add("rig", bpy.data.armatures.new("rig"))
    bpy.context.view_layer.objects.active = skeleton
    bpy.ops.object.mode_set(mode="EDIT")
    for name, about in rig.items():
        bone = skeleton.data.edit_bones.new(name)
        bone.head, bone.tail = (np.array(about[end]) * CLOTH_SCALE for end in ("head", "tail"))
        bone.parent = skeleton.data.edit_bones.get(about.get("parent", ""))
    bpy.ops.object.mode_set(mode="OBJECT")
    solid.select_set(True)
    skeleton.select_set(True)
    bpy.ops.object.parent_set(type="ARMATURE_AUTO")
    for name, about in rig.items():
        joint, most = skeleton.pose.bones[name], math.radians(about["bend_deg"])
        joint.rotation_mode, joint.rotation_euler = "XYZ", dice.uniform(-most, most, 3)
    vertices = evaluated(solid)[copies.reshape(-1)] @ rotation(np.array([0, dice.uniform(0, 2 * math.pi), 0])).T
    return Shape(vertices, template.uv, template.faces, vertices)


def deformed(template: Template, rig: dict, dice: np.random.Generator) -> Shape | None:
    """A random shape, template frame; none if its lengths differ too much from those at rest."""
    shape = bent_sheet(template, dice) if template.is_sheet else rigged(template, rig, dice)
    return shape if shape and keeps_lengths(template, shape.vertices) else None


def rotation(angles: Array) -> Array:
    """The rotation about x after that about y after that about z."""
    (cx, cy, cz), (sx, sy, sz) = np.cos(angles), np.sin(angles)
    about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    return about_x @ about_y @ np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])


def projected(points: Array) -> Array:
    return CAMERA["fx"] * points[..., :2] / points[..., 2:] + CENTRE


def posed(shape: Shape, dice: np.random.Generator) -> Shape | None:
    """Turns and moves an object before the camera until enough of it is in view; none if that fails."""
    centroid = shape.vertices.mean(0)
    for _ in range(64):
        turn = rotation(dice.uniform(-PAPER.max_rotation, PAPER.max_rotation, 3))
        place = np.array([*dice.uniform(-PAPER.max_shift_mm, PAPER.max_shift_mm, 2), dice.uniform(*PAPER.depth_mm)])
        points, vertices = ((part - centroid) @ turn.T + place for part in (shape.points, shape.vertices))
        cosine = turn[:, 2] @ place / np.linalg.norm(place)
        if vertices[:, 2].min() < PAPER.least_distance_mm or cosine < math.cos(PAPER.max_view_angle):
            continue
        pixels = projected(vertices)
        if ((pixels >= 0) & (pixels <= IMAGE)).all(-1).mean() >= PAPER.least_vertices:
            return shape._replace(points=points, vertices=vertices)
    return None


def cast(shape: Shape) -> tuple[Array, Array]:
    """Depth, mm (0 where the front is not seen), and registration at the centres of the pixels."""
    pixels = projected(shape.points)
    low = np.clip(np.floor(pixels.min(0)), 0, IMAGE).astype(int)
    high = np.clip(np.ceil(pixels.max(0)), 0, IMAGE).astype(int)
    x, y = (axis.ravel() for axis in np.meshgrid(np.arange(low[0], high[0]), np.arange(low[1], high[1])))
    rays = np.column_stack([(np.column_stack([x, y]) + 0.5 - CENTRE) / CAMERA["fx"], np.ones(len(x))])
    tree, origin = BVHTree.FromPolygons(shape.points.tolist(), shape.triangles.tolist()), Vector((0, 0, 0))
    hits = (tree.ray_cast(origin, Vector(ray))[2] for ray in rays.tolist())
    hit = np.array([-1 if face is None else face for face in hits], int)
    x, y, rays, triangles = x[hit >= 0], y[hit >= 0], rays[hit >= 0], shape.triangles[hit[hit >= 0]]
    # Weights w of the corners and depth z: sum of w p = z ray and sum of w = 1.
    corners = shape.points[triangles]
    weights = np.linalg.solve(corners.transpose(0, 2, 1), rays[:, :, None])[:, :, 0]
    z = 1 / weights.sum(1)
    uv = np.einsum("ni,nij->nj", weights * z[:, None], shape.uv[triangles])
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    front = np.einsum("ni,ni->n", normal, rays) < 0
    depth, registration = np.zeros(IMAGE[::-1]), np.zeros((*IMAGE[::-1], 2))
    depth[y[front], x[front]] = z[front]
    registration[y[front], x[front]] = np.clip(uv[front], 0, 1)
    return depth, registration


def add_object(shape: Shape, picture: Path, dice: np.random.Generator) -> None:
    thing = add_mesh("object", blender(shape.points), shape.triangles)
    lay_texture(thing.data, shape.uv, shape.triangles)
    looks = bpy.data.materials.new("print")
    front = surface_of(looks, dice.uniform(*PAPER.roughness), dice.uniform(*PAPER.specular))
    textured(looks, front, bpy.data.images.load(str(picture)))
    with_white_back(looks, front)
    thing.data.materials.append(looks)


def add_light(dice: np.random.Generator) -> Array:
    """The distant light, and no other; returns the unit vector towards it."""
    bpy.context.scene.world = None
    angle, around = dice.uniform(0, PAPER.max_light_angle), dice.uniform(0, 2 * math.pi)
    way = np.array([math.sin(angle) * math.cos(around), math.sin(angle) * math.sin(around), -math.cos(angle)])
    lamp = bpy.data.lights.new("light", "SUN")
    lamp.energy, lamp.angle = PAPER.white * math.pi, 0.0
    shine(lamp, way)
    return way


def add_background(photographs: list[Path], dice: np.random.Generator) -> None:
    """A photograph as it is, its middle as large as fills the image, or else a pattern; it shines on nothing."""
    distance, margin = 2500.0, 1.1
    corners = (np.array([[-1, -1], [-1, 1], [1, 1], [1, -1]]) * margin + 1) / 2
    points = np.column_stack([(corners * IMAGE - CENTRE) / CAMERA["fx"], np.ones(4)]) * distance
    wall = add_mesh("background", blender(points), np.array([[0, 1, 2, 3]]))
    if photographs:
        looks, picture = bpy.data.materials.new("photograph"), bpy.data.images.load(str(dice.choice(photographs)))
        surface_of(looks)
    else:
        looks, picture = patterned(dice, spread((2, 30), dice)), None
    nodes, links = looks.node_tree.nodes, looks.node_tree.links
    glow = nodes.new("ShaderNodeEmission")
    links.new(glow.outputs[0], output_of(looks).inputs["Surface"])
    if picture:
        share = IMAGE / np.array(picture.size)
        share /= share.max()
        lay_texture(wall.data, (corners - 0.5) * share + 0.5, np.array([0, 1, 2, 3]))
        textured(looks, glow, picture)
    else:
        links.new(next(node for node in nodes if node.type == "VALTORGB").outputs[0], glow.inputs[0])
    wall.data.materials.append(looks)
    wall.visible_diffuse = wall.visible_glossy = wall.visible_shadow = False


def add_discs(light: Array, depth: Array, dice: np.random.Generator) -> None:
    """Paints discs of one colour, whose outlines blend over a pixel; what they cover is no longer the object's."""
    y, x = np.indices(depth.shape) + 0.5
    for _ in range(dice.integers(0, PAPER.max_discs + 1)):
        centre, radius = dice.uniform(0, IMAGE), dice.uniform(*PAPER.disc_px) / 2
        inside = radius - np.hypot(x - centre[0], y - centre[1])
        alpha = np.clip(inside + 0.5, 0, 1)[..., None]
        light[:] = light * (1 - alpha) + dice.uniform(0, 1, 3) ** 2 * alpha
        depth[inside >= 0] = 0


def sample(folder: Path, index: int, template: Template, rig: dict, photographs: list[Path], options) -> None:
    """Renders a sample into `folder`; its JSON entry comes last."""
    for attempt in range(100):
        dice = np.random.default_rng([options.seed, index, attempt])
        bpy.ops.wm.read_factory_settings(use_empty=True)
        shape = deformed(template, rig, dice)
        shape = shape and posed(shape, dice)
        depth, uv = cast(shape) if shape else (np.zeros(0), None)
        if (depth > 0).sum() >= PAPER.least_pixels:
            break
    else:
        raise SystemExit(f"{folder}: no shape and pose show enough of the object")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    add_object(shape, template.picture, dice)
    add_background(photographs, dice)
    way = add_light(dice)
    add_camera(CAMERA["fx"] / max(IMAGE))
    folder.mkdir(parents=True, exist_ok=True)
    light = rendered(CAMERA, options, index, folder / "light.exr").copy()
    add_discs(light, depth, dice)
    seen = depth > 0
    maps = np.dstack([np.round(uv * 65535 * seen[..., None]), 65535 * seen]).astype(np.uint16)
    put(folder / ENTRIES[0], png(srgb(light * dice.uniform(*PAPER.gain))))
    put(folder / ENTRIES[1], png(np.round(10 * depth).astype(np.uint16)))
    put(folder / ENTRIES[2], png(maps))
    about = {"seed": options.seed, "index": index, "has_template": bool(seen.any()), "camera": CAMERA}
    about |= {"towards_light": way.tolist(), "vertices_camera": shape.vertices.tolist()}
    put(folder / ENTRIES[3], json.dumps(about).encode())


def shard(folders: list[Path]) -> bytes:
    """The tar file of samples. Nothing of the machine or the moment goes into it."""
    content = io.BytesIO()
    with tarfile.open(fileobj=content, mode="w", format=tarfile.USTAR_FORMAT) as archive:
        for number, folder in enumerate(folders):
            for ending in ENTRIES:
                entry, file = tarfile.TarInfo(f"{number:06}.{ending}"), (folder / ending).read_bytes()
                entry.size = len(file)
                archive.addfile(entry, io.BytesIO(file))
    return content.getvalue()


def pack(folders: list[Path], about: dict, out: Path) -> None:
    """Packs samples into shards and describes them."""
    names, sizes, hashes = [], [], []
    for first in range(0, len(folders), SHARD_SIZE):
        content = shard(folders[first : first + SHARD_SIZE])
        names.append(f"shard-{len(names):06}.tar")
        sizes.append(len(content))
        hashes.append(hashlib.sha256(content).hexdigest())
        put(out / names[-1], content)
    about = about | {"first": int(folders[0].name), "samples": len(folders)}
    about |= {"shards": names, "shard_bytes": sizes, "shard_sha256": hashes}
    put(out / "dataset.json", json.dumps(about, indent=2).encode())


def description(template: Template, rig: dict, photographs: list[Path], options) -> dict:
    """What `dataset.json` says of every sample."""
    settings = PAPER._asdict() | {"camera": CAMERA, "rig": rig}
    settings |= {"blender": bpy.app.version_string, "samples": options.samples}
    sha256, hashes = template.sha256(), [hashlib.sha256(file.read_bytes()).hexdigest() for file in photographs]
    return {
        "format_version": 1, "seed": options.seed, "first": 0,
        "template_size_mm": template.size.tolist(), "template_sha256": sha256,
        "depth_unit_mm": float(np.float32(0.1)), "uv_one": 65535,
        "configuration_fingerprint": fingerprint(settings), "configuration": settings,
        "fingerprint": fingerprint([settings, sha256, hashes]),
    }  # fmt: skip


def check_description(file: Path, about: dict) -> None:
    """Writes down of what the samples beside the file are, or checks that they are of the same."""
    text = json.dumps(about, indent=2)
    if not file.exists():
        file.parent.mkdir(parents=True, exist_ok=True)
        put(file, text.encode())
    elif file.read_text() != text:
        raise SystemExit(f"{file}: the samples there have another seed, template or setting: give another --out")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("template", type=Path, help="folder of a template")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--count", type=int, required=True)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--first", type=int, default=0, help="number of the first sample")
    parser.add_argument("--rig", type=Path, help="rig of an object with a volume (JSON)")
    parser.add_argument("--backgrounds", type=Path, help="folder of photographs (PNG or JPEG); else patterns")
    parser.add_argument("--samples", type=int, default=16, help="light paths of a pixel")
    parser.add_argument("--threads", type=int, default=1)
    options = parser.parse_args()
    if options.count < 1 or options.first < 0:
        parser.error("--count must be at least 1 and --first at least 0")
    template = read_template(options.template)
    if template.is_sheet == bool(options.rig):
        raise SystemExit(f"{options.template}: a sheet takes no --rig, and any other object needs one")
    rig = read_json(options.rig) if options.rig else {}
    files = sorted(options.backgrounds.iterdir()) if options.backgrounds else []
    photographs = [file.absolute() for file in files if file.suffix.lower() in (".png", ".jpg", ".jpeg")]
    if options.backgrounds and not photographs:
        raise SystemExit(f"{options.backgrounds}: it has no PNG or JPEG file")
    about = description(template, rig, photographs, options)
    samples = options.out.absolute() / "samples"
    check_description(samples / "settings.json", about)
    folders = [samples / f"{options.first + number:06}" for number in range(options.count)]
    missing = [(folder.name, folder) for folder in folders if not (folder / "json").exists()]
    for name, folder in reported(missing):
        sample(folder, int(name), template, rig, photographs, options)
    pack(folders, about, options.out.absolute())


if __name__ == "__main__":
    main()
