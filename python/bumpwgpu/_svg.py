"""The time-against-error chart of a report as SVG text, with names and figures under the pointer."""

from __future__ import annotations

import math
from html import escape
from typing import TYPE_CHECKING, Any

from ._chart import FLOOR_TEXELS, Point, axis_range, colors, place_labels, points, short

if TYPE_CHECKING:
    from .compare_result import CompareResult

__all__ = ["chart", "legend"]

_WIDTH, _HEIGHT = 780.0, 470.0
_LEFT, _RIGHT, _TOP, _BOTTOM = 64.0, 14.0, 12.0, 46.0
_FONT = 12.0
#: Mean advance of a sans-serif letter in ems; a little wide, so that estimated boxes are not too small.
_ADVANCE = 0.58


class _Scale:
    """A logarithmic axis onto pixels."""

    def __init__(self, limits: tuple[float, float], first: float, last: float) -> None:
        self.low, self.high = math.log10(limits[0]), math.log10(limits[1])
        self.first, self.last = first, last

    def __call__(self, value: float) -> float:
        share = (math.log10(value) - self.low) / (self.high - self.low)
        return self.first + share * (self.last - self.first)

    def ticks(self) -> list[float]:
        """Powers of ten, and 2 and 5 times them on a short axis."""
        steps = (1.0,) if self.high - self.low > 2.5 else (1.0, 2.0, 5.0)
        decades = range(math.floor(self.low), math.ceil(self.high) + 1)
        values = [step * 10.0**decade for decade in decades for step in steps]
        return [value for value in values if self.low <= math.log10(value) <= self.high]


def chart(result: CompareResult, elevation: Any) -> str:
    """One `<svg>` for one elevation."""
    shown = points(result, elevation)
    palette = colors(result)
    x = _Scale(axis_range([end for p in shown for end in (p.low_ns, p.high_ns)], 0.5), _LEFT, _WIDTH - _RIGHT)
    y = _Scale(axis_range([p.error_texels for p in shown], 2.0), _HEIGHT - _BOTTOM, _TOP)
    unit = "pixel" if result.kind == "scene" else "ray"
    parts = [
        f'<svg class="chart" viewBox="0 0 {_WIDTH:g} {_HEIGHT:g}" role="img" '
        f'aria-label="time against error" font-size="{_FONT:g}">',
        *_axes(x, y, unit),
        _line([p for p in shown if p.on_loose_front], x, y, "loose"),
        _line([p for p in shown if p.on_front], x, y, "front"),
        *(_marker(p, palette[p.technique], x, y, unit) for p in shown),
        *_labels(shown, x, y),
        "</svg>",
    ]
    return "\n".join(parts)


def legend(result: CompareResult) -> str:
    """Coloured names for under the chart."""
    names = "".join(
        f'<span class="key"><i style="background:{color}"></i>{escape(name)}</span>'
        for name, color in colors(result).items()
    )
    return f'<p class="legend">{names}<span class="key"><i class="hollow"></i>fails</span></p>'


def _axes(x: _Scale, y: _Scale, unit: str) -> list[str]:
    parts = []
    for value in x.ticks():
        at = x(value)
        parts.append(f'<path class="grid" d="M{at:.1f} {_TOP:g}V{_HEIGHT - _BOTTOM:g}"/>')
        parts.append(
            f'<text x="{at:.1f}" y="{_HEIGHT - _BOTTOM + 16:g}" text-anchor="middle">{_tick(value)}</text>'
        )
    for value in y.ticks():
        at = y(value)
        parts.append(f'<path class="grid" d="M{_LEFT:g} {at:.1f}H{_WIDTH - _RIGHT:g}"/>')
        text = f"&#8804; {_tick(value)}" if value <= FLOOR_TEXELS * 1.001 else _tick(value)
        parts.append(f'<text x="{_LEFT - 6:g}" y="{at + 4:.1f}" text-anchor="end">{text}</text>')
    middle = 0.5 * (_TOP + _HEIGHT - _BOTTOM)
    parts.append(
        f'<text x="{0.5 * (_LEFT + _WIDTH - _RIGHT):g}" y="{_HEIGHT - 8:g}" text-anchor="middle">'
        f"time, ns a {unit}</text>"
    )
    parts.append(
        f'<text transform="translate(14 {middle:g}) rotate(-90)" text-anchor="middle">'
        "p99 hit error, texels</text>"
    )
    return parts


def _tick(value: float) -> str:
    return f"{value:g}" if 1e-4 <= value < 1e6 else f"{value:.0e}"


def _line(front: list[Point], x: _Scale, y: _Scale, name: str) -> str:
    ordered = sorted(front, key=lambda p: p.time_ns)
    ends = " ".join(f"{x(p.time_ns):.1f},{y(p.error_texels):.1f}" for p in ordered)
    return f'<polyline class="{name}" points="{ends}"/>'


def _marker(p: Point, color: str, x: _Scale, y: _Scale, unit: str) -> str:
    at_x, at_y = x(p.time_ns), y(p.error_texels)
    radius = 6 if p.on_front else 4.5
    edge = "currentColor" if p.on_front else color
    fill = color if p.reliable else "var(--page)"
    least = "\N{LESS-THAN OR EQUAL TO} " if p.error_texels <= FLOOR_TEXELS else ""
    title = f"{p.label}: {p.time_ns:.4g} ns a {unit}, p99 {least}{p.error_texels:.3g} texels"
    if not p.reliable:
        title += ", fails"
    return (
        f'<g class="mark" tabindex="0"><title>{escape(title)}</title>'
        f'<path d="M{x(p.low_ns):.1f} {at_y:.1f}H{x(p.high_ns):.1f}" stroke="{color}" opacity="0.6"/>'
        f'<circle cx="{at_x:.1f}" cy="{at_y:.1f}" r="{radius}" fill="{fill}" stroke="{edge}"/>'
        # Wide enough for a finger.
        f'<circle class="reach" cx="{at_x:.1f}" cy="{at_y:.1f}" r="12"/></g>'
    )


def _labels(shown: list[Point], x: _Scale, y: _Scale) -> list[str]:
    named = sorted((p for p in shown if p.on_front or p.on_loose_front), key=lambda p: not p.on_front)
    # The layout counts from the lower left corner of the axes.
    at = {p.label: (x(p.time_ns) - _LEFT, _HEIGHT - _BOTTOM - y(p.error_texels)) for p in shown}
    sizes = [(_ADVANCE * _FONT * len(short(p.label)) + 4.0, 1.2 * _FONT) for p in named]
    bounds = (_WIDTH - _RIGHT - _LEFT, _HEIGHT - _BOTTOM - _TOP)
    placed = place_labels([at[p.label] for p in named], sizes, list(at.values()), bounds, 6.0)
    parts = []
    for p, size, label in zip(named, sizes, placed, strict=True):
        left, base = label.x + _LEFT, _HEIGHT - _BOTTOM - label.y
        if label.leads:
            parts.append(
                f'<path class="lead" d="M{x(p.time_ns):.1f} {y(p.error_texels):.1f}'
                f'L{left + 0.5 * size[0]:.1f} {base - 0.5 * size[1]:.1f}"/>'
            )
        kind = "name" if p.on_front else "name faint"
        parts.append(
            f'<text class="{kind}" x="{left + 2:.1f}" y="{base - 0.25 * size[1]:.1f}">'
            f"{escape(short(p.label))}</text>"
        )
    return parts
