"""compare: metrics that flag broken searches, ranking, and files that hold what was measured."""

from __future__ import annotations

import builtins
import json
import os
import re
import shutil
import subprocess
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import bumpwgpu as bw
from bumpwgpu import _bumpwgpu
from bumpwgpu._chart import place_labels, short
from bumpwgpu._quality import flip, psnr, ssim

SETTINGS = ["parallax", "steep", bw.techniques.Relief(linear=16, refine=6), "interval", "exact"]


@pytest.fixture(scope="module")
def posts() -> bw.HeightMap:
    """Thin posts on a swell: easy to skip."""
    y, x = np.mgrid[0:96, 0:96]
    heights = 0.2 + 0.1 * np.sin(x * 0.2) * np.cos(y * 0.2)
    heights[3::8, 5::16] = 1.0
    return bw.HeightMap(heights, scale=0.1)


@pytest.fixture(scope="module")
def result(posts: bw.HeightMap) -> bw.CompareResult:
    return bw.compare(posts, SETTINGS, elevations=(90, 20, 10), device="cpu", rays=3000, repeats=3)


def row_of(result: bw.CompareResult, technique: str, elevation: Any = "all") -> dict[str, Any]:
    return next(row for row in result.select(elevation) if row["technique"] == technique)


# Rows


def test_there_is_a_row_for_each_setting_and_elevation(result: bw.CompareResult) -> None:
    assert result.elevations == [90.0, 20.0, 10.0, "all"]
    assert len(result.rows) == len(SETTINGS) * 4
    assert [row["label"] for row in result.select("all")][2] == "relief(linear=16, refine=6)"
    keys = {
        "technique",
        "parameters",
        "label",
        "elevation",
        "rays",
        "time_cpu_ns_per_ray",
        "time_device_ns_per_ray",
        "uv_error_median_texels",
        "uv_error_p99_texels",
        "uv_error_max_texels",
        "share_above_1_texel",
        "depth_error_p99",
        "normal_error_p99_deg",
        "miss_rate",
        "false_hit_rate",
        "unconverged_rate",
        "nan_count",
        "shadow_error_rate",
        "steps_mean",
    }
    for row in result.rows:
        assert keys <= row.keys()
        assert row["time_cpu_ns_per_ray_low"] <= row["time_cpu_ns_per_ray"] <= row["time_cpu_ns_per_ray_high"]
        assert row["time_device_ns_per_ray"] is None
        assert row["rays"] == (9000 if row["elevation"] == "all" else 3000)


def test_the_exact_search_is_exact_and_the_others_are_not(result: bw.CompareResult) -> None:
    exact = row_of(result, "exact")
    assert exact["uv_error_max_texels"] < 1e-3
    for key in ("miss_rate", "false_hit_rate", "unconverged_rate", "nan_count"):
        assert exact[key] == 0
    assert exact["shadow_error_rate"] < 1e-3
    assert row_of(result, "steep", 10.0)["miss_rate"] > 0.01
    assert row_of(result, "parallax", 10.0)["uv_error_p99_texels"] > 1.0
    assert row_of(result, "parallax")["shadow_error_rate"] is None


def test_the_seed_fixes_everything_but_the_time(posts: bw.HeightMap) -> None:
    def errors(seed: int) -> list[Any]:
        made = bw.compare(posts, "steep", elevations=[10], device="cpu", rays=500, repeats=1, seed=seed)
        return [{k: v for k, v in row.items() if not k.startswith("time_")} for row in made.rows]

    assert errors(1) == errors(1)
    assert errors(1) != errors(2)


def test_the_default_sweep_is_quick_and_tries_every_technique() -> None:
    small = bw.HeightMap.procedural("bricks", 128)
    made = bw.compare(small, elevations=[30], device="cpu", rays=500, repeats=1)
    # The map of relaxed_cone_texel takes long to bake: it has to be asked for.
    assert {row["technique"] for row in made.rows} == set(bw.techniques.marching()) - {"relaxed_cone_texel"}
    labels = {row["label"] for row in made.select("all")}
    assert labels.isdisjoint(row["label"] for row in made.dropped)
    assert len(labels) + len(made.dropped) > len(bw.techniques.marching()) + 10


