"""Renders prints on bent sheets in scenes of its own, with the exact truth beside each image: an independent judge of the fit.

    python3.11 -m venv ENV && ENV/bin/pip install bpy "numpy<2"
    ENV/bin/python render_sheets.py PICTURES --out DIR

PICTURES are PNG or JPEG files and folders of them; DIR/prints gets copies. Every frame is a folder DIR/NAME-K:

    image.png    the image, with noise, and with depth of field in some frames
    camera.json  the camera; the image's corner is (0, 0)
    surface.npy  f32 [rows, columns, 3]: vertices of a regular grid on the print in the camera's frame (x right, y down,
                 z forward), mm; the first is the print's top left corner, (u, v) = (0, 0), the last its bottom right one
    visible.png  255 where the centre of a pixel sees the printed front, cast as a ray through a pinhole
    frame.json   print, size, material, light, shape and what else was drawn by lot; it comes last

Frames that are there are kept. `deepsft-lab study blender DIR` measures the fit on them."""

import argparse
import json
import math
import zlib
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix, Vector

from rendering import CLOTH_SCALE, Array, add_camera, add_mesh, blender, faces, lay_texture, patterned, png, put
from rendering import rendered, reported, shine, simulated, spread, srgb, surface_of, textured, with_white_back

SHAPES = ("cylinder", "cone", "s", "crumple", "cloth")
LIGHTS = ("sun", "area", "two-lamps", "hard-lamp")
MATERIALS = {  # roughness, specular level, coat, how far it bends
    "matt": (0.9, 0.3, 0.0, 1.0),
    "glossy": (0.3, 0.5, 0.7, 1.0),
    "card": (0.6, 0.4, 0.0, 0.5),
    "cloth": (1.0, 0.1, 0.0, 1.0),
}
FOCAL = 0.79
"""Focal length as a fraction of the image's long side."""

CELLS = 96
"""Cells of the grid along the print's long side."""

LONG_SIDE_MM, DISTANCE_MM, MAX_TILT_DEG = (160.0, 400.0), (300.0, 1200.0), 60.0
LEAST_AREA, LEAST_SEEN = 0.05, 0.45
"""Of the image's area; of the print's cells."""


def flat_sheet(size: Array, margin: int) -> Array:
    """The flat sheet, (rows, columns, 2) in mm around the print's centre; `margin` cells go around the print."""
    cells = [max(2, round(CELLS * side / size.max())) for side in size]
    x, y = ((np.arange(-margin, n + margin + 1) / n - 0.5) * side for n, side in zip(cells, size))
    return np.stack(np.meshgrid(x, y), -1)


def stretched(flat: Array, size: Array, dice: np.random.Generator) -> Array:
    """Cloth gives way in its plane: it shears and stretches by some per cent, differently from place to place. Its area
    stays, as no image tells a sheet that is larger from one that is nearer."""
    stretch = np.eye(2) + dice.uniform(-0.03, 0.03, (2, 2))
    flat = flat @ (stretch / math.sqrt(np.linalg.det(stretch)))
    waves = np.sin(flat @ (dice.uniform(-5.0, 5.0, (2, 2)) / size.max()) + dice.uniform(0, 6.28, 2))
    return flat + 0.004 * size.max() * waves


def rolled(flat: Array, way: float, slope) -> Array:
    """Bends a sheet along the direction `way`; `slope` gives the slope's angle at the fraction of the way (-0.5 to 0.5)."""
    axis, across = np.array([math.cos(way), math.sin(way)]), np.array([-math.sin(way), math.cos(way)])
    along = flat @ axis
    t = np.linspace(along.min(), along.max(), 4001)
    angle = slope((t - t[0]) / (t[-1] - t[0]) - 0.5)
    steps = np.stack([np.cos(angle), np.sin(angle)])
    path = np.concatenate([np.zeros((2, 1)), np.cumsum((steps[:, 1:] + steps[:, :-1]) / 2, 1) * (t[1] - t[0])], 1)
    forward, height = (np.interp(along, t, p) for p in path)
    return np.dstack([forward[..., None] * axis + (flat @ across)[..., None] * across, height])


