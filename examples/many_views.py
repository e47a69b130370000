"""A scene seen from a hundred places: `Renderer.render_many` against as many calls of `render`.

python examples/many_views.py [--views 100] [--size 256] [--segments 96 384] [--techniques relief exact]
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterable

import numpy as np

import bumpwgpu as bw


def cameras(count: int) -> list[bw.Camera]:
    """Places on a circle."""
    turns = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    places = np.stack([2.2 * np.sin(turns), np.full(count, 0.7), 2.2 * np.cos(turns)], axis=1)
    return [bw.Camera.look_at(tuple(place), (0.0, 0.0, 0.0)) for place in places]


def seconds(pictures: Callable[[], Iterable[bw.Frame]]) -> tuple[float, list[np.ndarray], float]:
    """How long it takes to draw them, what they show, and the milliseconds that the device draws one."""
    before = time.perf_counter()
    frames = list(pictures())
    took = time.perf_counter() - before
    drawn = float(np.median([frame.stats["draw_ms"] for frame in frames]))
    return took, [frame.color for frame in frames], drawn


def main() -> None:
    """Draws the views both ways in turn, compares the pictures, and prints the best time of each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--views", type=int, default=100)
    parser.add_argument("--repeats", type=int, default=2)
    parser.add_argument("--size", type=int, nargs="+", default=[64, 256])
    parser.add_argument(
        "--segments", type=int, nargs="+", default=[96, 384], help="of the torus, along its ring"
    )
    parser.add_argument("--techniques", nargs="+", default=["relief", "exact"])
    given = parser.parse_args()
    stone = bw.Material(bw.HeightMap.procedural("fbm", 1024, scale=0.05))
    views = cameras(given.views)
    for segments in given.segments:
        ring = bw.Mesh.torus(major_segments=segments, minor_segments=segments // 2)
        for size in given.size:
            for technique in given.techniques:
                options = {"technique": technique, "size": size}

                def single(ring: bw.Mesh = ring, options: dict = options) -> list[bw.Frame]:
                    return [bw.render(ring, stone, camera=view, **options) for view in views]

                def many(ring: bw.Mesh = ring, options: dict = options) -> list[bw.Frame]:
                    with bw.Renderer(ring, stone, **options) as renderer:
                        return list(renderer.render_many(views))

                bw.render(ring, stone, **options)
                rounds = [(seconds(single), seconds(many)) for _ in range(given.repeats)]
                same = all(np.array_equal(one, other) for (_, one, _), (_, other, _) in rounds)
                one, other = (
                    min(took for took, *_ in side) / given.views for side in zip(*rounds, strict=True)
                )
                drawn = min(drawn for (*_, drawn), _ in rounds)
                print(
                    f"{2 * segments * (segments // 2)} triangles, {size} x {size}, {technique}: "
                    f"{1e3 * one:.1f} ms a call of render, {drawn:.1f} of which the device draws, "
                    f"{1e3 * other:.1f} ms a view of a renderer, "
                    f"{one / other:.2f} times; pictures {'are the same' if same else 'DIFFER'}"
                )


if __name__ == "__main__":
    main()
