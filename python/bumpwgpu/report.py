"""The one-page report of a comparison: one HTML file that needs nothing else."""

from __future__ import annotations

import base64
import io
import json
import os
from collections.abc import Callable
from html import escape
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, features

from ._atomic import replace_file
from ._svg import chart, legend

if TYPE_CHECKING:
    from .compare_result import CompareResult, Picture, Row
    from .recommending import Recommendation

__all__ = ["report"]

#: Ends of the colour scale of the error pictures, texels; logarithmic in between.
HEAT_RANGE = (0.01, 10.0)
#: Viridis (Smith and van der Walt 2015) at equal steps; readable with any colour vision and in grey.
_VIRIDIS = np.array(
    [
        (68, 1, 84), (72, 40, 120), (62, 74, 137), (49, 104, 142), (38, 130, 142),
        (31, 158, 137), (53, 183, 121), (109, 205, 89), (180, 222, 44), (253, 231, 37),
    ],
    dtype=np.float64,
)  # fmt: skip
#: Where nothing was hit, or where there is no mesh.
_NO_HIT = (120, 120, 120)

Column = tuple[str, str, str, Callable[[Any], str]]


def _number(value: Any) -> str:
    return "" if value is None else f"{value:.3g}"


def _time(value: Any) -> str:
    return "" if value is None else f"{value:.4g}"


def _percent(value: Any) -> str:
    return "" if value is None else f"{100.0 * value:.3g}"


def _kib(value: Any) -> str:
    return "" if value is None else f"{value / 1024.0:.4g}"


#: What a table shows of a part of the relief beside what belongs to the whole setting.
_OF_SETTING = ("time_cpu_ns_per_ray", "time_device_ns_per_ray", "memory_bytes")
_REGION_NAMES = {
    "all": "everywhere",
    "interior": "interior",
    "silhouette": "silhouettes",
    "shadow": "in shadow",
}

_COLUMNS: tuple[Column, ...] = (
    ("time_cpu_ns_per_ray", "CPU<br>ns", "Median time on one core of the CPU", _time),
    ("time_device_ns_per_ray", "device<br>ns", "Median time on the device", _time),
    ("uv_error_median_texels", "median<br>texels", "Median hit error", _number),
    ("uv_error_p99_texels", "p99<br>texels", "99th percentile of the hit error", _number),
    (
        "uv_error_p99_bound_texels",
        "p99 below<br>texels",
        "What the 99th percentile of all such rays does not exceed, with 95 % confidence",
        _number,
    ),
    ("uv_error_max_texels", "max<br>texels", "Largest hit error", _number),
    ("share_above_1_texel", "&gt; 1 texel<br>%", "Share of rays more than a texel off", _percent),
    ("depth_error_p99", "height<br>p99", "99th percentile of the height error, heights 0..1", _number),
    ("normal_error_p99_deg", "normal<br>p99 &deg;", "99th percentile of the angle between normals", _number),
    ("miss_rate", "missed<br>%", "First hit skipped", _percent),
    (
        "false_hit_rate",
        "in the air<br>%",
        "Hit reported more than 1 % of the relief above the surface and a texel short of it",
        _percent,
    ),
    ("unconverged_rate", "gave up<br>%", "Search did not converge", _percent),
    ("nan_count", "NaN", "Rays with a NaN or an infinity", _number),
    ("shadow_error_rate", "shadow<br>%", "Shadow rays with the wrong answer", _percent),
    ("steps_mean", "steps", "Mean height reads or nodes visited", _number),
    ("memory_bytes", "texture<br>KiB", "Heights and the maps baked from them", _kib),
    (
        "device_difference_p99_texels",
        "device-CPU<br>texels",
        "99th percentile of the distance between the device's hits and the CPU's",
        _number,
    ),
    ("flip_mean", "FLIP", "Mean FLIP error against the exact picture, 0 is equal", _number),
    ("psnr_db", "PSNR<br>dB", "Against the exact picture; empty for equal pictures", _number),
    ("ssim", "SSIM", "Against the exact picture, 1 is equal", _number),
)