def cone(flat: Array, size: Array, bend: float, dice: np.random.Generator) -> Array:
    """Lays a sheet on a cone whose apex is outside of it: also without any change of lengths."""
    way, sign = dice.uniform(0, 2 * math.pi), dice.choice([-1, 1])
    middle, side = np.array([math.cos(way), math.sin(way)]), np.array([-math.sin(way), math.cos(way)])
    from_apex = flat + middle * dice.uniform(0.8, 1.6) * np.hypot(*size)
    radius, angle = np.hypot(*np.moveaxis(from_apex, -1, 0)), np.arctan2(from_apex @ side, from_apex @ middle)
    sine = min(0.95, np.ptp(angle) / bend)
    turned = angle / sine
    along = sine**2 * np.cos(turned) + 1 - sine**2
    height = sign * sine * math.sqrt(1 - sine**2) * (np.cos(turned) - 1)
    plane = along[..., None] * middle + (sine * np.sin(turned))[..., None] * side
    return radius[..., None] * np.dstack([plane, height])


def crumpled(points: Array, bend: float, dice: np.random.Generator) -> Array:
    """Mirrors what is beyond some planes: dents with curved creases, again without any change of lengths."""
    points = points - points.mean((0, 1))
    for _ in range(dice.integers(5, 10)):
        normal = np.append(dice.uniform(-0.3, 0.3, 2) * bend, dice.choice([-1, 1]))
        normal /= np.linalg.norm(normal)
        height = points @ normal
        beyond = np.maximum(height - np.quantile(height, dice.uniform(0.6, 0.9)), 0)
        points = points - 2 * beyond[..., None] * normal
    return points


def hanging(flat: Array, size: Array, bend: float, dice: np.random.Generator) -> Array:
    """A simulated cloth that hangs at two or three of its corners."""
    start = rolled(flat, 0.0, lambda t: 1.4 * bend * t) * CLOTH_SCALE
    quads, _ = faces(flat.shape)
    sheet = add_mesh("hanging", start, quads)
    corners = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5]])[: dice.integers(2, 4)] * size
    pinned = (np.linalg.norm(flat[..., None, :] - corners, axis=-1) < 0.08 * size.max()).any(-1)
    sheet.vertex_groups.new(name="pin").add(np.flatnonzero(pinned).tolist(), 1.0, "REPLACE")
    scene = bpy.context.scene
    scene.gravity = (dice.uniform(-3, 3), -9.8, dice.uniform(-8, 8))
    modifier = sheet.modifiers.new("cloth", "CLOTH")
    settings = modifier.settings
    settings.quality, settings.air_damping, settings.vertex_group_mass = 5, 3.0, "pin"
    settings.mass = spread((0.1, 0.4), dice)
    settings.tension_stiffness = settings.compression_stiffness = settings.shear_stiffness = 80.0
    settings.bending_stiffness = spread((0.05, 0.5), dice) / bend**2
    points = simulated(sheet, modifier, 40)
    bpy.data.objects.remove(sheet)
    return points.reshape(start.shape)


def bent(shape: str, flat: Array, size: Array, bend: float, dice: np.random.Generator) -> Array:
    """The sheet in space, (rows, columns, 3), with z away from whoever looks at its front."""
    way, sign = dice.uniform(0, 2 * math.pi), dice.choice([-1, 1])
    angle = sign * bend * dice.uniform(0.6, 2.2)
    if shape == "cylinder":
        return rolled(flat, way, lambda t: angle * t)
    if shape == "s":
        phase = dice.uniform(0, 6.28)
        return rolled(flat, way, lambda t: 0.4 * angle * np.sin(2 * math.pi * t + phase))
    if shape == "cone":
        return cone(flat, size, abs(angle) + 0.1, dice)
    if shape == "crumple":
        return crumpled(rolled(flat, way, lambda t: 0.5 * angle * t), bend, dice)
    return hanging(flat, size, bend, dice)


def normals(points: Array) -> Array:
    """Normals of the front at the grid's cells, as long as the cells are large."""
    return np.cross((points[1:] - points[:-1])[:, 1:], (points[:, 1:] - points[:, :-1])[1:])