# Negative controls: what is planted must be found.


def segments(posts: bw.HeightMap) -> tuple[Any, np.ndarray, np.ndarray, bw.Hits]:
    rng = np.random.default_rng(5)
    count = 2000
    starts = np.concatenate([rng.random((count, 2)), np.ones((count, 1))], axis=1).astype(np.float32)
    turn = rng.random(count) * 2 * np.pi
    deltas = np.stack([0.5 * np.cos(turn), 0.5 * np.sin(turn), -np.ones(count)], axis=1).astype(np.float32)
    reference = _bumpwgpu.SegmentReference(posts._field, starts, deltas)
    return reference, starts, deltas, bw.march(posts, starts, deltas)


def measured(
    reference: Any, uv: np.ndarray, z: np.ndarray, status: np.ndarray | None = None
) -> dict[str, Any]:
    status = np.zeros(len(z), np.uint8) if status is None else status
    return reference.measure(uv, z, status, np.zeros(len(z), np.uint8), [[0]])[0]


def test_right_hits_pass_and_a_tenth_of_a_texel_is_flagged(posts: bw.HeightMap) -> None:
    reference, _, _, hits = segments(posts)
    right = measured(reference, hits.uv, hits.z)
    assert right["uv_error_p99_texels"] < 1e-3
    assert right["failure_rate"] == right["false_hit_rate"] == 0
    shifted = hits.uv + np.array([0.1 / posts.shape[1], 0.0], np.float32)
    assert measured(reference, shifted, hits.z)["uv_error_median_texels"] == pytest.approx(0.1, abs=2e-3)
    assert measured(reference, hits.uv + np.float32(7.0), hits.z)["uv_error_p99_texels"] < 1e-3


def test_a_search_that_steps_over_thin_features_is_flagged(posts: bw.HeightMap) -> None:
    reference, starts, deltas, hits = segments(posts)
    past = hits.t + 1.5 / (0.5 * posts.shape[1])
    onward = bw.march(posts, starts + past[:, None] * deltas, deltas)
    t = past + onward.t
    there = (starts + t[:, None] * deltas).astype(np.float32)
    broken = measured(reference, np.ascontiguousarray(there[:, :2]), np.ascontiguousarray(there[:, 2]))
    assert broken["miss_rate"] > 0.02


def test_hits_in_the_air_missing_hits_and_nan_are_flagged(posts: bw.HeightMap) -> None:
    reference, starts, deltas, hits = segments(posts)
    early = (starts + 0.5 * hits.t[:, None] * deltas).astype(np.float32)
    air = measured(reference, np.ascontiguousarray(early[:, :2]), np.ascontiguousarray(early[:, 2]))
    assert air["false_hit_rate"] > 0.5
    status = (np.arange(len(hits.z)) % 2).astype(np.uint8)
    assert measured(reference, hits.uv, hits.z, status)["miss_rate"] == 0.5
    uv = hits.uv.copy()
    uv[3] = np.nan
    assert measured(reference, uv, hits.z)["nan_count"] == 1


def test_arrays_that_do_not_fit_are_refused(posts: bw.HeightMap) -> None:
    reference, starts, deltas, hits = segments(posts)
    with pytest.raises(ValueError, match="expected 4000"):
        measured(reference, hits.uv[:10], hits.z)
    with pytest.raises(ValueError, match="groups"):
        reference.measure(hits.uv, hits.z, np.zeros(len(hits.z), np.uint8), np.zeros(3, np.uint8), [[0]])
    with pytest.raises(ValueError, match=r"shape \(N, 3\)"):
        _bumpwgpu.SegmentReference(posts._field, starts, deltas[:5])
    deltas[4] = np.nan
    with pytest.raises(ValueError, match="ray 4"):
        _bumpwgpu.SegmentReference(posts._field, starts, deltas)


# Ranking


def test_the_recommendation_is_within_its_budget(result: bw.CompareResult) -> None:
    advice = result.recommend(0.5)
    assert advice
    assert advice.technique == "exact"
    assert advice.error_p99_texels is not None
    assert advice.error_p99_texels <= 0.5
    assert str(advice) == advice.reason
    loose = result.recommend(1e4, max_failure_rate=1.0)
    fastest = min(row["time_cpu_ns_per_ray"] for row in result.select("all"))
    assert loose.time_ns_per_ray is not None
    assert loose.time_ns_per_ray <= 2.0 * fastest


