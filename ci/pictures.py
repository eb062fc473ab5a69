"""Draws frames (OBJ files as the example hosts and the runner write them) as a picture sheet, without a display.

    python ci/pictures.py OUT.png FRAME.obj... [--columns 3] [--size 640x480] [--camera X,Y,Z] [--look-at X,Y,Z]
    python ci/pictures.py RUN [--count 6] ...

RUN is a folder that `signorini-run --out` wrote: RUN/sheet.png shows some of its frames, evenly spaced, RUN/stats.png
plots its steps; half-spaces and the camera are those of its scene. Objects named `cloth*`, and surfaces that are open, are
drawn as two-sided cloth, open surfaces of prescribed motion as glass, objects named `ground` are replaced by a floor (give
--floor; a run knows its own), all others as solids. Needs `pip install pyvista`.
"""

import argparse
import csv
import json
import pathlib

import numpy as np
import pyvista as pv
from PIL import Image

CLOTH_FRONT = "#c8452f"
CLOTH_BACK = "#e9b872"
SOLIDS = ["#b9cbd6", "#6f8f72", "#b8a58f"]
FLOOR = "#dcd8d0"
SHADOW = "#b9b4ab"
GRID = "#d0cbc2"
GLASS = "#7d94a3"
THREE_QUARTERS = np.array([0.75, 0.45, 1.05])
SKY_TOP, SKY_BOTTOM = "#dfe7ee", "#f6f3ee"


def read_obj(path):
    """Objects of an OBJ file: list of (name, points, triangles)."""
    objects, points, name, first = [], [], None, 0
    for line in pathlib.Path(path).read_text().splitlines():
        if line.startswith("o "):
            name, first = line[2:].strip(), len(points)
            objects.append([name, first, []])
        elif line.startswith("v "):
            points.append([float(word) for word in line.split()[1:4]])
        elif line.startswith("f "):
            corners = [int(word.split("/")[0]) - 1 for word in line.split()[1:4]]
            if not objects:
                objects.append(["solid", 0, []])
            objects[-1][2].append(corners)
    result = []
    ends = [o[1] for o in objects[1:]] + [len(points)]
    for (name, first, faces), end in zip(objects, ends):
        result.append((name, np.array(points[first:end]), np.array(faces, dtype=int) - first))
    return result


def turned(points):
    """Points of a scene with z up turned so that y is up."""
    return np.asarray(points)[..., [0, 2, 1]] * [1.0, 1.0, -1.0]


def is_open(faces):
    """Whether some edge belongs to one face only."""
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    return len(edges) > 0 and np.any(np.unique(edges, axis=0, return_counts=True)[1] == 1)


def surface(points, faces):
    cells = np.hstack([np.full((len(faces), 1), 3), faces]).astype(np.int64)
    return pv.PolyData(points, cells.ravel())


def add_cloth(plotter, points, faces):
    """One side in one colour, the other side in another: the sheet is drawn twice, half a hair apart."""
    mesh = surface(points, faces).compute_normals(
        cell_normals=False, point_normals=True, split_vertices=False, consistent_normals=False, auto_orient_normals=False
    )
    look = dict(smooth_shading=True, ambient=0.25, diffuse=0.8, specular=0.05, specular_power=10)
    plotter.add_mesh(mesh, color=CLOTH_FRONT, culling="back", **look)
    back = mesh.copy()
    back.points = mesh.points - 1e-4 * mesh.length * mesh["Normals"]
    back.flip_faces(inplace=True)
    back["Normals"] = -mesh["Normals"]
    plotter.add_mesh(back, color=CLOTH_BACK, culling="back", **look)


def add_solid(plotter, points, faces, color):
    mesh = surface(points, faces)
    plotter.add_mesh(
        mesh.compute_normals(cell_normals=False, split_vertices=True, feature_angle=50.0),
        color=color, smooth_shading=True, ambient=0.2, diffuse=0.8, specular=0.12, specular_power=20,
    )


