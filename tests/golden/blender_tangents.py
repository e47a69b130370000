"""Writes blender_tangents.npz: a warped, mirrored grid of quads and triangles with Blender's tangents.

Run with a Python that has Blender as a module (``pip install bpy``); the tests only read the file.
"""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np

COLUMNS, ROWS = 12, 9


def main() -> None:
    """Builds the grid, lets Blender compute its tangents, and writes both."""
    rng = np.random.default_rng(5)
    i, j = np.meshgrid(np.arange(COLUMNS), np.arange(ROWS))
    i, j = i.ravel(), j.ravel()
    places = np.column_stack((i, j, rng.uniform(-0.4, 0.4, i.size))).astype(np.float32)
    # Mirrored in the middle; a few columns of the map are collapsed into one.
    u = np.abs(i - 5.5) / 6 + rng.uniform(-0.02, 0.02, i.size)
    u[(i == 8) | (i == 9)] = 0.5
    image = np.column_stack((u, j / ROWS + rng.uniform(-0.02, 0.02, i.size))).astype(np.float32)
    faces: list[list[int]] = []
    for row in range(ROWS - 1):
        for column in range(COLUMNS - 1):
            a = row * COLUMNS + column
            quad = [a, a + 1, a + 1 + COLUMNS, a + COLUMNS]
            turn = (row + column) % 4
            quad = quad[turn:] + quad[:turn]
            if (row * 7 + column) % 5 == 0:
                faces += [[quad[0], quad[1], quad[2]], [quad[0], quad[2], quad[3]]]
            else:
                faces.append(quad)
    mesh = bpy.data.meshes.new("grid")
    mesh.from_pydata(places.tolist(), [], faces)
    layer = mesh.uv_layers.new(name="map")
    vertices = np.concatenate(faces)
    layer.data.foreach_set("uv", image[vertices].ravel())
    mesh.shade_smooth()
    mesh.calc_tangents(uvmap="map")

    def corners(name: str, width: int) -> np.ndarray:
        values = np.zeros(len(vertices) * width, np.float32)
        mesh.loops.foreach_get(name, values)
        return values.reshape(-1, width) if width > 1 else values

    np.savez_compressed(
        Path(__file__).with_suffix(".npz"),
        positions=places[vertices],
        uvs=image[vertices],
        normals=corners("normal", 3),
        tangents=np.column_stack((corners("tangent", 3), corners("bitangent_sign", 1))),
        sizes=np.array([len(face) for face in faces], np.uint8),
        blender=np.array(bpy.app.version_string),
    )


if __name__ == "__main__":
    main()
