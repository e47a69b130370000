"""Horizons, occlusion and bent normals under stress: against a hemisphere looked at in double precision.

Lines of sight and the sky between them are sampled here by plain loops that share nothing with the bakes,
which sweep hulls and add up closed forms.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ._stress_rows import Check, row
from ._stress_surface import surface
from .heightmap import HeightMap

__all__ = ["SKY_MAPS", "sky_checks", "sky_texels"]

Numbers = NDArray[np.float64]

SKY_MAPS = ("horizon", "ao", "bent_normal")
#: Mean difference of occlusion to the hemisphere's, over its mean. Measured: at most 0.0007, on a
#: checkerboard.
MOST_AO = 5e-3
#: Mean angle of bent normals to the hemisphere's, degrees. Measured: at most 0.21, on a checkerboard.
MOST_BENT = 0.5
#: Mean difference of horizons besides what lines beside a texel account for: 16 roundings to 32 bits.
MOST_BESIDE = 1e-6
#: Mean difference of horizons whatever accounts for it. Measured: at most 0.002, around a spike of one texel.
MOST_HORIZON = 0.004
#: Texels looked at, azimuths of occlusion and bent normals (the bakes' default), elevations of the sky.
_TEXELS, _AZIMUTHS, _ELEVATIONS = 48, 32, 512


def sky_checks(
    name: str, source: HeightMap, made: Numbers, normals: Numbers
) -> Iterator[tuple[Check, float]]:
    """What was found, and how far in the mean two right bakes of equal maps may then differ: each from the
    truth by its limit.

    Parameters
    ----------
    name : str
        One of `SKY_MAPS`.
    source : HeightMap
        What was baked.
    made : array
        The map.
    normals : (H, W, 3) array
        Normals of the surface, by the kernel that the bake used.
    """
    place = sky_texels(normals)
    if name == "horizon":
        yield from _horizons(source, made, *place)
        return
    sines = _sight(source, *place, _AZIMUTHS, 0.0)
    seen, bent = _sky(sines, normals[place])
    if name == "ao":
        off = np.abs(made[place] - seen)
        worst = float(off.mean() / seen.mean())
        yield row("hemisphere", worst, "share of the mean", MOST_AO, _where(off, place)), 2.0 * MOST_AO
        return
    chord = np.linalg.norm(made[place] - bent, axis=-1)
    angle = np.degrees(2.0 * np.arcsin(np.clip(0.5 * chord, 0.0, 1.0)))
    limit = 2.0 * float(np.radians(MOST_BENT))
    yield row("hemisphere", float(angle.mean()), "mean degrees", MOST_BENT, _where(angle, place)), limit


def sky_texels(normals: Numbers) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Rows and columns of the texels that are looked at: the steepest, and some anywhere."""
    order = np.random.default_rng(7).permutation(normals[..., 2].size)
    steepest = order[np.argsort(normals[..., 2].ravel()[order], kind="stable")[: _TEXELS // 2]]
    chosen = np.concatenate([steepest, order[~np.isin(order, steepest)][: _TEXELS // 2]])
    down, right = np.unravel_index(chosen, normals.shape[:2])
    return down, right


def _horizons(
    source: HeightMap, made: Numbers, down: NDArray[np.intp], right: NDArray[np.intp]
) -> Iterator[tuple[Check, float]]:
    """Mean difference to horizons found along lines.

    Sweeps look along lines up to half a texel beside a texel's centre: as much as that changes horizons they
    may differ, in the mean over texels and azimuths, and by `MOST_BESIDE`, but never by more than
    `MOST_HORIZON`; and no other order of azimuths may fit twice as well.
    """
    beside = [_sight(source, down, right, len(made), aside) for aside in (-0.5, 0.0, 0.5)]
    ours, truth = made[:, down, right], beside[1]
    spread = float((np.max(beside, axis=0) - np.min(beside, axis=0)).mean())
    limit = min(spread + MOST_BESIDE, MOST_HORIZON)
    off = np.abs(ours - truth)
    where = _where(off.mean(axis=0), (down, right))
    yield row("horizons", float(off.mean()), "mean value", limit, where), 2.0 * limit
    orders = [np.roll(way, turn, axis=0) for way in (truth, truth[::-1]) for turn in range(len(made))]
    best = min(np.abs(ours - order).mean() for order in orders)
    ratio = float(off.mean() / (best + 1e-6))
    yield row("order of azimuths", ratio, "ratio", 2.0, where), 2.0 * limit


def _where(off: Numbers, place: tuple[NDArray[np.intp], ...]) -> str:
    at = int(off.argmax())
    return f"at {tuple(int(axis[at]) for axis in place)}" if off[at] > 0.0 else ""


def _sight(
    source: HeightMap, down: NDArray[np.intp], right: NDArray[np.intp], azimuths: int, aside: float
) -> Numbers:
    """Sines of the highest lines of sight, (azimuths, texels), along lines `aside` texels beside the centres.

    A line is looked at where it crosses rows and columns of texels, at three places between, and where it
    begins, for a length of the map.
    """
    rows, columns = source.shape
    wide, tall = source.tile_size
    texel = min(wide / columns, tall / rows)
    low = source.array.astype(np.float64)[down, right]
    found = np.empty((azimuths, len(down)))
    for k in range(azimuths):
        turn = 2.0 * np.pi * k / azimuths
        x, y = np.cos(turn), np.sin(turn)
        length = min(wide / max(abs(x), 1e-9), tall / max(abs(y), 1e-9))
        cuts = [np.array([1e-6 * texel, length])]
        for start, rate in (
            (-aside * texel * y * columns / wide, x * columns / wide),
            (-aside * texel * x * rows / tall, -y * rows / tall),
        ):
            if abs(rate) > 1e-9:
                ends = sorted((start, start + rate * length))
                cuts.append((np.arange(np.floor(ends[0]), np.ceil(ends[1]) + 1.0) - start) / rate)
        cut = np.unique(np.concatenate(cuts))
        cut = cut[(cut >= 1e-6 * texel) & (cut <= length)]
        between = cut[:-1, None] + np.diff(cut)[:, None] * np.array([0.0, 0.25, 0.5, 0.75])
        along = np.append(between, cut[-1])
        u = (right[:, None] + 0.5) / columns + (along * x - aside * texel * y) / wide
        v = (down[:, None] + 0.5) / rows - (along * y + aside * texel * x) / tall
        rise = source.scale * (surface(source, u, v) - low[:, None])
        found[k] = np.maximum((rise / np.hypot(rise, along)).max(axis=1), 0.0)
    return found


def _sky(sines: Numbers, normals: Numbers) -> tuple[Numbers, Numbers]:
    """Share of an even sky's light, (texels,), and mean open direction, (texels, 3), by adding up directions.

    Open is what lies above the horizon, the level mesh and the surface's own tangent plane.
    """
    turn = 2.0 * np.pi * np.arange(len(sines))[:, None] / len(sines)
    high = (np.arange(_ELEVATIONS) + 0.5) * (0.5 * np.pi / _ELEVATIONS)
    across = normals[:, 0] * np.cos(turn) + normals[:, 1] * np.sin(turn)
    facing = across[..., None] * np.cos(high) + normals[:, 2, None] * np.sin(high)
    open_ = (np.sin(high) > sines[..., None]) & (facing > 0.0)
    angle = np.cos(high) * (0.5 * np.pi / _ELEVATIONS) * (2.0 * np.pi / len(sines))
    light = (np.where(open_, facing, 0.0) * angle).sum(axis=(0, 2)) / np.pi
    flat = (open_ * angle * np.cos(high)).sum(axis=2)
    upwards = (open_ * angle * np.sin(high)).sum(axis=(0, 2))
    total = np.stack([(flat * np.cos(turn)).sum(axis=0), (flat * np.sin(turn)).sum(axis=0), upwards], axis=-1)
    length = np.linalg.norm(total, axis=-1, keepdims=True)
    # Where nothing is open the bent normal is the surface's own.
    return light, np.where(length > 1e-6, total / np.maximum(length, 1e-300), normals)
