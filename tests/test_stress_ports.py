"""The stability suite finds what goes wrong when searches and bakes are ported: texels, borders, units."""

from __future__ import annotations

from typing import Any

import numpy as np
from test_stress import bake_only, checks, march_only, shifted

import bumpwgpu as bw


def test_half_a_texel_is_found() -> None:
    def moved(height_map: Any, origins: Any, directions: Any, technique: Any, **options: Any) -> Any:
        # Texels taken for points at their corners, in both axes; what is reported lies on the ray.
        aside = np.array([*(0.5 / np.array(height_map.shape[::-1])), 0.0]).astype(origins.dtype)
        hits = bw.march(height_map, origins + aside, directions, technique, **options)
        return shifted(hits, uv=hits.uv - aside[:2].astype(np.float32))

    assert {"on the surface", "normal"} <= checks(march_only(moved))
    for technique in ("relief", "pom", "steep_linear", "interval", "parallax"):
        assert "mirrored" in checks(march_only(moved, technique)), technique

    def baked(*arguments: Any, **options: Any) -> Any:
        made = bw.bake(*arguments, **options)
        return {name: 0.5 * (made[name] + np.roll(made[name], 1, axis=1)) for name in made}

    for name in ("normal_xy", "relief", "curvature"):
        assert not bake_only(name, baked), name


def test_a_wrong_mirror_is_found() -> None:
    def repeated(height_map: Any, *rays: Any, **options: Any) -> Any:
        wrap = "repeat" if height_map.wrap == "mirror" else height_map.wrap
        other = bw.HeightMap(height_map.array, scale=height_map.scale, wrap=wrap)
        return bw.march(other, *rays, **options)

    assert {"on the surface", "normal"} <= checks(march_only(repeated, only="mirror"))

    def unique(height_map: Any, *rays: Any, **options: Any) -> Any:
        # A mirror that does not say the edge texel twice, as image libraries have it.
        if height_map.wrap != "mirror" or min(height_map.shape) < 3:
            return bw.march(height_map, *rays, **options)
        origins, directions, technique = rays
        rows, columns = height_map.shape
        period = np.array([2.0 * columns - 2.0, 2.0 * rows - 2.0])
        twice = np.pad(height_map.array, ((0, rows - 2), (0, columns - 2)), mode="reflect")
        other = bw.HeightMap(twice, scale=height_map.scale, wrap="repeat")
        share = np.array([*(np.array([columns, rows]) / period), 1.0]).astype(origins.dtype)
        hits = bw.march(other, origins * share, directions * share, technique, **options)
        return shifted(hits, uv=(hits.uv / share[:2]).astype(np.float32))

    assert "on the surface" in checks(march_only(unique, only="mirror"))
    for technique in ("relief", "interval"):
        assert "whole tiles" in checks(march_only(unique, technique, "mirror")), technique


def test_a_climb_over_the_border_is_found() -> None:
    def climbing(height_map: Any, origins: Any, directions: Any, technique: Any, **options: Any) -> Any:
        # What would be hit in the first texel past the border is passed over.
        hits = bw.march(height_map, origins, directions, technique, **options)
        columns = height_map.shape[1]
        inside = hits.uv[:, 0] % 1.0
        with np.errstate(invalid="ignore"):
            crossed = np.floor(hits.uv[:, 0]) != np.floor(origins[:, 0])
        over = np.isfinite(hits.t) & crossed & (np.minimum(inside, 1.0 - inside) * columns < 1.0)
        step = 2.0 / (columns * np.maximum(np.abs(directions[:, 0]), 1e-3))
        start = np.where(np.isfinite(hits.t), hits.t, 0.0) + step
        later = bw.march(
            height_map, (origins + start[:, None] * directions).astype(origins.dtype), directions, technique,
            **options,
        )  # fmt: skip
        t = np.where(over, start + later.t, hits.t).astype(np.float32)
        place = origins + np.where(np.isfinite(t), t, 0.0)[:, None] * directions
        found = np.isfinite(t)
        return shifted(
            hits,
            t,
            uv=np.where(found[:, None], place[:, :2], np.nan).astype(np.float32),
            z=np.where(found, place[:, 2], np.nan).astype(np.float32),
            normal=np.where(over[:, None], later.normal, hits.normal),
            status=np.where(over, later.status, hits.status),
        )

    found = bw.stress("exact", maps=[], frames=[], march=climbing, rays=64, only="repeat")
    assert "nothing skipped" in checks(found)


