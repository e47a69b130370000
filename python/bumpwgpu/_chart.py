"""What the plot and the report's chart share: points, scales, colours, and labels that do not overlap."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

__all__ = ["FLOOR_TEXELS", "Label", "Point", "axis_range", "colors", "place_labels", "points", "short"]

#: Errors below this are drawn here: on a logarithmic axis nothing is exact.
FLOOR_TEXELS = 1e-4
#: Colours of techniques in order of appearance (Okabe and Ito 2008, then darker mixes of them).
_PALETTE = (
    "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#b8860b", "#56b4e9", "#7a3e9d", "#8b4513", "#5f6b1f",
    "#a01c4b", "#2f4f6f", "#e69f00", "#3b8686", "#666666",
)  # fmt: skip


@dataclass(frozen=True)
class Point:
    """One setting in the chart."""

    label: str
    technique: str
    time_ns: float
    low_ns: float
    high_ns: float
    error_texels: float
    on_front: bool
    #: On the front that ignores how often a setting fails.
    on_loose_front: bool
    reliable: bool


def points(result: Any, elevation: Any) -> list[Point]:
    """The settings at one elevation; the front sorted into time order by whoever draws it."""
    clock = f"time_{result.timed_on}_ns_per_ray"
    front = {row["label"] for row in result.pareto(elevation)}
    loose = {row["label"] for row in result.pareto(elevation, max_failure_rate=1.0)}
    from .compare_result import MAX_FAILURE_RATE

    return [
        Point(
            row["label"],
            row["technique"],
            row[clock],
            row[f"{clock}_low"],
            row[f"{clock}_high"],
            max(row["uv_error_p99_texels"], FLOOR_TEXELS),
            row["label"] in front,
            row["label"] in loose,
            row["failure_rate"] <= MAX_FAILURE_RATE,
        )
        for row in result.select(elevation)
    ]


def colors(result: Any) -> dict[str, str]:
    """Technique name to colour."""
    names = dict.fromkeys(row["technique"] for row in result.rows)
    return {name: _PALETTE[at % len(_PALETTE)] for at, name in enumerate(names)}


def axis_range(values: Sequence[float], decades: float) -> tuple[float, float]:
    """Limits of a logarithmic axis with some room around the values, at least so many decades apart."""
    low, high = min(values), max(values)
    room = max((high / low) ** 0.08, 1.25)
    lacking = decades - math.log10(high / low * room * room)
    high *= 10.0 ** max(lacking, 0.0)
    return low / room, high * room


def short(label: str) -> str:
    """``relief(32, 8)`` for ``relief(linear=32, refine=8)``: the axes need the room."""
    return re.sub(r"\w+=", "", label)


@dataclass(frozen=True)
class Label:
    """A text box: its lower left corner in the units of the chart, y up, and whether it needs a line."""

    x: float
    y: float
    leads: bool


Box = tuple[float, float, float, float]


def place_labels(
    anchors: Sequence[tuple[float, float]],
    sizes: Sequence[tuple[float, float]],
    obstacles: Sequence[tuple[float, float]],
    bounds: tuple[float, float],
    radius: float,
) -> list[Label]:
    """Boxes beside their anchors, inside the bounds, that cover neither each other nor the obstacles.

    Tries a ring of places around each anchor, nearest first, and takes the one with the least overlap.
    """
    taken: list[Box] = [(x - radius, y - radius, x + radius, y + radius) for x, y in obstacles]
    placed = []
    for (x, y), (width, height) in zip(anchors, sizes, strict=True):
        best: tuple[float, Box, float] | None = None
        for distance in (1.0, 2.2, 3.6, 5.5, 8.0, 11.0, 15.0):
            for turn in range(16):
                angle = turn * math.pi / 8.0
                reach = distance * radius
                cx = x + math.cos(angle) * (reach + radius + 0.5 * width)
                cy = y + math.sin(angle) * (reach + radius + 0.5 * height)
                left = min(max(cx - 0.5 * width, radius), bounds[0] - radius - width)
                low = min(max(cy - 0.5 * height, radius), bounds[1] - radius - height)
                box = (left, low, left + width, low + height)
                cost = sum(_overlap(box, other) for other in taken) + 0.02 * distance * radius
                if best is None or cost < best[0]:
                    best = (cost, box, distance)
            if best is not None and best[0] <= 0.02 * distance * radius:
                break
        assert best is not None
        taken.append(best[1])
        placed.append(Label(best[1][0], best[1][1], best[2] > 3.0))
    return placed


def _overlap(a: Box, b: Box) -> float:
    width = min(a[2], b[2]) - max(a[0], b[0])
    height = min(a[3], b[3]) - max(a[1], b[1])
    return width * height if width > 0.0 and height > 0.0 else 0.0
