"""Twenty relief objects, most of them distant or behind walls, drawn with and without skipping.

python examples/mixed_scene.py mixed_scene.png [--size 1920 1080] [--repeats 3]
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

import bumpwgpu as bw


def place(x: float, y: float, z: float, scale: float = 1.0, turn: float = 0.0) -> np.ndarray:
    """A matrix that scales, turns around +Y (degrees) and moves."""
    angle = np.radians(turn)
    matrix = np.eye(4)
    matrix[0, [0, 2]] = np.cos(angle) * scale, np.sin(angle) * scale
    matrix[2, [0, 2]] = -np.sin(angle) * scale, np.cos(angle) * scale
    matrix[1, 1] = scale
    matrix[:3, 3] = x, y, z
    return matrix


def scene() -> tuple[list[bw.Instance], bw.Camera]:
    """A wall on the left and one on the right hide most of what stands in rows behind them."""
    bricks = bw.Material(bw.HeightMap.procedural("bricks", 512, scale=0.05), albedo=(0.72, 0.45, 0.36))
    stone = bw.Material(bw.HeightMap.procedural("fbm", 512, scale=0.06), albedo=(0.6, 0.6, 0.55))
    tiles = bw.Material(bw.HeightMap.procedural("spheres", 512, scale=0.08), albedo=(0.4, 0.5, 0.6))
    wall, ball, ring, box = bw.Mesh.quad(3.0), bw.Mesh.sphere(0.5), bw.Mesh.torus(), bw.Mesh.cube(0.8)
    things = [
        bw.Instance(wall, bricks, place(-1.7, 0.0, 0.0)),
        bw.Instance(wall, bricks, place(1.7, 0.0, -0.4)),
    ]
    shapes = [(ball, stone), (ring, tiles), (box, bricks)]
    for at in range(18):
        row, column = divmod(at, 6)
        mesh, material = shapes[at % 3]
        x, z = (column - 2.5) * 1.3, -3.0 - 6.0 * row
        things.append(bw.Instance(mesh, material, place(x, -0.3 + 0.2 * row, z, 0.8, 25.0 * at)))
    return things, bw.Camera.look_at((0.0, 0.4, 4.2), (0.0, 0.0, 0.0), fov_y=50.0)


def measure(technique: str, size: tuple[int, int], repeats: int) -> tuple[bw.Frame, bw.Frame, float, float]:
    """A picture with skipping and one without, and the least milliseconds of each, taken in turn."""
    things, camera = scene()
    options = {"camera": camera, "technique": technique, "size": size}
    with bw.Renderer(things, **options) as quick, bw.Renderer(things, skip=False, **options) as plain:
        pairs = [(quick.render(), plain.render()) for _ in range(repeats + 1)][1:]
    with_skips, without = (min(frame.stats["draw_ms"] for frame in side) for side in zip(*pairs, strict=True))
    return *pairs[-1], with_skips, without


def main() -> None:
    """Draws the scene, prints what was skipped and what it saved, and saves the picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("picture", type=Path)
    parser.add_argument("--size", type=int, nargs=2, default=(1920, 1080))
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--techniques", nargs="+", default=["relief", "exact"])
    given = parser.parse_args()
    for technique in given.techniques:
        quick, plain, with_skips, without = measure(technique, tuple(given.size), given.repeats)
        off = np.abs(quick.color.astype(int) - plain.color)
        print(
            f"{technique}: {with_skips:.0f} ms with skipping, {without:.0f} ms without, "
            f"{without / with_skips:.2f} times; pictures differ by {off.max()} at most, in "
            f"{(off.max(axis=2) > 0).mean():.2%} of the pixels"
        )
        print("  skipped:", {name: count for name, count in quick.stats["skipped"].items() if count})
        print(f"  triangles drawn: {quick.stats['triangles_drawn']} of {plain.stats['triangles_drawn']}")
        quick.save(given.picture)


if __name__ == "__main__":
    main()
