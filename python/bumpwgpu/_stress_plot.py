"""The plot of a stress result: error against angle and against offset."""

from __future__ import annotations

import io
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ._atomic import replace_file
from ._chart import FLOOR_TEXELS
from .errors import CompareError

if TYPE_CHECKING:
    from .stressing import StressResult

__all__ = ["plot"]

_SUFFIXES = (".png", ".svg", ".pdf")


def plot(result: StressResult, path: str | os.PathLike[str]) -> Path:
    """Draw it; see :meth:`StressResult.plot`."""
    suffix = Path(path).suffix.lower()
    if suffix not in _SUFFIXES:
        raise ValueError(f"path must end in one of {', '.join(_SUFFIXES)}, got {os.fspath(path)!r}")
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError:
        raise CompareError("plot needs matplotlib: pip install 'bumpwgpu[plot]'") from None
    subjects = list(dict.fromkeys(row["subject"] for row in result.rows if row["check"] == "error"))
    if not subjects:
        raise ValueError("no search that promises the first hit was tested: there is nothing to plot")
    figure = Figure(figsize=(11.0, 4.6), dpi=130, facecolor="white")
    FigureCanvasAgg(figure)
    angle, offset = figure.subplots(1, 2)
    for subject in subjects:
        name = subject.removeprefix("march ")
        _draw(angle, _series(result, subject, "grazing", ""), name)
        _draw(offset, _series(result, subject, "offset", "f64"), name)
    angle.set_xlabel("degrees from the horizon", fontsize=9)
    angle.set_xscale("log")
    angle.invert_xaxis()
    offset.set_xlabel("tiles from the origin", fontsize=9)
    offset.set_xscale("symlog", linthresh=1.0)
    for axes, title in ((angle, "Error against the view angle"), (offset, "Error against the distance")):
        axes.set_title(title, fontsize=11)
        axes.set_yscale("log")
        axes.set_ylabel("hit error, texels", fontsize=9)
        axes.grid(True, color="#dddddd", linewidth=0.6)
        axes.tick_params(labelsize=8)
    angle.legend(fontsize=8, frameon=False, title="solid: worst ray; dashed: median", title_fontsize=8)
    figure.tight_layout()
    buffer = io.BytesIO()
    figure.savefig(buffer, format=suffix[1:])
    return replace_file(path, buffer.getvalue())


def _series(result: StressResult, subject: str, group: str, ending: str) -> list[tuple[float, float, float]]:
    """Where, worst error, and median error; the worst of cases at the same place."""
    found: dict[float, tuple[float, float]] = {}
    for row in result.rows:
        wanted = (row["subject"], row["group"], row["check"]) == (subject, group, "error")
        if not wanted or not row["case"].endswith(ending):
            continue
        worst, median = found.get(row["at"], (0.0, 0.0))
        found[row["at"]] = (max(worst, row["worst"]), max(median, row["median"]))
    if group == "grazing":
        found = {90.0 - at: values for at, values in found.items()}
    floor = 0.01 * FLOOR_TEXELS
    return [(at, max(worst, floor), max(median, floor)) for at, (worst, median) in sorted(found.items())]


def _draw(axes: Any, series: list[tuple[float, float, float]], name: str) -> None:
    places = [at for at, _, _ in series]
    line = axes.plot(places, [worst for _, worst, _ in series], marker="o", markersize=4, label=name)[0]
    axes.plot(
        places, [median for _, _, median in series], linestyle="--", linewidth=1, color=line.get_color()
    )