def add_shadow(plotter, points, faces, floor, sun):
    """The shadow that a mesh throws on the floor: the mesh itself, flattened along the light."""
    flat = points - np.outer((points[:, 1] - floor) / sun[1], sun)
    plotter.add_mesh(surface(flat, faces), color=SHADOW, lighting=False)


def add_grid(plotter, size, height):
    """Thin lines on the floor, half a unit apart at the scale of a metre, so that motion can be seen."""
    step, reach, height = 0.5, 12, height - 1.2e-3 * size
    for i in range(-2 * reach, 2 * reach + 1):
        for a, b in (((i * step, -reach), (i * step, reach)), ((-reach, i * step), (reach, i * step))):
            line = pv.Line((a[0], height, a[1]), (b[0], height, b[1]))
            plotter.add_mesh(line, color=GRID, line_width=2, lighting=False)


def add_glass(plotter, points, faces):
    """A surface that one sees through, with its outline."""
    mesh = surface(points, faces)
    plotter.add_mesh(mesh, color=GLASS, opacity=0.22, ambient=0.4, diffuse=0.6, smooth_shading=False)
    edges = mesh.extract_feature_edges(boundary_edges=True, feature_edges=False, manifold_edges=False)
    if edges.n_points:
        plotter.add_mesh(edges, color=GLASS, line_width=3, lighting=False)


def add_plane(plotter, normal, offset, points, size, camera):
    """The part of a half-space's plane under what is drawn, a hair below it, with lines across; seen from behind, only those."""
    normal = np.asarray(normal)
    across = np.cross(normal, [0.0, 0.0, 1.0] if abs(normal[2]) < 0.9 else [1.0, 0.0, 0.0])
    across /= np.linalg.norm(across)
    along = np.cross(across, normal)
    # A wall that moves is known where it ends, and stood no farther in than what is before it.
    offset = min(offset, (points @ normal).min())
    origin = (offset - 2e-3 * size) * normal
    margin = lambda x: 0.1 * np.ptp(x) + 0.02 * size
    (u0, u1), (v0, v1) = [(x.min() - margin(x), x.max() + margin(x)) for x in (points @ across, points @ along)]
    corner = lambda u, v: origin + u * across + v * along
    quad = np.array([corner(u0, v0), corner(u1, v0), corner(u1, v1), corner(u0, v1)])
    if camera @ normal > offset:
        plotter.add_mesh(surface(quad, np.array([[0, 1, 2], [0, 2, 3]])), color=FLOOR, lighting=False)
    step = 10.0 ** np.floor(np.log10(size / 4.0))
    for w in np.arange(np.ceil(v0 / step), v1 / step) * step:
        plotter.add_mesh(pv.Line(corner(u0, w) + 1e-3 * size * normal, corner(u1, w) + 1e-3 * size * normal), color=SHADOW, line_width=2, lighting=False)


def light_directions(view):
    """Towards the lights, in the world: sun, fill, rim. They turn with the camera about the vertical."""
    forward = np.array([view[0], 0.0, view[2]]) / np.hypot(view[0], view[2])
    right = np.array([-forward[2], 0.0, forward[0]])
    directions = [(0.5, 1.0, -0.45), (-1.0, 0.35, -0.8), (0.4, 0.15, -1.0)]
    return [a * right + np.array([0.0, b, 0.0]) + c * forward for a, b, c in directions]


def light_scene(plotter, directions, centre, size):
    for direction, intensity in zip(directions, (0.7, 0.38, 0.3)):
        light = pv.Light(position=centre + 4 * size * direction, focal_point=centre, intensity=intensity)
        light.positional = False
        plotter.add_light(light)