def test_no_recommendation_says_why(result: bw.CompareResult) -> None:
    advice = result.recommend(0.0)
    assert not advice
    assert advice.technique is None
    assert "exact" in advice.reason
    assert str(advice).startswith("No recommendation.")


def test_misses_keep_a_setting_off_the_front(result: bw.CompareResult) -> None:
    assert row_of(result, "steep")["failure_rate"] > 1e-3
    labels = {row["label"] for row in result.pareto()}
    assert "exact" in labels
    assert not any("steep" in label for label in labels)
    loose = result.pareto(max_failure_rate=1.0)
    assert len(loose) > 1
    times = [row["time_cpu_ns_per_ray"] for row in loose]
    assert times == sorted(times)
    for row in loose:
        for other in row["tied_with"]:
            back = [r["tied_with"] for r in loose if r["label"] == other]
            # On the front, where ties go both ways, or off it by the tie alone.
            assert all(row["label"] in tied for tied in back)
            assert other in {measured["label"] for measured in result.select()}
        assert set(row["rivals"]) <= set(row["tied_with"])
        assert row["certain"] == (not row["rivals"])


@pytest.mark.parametrize(
    ("call", "error", "says"),
    [
        (lambda r: r.select(33), ValueError, "there are: 90"),
        (lambda r: r.recommend(-1), ValueError, "max_error"),
        (lambda r: r.recommend("much"), TypeError, "max_error"),
        (lambda r: r.recommend(time="device"), ValueError, "no device time"),
        (lambda r: r.pareto(time="gpu"), ValueError, "unknown time"),
        (lambda r: r.report("/nowhere/at/all.html"), FileNotFoundError, "does not exist"),
        (lambda r: r.report("x.html", title=3), TypeError, "title"),
        (lambda r: r.to_json("/nowhere/at/all.json"), FileNotFoundError, "does not exist"),
        (lambda r: r.plot("plot.bmp"), ValueError, "bmp"),
    ],
)
def test_senseless_questions_are_refused(result: bw.CompareResult, call: Any, error: type, says: str) -> None:
    with pytest.raises(error, match=re.escape(says)):
        call(result)


@pytest.mark.parametrize(
    ("arguments", "error", "says"),
    [
        ({"techniques": []}, ValueError, "techniques is empty"),
        ({"techniques": ["reliev"]}, ValueError, "unknown technique"),
        ({"techniques": [3]}, TypeError, "technique"),
        ({"techniques": 3}, TypeError, "techniques"),
        ({"techniques": ["flat"]}, ValueError, "finds no hit"),
        ({"elevations": []}, ValueError, "elevations"),
        ({"elevations": [0]}, ValueError, "above 0"),
        ({"elevations": [91]}, ValueError, "at most 90"),
        ({"elevations": [float("nan")]}, ValueError, "elevations"),
        ({"elevations": ["steep"]}, TypeError, "elevations"),
        ({"elevations": [1e-7]}, ValueError, "texels"),
        ({"rays": 0}, ValueError, "rays"),
        ({"rays": 1.5}, TypeError, "rays"),
        ({"repeats": 0}, ValueError, "repeats"),
        ({"seed": -1}, ValueError, "seed"),
        ({"device": "tpu"}, ValueError, "device"),
        ({"progress": 3}, TypeError, "progress"),
    ],
)
def test_senseless_settings_are_refused(
    posts: bw.HeightMap, arguments: dict[str, Any], error: type, says: str
) -> None:
    with pytest.raises(error, match=says):
        bw.compare(posts, **{"techniques": "steep", "device": "cpu", "rays": 10, "repeats": 1, **arguments})


def test_only_maps_and_scenes_are_compared() -> None:
    with pytest.raises(TypeError, match="HeightMap or a Scene"):
        bw.compare("bricks.png")  # type: ignore[arg-type]