def report(result: CompareResult, path: str | os.PathLike[str], title: str | None = None) -> Path:
    """Write the report; see :meth:`CompareResult.report`."""
    if title is not None and not isinstance(title, str):
        raise TypeError(f"title must be a string, got {type(title).__name__}")
    heading = title or f"Techniques on a {'mesh scene' if result.kind == 'scene' else 'height map'}"
    template = resources.files(__package__).joinpath("report_template.html").read_text(encoding="utf-8")
    pictures = result.pictures()
    most = _most_steps(pictures)
    parts = {
        "TITLE": escape(heading),
        "ADVICE": _advice(result),
        "CHARTS": _charts(result),
        "LEGEND": legend(result),
        "ELEVATIONS": "".join(
            f'<option value="{escape(str(elevation))}">{escape(_angle(elevation))}</option>'
            for elevation in _elevations(result)
        ),
        "REGIONS": "".join(
            f'<option value="{name}">{escape(text)}</option>' for name, text in _REGION_NAMES.items()
        ),
        "TABLE": _table(result),
        "DROPPED": _dropped(result),
        "PICTURES": _script_json([_picture(picture, result, most) for picture in pictures]),
        "SCALES": _script_json(
            {
                "heat": ["Distance between the hit and the exact one, texels; grey: no hit.", *HEAT_RANGE],
                "steps": ["Height reads or nodes visited by the view ray.", 1, most],
            }
        ),
        "HEAT_GRADIENT": ", ".join(f"rgb({r:.0f} {g:.0f} {b:.0f})" for r, g, b in _VIRIDIS),
        "ENVIRONMENT": _environment(result.environment),
        "RAY": "pixel" if result.kind == "scene" else "ray",
    }
    return replace_file(path, _fill(template, parts).encode())


def _fill(template: str, parts: dict[str, str]) -> str:
    """Puts each part in once, so that text inside a part is never taken for a placeholder."""
    pieces = template.split("{{")
    out = [pieces[0]]
    for piece in pieces[1:]:
        name, rest = piece.split("}}", 1)
        out += [parts[name], rest]
    return "".join(out)


def _elevations(result: CompareResult) -> list[Any]:
    return ["all", *(elevation for elevation in result.elevations if elevation != "all")]


def _angle(elevation: Any) -> str:
    return "all elevations" if elevation == "all" else f"{elevation:g} degrees"


def _advice(result: CompareResult) -> str:
    lines = []
    said: dict[tuple[Any, ...], tuple[list[str], Recommendation]] = {}
    for budget in (0.1, 0.5, 2.0):
        advice = result.recommend(budget)
        # Equal advice for several budgets is given once, for the strictest.
        key = (advice.technique, *advice.parameters.items(), advice.heights_format, advice.cones_format)
        said.setdefault(key, ([], advice))[0].append(f"{budget:g}")
    for budgets, advice in said.values():
        mark = "yes" if advice else "no"
        within = " and ".join(filter(None, [", ".join(budgets[:-1]), budgets[-1]]))
        lines.append(f'<li class="{mark}"><b>within {within} texels</b> {escape(str(advice))}</li>')
    ties = [
        f"{escape(row['label'])} and {escape(', '.join(row['tied_with']))}"
        for row in result.pareto()
        if row["tied_with"]
    ]
    where = "the device" if result.timed_on == "device" else "one core of the CPU"
    tied = f" Times that cannot be told apart: {'; '.join(ties)}." if ties else ""
    return f"<ul>{''.join(lines)}</ul><p class='note'>Ranked by time on {where}.{tied}</p>"


def _charts(result: CompareResult) -> str:
    return "".join(
        f'<div data-elevation="{escape(str(elevation))}"{"" if elevation == "all" else " hidden"}>'
        f"{chart(result, elevation)}</div>"
        for elevation in _elevations(result)
    )


def _table(result: CompareResult) -> str:
    columns = [column for column in _COLUMNS if any(row.get(column[0]) is not None for row in result.rows)]
    fronts = {
        elevation: {row["label"] for row in result.pareto(elevation)} for elevation in _elevations(result)
    }
    head = "".join(
        f'<th scope="col" title="{escape(about)}"><button type="button">{name}</button></th>'
        for _, name, about, _ in columns
    )
    body = "".join(
        _table_row(part, region, columns, row["label"] in fronts[row["elevation"]])
        for row in result.rows
        for region, part in _parts(row)
    )
    return (
        '<table id="rows"><thead><tr><th scope="col"><button type="button">setting</button></th>'
        f"{head}</tr></thead><tbody>{body}</tbody></table>"
    )


def _parts(row: Row) -> list[tuple[str, Row]]:
    """The whole row, and what it says of each part of the relief."""
    kept = {key: row.get(key) for key in ("label", "elevation", *_OF_SETTING)}
    return [("all", row), *((name, {**part, **kept}) for name, part in row["regions"].items())]