def draw(scene, window, camera, look_at, angle, centre, size, floor, height, planes=(), scripted=()):
    """One frame as an array of pixels."""
    plotter = pv.Plotter(off_screen=True, lighting="none", window_size=[2 * side for side in window])
    plotter.set_background(SKY_BOTTOM, top=SKY_TOP)
    directions = light_directions(look_at - camera)
    light_scene(plotter, directions, centre, size)
    solids = 0
    for name, points, faces in scene:
        if len(faces) == 0:
            continue
        if name in scripted and is_open(faces):
            add_glass(plotter, points, faces)
        elif name.startswith("cloth") or is_open(faces):
            add_cloth(plotter, points, faces)
        else:
            add_solid(plotter, points, faces, SOLIDS[solids % len(SOLIDS)])
            solids += 1
    if floor:
        add_grid(plotter, size, height)
        # A hair under it, so that what lies on the floor is not drawn into it.
        ground = height - 2e-3 * size
        disc = pv.Disc(center=(centre[0], ground, centre[2]), inner=0.0, outer=9 * size, normal=(0, 1, 0), c_res=96)
        plotter.add_mesh(disc, color=FLOOR, lighting=False)
        for _, points, faces in scene:
            if len(faces):
                add_shadow(plotter, points, faces, ground + 5e-4 * size, directions[0])
    for plane in planes:
        add_plane(plotter, plane[:3], plane[3], np.concatenate([points for _, points, _ in scene if len(points)]), size, camera)
    plotter.camera.position, plotter.camera.focal_point = camera, look_at
    plotter.camera.up = (0.0, 1.0, 0.0)
    plotter.camera.view_angle = angle
    plotter.reset_camera_clipping_range()
    image = Image.fromarray(plotter.screenshot(return_img=True)[:, :, :3])
    plotter.close()
    # Drawn at twice the size: smooth edges on any renderer.
    return np.asarray(image.resize(window, Image.Resampling.LANCZOS))


def vector(text):
    return np.array([float(word) for word in text.split(",")])


def middle_and_extent(points):
    low, high = points.min(axis=0), points.max(axis=0)
    return 0.5 * (low + high), float(np.linalg.norm(high - low))


def camera_on(points, view, angle, aspect):
    """Where a camera that looks against `view` stands, and a point before it, so that it sees all points, as near as that allows."""
    view = view / np.linalg.norm(view)
    right = np.cross([0.0, 1.0, 0.0], view)
    right /= np.linalg.norm(right)
    steepest, place, distance = 0.94 * np.tan(np.radians(angle / 2)), np.zeros(3), 0.0
    for axis, slope in ((right, aspect * steepest), (np.cross(view, right), steepest)):
        # A point is seen where |across - middle| <= slope (distance - along view).
        high, low = (points @ (slope * view + axis)).max(), (points @ (slope * view - axis)).max()
        place += 0.5 * (high - low) * axis
        distance = max(distance, 0.5 * (high + low) / slope)
    camera = place + distance * view
    return camera, camera - view