@pytest.mark.parametrize("heights", [[[0.5]], [[0.0, 1.0]], [[1.0], [0.0], [0.3]], np.zeros((4, 4))])
@pytest.mark.parametrize("scale", [0.0, 1e-6, 50.0])
def test_tiny_flat_and_extreme_maps(heights: Any, scale: float) -> None:
    hm = bw.HeightMap(heights, scale=scale)
    made = bw.compare(hm, ["relief", "exact"], elevations=[90, 30], device="cpu", rays=200, repeats=1)
    exact = row_of(made, "exact")
    assert exact["failure_rate"] == 0
    assert exact["uv_error_max_texels"] < 0.01


# Progress


def test_progress_counts_up_and_can_stop(posts: bw.HeightMap) -> None:
    seen: list[tuple[int, int, str]] = []
    bw.compare(
        posts,
        ["steep", "exact"],
        elevations=[20, 10],
        device="cpu",
        rays=20000,
        repeats=3,
        progress=lambda *told: seen.append(told),
    )
    assert seen
    done = [told[0] for told in seen]
    assert done == sorted(done)
    assert done[-1] == seen[-1][1]
    assert all(isinstance(told[2], str) for told in seen)

    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        bw.compare(posts, elevations=[20, 10], device="cpu", rays=50000, progress=stop)


# Files


def test_json_holds_the_rows(result: bw.CompareResult, tmp_path: Path) -> None:
    data = json.loads(result.to_json(tmp_path / "rows.json").read_text())
    assert data["rows"] == result.rows
    assert data["recommendation"]["technique"] == "exact"
    assert data["environment"]["version"] == bw.__version__
    assert os.listdir(tmp_path) == ["rows.json"]