def _table_row(row: Row, region: str, columns: list[Column], on_front: bool) -> str:
    elevation = row["elevation"]
    cells = []
    for key, _, _, show in columns:
        value = row.get(key)
        sort = "" if value is None else f' data-value="{value!r}"'
        cells.append(f"<td{sort}>{show(value)}</td>")
    hidden = "" if elevation == region == "all" else " hidden"
    front = ' class="on-front"' if on_front else ""
    name = f'<th scope="row">{escape(row["label"])}</th>'
    where = f'data-elevation="{escape(str(elevation))}" data-region="{region}"'
    return f"<tr {where}{hidden}{front}>{name}{''.join(cells)}</tr>"


def _dropped(result: CompareResult) -> str:
    if not result.dropped:
        return ""
    body = "".join(
        f'<tr><th scope="row">{escape(row["label"])}</th><td>{_time(row["time_ns_per_ray"])}</td>'
        f"<td>{_number(row['uv_error_p99_texels'])}</td><td>{_percent(row['failure_rate'])}</td></tr>"
        for row in result.dropped
    )
    return (
        f"<details><summary>{len(result.dropped)} settings dropped after a first look</summary>"
        '<p class="note">Another setting was faster and more accurate by far.</p><div class="wide"><table>'
        '<thead><tr><th scope="col">setting</th><th scope="col">ns</th><th scope="col">p99 texels</th>'
        f'<th scope="col">failing %</th></tr></thead><tbody>{body}</tbody></table></div></details>'
    )


def _picture(picture: Picture, result: CompareResult, most_steps: float) -> dict[str, str]:
    row = next((row for row in result.select("all") if row["label"] == picture.label), None)
    about = ""
    if row is not None:
        about = f"p99 {row['uv_error_p99_texels']:.3g} texels, {100.0 * row['miss_rate']:.3g} % missed"
        if row.get("flip_mean") is not None:
            about += f", FLIP {row['flip_mean']:.3g}"
    return {
        "label": picture.label,
        "about": about,
        "color": _color_uri(picture.rgb),
        "heat": _heat_uri(picture.error_texels, HEAT_RANGE),
        "steps": _heat_uri(picture.steps, (1.0, most_steps)),
    }


def _most_steps(pictures: list[Picture]) -> float:
    """Upper end of the scale of steps: nearly all pixels of all pictures are below, a power of two."""
    most = [float(np.nanquantile(p.steps, 0.995)) for p in pictures if np.isfinite(p.steps).any()]
    return float(2.0 ** np.ceil(np.log2(max(2.0, *most)))) if most else 2.0


def _color_uri(rgb: NDArray[np.uint8]) -> str:
    image = Image.fromarray(np.ascontiguousarray(rgb[:, :, :3]))
    if features.check("webp"):
        return _uri(image, "webp", quality=92, method=4)
    return _uri(image, "png", optimize=True)


def _heat_uri(values: NDArray[np.float32], limits: tuple[float, float]) -> str:
    """A picture of numbers with 254 levels of a logarithmic scale."""
    low, high = np.log10(limits)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = (np.log10(values.astype(np.float64)) - low) / (high - low)
    level = np.where(np.isnan(values), 255.0, np.clip(np.nan_to_num(share), 0.0, 1.0) * 254.0)
    image = Image.fromarray(np.rint(level).astype(np.uint8))
    stops = np.linspace(0.0, 254.0, len(_VIRIDIS))
    palette = np.stack([np.interp(np.arange(255), stops, _VIRIDIS[:, c]) for c in range(3)], axis=1)
    image.putpalette([*np.rint(palette).astype(np.uint8).ravel().tolist(), *_NO_HIT])
    return _uri(image, "png", optimize=True)


def _uri(image: Image.Image, kind: str, **options: Any) -> str:
    buffer = io.BytesIO()
    image.save(buffer, kind, **options)
    return f"data:image/{kind};base64,{base64.b64encode(buffer.getvalue()).decode()}"


def _script_json(value: Any) -> str:
    """JSON that cannot end the script it stands in."""
    text = json.dumps(value, allow_nan=False)
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _environment(environment: dict[str, Any]) -> str:
    return "".join(
        f"<dt>{escape(str(name).replace('_', ' '))}</dt><dd>{_value(value)}</dd>"
        for name, value in environment.items()
        if value not in (None, "", [], {})
    )


def _value(value: Any) -> str:
    if isinstance(value, dict):
        named = ((escape(str(key).replace("_", " ")), _value(inner)) for key, inner in value.items())
        return "<br>".join(f"{key}: {inner}" for key, inner in named)
    if isinstance(value, list | tuple):
        return "<br>".join(_value(inner) for inner in value)
    return escape(str(value))