def sheet(scenes, out, arguments, height_of_floor, planes=(), scripted=()):
    """Draws frames beside and below each other."""
    points = np.concatenate([points for scene in scenes for _, points, _ in scene if len(points)])
    centre, size = middle_and_extent(points)
    width, height = (int(word) for word in arguments.size.split("x"))
    angle = 30.0 / arguments.zoom
    if arguments.camera is None:
        camera, look_at = camera_on(points, THREE_QUARTERS, angle, width / height)
    else:
        camera, look_at = arguments.camera, centre if arguments.look_at is None else arguments.look_at
    columns = min(arguments.columns, len(scenes))
    rows = -(-len(scenes) // columns)
    picture = np.full((rows * height, columns * width, 3), 255, dtype=np.uint8)
    for index, scene in enumerate(scenes):
        here = (camera, look_at, centre, size)
        if arguments.follow:
            # Seen from the same side, as near as what moves freely in this frame allows.
            free = np.concatenate([points for name, points, faces in scene if len(faces) and name not in scripted])
            here = (*camera_on(free, camera - look_at, angle, width / height), *middle_and_extent(free))
        image = draw(scene, (width, height), here[0], here[1], angle, here[2], here[3], arguments.floor, height_of_floor, planes, scripted)
        row, column = divmod(index, columns)
        picture[row * height : (row + 1) * height, column * width : (column + 1) * width] = image
    Image.fromarray(picture).save(out, optimize=True)
    print(f"{out}: {len(scenes)} frames, {columns * width} x {rows * height} pixels")


def draw_run(run, arguments):
    """The sheet and the plots of a run's folder."""
    report = json.loads((run / "report.json").read_text())
    frames = sorted((run / arguments.folder).glob("frame_*.obj"))
    if not frames:
        raise SystemExit(f"{run / arguments.folder}: no frames")
    chosen = [frames[i] for i in np.unique(np.linspace(0, arguments.to * (len(frames) - 1), arguments.count).round().astype(int))]
    scenes = [read_obj(frame) for frame in chosen]
    up = turned if report["up"] == "z" else np.asarray
    scenes = [[(name, up(points), faces) for name, points, faces in scene] for scene in scenes]
    for name in ("camera", "look_at"):
        if report.get(name) is not None and getattr(arguments, name) is None:
            setattr(arguments, name, up(report[name]))
    arguments.floor = report["floor"] is not None
    planes = [[*up(plane[:3]), plane[3]] for plane in report.get("planes", [])]
    # The floor is drawn as such.
    planes = [plane for plane in planes if plane[1] < 0.999]
    sheet(scenes, run / "sheet.png", arguments, report["floor"] or 0.0, planes, set(report.get("scripted", [])))
    plot(run, report)


def plot(run, report):
    """Contacts, rounds, energies and times over the steps of a run."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    with open(run / "stats.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    column = {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}
    time = column["time"]
    figure, axes = plt.subplots(2, 2, figsize=(12, 7), layout="constrained")
    figure.suptitle(f"{report['scene']}: {report['vertices']} vertices, {report['tets']} tetrahedra, dt {report['dt']} s")
    (contacts, energies), (times, rounds) = axes
    contacts.plot(time, column["contacts"], label="contacts")
    contacts.plot(time, column["active_contacts"], label="with an impulse")
    contacts.set(title="contacts", xlabel="s")
    energies.semilogy(time, np.maximum(column["kinetic_energy"], 1e-12), label="kinetic")
    energies.semilogy(time, np.maximum(column["elastic_energy"], 1e-12), label="elastic")
    energies.set(title="energy [J]", xlabel="s")
    bottom = np.zeros(len(time))
    for stage in ("dynamics", "search", "rows", "solve", "detection", "fail_safe", "certificate"):
        times.fill_between(time, 1e3 * bottom, 1e3 * (bottom + column[stage]), label=stage, linewidth=0)
        bottom += column[stage]
    times.plot(time, 1e3 * column["processor_seconds"], color="black", linewidth=0.7, label="processor")
    times.set(title="wall time a step, by stage [ms]", xlabel="s")
    histogram = report["cmr_rounds_histogram"]
    rounds.bar(list(histogram), list(histogram.values()))
    rounds.set(title="steps with contact by rounds of refinement", xlabel="rounds")
    for axis in (contacts, energies, times):
        axis.legend(fontsize=8)
    figure.savefig(run / "stats.png", dpi=100)
    plt.close(figure)
    print(f"{run / 'stats.png'}: {len(rows)} steps")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=pathlib.Path, help="the picture, or the folder of a run")
    parser.add_argument("frames", nargs="*")
    parser.add_argument("--count", type=int, default=6, help="frames of a run to draw")
    parser.add_argument("--to", type=float, default=1.0, help="up to this part of the run")
    parser.add_argument("--folder", default="frames", help="frames of a run to draw: frames or subdivided")
    parser.add_argument("--columns", type=int, default=3)
    parser.add_argument("--size", default="640x480", help="of one picture, in pixels")
    parser.add_argument("--camera", type=vector, help="where the camera stands; default: a three-quarter view of all")
    parser.add_argument("--look-at", type=vector)
    parser.add_argument("--zoom", type=float, default=1.0)
    parser.add_argument("--follow", action="store_true", help="move the camera with what is not scripted, as near as that allows")
    parser.add_argument("--floor", action="store_true", help="draw a floor at y = 0")
    arguments = parser.parse_args()
    if arguments.out.is_dir():
        draw_run(arguments.out, arguments)
    elif arguments.frames:
        sheet([read_obj(frame) for frame in arguments.frames], arguments.out, arguments, 0.0)
    else:
        parser.error("no frames given, and the first argument is not a folder")


if __name__ == "__main__":
    main()
