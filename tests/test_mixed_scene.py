"""What skipping changes in the example's scenes of twenty objects: nothing beyond the bound."""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType

import numpy as np
import pytest
from numpy.typing import NDArray

import bumpwgpu as bw

SIZE = (320, 180)
#: The documented bound: texels of the height map, and pixels.
TEXELS, PIXELS = 0.125, 0.25

pytestmark = pytest.mark.usefixtures("gpu")


@pytest.fixture(scope="module")
def example(load_example: Callable[[str], ModuleType]) -> ModuleType:
    module = load_example("mixed_scene")
    # Made once, so that each map is baked once.
    things = module.Things()
    module.Things = lambda: things
    return module


def numbers(things: list[bw.Instance], camera: bw.Camera) -> tuple[NDArray, NDArray]:
    """Which object each pixel shows on the mesh, from 0, or -1; and the uv there."""
    steps = 10

    def marked(at: int) -> bw.Instance:
        part = things[at]
        grey = (steps * (at + 1) + 0.5) / 255.0
        return bw.Instance(part.mesh, bw.Material(albedo=(grey, grey, grey)), part.world_from_object)

    frame = bw.render(
        [marked(at) for at in range(len(things))],
        camera=camera,
        technique="flat",
        lights=[],
        ambient=1.0,
        size=SIZE,
        aovs="uv",
    )
    return np.rint(frame.color[..., 0] / steps).astype(int) - 1, frame.aovs["uv"]


def beyond(example: ModuleType, name: str, technique: str, **options: object) -> tuple[int, int, int]:
    """Pixels that were judged, how many of them are off by more than the bound, and how many have another
    colour though they show the same point, against the picture with nothing left out."""
    things, camera, lights = example.scene(name)
    assert len(things) == 20
    given = {"camera": camera, "lights": lights, "technique": technique, "size": SIZE, "aovs": ("uv", "mask")}
    quick = bw.render(things, **given, **options)
    plain = bw.render(things, **given, skip=False)
    assert np.array_equal(quick.aovs["mask"], plain.aovs["mask"])
    number, uv = numbers(things, camera)
    sides = {at: part.material.height.shape for at, part in enumerate(things)}
    texels = np.array([sides[at][::-1] for at in range(len(things))], float)[number]

    inner = (slice(1, -1), slice(1, -1))
    judged = number[inner] >= 0
    steps = []
    for axis in (1, 0):
        before, after = np.roll(uv, 1, axis), np.roll(uv, -1, axis)
        for other in (np.roll(number, 1, axis), np.roll(number, -1, axis)):
            judged &= (other == number)[inner]
        back, on = ((uv - before) * texels)[inner], ((after - uv) * texels)[inner]
        # Not at the edges of a mesh, nor at the seams of its chart.
        judged &= (np.abs(back - on) <= 0.2 * (np.abs(back) + np.abs(on)) + 1e-3).all(axis=-1)
        steps.append(0.5 * (back + on))
    (xu, xv), (yu, yv) = (np.moveaxis(step, -1, 0) for step in steps)
    du, dv = np.moveaxis(((quick.aovs["uv"] - plain.aovs["uv"]) * texels)[inner], -1, 0)
    area = xu * yv - xv * yu
    judged &= np.abs(area) > 1e-12
    pixels = np.hypot(du * yv - dv * yu, dv * xu - du * xv) / np.maximum(np.abs(area), 1e-12)
    # The mesh bends within a pixel, and 32 bits end somewhere.
    off = judged & (np.hypot(du, dv) > TEXELS + 0.01) & (pixels > 1.1 * PIXELS)
    same = (number[inner] >= 0) & (np.hypot(du, dv) < 1e-4)
    differ = (np.abs(quick.color.astype(int) - plain.color)[inner] > 1).any(axis=-1)
    return int(judged.sum()), int(off.sum()), int((same & differ).sum())


@pytest.mark.parametrize("name", ["balls", "crates", "street", "stage", "walls", "field"])
def test_pictures_stay_within_the_bound(example: ModuleType, name: str) -> None:
    assert name in example.SCENES
    for technique in ("relief", "exact"):
        judged, off, recoloured = beyond(example, name, technique)
        assert judged > 1000, f"{technique}: only {judged} pixels were judged"
        assert off == 0, f"{technique}: {off} of {judged} pixels are off"
        assert recoloured == 0, f"{technique}: {recoloured} pixels that show the same have another colour"


def test_every_scene_is_looked_at(example: ModuleType) -> None:
    marks = [mark for mark in test_pictures_stay_within_the_bound.pytestmark if mark.name == "parametrize"]
    assert set(example.SCENES) == set(marks[0].args[1])


def test_a_wider_bound_is_noticed(example: ModuleType) -> None:
    judged, off, _ = beyond(example, "walls", "exact", skip_error=(0.5, 1.0))
    assert off > judged // 100
