"""The Pareto front elsewhere: in fresh processes, on one core of several, with other instructions."""

from __future__ import annotations

import itertools
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
    "panda3d/heightfield.png", "ambientcg/rock058/displacement.jpg", "bevy/parallax_example/cube_depth.png",
    "playcanvas/seaside-rocks01-height.jpg",
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
    "fronts": {
        str(at): [[row["label"], row["tied_with"], row["rivals"]] for row in found.pareto(at)]
        for at in found.elevations
    },
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


#: Members by rising time: label, what it ties with, and those of these that may take its place.
Front = list[tuple[str, list[str], list[str]]]


def differences(here: Front, there: Front) -> tuple[list[str], list[str]]:
    """What two runs disagree on: settings that tie in neither and changed places, and members of one front
    that are beaten in the other with all that may take their place: none of them is on it or ties with it.
    """
    ours, theirs = ({label: tied for label, tied, _ in front} for front in (here, there))
    both = [label for label in ours if label in theirs]
    order = list(theirs)
    swapped = [
        f"{first} and {then}"
        for at, first in enumerate(both)
        for then in both[at + 1 :]
        if order.index(first) > order.index(then) and then not in ours[first] and then not in theirs[first]
    ]
    beaten = [
        label
        for front, other in ((here, theirs), (there, ours))
        for label, _, rivals in front
        if not {label, *rivals} & {*other, *itertools.chain(*other.values())}
    ]
    return swapped, beaten


def test_differences_are_found() -> None:
    here: Front = [("a", [], []), ("b", ["c"], ["c"]), ("d", [], [])]
    assert differences(here, here) == ([], [])
    tied: Front = [("a", [], []), ("c", ["b"], []), ("d", [], [])]
    assert differences(here, tied) == ([], []), "b and c tie"
    taken: Front = [("a", [], []), ("c", [], []), ("d", [], [])]
    assert differences(here, taken) == ([], []), "c takes the place of b"
    other: Front = [("a", [], []), ("e", [], []), ("d", [], [])]
    assert differences(here, other) == ([], ["b", "e"]), "e may not"
    swapped: Front = [("b", ["c"], ["c"]), ("a", [], []), ("d", [], [])]
    assert differences(here, swapped) == (["a and b"], [])
    assert differences(here, here[:2]) == ([], ["d"])
    way: Front = [*here[:2], ("e", ["d"], ["d"])]
    assert differences(here, way) == ([], []), "d makes way for e, which it ties with"


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
    wrong = {at: differences(front, there["fronts"][at]) for at, front in here["fronts"].items()}
    assert not {at: found for at, found in wrong.items() if found != ([], [])}
    # Not for want of statements: few settings may take the place of another.
    for run in (here, there):
        searches = {label: label.split(")")[0].split(" r")[0] for label in run["settings"]}
        counts = [
            len({searches[rival] for rival in rivals} - {searches[label]})
            for front in run["fronts"].values()
            for label, _, rivals in front
        ]
        assert sum(counts) <= len(set(searches.values())) / 8 * len(counts), counts
