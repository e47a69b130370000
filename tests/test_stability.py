"""The Pareto front elsewhere: in fresh processes, on one core of several, with other instructions."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

ASSETS = Path(__file__).parents[2] / "shared" / "data"
#: Maps that stand in no other test: names, sizes and seeds of procedural ones, and files.
MAPS = (
    "sines 200 71", "fbm 192 72", "bricks 256 73", "spheres 160 74", "ridge 224 75", "wall 144 76",
    "panda3d/heightfield.png", "ambientcg/rock058/displacement.jpg",
)  # fmt: skip

SWEEP = """
import json, os, sys, warnings
import bumpwgpu as bw
cores, source, device = sys.argv[1:]
if cores == "one" and hasattr(os, "sched_setaffinity"):
    os.sched_setaffinity(0, [max(os.sched_getaffinity(0))])
warnings.simplefilter("ignore", bw.BumpWarning)
name, *rest = source.split()
if len(rest) == 2:
    height_map = bw.HeightMap.procedural(name, size=int(rest[0]), seed=int(rest[1]))
else:
    height_map = bw.HeightMap(source)
found = bw.compare(height_map, device=device)
print(json.dumps({
    "settings": [row["label"] for row in found.select()],
    "errors": {row["label"]: row["uv_error_p99_texels"] for row in found.select()},
    "fronts": [[[row["label"], row["tied_with"]] for row in found.pareto(at)] for at in found.elevations],
    "simd": bw.info()["simd"],
}))
"""


def sweep(source: str, device: str, cores: str, simd: str | None) -> dict[str, Any]:
    """The default sweep in a process of its own."""
    environment = {**os.environ, **({} if simd is None else {"BUMPWGPU_SIMD": simd})}
    done = subprocess.run(
        [sys.executable, "-c", SWEEP, cores, source, device],
        capture_output=True, text=True, check=True, env=environment, timeout=900,
    )  # fmt: skip
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def differences(here: list[Any], there: list[Any]) -> tuple[list[str], list[str]]:
    """Settings out of order, and those on one front alone that do not tie with a member of the other."""
    ours, theirs = ({label: tied for label, tied in front} for front in (here, there))
    both = [label for label in ours if label in theirs]
    order = list(theirs)
    swapped = [
        f"{first} and {then}"
        for at, first in enumerate(both)
        for then in both[at + 1 :]
        if order.index(first) > order.index(then) and then not in ours[first] and then not in theirs[first]
    ]
    missing = [
        label
        for front, other in ((ours, theirs), (theirs, ours))
        for label in front
        if label not in other and not any(label in tied for tied in other.values())
    ]
    return swapped, missing


def test_differences_are_found() -> None:
    here = [["a", []], ["b", ["c"]], ["d", []]]
    assert differences(here, here) == ([], [])
    assert differences(here, [["a", []], ["c", ["b"]], ["d", []]]) == ([], []), "b and c tie"
    assert differences(here, [["b", ["c"]], ["a", []], ["d", []]]) == (["a and b"], [])
    assert differences(here, [["a", []], ["b", []]]) == ([], ["d"])


@pytest.mark.slow
@pytest.mark.parametrize("source", MAPS)
@pytest.mark.parametrize("device", ["cpu", pytest.param("gpu", marks=pytest.mark.gpu)])
def test_the_front_holds_elsewhere(source: str, device: str) -> None:
    if len(source.split()) == 1:
        if not (ASSETS / source).exists():
            pytest.skip(f"{source} is not beside the repository")
        source = str(ASSETS / source)
    here = sweep(source, device, "all", None)
    if device == "gpu":
        there = sweep(source, device, "all", None)
    else:
        there = sweep(source, device, "one", "avx2" if here["simd"] == "avx512" else None)
    assert here["settings"] == there["settings"], "the sweep chooses by what every machine agrees on"
    for label, error in here["errors"].items():
        assert there["errors"][label] == pytest.approx(error, rel=1e-3, abs=1e-4), label
    found = [differences(*fronts) for fronts in zip(here["fronts"], there["fronts"], strict=True)]
    assert not [pair for swapped, _ in found for pair in swapped]
    # Over all elevations, which is what `pareto()` gives; a single one is timed too shortly for that.
    assert not found[-1][1]