def placed(points: Array, camera: dict, dice: np.random.Generator):
    """Turns and moves the sheet until enough of its front is in the image; with distance and tilt. None if that fails."""
    size, centre = np.array([camera["width"], camera["height"]]), np.array([camera["cx"], camera["cy"]])
    facing = Vector(normals(points).sum((0, 1))).rotation_difference(Vector((0, 0, -1))).to_matrix()
    for _ in range(500):
        distance, tilt, way = spread(DISTANCE_MM, dice), dice.uniform(0, MAX_TILT_DEG), dice.uniform(0, 6.28)
        tilted = Matrix.Rotation(math.radians(tilt), 3, (math.cos(way), math.sin(way), 0))
        turn = tilted @ Matrix.Rotation(dice.uniform(0, 6.28), 3, "Z") @ facing
        ray = np.append((dice.uniform(0.25, 0.75, 2) * size - centre) / camera["fx"], 1.0)
        moved = (points - points.mean((0, 1))) @ np.array(turn).T + distance * ray
        if moved[..., 2].min() < 150:
            continue
        pixels = camera["fx"] * moved[..., :2] / moved[..., 2:] + centre
        inside = ((pixels > 0) & (pixels < size)).all(-1)
        area = np.cross(pixels[1:, 1:] - pixels[:-1, :-1], pixels[1:, :-1] - pixels[:-1, 1:]) / 2
        seen = (area > 0) & inside[1:, 1:] & inside[:-1, :-1]
        if inside.mean() > 0.75 and seen.mean() > 0.6 and area[seen].sum() > LEAST_AREA * size.prod():
            return moved, distance, tilt
    return None


def add_primitive(kind: str, size: tuple, position: Array, axis: Array, looks) -> bpy.types.Object:
    """A cube, ball, tube or cone of `size` (mm, the last along `axis`) at `position`, both in our frame."""
    primitives = bpy.ops.mesh
    if kind == "ball":
        primitives.primitive_uv_sphere_add(radius=0.5, segments=48, ring_count=24)
    elif kind == "tube":
        primitives.primitive_cylinder_add(radius=0.5, depth=1, vertices=48)
    elif kind == "cone":
        primitives.primitive_cone_add(radius1=0.5, depth=1, vertices=48)
    else:
        primitives.primitive_cube_add(size=1)
    thing = bpy.context.object
    thing.scale = np.array(size) * 0.001
    bpy.ops.object.transform_apply(location=False, rotation=False, scale=True)
    thing.location = blender(position)
    thing.rotation_euler = Vector(blender(axis)).to_track_quat("Z", "Y").to_euler()
    thing.data.materials.append(looks)
    if kind == "ball":
        thing.data.polygons.foreach_set("use_smooth", np.ones(len(thing.data.polygons), bool))
    return thing


def printed(material: str, picture) -> list[bpy.types.Material]:
    """The print and the white around it. The back of both is white."""
    roughness, specular, coat, _ = MATERIALS[material]
    both = []
    for name in ("print", "margin"):
        looks = bpy.data.materials.new(name)
        front = surface_of(looks, roughness, specular, coat)
        nodes, links = looks.node_tree.nodes, looks.node_tree.links
        if name == "print":
            textured(looks, front, picture)
        if material == "cloth":
            place, weave, bump = (nodes.new("ShaderNode" + kind) for kind in ("TexCoord", "TexNoise", "Bump"))
            weave.inputs["Scale"].default_value, bump.inputs["Strength"].default_value = 400, 0.15
            links.new(place.outputs["UV"], weave.inputs["Vector"])
            links.new(weave.outputs[0], bump.inputs["Height"])
            links.new(bump.outputs["Normal"], front.inputs["Normal"])
        with_white_back(looks, front)
        both.append(looks)
    return both


def add_sheet(points: Array, margin: int, material: str, picture) -> bpy.types.Object:
    rows, columns = points.shape[:2]
    _, triangles = faces(points.shape)
    sheet = add_mesh("sheet", blender(points), triangles)
    for looks in printed(material, picture):
        sheet.data.materials.append(looks)
    sheet.data.polygons.foreach_set("material_index", np.repeat(~on_print(points.shape, margin), 2).astype(np.int32))
    u, v = ((np.arange(n) - margin) / (n - 1 - 2 * margin) for n in (columns, rows))
    lay_texture(sheet.data, np.stack(np.meshgrid(u, v), -1).reshape(-1, 2), triangles)
    return sheet