def test_an_interrupted_write_leaves_the_old_file(
    result: bw.CompareResult, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target = tmp_path / "rows.json"
    target.write_text("old")

    def fail(*_: object) -> None:
        raise OSError("disk full")

    monkeypatch.setattr(os, "replace", fail)
    with pytest.raises(OSError, match="disk full"):
        result.to_json(target)
    assert target.read_text() == "old"
    assert os.listdir(tmp_path) == ["rows.json"]


class Page(HTMLParser):
    """Collects what a browser would load, and checks that tags close."""

    VOID = frozenset({"meta", "img", "input", "br", "link", "hr"})

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.loads: list[str] = []
        self.text: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in self.VOID:
            self.open.append(tag)
        self.loads += [value or "" for name, value in attrs if name in ("src", "href")]

    def handle_endtag(self, tag: str) -> None:
        assert self.open
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text.append(data)


def test_the_report_is_one_page_that_loads_nothing(result: bw.CompareResult, tmp_path: Path) -> None:
    title = "</title><script>alert('x')</script> & {{TABLE}}"
    text = result.report(tmp_path / "report.html", title=title).read_text()
    assert os.listdir(tmp_path) == ["report.html"]
    page = Page()
    page.feed(text)
    page.close()
    assert not page.open
    assert page.loads == []
    assert not re.search(r"(https?:)?//[a-z]", re.sub(r"data:[^\"]*", "", text))
    assert "alert('x')" not in text
    assert "{{" not in text.replace("{{TABLE}}", "")
    assert title in "".join(page.text)
    for wanted in ("viewport", "relief(linear=16, refine=6)", bw.__version__, "data:image/"):
        assert wanted in text
    pictures = json.loads(re.search(r'application/json">(.*?)</script>', text, re.S)[1])  # type: ignore[index]
    assert pictures[0]["label"] == "exact"
    assert len(pictures) == len(SETTINGS)
    assert text.count("<svg") == len(result.elevations)


DRIVE = """
<script>
const check = (name, ok) => { document.title += (ok ? " ok:" : " FAILED:") + name; };
const change = (node, value) => { node.value = value; node.dispatchEvent(new Event("change")); };
document.title = "driven";
const shown = () => [...document.querySelectorAll("#rows tbody tr")].filter((row) => !row.hidden);
check("pictures", !document.getElementById("pictures").hidden && document.getElementById("over").src);
change(document.getElementById("mode"), "heat");
check("heat", document.getElementById("over").src.startsWith("data:image/png"));
check("key", !document.getElementById("heat-key").hidden);
const errors = document.getElementById("over").src;
change(document.getElementById("mode"), "steps");
check("steps", document.getElementById("over").src.startsWith("data:image/png")
  && document.getElementById("over").src !== errors
  && document.getElementById("heat-text").textContent.startsWith("Height reads"));
const slider = document.getElementById("slider");
slider.value = 20;
slider.dispatchEvent(new Event("input"));
check("slider", document.getElementById("viewer").style.getPropertyValue("--at") === "20%");
const before = shown().length;
change(document.querySelector("select.elevation"), "10.0");
check("rows", shown().length === before && shown().every((row) => row.dataset.elevation === "10.0"));
check("charts", [...document.querySelectorAll("#charts > div")].filter((part) => !part.hidden).length === 1);
const heads = [...document.querySelectorAll("#rows thead th")];
const p99 = heads.findIndex((head) => head.textContent.startsWith("p99"));
const column = () => shown().map((row) => Number(row.cells[p99].dataset.value));
const sorted = (values) => values.every((value, i) => i === 0 || values[i - 1] <= value);
heads[p99].querySelector("button").click();
check("up", sorted(column()) && heads[p99].getAttribute("aria-sort") === "ascending");
heads[p99].querySelector("button").click();
check("down", sorted(column().reverse()));
const mark = [...document.querySelectorAll("#charts > div:not([hidden]) g.mark")].at(-1);
mark.dispatchEvent(new Event("pointerenter"));
const pointed = document.getElementById("pointed").textContent;
check("hover", pointed === mark.querySelector("title").textContent
  && /exact.* ns a ray, p99 .* texels/.test(pointed)
  && document.querySelectorAll("g.chosen").length === 1);
change(document.getElementById("region"), "silhouette");
check("region", shown().length > 0 && shown().every((row) => row.dataset.region === "silhouette"
  && row.dataset.elevation === "10.0"));
check("narrow", document.documentElement.scrollWidth <= window.innerWidth);
</script>
"""


def test_the_report_works_in_a_browser(result: bw.CompareResult, tmp_path: Path) -> None:
    browsers = ("chromium", "chromium-browser", "google-chrome")
    browser = next((found for found in map(shutil.which, browsers) if found), None)
    if browser is None:
        pytest.skip("no Chromium")
    page = result.report(tmp_path / "report.html")
    page.write_text(page.read_text().replace("</body>", DRIVE + "</body>"))
    command = [
        *(browser, "--headless", "--no-sandbox", "--disable-gpu", "--window-size=500,900"),
        *(f"--user-data-dir={tmp_path / 'profile'}", "--dump-dom", page.as_uri()),
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    title = re.search(r"<title>(.*?)</title>", done.stdout)
    assert title, done.stderr
    assert "FAILED" not in title[1]
    assert title[1].count("ok:") == 12


def test_pictures_show_the_map_and_where_it_is_wrong(result: bw.CompareResult) -> None:
    pictures = {picture.label: picture for picture in result.pictures()}
    exact, flat = pictures["exact"], pictures["parallax"]
    assert exact.rgb.shape == (300, 480, 3)
    assert np.nanmax(exact.error_texels) < 0.01
    assert np.nanmax(flat.error_texels) > 1.0
    assert exact.rgb.std() > 5.0
    assert not np.array_equal(exact.rgb, flat.rgb)


@pytest.mark.parametrize("suffix", [".png", ".svg", ".pdf"])
def test_the_plot_is_written(result: bw.CompareResult, tmp_path: Path, suffix: str) -> None:
    pytest.importorskip("matplotlib")
    path = result.plot(tmp_path / f"plot{suffix}")
    assert path.stat().st_size > 5000
    assert os.listdir(tmp_path) == [path.name]
    if suffix == ".png":
        with Image.open(path) as image:
            assert np.asarray(image.convert("L")).std() > 5.0


def test_a_missing_matplotlib_is_said(
    result: bw.CompareResult, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = builtins.__import__

    def without(name: str, *rest: Any) -> Any:
        if name.startswith("matplotlib"):
            raise ImportError(name)
        return real(name, *rest)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(bw.CompareError, match=r"bumpwgpu\[plot\]"):
        result.plot(tmp_path / "plot.png")
    result.report(tmp_path / "report.html")


def test_labels_keep_out_of_each_others_way() -> None:
    rng = np.random.default_rng(2)
    anchors = [tuple(point) for point in rng.random((12, 2)) * (600, 400)]
    sizes = [(90.0, 14.0)] * len(anchors)
    placed = place_labels(anchors, sizes, anchors, (600.0, 400.0), 5.0)
    boxes = [(p.x, p.y, p.x + 90.0, p.y + 14.0) for p in placed]
    for at, a in enumerate(boxes):
        assert a[0] >= 0.0
        assert a[2] <= 600.0
        assert a[1] >= 0.0
        assert a[3] <= 400.0
        for b in boxes[:at]:
            assert a[2] <= b[0] or b[2] <= a[0] or a[3] <= b[1] or b[3] <= a[1]
    assert short("relief(linear=32, refine=8)") == "relief(32, 8)"


# Pictures against pictures


def noisy(amplitude: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(0)
    first = rng.integers(0, 256, (64, 80, 4), np.uint8)
    noise = rng.integers(-amplitude, amplitude + 1, first.shape)
    return first, np.clip(first.astype(int) + noise, 0, 255).astype(np.uint8)


def test_ssim_and_psnr_are_those_of_scikit_image() -> None:
    # scikit-image 0.26: gaussian_weights, sigma 1.5, population covariance, on the luma.
    first, second = noisy(20)
    assert ssim(first, second) == pytest.approx(0.9869898515419994, abs=1e-12)
    assert psnr(first, second) == pytest.approx(26.843975993947463, abs=1e-9)
    assert ssim(first, first) == 1.0
    assert psnr(first, first) == float("inf")
    assert ssim(first[:4, :4], second[:4, :4]) < 1.0


def test_flip_is_zero_for_equal_pictures_and_grows_with_the_difference() -> None:
    pytest.importorskip("flip_evaluator")
    first, slightly = noisy(8)
    _, badly = noisy(80)
    assert flip(first, first)[0] == 0.0
    near, errors = flip(first, slightly)
    assert errors.shape == (64, 80)
    assert 0.0 < near < flip(first, badly)[0]


# Device


@pytest.mark.gpu
def test_the_device_is_timed_and_agrees_with_the_cpu(posts: bw.HeightMap) -> None:
    made = bw.compare(
        posts, ["steep", "relief", "exact"], elevations=[45, 10], device="gpu", rays=2000, repeats=2
    )
    assert made.timed_on == "device"
    for row in made.select("all"):
        assert row["time_device_ns_per_ray"] > 0.0
        # Measured on lavapipe: 1e-4 texels, no ray.
        assert row["device_difference_p99_texels"] < 0.01
        assert row["device_difference_hit_rate"] <= 1e-3


@pytest.fixture(scope="module")
def scene() -> bw.Scene:
    material = bw.Material(height=bw.HeightMap.procedural("bricks", 128, scale=0.08), albedo=(0.7, 0.5, 0.4))
    camera = bw.Camera.look_at((0.0, -1.1, 0.6), (0.0, 0.0, 0.0), fov_y=40.0)
    return bw.Scene(bw.Mesh.quad(), material, camera, [bw.Light.directional((-0.6, 0.4, -0.7))], (120, 90))


@pytest.fixture(scope="module")
def scene_result(scene: bw.Scene, _device_problem: str | None) -> bw.CompareResult:
    if _device_problem is not None:
        pytest.skip(f"no Vulkan device: {_device_problem}")
    return bw.compare(scene, ["flat", "parallax", "relief", "exact"], elevations=(60, 30, 15), repeats=2)


@pytest.mark.gpu
def test_the_exact_picture_is_that_of_the_reference(scene_result: bw.CompareResult) -> None:
    exact = row_of(scene_result, "exact")
    assert exact["rays"] > 1000
    assert exact["uv_error_p99_texels"] < 0.02
    assert exact["miss_rate"] == 0.0
    assert (exact["psnr_db"], exact["ssim"]) == (None, 1.0)
    check = scene_result.environment["exact picture against double precision"]
    assert check["uv_error_p99_texels"] == exact["uv_error_p99_texels"]


@pytest.mark.gpu
def test_scene_errors_rank_the_techniques(scene_result: bw.CompareResult) -> None:
    exact, relief, flat = (row_of(scene_result, name) for name in ("exact", "relief", "flat"))
    assert exact["uv_error_p99_texels"] < relief["uv_error_p99_texels"] < flat["uv_error_p99_texels"]
    assert exact["ssim"] > relief["ssim"] > flat["ssim"]
    if exact["flip_mean"] is not None:
        assert exact["flip_mean"] == 0.0
        assert relief["flip_mean"] < flat["flip_mean"]
    assert flat["shadow_error_rate"] is None
    assert exact["time_cpu_ns_per_ray"] is None
    assert exact["time_device_ns_per_ray"] > 0.0
    angles = [elevation for elevation in scene_result.elevations if elevation != "all"]
    assert set(angles) <= {60.0, 30.0, 15.0}
    assert sum(row_of(scene_result, "exact", angle)["rays"] for angle in angles) == exact["rays"]
    assert scene_result.recommend(0.5).technique in ("exact", "relief")


@pytest.mark.gpu
def test_a_camera_path_counts_all_of_its_pixels(scene: bw.Scene) -> None:
    aside = bw.Camera.look_at((0.5, -0.9, 0.5), (0.0, 0.0, 0.0), fov_y=40.0)

    def compared(*cameras: bw.Camera) -> bw.CompareResult:
        path = bw.Scene(scene.mesh, scene.material, cameras, scene.lights, (64, 48))
        return bw.compare(path, ["relief", "exact"], elevations=(60, 30, 15), repeats=2)

    assert isinstance(scene.camera, bw.Camera)
    first, second = compared(scene.camera), compared(aside)
    both = compared(scene.camera, aside)
    assert both.environment["cameras"] == 2
    for name in ("relief", "exact"):
        rows = [row_of(made, name) for made in (first, second, both)]
        assert rows[2]["rays"] == rows[0]["rays"] + rows[1]["rays"]
        worst = [row["uv_error_max_texels"] for row in rows]
        assert worst[2] == max(worst[:2])
        assert rows[2]["regions"].keys() == {"interior", "silhouette", "shadow"}
        for key in ("silhouette", "shadow"):
            parts = [row["regions"][key]["rays"] for row in rows]
            assert parts[2] == parts[0] + parts[1]
    advice = both.recommend(0.5)
    assert advice.technique in ("exact", "relief")
    assert advice.verified_rays > both.select("all")[0]["rays"]


@pytest.mark.gpu
def test_several_instances_count_together(scene: bw.Scene) -> None:
    def placed(x: float, y: float, size: float) -> bw.Instance:
        # Turned about z, mirrored, and stretched unevenly.
        world = np.array([[0.0, -size, 0.0, x], [-0.7 * size, 0.0, 0.0, y], [0, 0, 0.8, 0], [0, 0, 0, 1.0]])
        return bw.Instance(bw.Mesh.quad() if x < 0.0 else bw.Mesh.cube(), scene.material, world)

    both = [placed(-0.6, 0.1, 0.7), placed(0.5, 0.0, 0.5)]
    cameras = [bw.Camera.look_at((x, -1.6, 1.1), (0.0, 0.0, 0.0), fov_y=45.0) for x in (-0.4, 0.7)]

    def compared(*instances: bw.Instance) -> bw.CompareResult:
        path = bw.Scene(instances, None, cameras, scene.lights, (96, 72))
        return bw.compare(path, ["flat", "relief", "exact"], elevations=(60, 30, 15), repeats=1)

    together, alone = compared(*both), [compared(one) for one in both]
    exact, relief, flat = (row_of(together, name) for name in ("exact", "relief", "flat"))
    assert exact["uv_error_p99_texels"] < 0.02
    assert exact["miss_rate"] == 0.0
    assert exact["uv_error_p99_texels"] < relief["uv_error_p99_texels"] < flat["uv_error_p99_texels"]
    # Neither hides the other here.
    rays = [row_of(made, "exact")["rays"] for made in alone]
    assert min(rays) > 200
    assert exact["rays"] == sum(rays)
    assert flat["uv_error_max_texels"] == max(row_of(made, "flat")["uv_error_max_texels"] for made in alone)
    for row in together.rows:
        assert row["regions"].keys() <= {"interior", "silhouette", "shadow"}
        assert sum(part["rays"] for part in row["regions"].values()) == row["rays"]
    assert exact["regions"].keys() == {"interior", "silhouette", "shadow"}
    assert len(together.environment["mesh"]) == 2
    assert together.recommend(0.5).verified_rays > exact["rays"]


@pytest.mark.gpu
def test_a_scene_makes_a_report_too(scene_result: bw.CompareResult, tmp_path: Path) -> None:
    text = scene_result.report(tmp_path / "scene.html").read_text()
    assert "FLIP" in text or "SSIM" in text
    assert len(scene_result.pictures()) == 4
    json.loads(scene_result.to_json(tmp_path / "scene.json").read_text())


@pytest.mark.gpu
@pytest.mark.parametrize("mesh", ["cube", "sphere", "torus"])
def test_the_reference_holds_on_curved_meshes(mesh: str) -> None:
    material = bw.Material(height=bw.HeightMap.procedural("sines", 64, scale=0.05))
    camera = bw.Camera.look_at((1.2, 1.6, 2.2), (0.0, 0.0, 0.0), fov_y=45.0)
    made = bw.compare(
        bw.Scene(getattr(bw.Mesh, mesh)(), material, camera, size=(96, 96)), ["exact"], repeats=1
    )
    exact = row_of(made, "exact")
    assert exact["uv_error_p99_texels"] < 0.02
    assert exact["miss_rate"] == 0.0


@pytest.mark.gpu
def test_a_scene_that_shows_nothing_is_said(scene: bw.Scene) -> None:
    away = bw.Camera.look_at((0.0, 0.0, 3.0), (0.0, 0.0, 9.0))
    with pytest.raises(bw.CompareError, match="no pixel"):
        bw.compare(bw.Scene(scene.mesh, scene.material, away, size=(16, 16)), ["exact"], repeats=1)


def test_scenes_are_checked(scene: bw.Scene) -> None:
    with pytest.raises(ValueError, match="Vulkan"):
        bw.compare(scene, device="cpu")
    with pytest.raises(ValueError, match="no height map"):
        bw.Scene(scene.mesh, bw.Material(), scene.camera)
    with pytest.raises(TypeError, match="camera"):
        bw.Scene(scene.mesh, scene.material, (0, 0, 3))  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="camera path is empty"):
        bw.Scene(scene.mesh, scene.material, ())
    with pytest.raises(ValueError, match="formats"):
        bw.compare(scene, "exact", formats=["r8unorm"])
    with pytest.raises(TypeError, match="lights"):
        bw.Scene(scene.mesh, scene.material, scene.camera, [(0, 0, -1)])  # type: ignore[list-item]
    assert isinstance(scene.material, bw.Material)
    other = bw.Instance(bw.Mesh.quad(), bw.Material(height=bw.HeightMap.procedural("sines", 32)))
    with pytest.raises(ValueError, match="2 height maps"):
        bw.Scene([bw.Instance(bw.Mesh.quad(), scene.material), other], None, scene.camera)
    with pytest.raises(ValueError, match="material must be None"):
        bw.Scene([other], scene.material, scene.camera)
    with pytest.raises(ValueError, match="no height map"):
        bw.Scene([other, bw.Instance(bw.Mesh.quad())], None, scene.camera)
    with pytest.raises(TypeError, match="material"):
        bw.Scene(scene.mesh, scene.material.height, scene.camera)  # type: ignore[arg-type]


# Real maps


@pytest.mark.parametrize(
    "name", ["ambientcg/facade005/displacement.jpg", "bevy/parallax_example/cube_depth.png"]
)
@pytest.mark.filterwarnings("ignore::bumpwgpu.BumpWarning")
def test_real_maps_with_walls(assets: Path, name: str) -> None:
    made = bw.compare(
        bw.HeightMap(assets / name),
        ["steep", "relief", "exact"],
        elevations=(45, 10, 2),
        device="cpu",
        rays=3000,
        repeats=1,
    )
    exact = row_of(made, "exact")
    assert exact["failure_rate"] == 0
    assert exact["uv_error_p99_texels"] < 0.01
    assert row_of(made, "steep", 2.0)["miss_rate"] > 0.01
