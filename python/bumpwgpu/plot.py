"""The time-against-error plot as a picture file; needs matplotlib."""

from __future__ import annotations

import io
import math
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ._atomic import replace_file
from ._chart import FLOOR_TEXELS, axis_range, colors, place_labels, points, short
from .errors import CompareError

if TYPE_CHECKING:
    from .compare_result import CompareResult

__all__ = ["plot"]

_SUFFIXES = (".png", ".svg", ".pdf")
#: Quotient of the ends of the time axis up to which each decade has three numbers.
_FEW_DECADES = 300.0
_DPI = 130
_FONT_POINTS = 7.5


def plot(result: CompareResult, path: str | os.PathLike[str]) -> Path:
    """Write the plot; see :meth:`CompareResult.plot`."""
    suffix = Path(path).suffix.lower()
    if suffix not in _SUFFIXES:
        raise ValueError(f"plots are written as {', '.join(_SUFFIXES)}, not {suffix or 'without a suffix'!r}")
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError:
        raise CompareError("plotting needs matplotlib: pip install 'bumpwgpu[plot]'") from None
    panels = ["all", *(elevation for elevation in result.elevations if elevation != "all")]
    columns = min(len(panels), 3)
    rows = math.ceil(len(panels) / columns)
    figure = Figure(figsize=(5.4 * columns, 4.3 * rows + 1.0), dpi=_DPI, facecolor="white")
    FigureCanvasAgg(figure)
    grid = figure.subplots(rows, columns, squeeze=False)
    palette = colors(result)
    for axes, elevation in zip(grid.flat, panels, strict=False):
        _draw_panel(axes, result, elevation, palette)
    for axes in list(grid.flat)[len(panels) :]:
        axes.set_axis_off()
    where = "device" if result.timed_on == "device" else "one CPU core"
    figure.suptitle(
        f"Time against error ({where}). Solid: settings worth having; dashed: if failing rays did not matter",
        fontsize=11,
    )
    handles = [_marker(color, name) for name, color in palette.items()]
    handles.append(_marker("#999999", "fails on over 0.1 % of rays", filled=False))
    figure.legend(handles=handles, loc="lower center", ncols=min(len(handles), 6), fontsize=8, frameon=False)
    figure.tight_layout(rect=(0.0, 0.9 / (4.3 * rows + 1.0), 1.0, 0.98))
    figure.canvas.draw()
    for axes, elevation in zip(grid.flat, panels, strict=False):
        _draw_labels(figure, axes, result, elevation)
    buffer = io.BytesIO()
    figure.savefig(buffer, format=suffix[1:], dpi=_DPI)
    return replace_file(path, buffer.getvalue())


def _marker(color: str, name: str, filled: bool = True) -> Any:
    from matplotlib.lines import Line2D

    return Line2D(
        [],
        [],
        linestyle="",
        marker="o",
        markersize=6,
        label=name,
        markeredgecolor=color,
        markerfacecolor=color if filled else "none",
    )


def _draw_panel(axes: Any, result: CompareResult, elevation: Any, palette: dict[str, str]) -> None:
    from matplotlib.ticker import LogLocator, NullLocator

    shown = points(result, elevation)
    axes.set_xscale("log")
    axes.set_yscale("log")
    low, high = axis_range([end for p in shown for end in (p.low_ns, p.high_ns)], 0.5)
    axes.set_xlim(low, high)
    # Few enough for whole numbers beside each other.
    parts = (1.0, 2.0, 5.0) if high < _FEW_DECADES * low else (1.0,)
    axes.xaxis.set_major_locator(LogLocator(subs=parts))
    axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set_ylim(*axis_range([p.error_texels for p in shown], 2.0))
    axes.grid(True, which="major", color="#dddddd", linewidth=0.6)
    axes.set_axisbelow(True)
    front = sorted((p for p in shown if p.on_front), key=lambda p: p.time_ns)
    axes.plot([p.time_ns for p in front], [p.error_texels for p in front], color="#222222", linewidth=1.4)
    loose = sorted((p for p in shown if p.on_loose_front), key=lambda p: p.time_ns)
    axes.plot(
        [p.time_ns for p in loose],
        [p.error_texels for p in loose],
        color="#777777",
        linewidth=0.9,
        linestyle="--",
        zorder=1.5,
    )
    for p in shown:
        color = palette[p.technique]
        axes.plot([p.low_ns, p.high_ns], [p.error_texels] * 2, color=color, linewidth=1.0, alpha=0.6)
        axes.plot(
            [p.time_ns],
            [p.error_texels],
            linestyle="",
            marker="o",
            markersize=7 if p.on_front else 5,
            markeredgecolor="#222222" if p.on_front else color,
            markerfacecolor=color if p.reliable else "white",
        )
    axes.set_title("all elevations" if elevation == "all" else f"{elevation:g} degrees", fontsize=10)
    unit = "pixel" if result.kind == "scene" else "ray"
    axes.set_xlabel(f"time, ns a {unit}", fontsize=8)
    axes.set_ylabel("p99 hit error, texels", fontsize=8)
    axes.tick_params(labelsize=8, which="both")
    axes.yaxis.set_major_formatter(_power)
    axes.yaxis.set_minor_formatter("")
    if any(p.error_texels == FLOOR_TEXELS for p in shown):
        axes.axhline(FLOOR_TEXELS, color="#999999", linewidth=0.6, linestyle=":")


def _power(value: float, _: int) -> str:
    """A power of ten; the floor stands for everything below it too."""
    sign = r"\leq " if value <= 1.001 * FLOOR_TEXELS else ""
    return f"${sign}10^{{{round(math.log10(value))}}}$"


def _draw_labels(figure: Any, axes: Any, result: CompareResult, elevation: Any) -> None:
    """Names of the front, placed in pixels once the layout stands."""
    renderer = figure.canvas.get_renderer()
    box = axes.get_window_extent(renderer)
    shown = points(result, elevation)
    to_pixels = axes.transData.transform
    at = {p.label: tuple(to_pixels((p.time_ns, p.error_texels)) - (box.x0, box.y0)) for p in shown}
    named = sorted((p for p in shown if p.on_front or p.on_loose_front), key=lambda p: not p.on_front)
    texts = [
        axes.text(
            0,
            0,
            short(p.label),
            fontsize=_FONT_POINTS,
            color="#000000" if p.on_front else "#666666",
            weight="bold" if p.on_front else "normal",
        )
        for p in named
    ]
    sizes = [(extent.width, extent.height) for extent in (text.get_window_extent(renderer) for text in texts)]
    radius = 5.0 * _DPI / 100.0
    anchors = [at[p.label] for p in named]
    labels = place_labels(anchors, sizes, list(at.values()), (box.width, box.height), radius)
    back = axes.transData.inverted().transform
    for point, text, size, label in zip(named, texts, sizes, labels, strict=True):
        text.set_position(back((label.x + box.x0, label.y + box.y0)))
        text.set_verticalalignment("bottom")
        if label.leads:
            middle = (label.x + 0.5 * size[0] + box.x0, label.y + 0.5 * size[1] + box.y0)
            end = back(middle)
            axes.plot(
                [point.time_ns, end[0]],
                [point.error_texels, end[1]],
                color="#888888",
                linewidth=0.5,
                zorder=1,
            )
        text.set_bbox({"facecolor": "white", "edgecolor": "none", "pad": 0.5, "alpha": 0.75})