def on_print(shape: tuple, margin: int) -> Array:
    """Which cells of the grid are not of the white margin."""
    cells = np.zeros((shape[0] - 1, shape[1] - 1), bool)
    cells[margin : shape[0] - 1 - margin, margin : shape[1] - 1 - margin] = True
    return cells.ravel()


def add_background(points: Array, dice: np.random.Generator) -> tuple[str, Array, float]:
    """A table under the sheet or a wall behind it, with objects; its normal and its distance from the camera."""
    front = normals(points).sum((0, 1))
    is_table = dice.random() < 0.6
    normal = front / np.linalg.norm(front) if is_table else np.array([0, 0, -1.0])
    normal = normal + dice.uniform(-1, 1, 3) * (0.15 if is_table else 0.4)
    gap = dice.uniform(1, 15) if is_table else dice.uniform(30, 500)
    for normal in (normal / np.linalg.norm(normal), np.array([0, 0, -1.0])):
        offset = gap - (points @ normal).min()
        if offset > 150:
            break
    centre = points.mean((0, 1))
    foot = centre - (centre @ normal + offset) * normal
    add_primitive("cube", (8000, 8000, 1), foot - 0.6 * normal, normal, patterned(dice, spread((3, 60), dice)))
    aside = np.cross(normal, [0, 1, 0.1])
    reach = np.linalg.norm(points - centre, axis=-1).max()
    for _ in range(dice.integers(2, 8)):
        size, angle = dice.uniform(30, 130, 3), dice.uniform(0, 6.28)
        way = Matrix.Rotation(angle, 3, Vector(normal)) @ Vector(aside).normalized()
        at = foot + np.array(way) * (reach * dice.uniform(0.9, 1.8) + size.max() / 2) + normal * size[2] / 2
        if at[2] > 200:
            kind = str(dice.choice(["cube", "ball", "tube", "cone"]))
            add_primitive(kind, size, at, normal, patterned(dice, spread((10, 100), dice)))
    return "table" if is_table else "wall", normal, offset


def add_occluder(points: Array, dice: np.random.Generator) -> str:
    """A finger, a pen or a ball just in front of some place of the sheet."""
    kind, across = str(dice.choice(["finger", "pen", "ball"])), dice.uniform(18, 60)
    sizes = {"finger": (17, 17, 110), "pen": (9, 9, 150), "ball": (across, across, across)}
    target = points[dice.integers(points.shape[0]), dice.integers(points.shape[1])]
    at = target * (1 - (dice.uniform(5, 30) + sizes[kind][0] / 2) / np.linalg.norm(target))
    looks = bpy.data.materials.new(kind)
    surface_of(looks, 0.5, 0.4, color=(0.75, 0.45, 0.33) if kind == "finger" else dice.uniform(0.02, 0.8, 3))
    axis = np.append(dice.normal(size=2), 0.3 * dice.normal())
    add_primitive("tube" if kind == "pen" else "ball", sizes[kind], at, axis, looks)
    return kind