def test_the_wrong_cell_on_a_line_is_found() -> None:
    def beside(height_map: Any, origins: Any, directions: Any, technique: Any, **options: Any) -> Any:
        # floor(x - 0.5) that a rounding takes to the cell before, on lines between cells alone.
        size = np.array(height_map.shape[::-1])
        at = origins[:, :2] * size - 0.5
        on_line = np.abs(at - np.rint(at)) < 1e-5
        moved = origins.copy()
        moved[:, :2] -= on_line / size
        hits = bw.march(height_map, moved, directions, technique, **options)
        back = (on_line / size).astype(np.float32)
        return shifted(hits, uv=hits.uv + back)

    found = march_only(beside, only="cell border")
    assert {"on the surface", "nothing skipped"} <= checks(found)


def test_filters_and_units_of_bakes_are_found() -> None:
    def transposed(source: Any, *arguments: Any, **options: Any) -> Any:
        other = bw.HeightMap(source.array.T, scale=source.scale, wrap=source.wrap)
        made = bw.bake(other, *arguments, **options)
        return {name: np.swapaxes(made[name], 0, 1) for name in made}

    assert not bake_only("normal", transposed)

    def blurred(*arguments: Any, **options: Any) -> Any:
        shifts = ((0, 0), (1, 0), (0, 1), (1, 1))
        made = bw.bake(*arguments, **options)
        return {name: sum(np.roll(made[name], at, axis=(-1, -2)) for at in shifts) / 4 for name in made}

    for name, relief in (("ao", "odd"), ("curvature", "odd"), ("distance", "step"), ("cone", "odd")):
        assert not bw.stress([], maps=[name], frames=[], bake=blurred, only=relief), name

    def turned(*arguments: Any, **options: Any) -> Any:
        return {"horizon": np.roll(bw.bake(*arguments, **options)["horizon"], 1, axis=0)}

    assert not bake_only("horizon", turned)

    for factor in (0.9999, 1.0001):

        def bent(*arguments: Any, factor: float = factor, **options: Any) -> Any:
            return {"horizon": bw.bake(*arguments, **options)["horizon"] * factor}

        found = bw.stress([], maps=["horizon"], frames=[], bake=bent)
        assert "horizons" in checks(found), factor

    def raised(*arguments: Any, **options: Any) -> Any:
        return {"horizon": np.minimum(bw.bake(*arguments, **options)["horizon"] + 1e-5, 1.0)}

    assert {"horizons", "shifted"} <= checks(bake_only("horizon", raised))

    def steeper(source: Any, *arguments: Any, **options: Any) -> Any:
        other = bw.HeightMap(source.array, scale=1.001 * source.scale, wrap=source.wrap)
        return bw.bake(other, *arguments, **options)

    for name in ("normal", "curvature", "moments", "normal_mips", "toksvig"):
        assert not bake_only(name, steeper), name
        assert bake_only(name), name


def test_mips_that_stray_are_found() -> None:
    def dropped(*arguments: Any, **options: Any) -> Any:
        # Squares of four texels, whose last row and column are left out where sides are odd.
        made = {}
        for name, levels in bw.bake(*arguments, **options).items():
            made[name] = [levels[0]]
            for level in levels[1:]:
                rows, columns = level.shape[:2]
                finer = made[name][-1]
                # A side of 1 has no second half.
                finer = np.concatenate([finer, finer], axis=0) if len(finer) == 1 else finer
                finer = np.concatenate([finer, finer], axis=1) if finer.shape[1] == 1 else finer
                parts = [finer[j::2, i::2][:rows, :columns] for j in (0, 1) for i in (0, 1)]
                made[name].append((sum(parts) / 4).astype(np.float32))
        return made

    for name in ("moments", "normal_mips"):
        assert "averages" in checks(bake_only(name, dropped)), name

    def fewer(*arguments: Any, **options: Any) -> Any:
        return {name: levels[1:] for name, levels in bw.bake(*arguments, **options).items()}

    for name in ("moments", "normal_mips", "toksvig"):
        assert "averages" in checks(bake_only(name, fewer)), name
