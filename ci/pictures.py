"""Draws frames (OBJ files as the example hosts write them) as a picture sheet, without a display.

    python ci/pictures.py OUT.png FRAME.obj... [--columns 3] [--size 640x480] [--camera X,Y,Z] [--look-at X,Y,Z]

Objects named `cloth*` are drawn as two-sided cloth, objects named `ground` are replaced by a floor at y = 0 (give
--floor), all others as solids. Needs `pip install pyvista`.
"""

import argparse
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


def add_grid(plotter, size):
    """Thin lines on the floor, half a unit apart at the scale of a metre, so that motion can be seen."""
    step, reach, height = 0.5, 12, -1.2e-3 * size
    for i in range(-2 * reach, 2 * reach + 1):
        for a, b in (((i * step, -reach), (i * step, reach)), ((-reach, i * step), (reach, i * step))):
            line = pv.Line((a[0], height, a[1]), (b[0], height, b[1]))
            plotter.add_mesh(line, color=GRID, line_width=2, lighting=False)


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


def draw(scene, window, camera, look_at, angle, centre, size, floor):
    """One frame as an array of pixels."""
    plotter = pv.Plotter(off_screen=True, lighting="none", window_size=[2 * side for side in window])
    plotter.set_background(SKY_BOTTOM, top=SKY_TOP)
    directions = light_directions(look_at - camera)
    light_scene(plotter, directions, centre, size)
    solids = 0
    for name, points, faces in scene:
        if len(faces) == 0:
            continue
        if name.startswith("cloth"):
            add_cloth(plotter, points, faces)
        else:
            add_solid(plotter, points, faces, SOLIDS[solids % len(SOLIDS)])
            solids += 1
    if floor:
        add_grid(plotter, size)
        # A hair under y = 0, so that what lies on the floor is not drawn into it.
        ground = -2e-3 * size
        disc = pv.Disc(center=(centre[0], ground, centre[2]), inner=0.0, outer=9 * size, normal=(0, 1, 0), c_res=96)
        plotter.add_mesh(disc, color=FLOOR, lighting=False)
        for _, points, faces in scene:
            if len(faces):
                add_shadow(plotter, points, faces, ground + 5e-4 * size, directions[0])
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


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out")
    parser.add_argument("frames", nargs="+")
    parser.add_argument("--columns", type=int, default=3)
    parser.add_argument("--size", default="640x480", help="of one picture, in pixels")
    parser.add_argument("--camera", type=vector, help="where the camera stands; default: a three-quarter view of all")
    parser.add_argument("--look-at", type=vector)
    parser.add_argument("--zoom", type=float, default=1.0)
    parser.add_argument("--follow", action="store_true", help="move the camera with the middle of what is drawn")
    parser.add_argument("--floor", action="store_true", help="draw a floor at y = 0")
    arguments = parser.parse_args()

    scenes = [read_obj(frame) for frame in arguments.frames]
    points = np.concatenate([points for scene in scenes for _, points, _ in scene if len(points)])
    low, high = points.min(axis=0), points.max(axis=0)
    centre, size = 0.5 * (low + high), float(np.linalg.norm(high - low))
    look_at = arguments.look_at if arguments.look_at is not None else centre
    camera = arguments.camera if arguments.camera is not None else centre + size * np.array([0.75, 0.45, 1.05])

    width, height = (int(word) for word in arguments.size.split("x"))
    columns = min(arguments.columns, len(scenes))
    rows = -(-len(scenes) // columns)
    sheet = np.full((rows * height, columns * width, 3), 255, dtype=np.uint8)
    for index, scene in enumerate(scenes):
        shift = np.zeros(3)
        if arguments.follow:
            shift = np.mean([points.mean(axis=0) for _, points, faces in scene if len(faces)], axis=0) - centre
            shift[1] = 0.0
        image = draw(scene, (width, height), camera + shift, look_at + shift, 30.0 / arguments.zoom, centre, size, arguments.floor)
        row, column = divmod(index, columns)
        sheet[row * height : (row + 1) * height, column * width : (column + 1) * width] = image
    Image.fromarray(sheet).save(arguments.out, optimize=True)
    print(f"{arguments.out}: {len(scenes)} frames, {columns * width} x {rows * height} pixels")


if __name__ == "__main__":
    main()
