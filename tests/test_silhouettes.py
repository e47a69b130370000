"""Displacement and relief with true outlines, through the Python API."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import bumpwgpu as bw
from bumpwgpu.cli import app

pytestmark = pytest.mark.gpu

CAMERA = bw.Camera.look_at((0.4, 0.7, 1.7), (0, 0, 0))
OUTPUTS = ("mask", "depth", "position", "shadow")


def sphere(technique: str, **options: object) -> bw.Frame:
    heights = bw.HeightMap.procedural("sines", 64, scale=0.1, base=0.0)
    return bw.render(
        bw.Mesh.sphere(),
        bw.Material(height=heights),
        camera=CAMERA,
        technique=technique,
        size=(96, 80),
        aovs=OUTPUTS,
        **options,  # type: ignore[arg-type]
    )


def grown(mask: np.ndarray) -> np.ndarray:
    """What is within a pixel of the mask."""
    padded = np.pad(mask, 1)
    h, w = mask.shape
    return np.any([padded[y : y + h, x : x + w] for y in range(3) for x in range(3)], axis=0)


def test_traced_relief_has_the_outline_and_depth_of_displacement() -> None:
    real, traced = sphere("displacement"), sphere("exact", silhouettes=True)
    a, b = real.aovs["mask"] == 1, traced.aovs["mask"] == 1
    assert not (a & ~grown(b)).any()
    assert not (b & ~grown(a)).any()
    both = a & b
    depth = np.abs(real.aovs["depth"][both] - traced.aovs["depth"][both])
    assert np.percentile(depth, 98) < 2 * 2 * np.tan(np.radians(22.5)) / 80
    assert (real.aovs["shadow"][both] != traced.aovs["shadow"][both]).mean() < 0.02
    # Negative control: on the mesh's own outline it is another picture.
    flat = sphere("exact").aovs["mask"] == 1
    assert (a & ~grown(flat)).sum() > 50


def test_a_technique_without_outlines_of_its_own_warns() -> None:
    with pytest.warns(bw.BumpWarning, match="silhouettes=True has no effect"):
        sphere("relief", silhouettes=True)
    with pytest.raises(TypeError, match="silhouettes"):
        sphere("exact", silhouettes="yes")


def test_displacement_is_a_technique_like_the_others() -> None:
    displacement = bw.techniques.Displacement()
    assert displacement.casts_shadows
    assert not displacement.marches
    assert "Cook" in displacement.source
    frame = sphere("displacement")
    assert frame.stats["triangles_drawn"] > 5000


def test_the_command_line_knows_silhouettes(tmp_path: Path) -> None:
    heights = bw.HeightMap.procedural("sines", 32).array
    np.save(tmp_path / "h.npy", heights)
    picture = tmp_path / "out.png"
    words = ["render", str(tmp_path / "h.npy"), "--mesh", "torus", "--size", "64", "48", "-o", str(picture)]
    result = CliRunner().invoke(app, [*words, "--technique", "exact", "--silhouettes"])
    assert result.exit_code == 0, result.output
    assert picture.exists()
