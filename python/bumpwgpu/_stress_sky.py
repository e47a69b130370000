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

__all__ = ["SKY_MAPS", "bounded", "sky_checks", "sky_texels"]

Numbers = NDArray[np.float64]

SKY_MAPS = ("horizon", "ao", "bent_normal")
#: Mean difference of occlusion to the hemisphere's, over its mean. Measured: at most 0.0007, on a
#: checkerboard.
MOST_AO = 5e-3
#: Mean angle of bent normals to the hemisphere's, degrees. Measured: at most 0.21, on a checkerboard.
MOST_BENT = 0.5
#: How far horizons may lie outside of their bounds: 16 roundings to 32 bits.
MOST_BESIDE = 1e-6
#: Texels along its main axis up to which a texel follows its own line, and from which on the two beside it
#: count; and how close to a column of texels, in texels, a row need not be looked at (docs of
#: `bumpwgpu.bake`: "horizon").
_NEAR, _FAR, _APART = 8, 6, 1.0 / 256.0
#: Texels looked at, azimuths of occlusion and bent normals (the bakes' default), elevations of the sky.
_TEXELS, _AZIMUTHS, _ELEVATIONS = 48, 32, 512


def sky_checks(
    name: str, source: HeightMap, made: Numbers, normals: Numbers
) -> Iterator[tuple[Check, float]]:
    """What was found, and how far in the mean two right bakes of equal maps may then differ: each from the
    truth by its limit. Horizons are to be held to their bounds again.

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
        for check in _horizons(source, made, *place):
            yield check, 0.0
        return
    sines = _sight(source, *place, _AZIMUTHS)
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
) -> Iterator[Check]:
    """Each horizon between its bounds, and no other order of azimuths may fit what is seen along lines
    twice as well.
    """
    yield bounded("horizons", source, made, (down, right))
    ours, truth = made[:, down, right], _sight(source, down, right, len(made))
    beside = np.abs(ours - truth)
    where = _where(beside.mean(axis=0), (down, right))
    yield row("beside the true horizon", float(beside.mean()), "mean value", np.inf, where)
    orders = [np.roll(way, turn, axis=0) for way in (truth, truth[::-1]) for turn in range(len(made))]
    best = min(np.abs(ours - order).mean() for order in orders)
    yield row("order of azimuths", float(beside.mean() / (best + 1e-6)), "ratio", 2.0, where)


def bounded(
    name: str, source: HeightMap, made: Numbers, place: tuple[NDArray[np.intp], NDArray[np.intp]]
) -> Check:
    """How far horizons at some rows and columns lie outside of their bounds."""
    turns = 2.0 * np.pi * np.arange(len(made)) / len(made)
    bounds = np.array([_bounds(source, *place, float(turn)) for turn in turns])
    ours = made[:, place[0], place[1]]
    off = np.maximum(np.maximum(bounds[:, 0] - ours, ours - bounds[:, 1]), 0.0)
    return row(name, float(off.max()), "value", MOST_BESIDE, _where(off.max(axis=0), place))


def _bounds(
    source: HeightMap, down: NDArray[np.intp], right: NDArray[np.intp], turn: float
) -> tuple[Numbers, Numbers]:
    """Between which sines the horizon of texels at an azimuth lies.

    The nearest texels are looked at along the texel's own line, and what is farther along two lines a texel
    apart that pass beside it (Timonen and Westerholm 2010). A line shows what rises most steeply from its own
    height, e, at a distance p that is not known here; seen from another height, e + d, that rises as steeply
    as anything does from there at the most, and at the least as steeply as it did from e, less d / p, where p
    is at least `_FAR`.
    """
    size = np.array(source.shape[::-1])
    texel = np.array(source.tile_size) / size
    advance = np.array([np.cos(turn), -np.sin(turn)]) / texel
    main = int(abs(advance[1]) > abs(advance[0]) * (1.0 + 1e-12))
    slant = advance[1 - main] / abs(advance[main])
    slant = 0.0 if abs(slant) < 1e-12 else float(slant)
    ahead = 1.0 if advance[main] > 0.0 else -1.0
    slope = source.scale / np.hypot(texel[main], slant * texel[1 - main])
    place = np.stack([right, down]).astype(np.float64)
    at = place[main] if ahead > 0.0 else size[main] - 1.0 - place[main]
    share = -slant * at - np.floor(-slant * at)

    def rises(aside: Numbers, steps: Numbers, eye: Numbers) -> Numbers:
        """The steepest rise from a height to points of the lines, heights a step."""
        along = np.repeat(place[:, :, None], steps.shape[1], axis=2)
        along[main] += ahead * steps
        along[1 - main] += aside[:, None] + slant * steps
        u, v = (along + 0.5) / size[:, None, None]
        return np.asarray(((surface(source, u, v) - eye[:, None]) / steps).max(axis=1, initial=-np.inf))

    def sine(rise: Numbers) -> Numbers:
        tangent = np.maximum(rise, 0.0) * slope
        return np.asarray(tangent / np.sqrt(1.0 + tangent * tangent))

    own = source.array.astype(np.float64)[down, right]
    straight = np.zeros(len(own))
    near = _places(slant, straight, 0, _NEAR)
    # The middles between them count, and the slope at the texel itself.
    middles = 0.5 * (near[:, 1:] + near[:, :-1])
    start = np.tile([1e-9, 0.5], (len(own), 1))
    closely = np.concatenate([start, near, middles], axis=1)
    low, high = (sine(rises(straight, steps, own)) for steps in (_sure(near), closely))
    least, most = (_places(slant, share, _FAR, times * int(size[main])) for times in (1, 2))
    least = _sure(least)
    lines = []
    for aside in (-share, 1.0 - share):
        shift = np.zeros((2, len(own)))
        shift[1 - main] = aside
        eye = surface(source, *((place + shift + 0.5) / size[:, None]))
        lines.append((aside, eye, own - eye))
    excess = lines[0][2] + (lines[1][2] - lines[0][2]) * share
    shown = [rises(aside, least, eye) for aside, eye, _ in lines]
    lows = [sine(rise - np.maximum(excess, 0.0) / _FAR) for rise in shown]
    highs = [sine(rises(aside, most, eye + excess)) for aside, eye, _ in lines]
    # What neither line shows from the texel's own height is not there.
    top_low = sine(
        np.max(
            [rise - np.maximum(lift, 0.0) / _FAR for rise, (*_, lift) in zip(shown, lines, strict=True)], 0
        )
    )
    top_high = sine(np.max([rises(aside, most, own) for aside, *_ in lines], axis=0))
    far_low = np.minimum(lows[0] + (lows[1] - lows[0]) * share, top_low)
    far_high = np.minimum(highs[0] + (highs[1] - highs[0]) * share, top_high)
    return np.maximum(low, far_low), np.maximum(high, far_high)


def _places(slant: float, share: Numbers, first: int, last: int) -> Numbers:
    """Steps, (texels, K) in order, at which lines meet columns of texels, and rows; `share` of a row behind
    the texel is where one of them is. Some are there twice.
    """
    whole = np.arange(max(first, 1), last + 1.0)
    steps = np.tile(whole, (len(share), 1))
    if slant != 0.0 and len(whole):
        rows = np.arange(np.ceil(abs(slant) * last) + 2.0) + np.sign(slant) * share[:, None]
        rows /= abs(slant)
        steps = np.concatenate([steps, np.where((rows >= whole[0]) & (rows <= last), rows, whole[0])], axis=1)
    return np.sort(steps, axis=1)


def _sure(steps: Numbers) -> Numbers:
    """Those that are whole, or so far from whole ones that they are looked at for themselves; whole ones for
    others.
    """
    beside = np.abs(steps - np.rint(steps))
    return np.where(beside > _APART, steps, np.clip(np.rint(steps), steps[:, :1], steps[:, -1:]))


def _where(off: Numbers, place: tuple[NDArray[np.intp], ...]) -> str:
    at = int(off.argmax())
    return f"at {tuple(int(axis[at]) for axis in place)}" if off[at] > 0.0 else ""


def _sight(source: HeightMap, down: NDArray[np.intp], right: NDArray[np.intp], azimuths: int) -> Numbers:
    """Sines of the highest lines of sight from the middles of texels, (azimuths, texels).

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
        for rate in (x * columns / wide, -y * rows / tall):
            if abs(rate) > 1e-9:
                ends = sorted((0.0, rate * length))
                cuts.append(np.arange(np.floor(ends[0]), np.ceil(ends[1]) + 1.0) / rate)
        cut = np.unique(np.concatenate(cuts))
        cut = cut[(cut >= 1e-6 * texel) & (cut <= length)]
        between = cut[:-1, None] + np.diff(cut)[:, None] * np.array([0.0, 0.25, 0.5, 0.75])
        along = np.append(between, cut[-1])
        u = (right[:, None] + 0.5) / columns + along * x / wide
        v = (down[:, None] + 0.5) / rows - along * y / tall
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
