"""Properties of searches that promise the first hit, on maps and rays that hypothesis makes up."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

import bumpwgpu as bw
from bumpwgpu import _bumpwgpu
from bumpwgpu._stress_march import EPSILON, GUARANTEED, MOST_SKIPPED, MOST_ULPS

maps = arrays.arrays(
    np.float32,
    arrays.array_shapes(min_dims=2, max_dims=2, max_side=7),
    elements=st.floats(0.0, 1.0, width=32),
)
# Whole and half texels among them: there the walks have ties to break.
places = st.one_of(st.floats(-4.0, 4.0, width=32), st.integers(-12, 12).map(lambda n: n / 6.0))
steps = st.one_of(st.floats(-2.0, 2.0, width=32), st.sampled_from([0.0, 1.0, -1.0, 0.5, 1e-20]))
rays = st.lists(st.tuples(places, places, steps, steps), min_size=1, max_size=20)


@pytest.mark.parametrize("technique", GUARANTEED)
@settings(max_examples=60, deadline=None, derandomize=True)
@given(heights=maps, wrap=st.sampled_from(["repeat", "clamp", "mirror"]), made=rays)
def test_the_first_hit_is_found(technique: str, heights: Any, wrap: Any, made: Any) -> None:
    height_map = bw.HeightMap(heights, wrap=wrap)
    table = np.array(made, np.float32)
    count = len(table)
    origins = np.concatenate([table[:, :2], np.ones((count, 1), np.float32)], axis=1)
    directions = np.concatenate([table[:, 2:], -np.ones((count, 1), np.float32)], axis=1)
    hits = bw.march(height_map, origins, directions, technique)
    assert (hits.status == 0).all(), "every ray that goes down meets the surface"
    _, gap, skipped, rate = _bumpwgpu.judge(
        height_map.array,
        wrap,
        origins.astype(np.float64),
        directions.astype(np.float64),
        hits.t.astype(np.float64),
    )
    unit = EPSILON * (1.0 + hits.t * rate)
    assert (np.abs(gap) <= MOST_ULPS * unit).all()
    assert (skipped <= MOST_SKIPPED + MOST_ULPS * unit).all()
