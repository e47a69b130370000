"""The stability suite: it passes what is sound and finds every fault planted on purpose."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import bumpwgpu as bw
from bumpwgpu import _bumpwgpu
from bumpwgpu._stress_pictures import picture_checks

RAYS = 16


def march_only(march: Any = None, technique: Any = "exact", only: str = "grazing") -> bw.StressResult:
    return bw.stress(technique, maps=[], frames=[], march=march, rays=RAYS, only=only, device="cpu")


def bake_only(name: str, bake: Any = None) -> bw.StressResult:
    return bw.stress([], maps=[name], frames=[], bake=bake, only="odd")


def checks(result: bw.StressResult) -> set[str]:
    return {row["check"] for row in result.failures}


@pytest.fixture(scope="module")
def sound() -> bw.StressResult:
    return bw.stress(["relief", "exact"], maps=["curvature"], frames=["mikktspace"], rays=RAYS, device="cpu")


def test_what_is_sound_passes(sound: bw.StressResult) -> None:
    assert sound, str(sound)
    assert not sound.failures
    groups = {row["group"] for row in sound.rows}
    assert groups == {
        "grazing", "offset", "scale", "map", "cell border", "length", "far start", "camera", "bundles",
        "shadow", "mesh",
    }  # fmt: skip
    names = {row["case"] for row in sound.rows}
    assert {"89.99 degrees, repeat", "1e+06 tiles, f64", "denormal, mirror", "1 x N, clamp"} <= names
    assert {"mirrored", "needle triangles", "all UVs equal"} <= names
    ulps = max(row["worst"] for row in sound.rows if row["check"] == "on the surface")
    # Measured: 1 for exact; the limit is 24.
    assert 0.0 < ulps < 8.0
    assert "checks, 0 failed" in str(sound)


@pytest.mark.parametrize("technique", ["cone", "relaxed_cone", "distance", "pom"])
def test_other_searches_pass_too(technique: str) -> None:
    for only in ("cell border", "checkerboard", "89"):
        made = march_only(technique=technique, only=only)
        assert made, str(made)


# Planted faults


def shifted(hits: Any, t: Any = None, **others: Any) -> SimpleNamespace:
    kept = {name: getattr(hits, name) for name in ("t", "uv", "z", "normal", "status")}
    return SimpleNamespace(**{**kept, "t": hits.t if t is None else t, **others})


def test_an_epsilon_nudge_is_found() -> None:
    def nudged(height_map: Any, origins: Any, directions: Any, technique: Any, **options: Any) -> Any:
        # A start moved along the ray by 1e-5, as walks do that push themselves over a border.
        moved = origins + directions * directions.dtype.type(1e-5)
        return bw.march(height_map, moved, directions, technique, **options)

    found = march_only(nudged)
    assert {"on the surface", "on the ray"} <= checks(found)
    for technique in ("pom", "interval", "parallax"):
        assert "flat ground" in checks(march_only(nudged, technique, "flat 0.5"))


def test_a_missing_wrap_is_found() -> None:
    def clamped(height_map: Any, *rays: Any, **options: Any) -> Any:
        other = bw.HeightMap(height_map.array, scale=height_map.scale, wrap="clamp")
        return bw.march(other, *rays, **options)

    assert {"on the surface", "whole tiles"} <= checks(march_only(clamped))
    assert "whole tiles" in checks(march_only(clamped, "relief"))

    def clamped_bake(height_map: Any, *arguments: Any, **options: Any) -> Any:
        other = bw.HeightMap(height_map.array, scale=height_map.scale, wrap="clamp")
        return bw.bake(other, *arguments, **options)

    for name in ("normal", "cone", "ao", "horizon", "curvature"):
        assert not bake_only(name, clamped_bake), name


def test_a_search_that_skips_is_found() -> None:
    def skipping(height_map: Any, origins: Any, directions: Any, technique: Any, **options: Any) -> Any:
        return bw.march(
            height_map, origins, directions, bw.techniques.Relief(linear=64, refine=24), **options
        )

    assert "nothing skipped" in checks(march_only(skipping))


def test_answers_that_are_none_are_found() -> None:
    def silent(*rays: Any, **options: Any) -> Any:
        hits = bw.march(*rays, **options)
        t = hits.t.copy()
        t[3] = np.nan
        return shifted(hits, t)

    assert "answers" in checks(march_only(silent))

    def raising(*_rays: Any, **_options: Any) -> Any:
        raise RuntimeError("gave up")

    broken = march_only(raising)
    assert checks(broken) >= {"runs"}
    assert "gave up" in str(broken)


def test_small_faults_of_hits_are_found() -> None:
    def late(*rays: Any, **options: Any) -> Any:
        hits = bw.march(*rays, **options)
        return shifted(hits, hits.t * 1.0001)

    assert {"on the surface", "on the ray", "uv on the ray"} <= checks(march_only(late))
    assert {"on the ray", "uv on the ray"} <= checks(march_only(late, "relief"))

    def later(height_map: Any, origins: Any, directions: Any, technique: Any, **options: Any) -> Any:
        # Everything moved along: only the surface knows.
        hits = bw.march(height_map, origins, directions, technique, **options)
        t = hits.t + np.float32(1e-4)
        return shifted(
            hits,
            t,
            uv=origins[:, :2] + t[:, None] * directions[:, :2],
            z=origins[:, 2] + t * directions[:, 2],
        )

    assert "on the surface" in checks(march_only(later))

    def flipped(*rays: Any, **options: Any) -> Any:
        hits = bw.march(*rays, **options)
        return shifted(hits, uv=hits.uv * np.float32([1, -1]) + np.float32([0, 1]))

    assert "uv on the ray" in checks(march_only(flipped))


@pytest.mark.parametrize(
    "technique",
    ["parallax", "parallax_limited", "steep", "steep_linear", "steep_exponential", "binary", "relief", "pom"],
)
def test_answers_that_are_not_the_recipe_s_are_found(technique: str) -> None:
    def later(height_map: Any, origins: Any, directions: Any, chosen: Any, **options: Any) -> Any:
        # A tenth of what a step of relief mapping's last halving is long.
        hits = bw.march(height_map, origins, directions, chosen, **options)
        t = hits.t + np.float32(1e-5)
        return shifted(
            hits,
            t,
            uv=origins[:, :2] + t[:, None] * directions[:, :2],
            z=origins[:, 2] + t * directions[:, 2],
        )

    assert "recipe" in checks(march_only(later, technique))
    assert march_only(technique=technique)


@pytest.mark.parametrize("lift", [0.001, 0.01])
def test_light_that_gets_past_what_touches_it_is_found(lift: float) -> None:
    def biased(height_map: Any, origins: Any, directions: Any, technique: Any, **options: Any) -> Any:
        # Started above the surface, so that it does not hide itself: as shadow maps do.
        return bw.march(
            height_map, origins + origins.dtype.type([0, 0, lift]), directions, technique, **options
        )

    found = bw.stress("exact", maps=[], frames=[], march=biased, only="shadow")
    assert checks(found) == {"hidden where it should be"}


def test_surfaces_that_hide_themselves_are_found() -> None:
    def sunk(height_map: Any, origins: Any, directions: Any, technique: Any, **options: Any) -> Any:
        options = {**options, "from_surface": False}
        return bw.march(height_map, origins, directions, technique, **options)

    assert checks(march_only(sunk, only="shadow")) == {"does not hide itself"}


def test_lone_posts_that_are_passed_over_are_found() -> None:
    def blind(height_map: Any, origins: Any, directions: Any, technique: Any, **options: Any) -> Any:
        # One ray of each square of eight by eight sees nothing higher than the ground.
        hits = bw.march(height_map, origins, directions, technique, **options)
        at = np.arange(len(origins))
        corner = (at % 8 == 0) & (at // 256 % 8 == 0)
        ground = bw.HeightMap(np.zeros((1, 1), np.float32))
        other = bw.march(ground, origins, directions, technique, **options)
        kept = {
            name: np.where(corner[:, None] if np.ndim(getattr(hits, name)) > 1 else corner,
                           getattr(other, name), getattr(hits, name))
            for name in ("t", "uv", "z", "normal", "status")
        }  # fmt: skip
        return SimpleNamespace(**kept)

    assert "nothing skipped" in checks(march_only(blind, only="bundles"))


def test_a_hit_a_rounding_away_from_a_wall_is_none_too_far_off() -> None:
    # Rays of a thousand tiles: a rounding of t takes them into the next cell, which may be much steeper.
    made = bw.stress("exact", maps=[], frames=[], device="cpu", only="1000")
    assert made, str(made)


def test_small_faults_of_hit_normals_are_found() -> None:
    def steeper(*rays: Any, **options: Any) -> Any:
        hits = bw.march(*rays, **options)
        bent = hits.normal * np.float32([1.01, 1.01, 1.0])
        return shifted(hits, normal=bent / np.linalg.norm(bent, axis=1, keepdims=True))

    assert checks(march_only(steeper)) == {"normal"}

    def turned(*rays: Any, **options: Any) -> Any:
        hits = bw.march(*rays, **options)
        return shifted(hits, normal=hits.normal * np.float32([1, -1, 1]))

    assert checks(march_only(turned)) == {"normal"}

    def unwrapped(height_map: Any, *rays: Any, **options: Any) -> Any:
        # Right but in the cells across the border, whose slope is that of a map that ends there.
        hits = bw.march(height_map, *rays, **options)
        size = np.array(height_map.shape[::-1])
        ends = bw.HeightMap(height_map.array, scale=height_map.scale, wrap="clamp")
        at = hits.uv - np.floor(hits.uv)
        edge = ((at * size < 0.5) | (at * size > size - 0.5)).any(axis=1)
        origins = np.concatenate([at, np.full((len(at), 1), 1.0, np.float32)], axis=1).astype(np.float32)
        down = np.tile(np.float32([0, 0, -1]), (len(at), 1))
        wrong = bw.march(ends, np.nan_to_num(origins, nan=0.5), down, "exact").normal
        return shifted(hits, normal=np.where(edge[:, None], wrong, hits.normal))

    found = bw.stress("exact", maps=[], frames=[], march=unwrapped, rays=64, only="repeat")
    assert checks(found) == {"normal"}


def test_rays_that_disturb_their_neighbours_are_found() -> None:
    def leaking(*rays: Any, **options: Any) -> Any:
        # A lane that is done, here every fifth, spoils the next one a little.
        hits = bw.march(*rays, **options)
        t = hits.t.copy()
        t[1::5] = np.nextafter(t[1::5], np.float32(0))
        return shifted(hits, t)

    assert checks(march_only(leaking)) == {"in reverse"}

    def spreading(*rays: Any, **options: Any) -> Any:
        hits = bw.march(*rays, **options)
        t = hits.t.copy()
        t[1:][~np.isfinite(hits.t[:-1])] = np.nan
        t[5] = np.nan
        return shifted(hits, t)

    assert "answers" in checks(march_only(spreading))


def test_small_faults_of_bakes_are_found() -> None:
    def wider(*arguments: Any, **options: Any) -> Any:
        return {"cone": bw.bake(*arguments, **options)["cone"] * 1.01}

    assert "conservative" in checks(bw.stress([], maps=["cone"], frames=[], bake=wider))

    def reversed_(*arguments: Any, **options: Any) -> Any:
        made = bw.bake(*arguments, **options)["horizon"]
        return {"horizon": np.roll(made[::-1], 1, axis=0)}

    assert "order of azimuths" in checks(bake_only("horizon", reversed_))
    assert bake_only("horizon")

    for factor in (0.98, 1.02):

        def dimmed(*arguments: Any, factor: float = factor, **options: Any) -> Any:
            return {"ao": bw.bake(*arguments, **options)["ao"] * factor}

        assert checks(bw.stress([], maps=["ao"], frames=[], bake=dimmed, only="flat")) >= {"flat ground"}
        # And on every other kind of relief, before a hemisphere in double precision.
        for relief in ("spike", "checkerboard", "step", "extremes", "1 x N", "odd"):
            found = bw.stress([], maps=["ao"], frames=[], bake=dimmed, only=relief)
            missed = {row["case"] for row in found.rows if "scale 0.1" in row["case"]}
            missed -= {row["case"] for row in found.failures if row["check"] == "hemisphere"}
            assert not missed, missed

    def steeper(source: Any, *arguments: Any, **options: Any) -> Any:
        other = bw.HeightMap(source.array, scale=1.01 * source.scale, wrap=source.wrap)
        return bw.bake(other, *arguments, **options)

    for name in ("normal", "relief", "normal_xy"):
        assert any(check.startswith("formula") for check in checks(bake_only(name, steeper))), name

    def leaning(*arguments: Any, **options: Any) -> Any:
        bent = bw.bake(*arguments, **options)["bent_normal"] + np.float32([0.02, 0.0, 0.0])
        return {"bent_normal": bent / np.linalg.norm(bent, axis=-1, keepdims=True)}

    assert "hemisphere" in checks(bake_only("bent_normal", leaning))
    assert bake_only("ao")
    assert bake_only("bent_normal")


def test_a_swapped_green_is_found() -> None:
    def swapped(*arguments: Any, **options: Any) -> Any:
        return bw.bake(*arguments, convention="directx", **options)

    def in_files(*arguments: Any, **options: Any) -> Any:
        return bw.bake(*arguments, convention="directx" if "dtype" in options else "opengl", **options)

    for name in ("normal", "relief", "normal_xy"):
        assert any(check.startswith("formula") for check in checks(bake_only(name, swapped))), name
        assert checks(bake_only(name, in_files)) == {"numbers of 8 bits", "numbers of 16 bits"}, name


@pytest.mark.parametrize("name", ["cone", "relaxed_cone"])
def test_a_cone_that_is_not_conservative_is_found(name: str) -> None:
    def widened(*arguments: Any, **options: Any) -> Any:
        made = bw.bake(*arguments, **options)
        return {name: np.minimum(made[name] * 1.2, 1.0)}

    assert "conservative" in checks(bake_only(name, widened))
    assert bake_only(name)

    def textbook(*arguments: Any, **options: Any) -> Any:
        return bw.bake(*arguments, mode="texel", **options)

    assert "conservative" in checks(bake_only(name, textbook))


def test_other_faults_of_bakes_are_found() -> None:
    def longer(*arguments: Any, **options: Any) -> Any:
        made = bw.bake(*arguments, **options)
        return {name: made[name] * 1.01 for name in made}

    assert {"unit length", "in range"} <= checks(bake_only("normal", longer))
    assert "lower bound" in checks(
        bake_only("distance", lambda *a, **o: {"distance": bw.bake(*a, **o)["distance"] * 1.3 + 0.001})
    )
    lowered = bake_only(
        "pyramid", lambda *a, **o: {"pyramid": [level * 0.999 for level in bw.bake(*a, **o)["pyramid"]]}
    )
    assert {"top level", "holds the cells"} <= checks(lowered)


def test_faults_of_frames_are_found() -> None:
    def tilted(positions: Any, faces: Any, uv: Any, normals: Any, method: str) -> Any:
        made = bw.tangents(positions, faces, uv, normals, method)
        bent = made.tangents.copy()
        bent[:, :3] += 0.01 * normals[made.source]
        bent[0, 3] = 0.0
        return made._replace(tangents=bent)

    found = bw.stress([], maps=[], frames=["mikktspace"], tangents=tilted)
    assert {"upright", "handedness is 1 or -1"} <= checks(found)


@pytest.mark.parametrize("method", ["mikktspace", "averaged", "split", "edge"])
def test_mirrored_and_turned_tangents_are_found(method: str) -> None:
    def bent(how: Any) -> set[str]:
        def made(positions: Any, faces: Any, uv: Any, normals: Any, name: str) -> Any:
            right = bw.tangents(positions, faces, uv, normals, name)
            return right._replace(tangents=how(right.tangents.copy(), normals[right.source]))

        return checks(bw.stress([], maps=[], frames=[method], tangents=made))

    def one_handed(found: Any, _: Any) -> Any:
        # Mirrored charts are taken for others.
        found[:, 3] = -found[:, 3].max()
        return found

    def swapped(found: Any, normals: Any) -> Any:
        # The bitangent in place of the tangent.
        found[:, :3] = found[:, 3:] * np.cross(normals, found[:, :3])
        return found

    assert bent(one_handed) == {"hand of the chart"}
    assert bent(lambda found, _: found * np.float32([1, 1, 1, -1])) == {"hand of the chart"}
    assert bent(lambda found, _: found * np.float32([-1, -1, -1, 1])) == {"along u"}
    assert "along u" in bent(swapped)
    assert not bent(lambda found, _: found)


# The judge


def test_the_judge_refuses_arrays_that_do_not_fit() -> None:
    heights = np.zeros((2, 2), np.float32)
    with pytest.raises(ValueError, match="3 results"):
        _bumpwgpu.judge(heights, "repeat", np.zeros((2, 3)), np.zeros((2, 3)), np.zeros(3))


# Files and settings


def test_results_are_written(sound: bw.StressResult, tmp_path: Path) -> None:
    data = json.loads(sound.to_json(tmp_path / "stress.json").read_text())
    assert len(data["rows"]) == len(sound.rows)
    assert data["environment"]["version"] == bw.__version__
    with sound.to_csv(tmp_path / "stress.csv").open() as lines:
        assert len(list(csv.DictReader(lines))) == len(sound.rows)
    assert len(sound.summary()) < len(sound.rows)


@pytest.mark.parametrize("suffix", [".png", ".svg"])
def test_errors_are_plotted(sound: bw.StressResult, tmp_path: Path, suffix: str) -> None:
    pytest.importorskip("matplotlib")
    assert sound.plot(tmp_path / f"stress{suffix}").stat().st_size > 5000
    with pytest.raises(ValueError, match="must end in"):
        sound.plot(tmp_path / "stress.gif")
    with pytest.raises(ValueError, match="nothing to plot"):
        bw.StressResult([], {}).plot(tmp_path / "stress.png")


def test_progress_is_told_and_can_stop_it() -> None:
    seen: list[tuple[int, int, str]] = []
    bw.stress([], maps=[], frames=["edge", "split"], progress=lambda *told: seen.append(told))
    assert [told[0] for told in seen] == [0, 1, 2]
    assert {told[1] for told in seen} == {2}

    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        bw.stress(progress=stop)


@pytest.mark.parametrize(
    ("arguments", "error", "says"),
    [
        ({"techniques": "reliev"}, ValueError, "unknown technique"),
        ({"techniques": "flat"}, ValueError, "does not search"),
        ({"techniques": 3}, TypeError, "techniques"),
        ({"maps": ["norml"]}, ValueError, "maps"),
        ({"frames": ["mikk"]}, ValueError, "frames"),
        ({"rays": 1}, ValueError, "rays"),
        ({"device": "auto"}, ValueError, "device"),
        ({"march": 3}, TypeError, "march must be callable"),
        ({"only": 3}, TypeError, "only must be a string"),
        ({"techniques": "exact", "only": "no such case"}, ValueError, "no case contains"),
    ],
)
def test_senseless_settings_are_refused(arguments: dict[str, Any], error: type, says: str) -> None:
    with pytest.raises(error, match=says):
        bw.stress(**{"techniques": [], "maps": [], "frames": [], **arguments})


def test_answers_that_hang_on_a_rounding_are_told_from_faults() -> None:
    # At 89.99 degrees a step of interval is hundreds of texels long, and its bracket holds many hits.
    for technique in ("interval", "steep"):
        made = bw.stress(technique, maps=[], frames=[], rays=128, only="89.99", device="cpu")
        assert made, str(made)

    def leaning(height_map: Any, origins: Any, directions: Any, technique: Any, **options: Any) -> Any:
        # Rays to the right see a relief moved by half a texel: a mirrored map is then another one.
        moved = origins.copy()
        moved[:, 0] += np.where(directions[:, 0] > 0.0, 0.5 / height_map.shape[1], 0.0)
        return bw.march(height_map, moved, directions, technique, **options)

    assert "mirrored" in checks(march_only(leaning, "interval"))


@pytest.mark.slow
def test_everything_passes() -> None:
    made = bw.stress(rays=256)
    assert made, str(made)


@pytest.mark.gpu
def test_the_device_passes() -> None:
    made = bw.stress(["exact", "relief"], maps=[], frames=[], rays=RAYS, only="grazing")
    assert made, str(made)
    subjects = {row["subject"] for row in made.rows}
    assert subjects == {"march exact", "march relief", "march exact, device", "march relief, device"}


@pytest.mark.gpu
@pytest.mark.parametrize("technique", ["exact", "relief"])
def test_faults_of_pictures_are_found(technique: str) -> None:
    def found(change: Any) -> set[str]:
        def drawn(*arguments: Any, **options: Any) -> Any:
            aovs = {name: value.copy() for name, value in bw.render(*arguments, **options).aovs.items()}
            change(aovs)
            return SimpleNamespace(aovs=aovs)

        rows = picture_checks(drawn, bw.techniques.get(technique), 0)
        return {check["check"] for _, check in rows if not check["passed"]}

    assert found(lambda aovs: None) == set()
    assert found(lambda aovs: aovs["shadow"].fill(0.0)) == {"hidden where it should be"}
    assert found(lambda aovs: aovs["shadow"].fill(1.0)) == {"does not hide itself"}
    assert "uv on the ray" in found(lambda aovs: aovs["uv"].__iadd__(np.float32(0.0001)))
    if technique == "exact":
        swapped = found(lambda aovs: aovs["normal"].__imul__(np.float32([1, -1, 1])))
        assert "normal" in swapped
        sunk = found(lambda aovs: aovs["height"].__isub__(np.float32(0.001)))
        assert {"on the surface", "uv on the ray"} <= sunk
