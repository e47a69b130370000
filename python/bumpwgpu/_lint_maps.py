"""What can be wrong with height, normal and cone maps."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._images import read_any
from ._stress_bake import cones
from .errors import BumpError, BumpWarning
from .heightmap import HeightMap, Wrap
from .repair import NormalReport, check_normals, tile_report

__all__ = ["alpha_heights", "cone_findings", "height_findings", "normal_findings", "unreadable"]

Found = tuple[str, str, str, str]

#: Share of texels whose length may be off by more than 0.02: integers of 8 bits are off by 0.007.
MOST_NOT_UNIT = 0.02
#: Share of texels that may point into the surface: filters and compression turn some over at walls.
MOST_INWARD = 1e-3
#: Correlation below which normals and heights are of different surfaces.
LEAST_CORRELATION = 0.25
#: Largest quotient of the relief's depth and the one its normals were made for.
MOST_SCALE = 1.5
#: How far the surface may reach into a cone, heights: what 32 bits round.
MOST_CUT = 1e-5


def height_findings(
    source: Any, wrap: Wrap, tile_size: tuple[float, float], inverted: bool
) -> tuple[list[Found], HeightMap | None]:
    """Looks at a height map."""
    found = []
    try:
        pixels = read_any(source, "heights")
        found += _tags(pixels.warnings)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", BumpWarning)
            heights = HeightMap(source, wrap=wrap, tile_size=tile_size, invert=inverted)
    except (BumpError, ValueError, TypeError, OSError) as error:
        return [*found, unreadable(error)], None
    low, high = float(heights.array.min()), float(heights.array.max())
    if low == high:
        found.append(("flat-heights", "warning", f"all heights are {low:g}", "Leave the map out."))
    elif heights.bits <= 8:
        found.append(
            (
                "8-bit-heights",
                "warning",
                f"the heights have {heights.bits} bits",
                "Export 16 bits, or smooth the steps with bumpwgpu.dequantise and save 16 bits.",
            )
        )
    if low < high < low + 0.25:
        found.append(
            (
                "unused-range",
                "info",
                f"heights run from {low:.3g} to {high:.3g}",
                "Stretch them to 0..1 and scale the relief down, for more levels.",
            )
        )
    if wrap == "repeat" and min(heights.shape) > 4:
        report = tile_report(heights)
        for axis, seam in (("x", report.x), ("y", report.y)):
            if seam.verdict == "tiles":
                continue
            bad = seam.verdict == "seam"
            what = (
                f"a step {max(seam.ratio, seam.local):.1f} times those near it"
                if bad
                else "the slopes do not meet"
            )
            found.append(
                (
                    "tile-seam",
                    "error" if bad else "warning",
                    f"does not tile along {axis}: {what}",
                    "Make it tile, or use wrap='clamp' or 'mirror'.",
                )
            )
    return found, heights


def alpha_heights(source: Any) -> NDArray[Any]:
    """The plane of heights that a normal map has beside its vectors.

    Raises
    ------
    ValueError
        There is none.
    """
    values = read_any(source, "normals").values
    if values.ndim != 3 or values.shape[2] != 4:
        raise ValueError(
            "its name says that heights stand in the alpha channel, but there is none; export it with alpha"
        )
    return np.ascontiguousarray(values[..., 3])


def normal_findings(
    source: Any,
    partner: HeightMap | None,
    convention: str,
    wrap: Wrap,
    scale: float | None,
    alpha_is_heights: bool = False,
) -> list[Found]:
    """Looks at a normal map, by itself and beside its heights."""
    found = []
    try:
        pixels = read_any(source, "normals")
        found += _tags(pixels.warnings)
        report = check_normals(source, partner, wrap=wrap)
    except (BumpError, ValueError, TypeError, OSError) as error:
        return [*found, unreadable(error)]
    found += _vectors(report, pixels.values.shape[-1])
    if not alpha_is_heights and pixels.values.shape[-1] == 4 and np.ptp(pixels.values[..., 3]) > 0:
        fix = "Name the file _nh when these are heights, and they are looked at too."
        found.append(("data-in-alpha", "info", "something is stored in the alpha channel", fix))
    if partner is not None and partner.shape != pixels.values.shape[:2]:
        sizes = " x ".join(map(str, pixels.values.shape[1::-1]))
        rows, columns = partner.shape
        found.append(
            (
                "size-mismatch",
                "info",
                f"{sizes} texels, and {columns} x {rows} heights",
                "Bake the normals from the heights at their size.",
            )
        )
    belongs = report.heights is None or report.heights.decides
    if report.heights is not None and report.heights.confidence < LEAST_CORRELATION:
        found.append(
            (
                "height-mismatch",
                "error",
                f"slopes of normals and heights correlate by {report.heights.confidence:.2f}",
                "Bake both from one surface: bumpwgpu.bake(heights).",
            )
        )
    elif report.heights is not None and belongs:
        found += _beside(report, scale)
    found += _green(report, convention)
    if wrap == "repeat":
        found += _normal_seams(pixels.values)
    return found


def _vectors(report: NormalReport, channels: int) -> list[Found]:
    found = []
    if channels > 2 and report.not_unit > MOST_NOT_UNIT:
        low, high = report.length_range
        found.append(
            (
                "non-unit",
                "error" if abs(report.mean_length - 1.0) > 0.05 else "warning",
                f"{report.not_unit:.1%} of the vectors are not of length 1 ({low:.2f} to {high:.2f}, mean "
                f"{report.mean_length:.3f})",
                "Normalise them; compress with BC5, which stores two channels, and not as a photograph.",
            )
        )
    if report.inward > MOST_INWARD:
        found.append(
            (
                "inward",
                "error",
                f"{report.inward:.1%} of the vectors point into the surface",
                "Blue must be above half: channels may be exchanged, or the map be in object space.",
            )
        )
    return found


def _beside(report: NormalReport, scale: float | None) -> list[Found]:
    """Normals that belong to their heights."""
    assert report.heights is not None
    found = []
    if report.heights.inverted:
        found.append(
            (
                "inverted-heights",
                "error",
                "the heights are depths to these normals",
                "Read them with invert=True, or invert the file.",
            )
        )
    if scale is not None and report.heights.scale > 0.0:
        quotient = scale / report.heights.scale
        if max(quotient, 1.0 / max(quotient, 1e-30)) > MOST_SCALE:
            found.append(
                (
                    "scale-mismatch",
                    "warning",
                    f"the relief is {scale:.3g} deep, its normals are those of {report.heights.scale:.3g}",
                    f"Use scale={report.heights.scale:.3g}, or bake the normals again.",
                )
            )
    return found


def _green(report: NormalReport, convention: str) -> list[Found]:
    if report.convention is None:
        if report.curl is None:
            return []
        fix = "Give the height map too: it decides."
        return [("undecided-green", "info", "nothing tells which way green points", fix)]
    if report.swapped:
        fix = "Exchange red and green."
        return [("swapped-channels", "error", "red holds y, and green x", fix)]
    if report.convention != convention:
        points = {"opengl": "up", "directx": "down"}[report.convention]
        fix = f"Invert green, or import the map as {report.convention}."
        return [
            (
                "wrong-green",
                "error",
                f"green points {points} the image ({report.convention}), and {convention} was expected; "
                f"confidence {report.confidence:.2f}",
                fix,
            )
        ]
    return []


def _normal_seams(values: NDArray[Any]) -> list[Found]:
    """Whether vectors jump more from the last line to the first than anywhere inside."""
    found = []
    vectors = values[..., :3].astype(np.float64)
    if values.dtype.kind in "ui":
        vectors /= np.iinfo(values.dtype).max
    for axis, name in ((1, "x"), (0, "y")):
        if vectors.shape[axis] < 8:
            continue
        lines = np.moveaxis(vectors, axis, 0)
        inside = np.abs(np.diff(lines, axis=0)).mean(axis=(1, 2))
        edge = float(np.abs(lines[0] - lines[-1]).mean())
        usual = float(np.median(inside))
        if edge > 1.2 * float(inside.max()) and edge > 2.0 * usual + 1e-3:
            found.append(
                (
                    "tile-seam",
                    "error",
                    f"does not tile along {name}: vectors change {edge / max(usual, 1e-9):.1f} times as much "
                    "across the edge as inside",
                    "Make it tile, or use wrap='clamp' or 'mirror'.",
                )
            )
    return found


def cone_findings(source: Any, role: str, partner: HeightMap | None) -> list[Found]:
    """Whether the cones of a map are empty over its heights."""
    try:
        pixels = read_any(source, "cones")
    except (BumpError, ValueError, TypeError, OSError) as error:
        return [unreadable(error)]
    found = _tags(pixels.warnings)
    if partner is None:
        fix = "Give the height map too."
        return [*found, ("unknown-role", "info", "cones can only be checked beside their heights", fix)]
    ratios = pixels.values if pixels.values.ndim == 2 else pixels.values[..., 0]
    if ratios.shape != partner.shape:
        rows, columns = partner.shape
        message = f"{ratios.shape[1]} x {ratios.shape[0]} cones over {columns} x {rows} heights"
        fix = "Bake cones from the heights at their size: mips and resized cones are not safe."
        return [*found, ("size-mismatch", "error", message, fix)]
    scaled = ratios.astype(np.float64)
    if ratios.dtype.kind in "ui":
        scaled /= np.iinfo(ratios.dtype).max
    row = cones(role, partner, scaled)
    if row["worst"] > MOST_CUT:
        found.append(
            (
                "non-conservative-cone",
                "error",
                f"the surface reaches {row['worst']:.2g} of the relief into cones, {row['where']}",
                f"Bake {role} with mode='conservative', and round down when encoding.",
            )
        )
    return found


def _tags(texts: list[str]) -> list[Found]:
    found = []
    for text in texts:
        if "sRGB" in text or "gamma" in text:
            fix = "Save it without a colour profile, and import it as linear data."
            found.append(("srgb-tagged", "error", text, fix))
        elif "the first is read" in text:
            fix = "Save each picture as a file of its own."
            found.append(("several-pictures", "warning", text, fix))
        elif "in blocks" in text:
            fix = "Keep normals in BC5 or BC7, and heights in BC4 or 16 bits."
            found.append(("lossy", "warning", text, fix))
        elif "JPEG" in text:
            fix = "Export PNG, TIFF or EXR."
            found.append(("lossy", "warning", text, fix))
    return found


def unreadable(error: BaseException) -> Found:
    """What is said of a file that could not be read."""
    text = str(error).splitlines()
    return ("unreadable", "error", text[0] if text else type(error).__name__, "Export the file again.")
