"""What to use within a budget, checked on rays that it was not chosen by."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from . import _bumpwgpu
from . import techniques as _techniques
from ._checks import choice, number, whole
from .engines import EngineSettings, engine_settings
from .heightmap import HeightMap

if TYPE_CHECKING:
    from .compare_result import CompareResult, Row
    from .techniques import Technique

__all__ = ["MipAdvice", "Recommendation", "recommend", "recommend_by_mip"]

#: Shading languages that a search can be written in.
LANGUAGES = ("wgsl", "glsl", "hlsl", "msl")
#: Picks that may turn out worse on unseen rays before nothing is recommended.
MOST_CHECKED = 12
#: Rays that a pick is checked on, at least, all elevations together: what a bound on the 99th
#: percentile needs to be near it.
LEAST_CHECKED = 4096


@dataclass(frozen=True)
class Recommendation:
    """What to use, and why; or why nothing qualifies.

    Attributes
    ----------
    technique : str or None
        Name of the technique, None when nothing is within the budget.
    parameters : dict of str to int
        Its parameters.
    error_p99_texels : float or None
        99th percentile of the hit-uv error on the rays it was chosen by, texels.
    failure_rate : float or None
        Measured share of rays without a right hit, 0..1.
    time_ns_per_ray : float or None
        Median time.
    reason : str
        A few sentences.
    memory_bytes : int or None
        Texture that it reads: heights, and the maps baked from them.
    heights_format, cones_format : str or None
        Texture formats it was measured with; None for cones where none are read.
    bound_p99_texels : float or None
        What the 99th percentile does not exceed, with 95 % confidence, by rays that the choice did not
        know; None where it was not checked.
    bound_failure_rate : float or None
        The same for the share of rays without a right hit.
    verified_rays : int
        How many rays that was checked on.
    """

    technique: str | None
    parameters: dict[str, int]
    error_p99_texels: float | None
    failure_rate: float | None
    time_ns_per_ray: float | None
    reason: str
    memory_bytes: int | None = None
    heights_format: str | None = None
    cones_format: str | None = None
    bound_p99_texels: float | None = None
    bound_failure_rate: float | None = None
    verified_rays: int = 0
    _height_map: HeightMap | None = field(default=None, repr=False, compare=False)

    def __bool__(self) -> bool:
        return self.technique is not None

    def __str__(self) -> str:
        return self.reason if self.technique is not None else f"No recommendation. {self.reason}"

    def object(self) -> Technique:
        """The technique as an object, for `render` and `march`.

        Returns
        -------
        Technique

        Raises
        ------
        ValueError
            Nothing was recommended.
        """
        made: Technique = type(_techniques.get(self._name()))(**self.parameters)
        return made

    def shader(self, language: Literal["wgsl", "glsl", "hlsl", "msl"] = "wgsl") -> str:
        """The search with exactly these parameters as a shader.

        It has the functions ``search`` and ``occluded`` and a fragment entry point that shows how they
        are called. WGSL is what `render` runs; the others are made of it by naga: GLSL ES 3.00 (WebGL
        2) for searches that read a height texture, 3.10 for those that read buffers, HLSL of shader
        model 5.1, MSL 2.0, whose buffers, textures and samplers have slots from 0 on in the order of the
        entry point's arguments; ``_buffer_sizes`` holds the bytes of buffers that end in an array.

        Parameters
        ----------
        language : {"wgsl", "glsl", "hlsl", "msl"}
            The shading language.

        Returns
        -------
        str

        Raises
        ------
        ValueError
            Nothing was recommended, the technique draws without searching, or no such language.
        """
        name = self._name()
        choice("language", language, LANGUAGES)
        if not _techniques.get(name).marches:
            raise ValueError(f"{name} does not search: there is no search to write out")
        wrap = "repeat" if self._height_map is None else self._height_map.wrap
        return _bumpwgpu.export_search(name, list(self.parameters.items()), wrap, language)

    def settings(self, engine: Literal["bevy", "godot", "threejs", "unity_hdrp"]) -> EngineSettings:
        """The same in the words of an engine's material.

        Parameters
        ----------
        engine : {"bevy", "godot", "threejs", "unity_hdrp"}
            Which engine.

        Returns
        -------
        EngineSettings
            Says whether the engine's own material has this technique, or needs :meth:`shader`.

        Raises
        ------
        ValueError
            Nothing was recommended, no such engine, or it is not known for which height map.
        """
        name = self._name()
        if self._height_map is None:
            raise ValueError("this recommendation does not say for which height map it is")
        return engine_settings(name, self.parameters, self._height_map, engine)

    def _name(self) -> str:
        if self.technique is None:
            raise ValueError(f"nothing was recommended: {self.reason}")
        return self.technique


class MipAdvice(NamedTuple):
    """What to use where a mip level of the height map is read.

    Attributes
    ----------
    level : int
        The mip level, 0 is the map itself.
    size : (int, int)
        Rows and columns of that level.
    texel_size : float
        Mesh units covered by one of its texels, along the finer axis.
    recommendation : Recommendation
        Errors are in texels of this level.
    """

    level: int
    size: tuple[int, int]
    texel_size: float
    recommendation: Recommendation

    def distance(self, fov_y: float = 45.0, pixels: int = 1080) -> float:
        """From how far away a pixel covers a texel of this level.

        Parameters
        ----------
        fov_y : float, default 45
            Vertical field of view, degrees, above 0 and below 180.
        pixels : int, default 1080
            Height of the picture.

        Returns
        -------
        float
            Mesh units; 0 for level 0, which is also read from nearer by.

        Raises
        ------
        ValueError, TypeError
            Out of range or of the wrong kind.
        """
        angle = number("fov_y", fov_y, 0.1, 179.0)
        rows = whole("pixels", pixels, 1, 1 << 16)
        if self.level == 0:
            return 0.0
        return self.texel_size * rows / (2.0 * math.tan(math.radians(angle) / 2.0))


def recommend(
    result: CompareResult,
    rows: list[Row],
    measured: list[Any],
    budget: tuple[float, float, float, float],
    elevation: float | str,
    verify: bool,
) -> Recommendation:
    """See :meth:`bumpwgpu.CompareResult.recommend`."""
    left = list(range(len(rows)))
    refused: list[str] = []
    height_map = result._height_map()
    for _ in range(MOST_CHECKED):
        at, reason = _bumpwgpu.compare_recommend([measured[index] for index in left], budget)
        if at is None:
            return Recommendation(None, {}, None, None, None, " ".join([reason, *refused]))
        row = rows[left[at]]
        advice = Recommendation(
            row["technique"],
            dict(row["parameters"]),
            row["uv_error_p99_texels"],
            row["failure_rate"],
            measured[left[at]][1][1],
            reason,
            row["memory_bytes"],
            row["heights_format"],
            row["cones_format"],
            _height_map=height_map,
        )
        if not verify:
            return replace(advice, reason=" ".join([reason, *_worst_angle(result, row, elevation), *refused]))
        checked = result._verified(row, elevation)
        bound = checked["uv_error_p99_bound_texels"]
        bound = checked["uv_error_p99_texels"] if bound is None else bound
        if bound <= budget[0] and checked["failure_rate"] <= budget[1]:
            said = (
                f"On {checked['rays']} rays it was not chosen by, the p99 error is at most {bound:.3g} "
                f"texels and at most {100.0 * checked['failure_rate_bound']:.2g} % fail (95 % confidence)."
            )
            return replace(
                advice,
                reason=" ".join([reason, *_worst_angle(result, row, elevation), said, *refused]),
                bound_p99_texels=bound,
                bound_failure_rate=checked["failure_rate_bound"],
                verified_rays=checked["rays"],
            )
        refused.append(
            f"{row['label']} did not hold on unseen rays: p99 up to {bound:.3g} texels, "
            f"{100.0 * checked['failure_rate']:.2g} % failing."
        )
        del left[at]
    reason = f"None of the {MOST_CHECKED} cheapest settings held on unseen rays. {refused[-1]}"
    return Recommendation(None, {}, None, None, None, reason)


def _worst_angle(result: CompareResult, row: Row, elevation: float | str) -> list[str]:
    """A sentence on the angle at which a setting is worst, if that is worse than its sum."""
    own = [other for other in result.rows if other["label"] == row["label"]]
    worst = max(own, key=lambda other: other["uv_error_p99_texels"])
    if elevation != "all" or worst["uv_error_p99_texels"] <= row["uv_error_p99_texels"]:
        return []
    texels = worst["uv_error_p99_texels"]
    return [f"At its worst angle, {worst['elevation']:g} degrees, the p99 error is {texels:.3g} texels."]


def recommend_by_mip(
    result: CompareResult, max_error: float, levels: int, progress: Any, options: dict[str, Any]
) -> list[MipAdvice]:
    """See :meth:`bumpwgpu.CompareResult.recommend_by_mip`."""
    from .comparing import compare

    source = result._height_map()
    if source is None or result.kind != "planar":
        raise ValueError("mips are recommended for height maps; compare the scene's height map itself")
    plain = [row for row in result.select("all") if row["heights_format"] == "r32float"]
    plain = [row for row in plain if row["cones_format"] in (None, "r32float")]
    settings = [type(_techniques.get(row["technique"]))(**row["parameters"]) for row in plain]
    angles = [angle for angle in result.elevations if angle != "all"]
    made = []
    heights = source.array
    for level in range(levels):
        if level > 0:
            if max(heights.shape) == 1:
                break
            heights = halved(heights)
        own = HeightMap(
            heights,
            scale=source.scale,
            base=source.base,
            tile_size=source.tile_size,
            wrap=source.wrap,
        )
        tell = None
        if progress is not None:

            def tell(done: int, total: int, text: str, level: int = level) -> None:
                progress(level * total + done, levels * total, f"mip {level}: {text}")

        here = result
        if level > 0:
            here = compare(
                own,
                settings,
                elevations=angles,
                device="gpu" if result.timed_on == "device" else "cpu",
                rays=max(result.environment["rays_per_elevation"] // 2, 1),
                repeats=3,
                seed=result.environment["seed"],
                progress=tell,
            )
        rows, columns = heights.shape
        texel = min(source.tile_size[0] / columns, source.tile_size[1] / rows)
        made.append(MipAdvice(level, (rows, columns), texel, here.recommend(max_error, **options)))
    return made


def halved(heights: Any) -> Any:
    """The next mip: means of two by two texels; an odd last row or column weighs into its neighbour."""
    for axis in (0, 1):
        length = heights.shape[axis]
        if length == 1:
            continue
        edges = np.linspace(0, length, length // 2 + 1)
        heights = _means(heights, axis, edges)
    return np.ascontiguousarray(np.clip(heights, 0.0, 1.0), dtype=np.float32)


def _means(heights: Any, axis: int, edges: Any) -> Any:
    """Means between fractional edges along an axis."""
    sums = np.cumsum(np.moveaxis(heights.astype(np.float64), axis, 0), axis=0)
    sums = np.concatenate([np.zeros_like(sums[:1]), sums])
    whole_part = np.minimum(edges.astype(int), len(sums) - 2)
    part = (edges - whole_part)[:, None]
    upto = sums[whole_part] + part * (sums[whole_part + 1] - sums[whole_part])
    return np.moveaxis(np.diff(upto, axis=0) / np.diff(edges)[:, None], 0, axis)