def add_lights(light: str, points: Array, normal: Array, offset: float, dice: np.random.Generator) -> bool:
    """The lamps, some 3 W / m2 at the sheet, and the sky. Whether a bar throws a shadow on the sheet."""
    world = bpy.context.scene.world = bpy.data.worlds.new("sky")
    if not world.node_tree:
        world.use_nodes = True
    sky = next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")
    sky.inputs["Color"].default_value = (*dice.uniform(0.8, 1, 3), 1)
    sky.inputs["Strength"].default_value = dice.uniform(0.1, 0.4)
    centre, front = points.mean((0, 1)), normals(points).sum((0, 1))
    front, way = front / np.linalg.norm(front), np.zeros(3)
    has_bar = light in ("hard-lamp", "sun") and dice.random() < 0.5
    for number in range(2 if light == "two-lamps" else 1):
        distance = dice.uniform(700, 1500)
        for _ in range(100):
            way = front + 1.2 * dice.normal(size=3) / math.sqrt(3)
            way /= np.linalg.norm(way)
            if way @ front > 0.4 and (centre + distance * way) @ normal + offset > 100:
                break
        kind = {"sun": "SUN", "hard-lamp": "POINT"}.get(light, "AREA")
        lamp = bpy.data.lights.new(light, kind)
        metres = distance / 1000
        if kind == "SUN":
            lamp.energy, lamp.angle = 3.0, dice.uniform(0.005, 0.05)
        elif kind == "POINT":
            lamp.energy, lamp.shadow_soft_size = 3.0 * 4 * math.pi * metres**2, 0.002
        else:
            lamp.energy, lamp.size = 3.0 * math.pi * metres**2, 0.12 if light == "two-lamps" else dice.uniform(0.4, 1)
        if light == "two-lamps":
            lamp.color = ((1, 0.55, 0.25), (0.3, 0.55, 1))[number]
        shine(lamp, way).location = blender(centre + distance * way)
    if has_bar:
        target = points[dice.integers(points.shape[0]), dice.integers(points.shape[1])]
        looks = bpy.data.materials.new("bar")
        surface_of(looks)
        along = np.cross(way, dice.normal(size=3))
        bar = add_primitive("cube", (25, 5, 500), target + dice.uniform(120, 300) * way, along, looks)
        bar.visible_camera = False
        bar.hide_viewport = True  # No ray of the mask hits it.
    return has_bar


def add_lens(distance: float, dice: np.random.Generator) -> float | None:
    """The camera in the origin; returns the f-number of a lens with depth of field."""
    data, f_number = add_camera(FOCAL), None
    if dice.random() < 0.3:
        f_number = round(spread((1.4, 5.6), dice), 1)
        data.dof.use_dof, data.dof.aperture_fstop = True, f_number
        data.dof.focus_distance = distance / 1000 * dice.uniform(0.9, 1.1)
    return f_number


def seen_cells(sheet: bpy.types.Object, points: Array, camera: dict) -> Array:
    """The cell of the sheet whose front each pixel's centre sees, -1 elsewhere."""
    bpy.context.view_layer.update()
    scene, graph = bpy.context.scene, bpy.context.evaluated_depsgraph_get()
    width, height, focal = camera["width"], camera["height"], camera["fx"]
    corners = points.reshape(-1, 3)[faces(points.shape)[1]]
    front = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    is_front = (np.einsum("ij,ij->i", front, corners[:, 0]) < 0).tolist()
    pixels = focal * points[..., :2] / points[..., 2:] + [camera["cx"], camera["cy"]]
    low = np.clip(np.floor(pixels.min((0, 1))), 0, [width, height]).astype(int)
    high = np.clip(np.ceil(pixels.max((0, 1))), 0, [width, height]).astype(int)
    cells, origin = np.full((height, width), -1), Vector((0, 0, 0))
    for y in range(low[1], high[1]):
        for x in range(low[0], high[0]):
            ray = Vector(((x + 0.5 - camera["cx"]) / focal, -(y + 0.5 - camera["cy"]) / focal, -1)).normalized()
            hit, _, _, face, thing, _ = scene.ray_cast(graph, origin, ray)
            if hit and thing.name == sheet.name and is_front[face]:
                cells[y, x] = face // 2
    return cells


def developed(light: Array, dice: np.random.Generator) -> Array:
    """What a camera makes of it: exposure by the bright parts, noise of photons and sensor, sRGB of 8 bits."""
    light = light * (dice.uniform(0.6, 0.95) / np.quantile(light, 0.95))
    noise = dice.uniform(0.0, 1.0) * np.sqrt(2e-4 * np.maximum(light, 0) + 4e-6)
    return srgb(light + noise * dice.normal(size=light.shape))


def strain(points: Array, size: Array, cells: tuple[int, int]) -> list[float]:
    """By how many per cent the grid's edges are longer than on the flat print: 5th and 95th percentile."""
    rest = [size[0] / cells[0], size[1] / cells[1]]
    along = [np.linalg.norm(np.diff(points, axis=axis), axis=-1).ravel() / rest[1 - axis] for axis in (1, 0)]
    return [round(100 * float(q) - 100, 2) for q in np.quantile(np.concatenate(along), [0.05, 0.95])]


