"""Scenes of twenty relief objects, most of them distant or partly hidden, drawn with and without skipping.

python examples/mixed_scene.py mixed_scene.png [--scenes balls street] [--size 1920 1080] [--repeats 3]

Each scene is made by a seeded generator of random numbers and lists its objects in random order. The pictures
with skipping are saved as mixed_scene-balls.png and so on. Times are the best of each, taken in turn: of
drawing by the clock, and what the processors worked for a whole picture, which on a software device other
jobs hardly disturb.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import bumpwgpu as bw

Scene = tuple[list[bw.Instance], bw.Camera, list[bw.Light]]
SUN = bw.Light.directional((-0.6, -0.7, -0.9))


def place(at: tuple[float, float, float], scale: object = 1.0, turn: float = 0.0) -> np.ndarray:
    """A matrix that scales, along each axis if asked to, turns around +Y (degrees) and moves."""
    angle = np.radians(turn)
    matrix = np.eye(4)
    matrix[0, [0, 2]] = np.cos(angle), np.sin(angle)
    matrix[2, [0, 2]] = -np.sin(angle), np.cos(angle)
    matrix[:3, :3] *= np.broadcast_to(np.asarray(scale, float), 3)
    matrix[:3, 3] = at
    return matrix


class Things:
    """Meshes and materials to choose from."""

    def __init__(self) -> None:
        relief = bw.HeightMap.procedural
        self.bricks = bw.Material(relief("bricks", 512, scale=0.05), albedo=(0.72, 0.45, 0.36))
        self.stone = bw.Material(relief("fbm", 1024, scale=0.06), albedo=(0.6, 0.6, 0.55))
        self.studs = bw.Material(relief("spheres", 512, scale=0.08), albedo=(0.4, 0.5, 0.6))
        self.waves = bw.Material(relief("sines", 512, scale=0.04), albedo=(0.5, 0.6, 0.4))
        self.materials = (self.bricks, self.stone, self.studs, self.waves)
        self.panel, self.ball = bw.Mesh.quad(), bw.Mesh.sphere(0.5)
        self.ring, self.box = bw.Mesh.torus(), bw.Mesh.cube()


def balls(things: Things, rng: np.random.Generator) -> Scene:
    """Balls and rings in the air, one near, the others behind one another."""
    made = [bw.Instance(things.ball, things.stone, place((-0.6, 0.1, 1.2)))]
    for at in range(19):
        depth = rng.uniform(2.0, 30.0)
        spot = (rng.uniform(-0.45, 0.45) * (depth + 3.0), rng.uniform(-0.25, 0.25) * (depth + 3.0), -depth)
        mesh = things.ring if at % 3 == 0 else things.ball
        made.append(bw.Instance(mesh, things.materials[at % 4], place(spot, rng.uniform(1.0, 2.5))))
    return made, bw.Camera.look_at((0.0, 0.3, 4.0), (0.0, 0.0, 0.0), fov_y=50.0), [SUN]


def crates(things: Things, rng: np.random.Generator) -> Scene:
    """Boxes piled up in rows, seen from one end."""
    made = []
    for at in range(20):
        row, column = divmod(at, 4)
        spot = (2.2 * column - 3.3 + rng.uniform(-0.3, 0.3), rng.uniform(-0.2, 0.2), -2.5 * row)
        turn = rng.uniform(0.0, 90.0)
        made.append(bw.Instance(things.box, things.materials[at % 4], place(spot, 1.3, turn)))
    return made, bw.Camera.look_at((1.0, 0.5, 5.0), (0.0, 0.0, -4.0), fov_y=45.0), [SUN]


def street(things: Things, rng: np.random.Generator) -> Scene:
    """Houses on both sides of a street, some of them before others, and a ball at its end; two lights."""
    made = [bw.Instance(things.ball, things.studs, place((0.0, -0.4, -30.0), 2.0))]
    for at in range(19):
        side, row = 1.0 if at % 2 else -1.0, at // 2
        size = (rng.uniform(1.5, 2.2), rng.uniform(2.0, 5.0), rng.uniform(1.5, 2.2))
        spot = (side * rng.uniform(2.2, 2.8), 0.5 * size[1] - 1.5, -3.2 * row)
        made.append(bw.Instance(things.box, things.materials[at % 4], place(spot, size)))
    lamp = bw.Light.directional((0.5, -0.8, -0.4), intensity=0.4)
    return made, bw.Camera.look_at((0.3, 0.2, 7.0), (0.0, 0.2, -10.0), fov_y=50.0), [SUN, lamp]


def stage(things: Things, rng: np.random.Generator) -> Scene:
    """Panels one behind the other, as on a stage, with balls between them; a lamp above."""
    made = []
    for at in range(10):
        spot = (rng.uniform(-1.2, 1.2), rng.uniform(-0.3, 0.3), -1.5 * at)
        turn = rng.uniform(-20.0, 20.0)
        made.append(bw.Instance(things.panel, things.materials[at % 4], place(spot, 1.6, turn)))
        spot = (rng.uniform(-1.8, 1.8), rng.uniform(-0.6, 0.6), -1.5 * at - 0.75)
        made.append(bw.Instance(things.ball, things.materials[(at + 1) % 4], place(spot, 0.6)))
    lamp = bw.Light.point((1.0, 3.0, 4.0), intensity=12.0)
    return made, bw.Camera.look_at((0.2, 0.3, 4.5), (0.0, 0.0, -2.0), fov_y=45.0), [lamp]


def walls(things: Things, rng: np.random.Generator) -> Scene:
    """Two walls near by, and rows of objects behind them."""
    made = [
        bw.Instance(things.panel, things.bricks, place((-1.7, 0.0, 0.0), 3.0)),
        bw.Instance(things.panel, things.bricks, place((1.7, 0.0, -0.4), 3.0)),
    ]
    for at in range(18):
        row, column = divmod(at, 6)
        mesh = (things.ball, things.ring, things.box)[at % 3]
        spot = ((column - 2.5) * 1.3, -0.3 + 0.2 * row, -3.0 - 6.0 * row)
        made.append(bw.Instance(mesh, things.materials[at % 4], place(spot, 0.8, rng.uniform(0.0, 360.0))))
    return made, bw.Camera.look_at((0.0, 0.4, 4.2), (0.0, 0.0, 0.0), fov_y=50.0), [SUN]


def field(things: Things, rng: np.random.Generator) -> Scene:
    """All of them far away, over a wide field."""
    made = []
    for at in range(20):
        depth = rng.uniform(12.0, 60.0)
        spot = (rng.uniform(-0.7, 0.7) * depth, rng.uniform(-0.3, 0.3) * depth, -depth)
        mesh = (things.ball, things.ring, things.box)[at % 3]
        turn = rng.uniform(0.0, 360.0)
        made.append(bw.Instance(mesh, things.materials[at % 4], place(spot, rng.uniform(2.0, 5.0), turn)))
    return made, bw.Camera.look_at((0.0, 0.0, 4.0), (0.0, 0.0, 0.0), fov_y=50.0), [SUN]


SCENES: dict[str, Callable[[Things, np.random.Generator], Scene]] = {
    "balls": balls,
    "crates": crates,
    "street": street,
    "stage": stage,
    "walls": walls,
    "field": field,
}


def scene(name: str, things: Things | None = None) -> Scene:
    """One of the scenes: its objects in random order, its camera and its lights."""
    rng = np.random.default_rng(2003)
    made, camera, lights = SCENES[name](things or Things(), rng)
    return [made[at] for at in rng.permutation(len(made))], camera, lights


def measure(
    made: Scene, technique: str, size: tuple[int, int], repeats: int
) -> tuple[bw.Frame, bw.Frame, np.ndarray]:
    """A picture with skipping and one without, and the least milliseconds of each: drawing, and worked."""
    things, camera, lights = made
    options = {"camera": camera, "lights": lights, "technique": technique, "size": size}
    with bw.Renderer(things, **options) as quick, bw.Renderer(things, skip=False, **options) as plain:
        rounds = []
        for _ in range(repeats + 1):
            row = []
            for renderer in (quick, plain):
                before = time.process_time()
                frame = renderer.render()
                row.append((frame, frame.stats["draw_ms"], 1e3 * (time.process_time() - before)))
            rounds.append(row)
    # The first round compiles and uploads.
    took = np.array([[side[1:] for side in row] for row in rounds[1:]]).min(axis=0)
    return rounds[-1][0][0], rounds[-1][1][0], took


def main() -> None:
    """Draws the scenes, prints what was skipped and what it saved, and saves the pictures."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("picture", type=Path)
    parser.add_argument("--scenes", nargs="+", choices=SCENES, default=list(SCENES))
    parser.add_argument("--size", type=int, nargs=2, default=(1920, 1080))
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--techniques", nargs="+", default=["relief", "exact"])
    given = parser.parse_args()
    things = Things()
    for name in given.scenes:
        made = scene(name, things)
        for technique in given.techniques:
            quick, plain, took = measure(made, technique, tuple(given.size), given.repeats)
            off = np.abs(quick.color.astype(int) - plain.color).max(axis=2)
            (drawn, worked), (drawn_plain, worked_plain) = took
            print(
                f"{name}, {technique}: drawn in {drawn:.0f} ms with skipping, {drawn_plain:.0f} without, "
                f"{drawn_plain / drawn:.2f} times; worked {worked:.0f} and {worked_plain:.0f} ms, "
                f"{worked_plain / worked:.2f} times; pictures differ by {off.max()} at most, "
                f"by more than 2 in {(off > 2).mean():.3%} of the pixels"
            )
            print("  skipped:", {kind: count for kind, count in quick.stats["skipped"].items() if count})
            drawn_triangles = [frame.stats["triangles_drawn"] for frame in (quick, plain)]
            print(f"  triangles drawn: {drawn_triangles[0]} of {drawn_triangles[1]}", flush=True)
            quick.save(given.picture.with_stem(f"{given.picture.stem}-{name}"))


if __name__ == "__main__":
    main()