def frame(folder: Path, print_file: Path, number: int, index: int, camera: dict, options) -> None:
    """Renders one frame into `folder`. `number` of the print's frame chooses the seed, `index` of all frames the strata."""
    name = zlib.crc32(print_file.stem.encode())
    long_side = spread(LONG_SIDE_MM, np.random.default_rng([options.seed, name]))
    shape, light = SHAPES[index % len(SHAPES)], LIGHTS[index % len(LIGHTS)]
    material = list(MATERIALS)[(index + index // len(LIGHTS)) % len(MATERIALS)]
    for attempt in range(30):
        dice = np.random.default_rng([options.seed, name, number, attempt])
        bpy.ops.wm.read_factory_settings(use_empty=True)
        picture = bpy.data.images.load(str(print_file))
        size = np.array(picture.size) * long_side / max(picture.size)
        margin = int(dice.integers(3, 9)) if dice.random() < 0.35 else 0
        flat = flat_sheet(size, margin)
        if material == "cloth":
            flat = stretched(flat, size, dice)
        placing = placed(bent(shape, flat, size, MATERIALS[material][3], dice), camera, dice)
        if placing is None:
            continue
        points, distance, tilt = placing
        inner = points[margin : points.shape[0] - margin, margin : points.shape[1] - margin]
        sheet = add_sheet(points, margin, material, picture)
        background, normal, offset = add_background(points, dice)
        occluder = add_occluder(inner, dice) if dice.random() < 0.35 else None
        has_bar = add_lights(light, points, normal, offset, dice)
        f_number = add_lens(distance, dice)
        cells, of_print = seen_cells(sheet, points, camera), on_print(points.shape, margin)
        visible = (cells >= 0) & of_print[cells]
        share = len(np.unique(cells[visible])) / of_print.sum()
        if share >= LEAST_SEEN and visible.mean() >= LEAST_AREA / 2:
            break
    else:
        raise SystemExit(f"{folder.name}: no scene shows enough of the print")
    put(folder / "image.png", png(developed(rendered(camera, options, index, folder / "light.exr"), dice)))
    put(folder / "visible.png", png(255 * visible.astype(np.uint8)))
    np.save(folder / "surface.npy", np.ascontiguousarray(inner, "<f4"))
    put(folder / "camera.json", json.dumps(camera).encode())
    about = {"print": print_file.name, "size_mm": size.tolist(), "material": material, "light": light, "shape": shape}
    about |= {"background": background, "occluder": occluder, "bar_shadow": has_bar, "f_number": f_number}
    about |= {"margin_mm": margin * long_side / CELLS, "distance_mm": distance, "tilt_deg": tilt, "visible_share": share}
    about |= {"grid": [inner.shape[1], inner.shape[0]]}
    about |= {"strain_percent": strain(inner, size, (inner.shape[1] - 1, inner.shape[0] - 1))}
    about |= {"seed": options.seed, "samples": options.samples, "blender": bpy.app.version_string}
    put(folder / "frame.json", json.dumps(about, indent=1).encode())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pictures", nargs="+", type=Path, help="PNG or JPEG files, or folders of them")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--frames", type=int, default=3, help="frames of each print")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--size", default="960x540")
    parser.add_argument("--samples", type=int, default=24)
    parser.add_argument("--threads", type=int, default=1)
    options = parser.parse_args()
    width, height = map(int, options.size.split("x"))
    focal = FOCAL * max(width, height)
    camera = {"width": width, "height": height, "fx": focal, "fy": focal, "cx": width / 2, "cy": height / 2}
    files = [file for path in options.pictures for file in (sorted(path.iterdir()) if path.is_dir() else [path])]
    files = [file for file in files if file.suffix.lower() in (".png", ".jpg", ".jpeg")]
    prints = options.out / "prints"
    prints.mkdir(parents=True, exist_ok=True)
    jobs = [(file, k, options.out / f"{file.stem}-{k}") for file in files for k in range(options.frames)]
    missing = [(job[2].name, index, job) for index, job in enumerate(jobs) if not (job[2] / "frame.json").exists()]
    for _, index, (file, k, folder) in reported(missing):
        copy = prints / file.name
        if not copy.exists():
            put(copy, file.read_bytes())
        folder.mkdir(exist_ok=True)
        frame(folder.absolute(), copy.absolute(), k, index, camera, options)


if __name__ == "__main__":
    main()
