"""render: which way up, lit from where, what the outputs hold; what is refused; and life without a device."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

import bumpwgpu as bw

FRONT = bw.Camera.look_at((0, 0, 2), (0, 0, 0), fov_y=2 * np.degrees(np.arctan(0.25)))
"""Sees the unit quad exactly, edge to edge."""
LOW = bw.Camera.look_at((0.1, -0.9, 0.5), (0, 0, 0))
ALL = ("uv", "depth", "position", "normal", "height", "steps", "shadow", "mask", "ray_start", "ray_delta")
TECHNIQUES = bw.techniques.names()
FACING = bw.Light.directional((0, 0, -1))


def render(technique: str | bw.techniques.Technique = "flat", **options: Any) -> bw.Frame:
    material = options.pop("material", None) or bw.Material(albedo=(1.0, 1.0, 1.0), specular=0.0)
    defaults: dict[str, Any] = {"camera": FRONT, "lights": [FACING], "size": (64, 64), "ambient": 0.0}
    return bw.render(
        options.pop("mesh", None) or bw.Mesh.quad(), material, technique=technique, **{**defaults, **options}
    )


def bricks(**options: Any) -> bw.Material:
    return bw.Material(height=bw.HeightMap.procedural("bricks", 64, scale=0.08), specular=0.0, **options)


def luma(frame: bw.Frame) -> NDArray[np.float64]:
    return np.asarray(frame.color[:, :, :3].mean(axis=2), dtype=np.float64)


@pytest.mark.gpu
def test_the_picture_is_upright_and_unmirrored() -> None:
    image = np.zeros((2, 2, 3), np.uint8)
    image[0, 0], image[0, 1], image[1, 0], image[1, 1] = (
        (255, 0, 0),
        (0, 255, 0),
        (0, 0, 255),
        (255, 255, 255),
    )
    image = image.repeat(32, 0).repeat(32, 1)
    frame = render(material=bw.Material(albedo=image, specular=0.0))
    assert frame.color.shape == (64, 64, 4)
    assert frame.color.dtype == np.uint8
    # Away from the borders, colours come through as they are: light 1 on a facing surface.
    for row, column in ((8, 8), (8, 56), (56, 8), (56, 56)):
        expected = image[row, column]
        np.testing.assert_allclose(frame.color[row, column, :3], expected, atol=1)


@pytest.mark.gpu
def test_outputs_of_a_quad_in_closed_form() -> None:
    width, height = 61, 37  # odd: rows are padded on the device
    camera = bw.Camera.look_at((0, 0, 2), (0, 0, 0), fov_y=60)
    frame = render(camera=camera, size=(width, height), aovs=("uv", "depth", "position", "normal", "mask"))
    tangent = np.tan(np.radians(30)) * 2
    x = (2 * (np.arange(width) + 0.5) / width - 1) * tangent * width / height
    y = (1 - 2 * (np.arange(height) + 0.5) / height) * tangent
    inside = (np.abs(x)[None] < 0.5) & (np.abs(y)[:, None] < 0.5)
    np.testing.assert_array_equal(frame.aovs["mask"] == 1, inside)
    np.testing.assert_array_equal(frame.color[:, :, 3] == 255, inside)
    plane = np.dstack(np.broadcast_arrays(x[None], y[:, None], 0.0))
    np.testing.assert_allclose(frame.aovs["position"][inside], plane[inside], atol=1e-5)
    uv = np.dstack(np.broadcast_arrays(x[None] + 0.5, 0.5 - y[:, None]))
    np.testing.assert_allclose(frame.aovs["uv"][inside], uv[inside], atol=1e-5)
    np.testing.assert_allclose(frame.aovs["depth"][inside], 2.0, atol=1e-5)
    assert np.isinf(frame.aovs["depth"][~inside]).all()
    np.testing.assert_allclose(frame.aovs["normal"][inside], [[0, 0, 1]] * inside.sum(), atol=1e-6)
    assert all(values.dtype == np.float32 for values in frame.aovs.values())


@pytest.mark.gpu
def test_lambert_and_the_srgb_curve() -> None:
    for degrees in (0, 30, 60):
        angle = np.radians(degrees)
        frame = render(lights=[bw.Light.directional((np.sin(angle), 0, -np.cos(angle)))])
        linear = np.cos(angle)
        expected = 255 * (1.055 * linear ** (1 / 2.4) - 0.055)
        assert abs(luma(frame)[32, 32] - expected) < 1.5
    assert luma(render(lights=[bw.Light.directional((0, 0, 1))])).max() == 0
    # Four times the light at twice the distance.
    one = render(lights=[bw.Light.point((0, 0, 1), intensity=0.5)])
    far = render(lights=[bw.Light.point((0, 0, 2), intensity=2.0)])
    assert abs(luma(one)[32, 32] - luma(far)[32, 32]) <= 1


@pytest.mark.gpu
@pytest.mark.parametrize("technique", [name for name in TECHNIQUES if name != "flat"])
def test_relief_is_lit_from_where_the_light_is(technique: str) -> None:
    """A ridge along v: the side that faces the light is the bright one."""
    ridge = bw.HeightMap.procedural("ridge", 64, scale=0.2)
    material = bw.Material(height=ridge, specular=0.0)
    light = bw.Light.directional((1, 0, -1))  # comes from the left
    frame = render(technique, material=material, lights=[light], shadows=False)
    left, right = luma(frame)[:, 8:24].mean(), luma(frame)[:, 40:56].mean()
    assert left > 1.3 * right
    upright = bw.Material(height=bw.HeightMap(ridge.array.T, scale=0.2), specular=0.0)
    above = bw.Light.directional((0, -1, -1))
    frame = render(technique, material=upright, lights=[above], shadows=False)
    assert luma(frame)[8:24].mean() > 1.3 * luma(frame)[40:56].mean()


@pytest.mark.gpu
@pytest.mark.parametrize("technique", TECHNIQUES)
def test_every_technique_draws(technique: str) -> None:
    frame = render(technique, mesh=bw.Mesh.torus(), material=bricks(), camera=None, aovs=ALL)
    mask = frame.aovs["mask"] == 1
    assert 0.05 < mask.mean() < 0.95
    assert (frame.color[:, :, 3][mask] == 255).all()
    assert len(np.unique(frame.color[mask], axis=0)) > 10
    for name, values in frame.aovs.items():
        assert values.shape[:2] == (64, 64), name
        assert np.isfinite(values[mask]).all(), name
    assert list(frame.aovs) == [name for name in ALL if name in frame.aovs]
    np.testing.assert_allclose(np.linalg.norm(frame.aovs["normal"][mask], axis=1), 1, atol=1e-3)


@pytest.mark.gpu
@pytest.mark.parametrize("technique", ["relief", "interval", "exact"])
def test_what_is_seen_lies_on_the_surface(technique: str) -> None:
    """Position, uv and height of a pixel agree, and lie on its view ray."""
    hm = bw.HeightMap.procedural("sines", 64, scale=0.1)
    frame = render(technique, material=bw.Material(height=hm), camera=LOW, aovs=ALL)
    mask = frame.aovs["mask"] == 1
    uv, z, position = (frame.aovs[name][mask] for name in ("uv", "height", "position"))
    np.testing.assert_allclose(position[:, 0], uv[:, 0] - 0.5, atol=1e-4)
    np.testing.assert_allclose(position[:, 1], 0.5 - uv[:, 1], atol=1e-4)
    np.testing.assert_allclose(position[:, 2], 0.1 * (z - 1), atol=1e-4)
    u, v = uv.T
    surface = 0.5 + 0.25 * np.sin(6 * np.pi * u) + 0.25 * np.sin(4 * np.pi * v)
    np.testing.assert_allclose(z, surface, atol=5e-3)


@pytest.mark.gpu
def test_exact_pixels_are_march_results() -> None:
    hm = bw.HeightMap.procedural("bricks", 64, scale=0.08)
    frame = render("exact", material=bw.Material(height=hm), camera=LOW, aovs=ALL)
    mask = frame.aovs["mask"] == 1
    starts, deltas = frame.aovs["ray_start"][mask], frame.aovs["ray_delta"][mask]
    hits = bw.march(hm, starts, deltas)
    assert (hits.status == 0).mean() > 0.999
    difference = hits.uv - frame.aovs["uv"][mask]
    difference -= np.round(difference)
    assert np.nanpercentile(np.abs(difference) * 64, 99) < 0.01  # texels
    # Negative control: the start of the segment is not the hit.
    assert np.percentile(np.abs(starts[:, :2] - hits.uv) * 64, 50) > 0.1


@pytest.mark.gpu
@pytest.mark.parametrize("technique", ["cone", "relaxed_cone", "distance"])
def test_searches_that_read_maps_draw_about_as_fast_as_exact(technique: str) -> None:
    # Small triangles: half of what is drawn only serves derivatives of neighbours, and is not to be marched.
    mesh, material = bw.Mesh.torus(), bricks()
    camera = bw.Camera((1.2, 0.9, 1.2), (0.0, 0.0, 0.0))

    def fastest(name: str) -> float:
        frames = [bw.render(mesh, material, camera=camera, technique=name, size=160) for _ in range(3)]
        return min(float(frame.stats["draw_ms"]) for frame in frames)

    # Measured: 0.9 to 2.2 times as long; 45 to 130 times when such pixels are marched.
    assert fastest(technique) < 12.0 * fastest("exact")


@pytest.mark.gpu
def test_shadows_darken() -> None:
    low_sun = [bw.Light.directional((1, 0.3, -0.5))]
    lit = render("relief", material=bricks(), lights=low_sun, shadows=False, aovs=("shadow",))
    shadowed = render("relief", material=bricks(), lights=low_sun, shadows=True, aovs=("shadow",))
    assert luma(shadowed).mean() < luma(lit).mean() - 5
    assert lit.aovs["shadow"].max() == 0
    assert shadowed.aovs["shadow"].max() == 1
    assert (luma(shadowed) <= luma(lit) + 1).all()
    assert shadowed.stats["shadow_rays"] > 0
    with pytest.warns(bw.BumpWarning, match="shadow"):
        render("bump", material=bricks(), shadows=True)


@pytest.mark.gpu
def test_shadows_from_a_horizon_map() -> None:
    low_sun = [bw.Light.directional((1, 0.3, -0.5))]
    rays, looked_up, soft, none = (
        render("relief", material=bricks(), lights=low_sun, shadows=shadows, aovs=("shadow",))
        for shadows in (True, "horizon", bw.HorizonShadows(azimuths=64, softness=20.0), False)
    )
    assert looked_up.stats["shadow_rays"] == 0 < rays.stats["shadow_rays"]
    same = ((looked_up.aovs["shadow"] > 0.5) == (rays.aovs["shadow"] > 0.5)).mean()
    assert same > 0.95
    # Negative control: no shadow at all is not as close.
    assert ((none.aovs["shadow"] > 0.5) == (rays.aovs["shadow"] > 0.5)).mean() < same - 0.05
    partly = (soft.aovs["shadow"] > 0.01) & (soft.aovs["shadow"] < 0.99)
    assert partly.mean() > 0.05
    hard = (looked_up.aovs["shadow"] > 0.01) & (looked_up.aovs["shadow"] < 0.99)
    assert not hard.any()
    # Techniques without a search get shadows too; those without a relief say that they do not.
    bump = render("bump", material=bricks(), lights=low_sun, shadows="horizon", aovs=("shadow",))
    assert bump.warnings == ()
    assert bump.aovs["shadow"].max() == 1
    with pytest.warns(bw.BumpWarning, match="horizon"):
        render("flat", material=bricks(), shadows="horizon")


def test_horizon_shadows_are_checked() -> None:
    assert bw.HorizonShadows() == bw.HorizonShadows(azimuths=32, softness=0.0)
    for wrong in ({"azimuths": 3}, {"azimuths": 257}, {"softness": -1.0}, {"softness": float("nan")}):
        with pytest.raises(ValueError, match=next(iter(wrong))):
            bw.HorizonShadows(**wrong)
    with pytest.raises(TypeError, match="azimuths"):
        bw.HorizonShadows(azimuths=8.5)
    with pytest.raises(TypeError, match="horizon"):
        bw.render(bw.Mesh.quad(), shadows="soft")


@pytest.mark.gpu
def test_the_same_twice_and_other_materials_differ() -> None:
    one, two = (render("relief", material=bricks(), camera=LOW) for _ in range(2))
    np.testing.assert_array_equal(one.color, two.color)
    material = bricks(albedo=(0.9, 0.2, 0.2))
    assert not np.array_equal(render("relief", material=material, camera=LOW).color, one.color)


@pytest.mark.gpu
def test_normal_maps_given_and_baked_agree() -> None:
    hm = bw.HeightMap.procedural("sines", 64, scale=0.05)
    light = [bw.Light.directional((1, -0.5, -1))]
    normal = bw.bake(hm)["normal"]
    baked = luma(render("normal", material=bw.Material(height=hm, specular=0.0), lights=light))
    floats = luma(render("normal", material=bw.Material(normal=normal, specular=0.0), lights=light))
    coded = ((normal + 1) / 2 * 65535 + 0.5).astype(np.uint16)
    integers = luma(render("normal", material=bw.Material(normal=coded, specular=0.0), lights=light))
    flipped = bw.bake(hm, convention="directx")["normal"]
    directx = bw.Material(normal=flipped, normal_convention="directx", specular=0.0)
    assert np.abs(floats - integers).max() <= 1
    assert np.abs(floats - luma(render("normal", material=directx, lights=light))).max() <= 1
    assert np.abs(floats - baked).mean() < 3
    # Negative control: the green channel matters.
    wrong = luma(render("normal", material=bw.Material(normal=flipped, specular=0.0), lights=light))
    assert np.abs(floats - wrong).mean() > 5


@pytest.mark.gpu
def test_materials_of_a_mesh_file(tmp_path: Path) -> None:
    Image.fromarray(np.full((4, 4, 3), (220, 30, 30), np.uint8)).save(tmp_path / "red.png")
    (tmp_path / "two.mtl").write_text("newmtl red\nmap_Kd red.png\nnewmtl green\nKd 0 1 0\n")
    (tmp_path / "two.obj").write_text(
        "mtllib two.mtl\nv -1 -1 0\nv 0 -1 0\nv 0 1 0\nv -1 1 0\nv 1 -1 0\nv 1 1 0\n"
        "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl red\nf 1/1 2/2 3/3 4/4\nusemtl green\nf 2/1 5/2 6/3 3/4\n"
    )
    mesh = bw.Mesh.open(tmp_path / "two.obj")
    aside = bw.Light.directional((1, 0, -0.5))  # no highlight towards the camera
    options: dict[str, Any] = {"camera": FRONT, "lights": [aside], "size": 32, "technique": "flat"}
    frame = bw.render(mesh, **options)
    left, right = frame.color[16, 8, :3].astype(int), frame.color[16, 24, :3].astype(int)
    assert left[0] > 2 * left[1]
    assert right[1] > 2 * right[0]
    plain = bw.Material(specular=0.0)
    swapped = bw.render(mesh, [plain, plain], **options)
    np.testing.assert_array_equal(swapped.color[16, 8], swapped.color[16, 24])
    with pytest.raises(ValueError, match="1 materials given, but the mesh has 2"):
        bw.render(mesh, [plain], **options)


@pytest.mark.gpu
def test_background_ambient_and_culling() -> None:
    frame = render(mesh=bw.Mesh.quad(0.2), background=(1.0, 0.0, 0.0))
    assert frame.color[0, 0].tolist() == [255, 0, 0, 255]
    assert render(mesh=bw.Mesh.quad(0.2)).color[0, 0].tolist() == [0, 0, 0, 0]
    glow = render(lights=[], ambient=1.0)
    assert glow.color[32, 32].tolist() == [255, 255, 255, 255]
    away = bw.Camera.look_at((0, 0, 2), (0, 0, 9))
    empty = render(camera=away, aovs=("mask",))
    assert empty.aovs["mask"].max() == 0
    assert empty.stats["triangles_drawn"] == 0
    assert empty.stats["triangles_culled"] == 2


@pytest.mark.gpu
def test_frames_are_saved(tmp_path: Path) -> None:
    frame = render("relief", material=bricks(), size=(33, 17))
    for suffix in ("png", "tiff", "bmp"):
        path = frame.save(tmp_path / f"picture.{suffix}")
        with Image.open(path) as image:
            np.testing.assert_array_equal(np.asarray(image.convert("RGB")), frame.color[:, :, :3])
    frame.save(str(tmp_path / "picture.jpg"))
    assert frame.to_pil().size == (33, 17)
    assert frame._repr_png_().startswith(b"\x89PNG")
    assert repr(frame) == "<Frame 33 x 17>"
    before = sorted(path.name for path in tmp_path.iterdir())
    with pytest.raises(ValueError, match="suffix"):
        frame.save(tmp_path / "picture.xyz")
    with pytest.raises(FileNotFoundError):
        frame.save(tmp_path / "nowhere" / "picture.png")
    with pytest.raises(TypeError):
        frame.save(3)
    assert sorted(path.name for path in tmp_path.iterdir()) == before


@pytest.mark.gpu
def test_settings_without_effect_warn() -> None:
    with pytest.warns(bw.BumpWarning, match="no height map"):
        frame = render("relief")
    assert frame.warnings
    with pytest.warns(bw.BumpWarning, match="one light|first light|lights"):
        render("dot3", material=bricks(), lights=[FACING, FACING])


@pytest.mark.gpu
def test_absurd_sizes() -> None:
    with pytest.raises(bw.RenderError, match="at most"):
        render(size=(70_000, 1))
    assert render(size=(1, 1)).color.shape == (1, 1, 4)
    assert render(size=(257, 1)).color.shape == (1, 257, 4)


QUAD = bw.Mesh.quad()
REFUSED: dict[str, tuple[Callable[[], Any], type[Exception], str]] = {
    "mesh": (lambda: bw.render("quad"), TypeError, "Mesh"),
    "material": (lambda: bw.render(QUAD, 3), TypeError, "Material"),
    "technique": (lambda: bw.render(QUAD, technique="cones"), ValueError, "relief"),
    "size": (lambda: bw.render(QUAD, size=(0, 5)), ValueError, "at least 1"),
    "size 3": (lambda: bw.render(QUAD, size=(1, 2, 3)), ValueError, "size"),
    "half pixels": (lambda: bw.render(QUAD, size=1.5), TypeError, "whole"),
    "aov": (lambda: bw.render(QUAD, aovs=("colour",)), ValueError, "depth"),
    "device": (lambda: bw.render(QUAD, device="cpu"), ValueError, "Vulkan"),
    "device name": (lambda: bw.render(QUAD, device="tpu"), ValueError, "auto"),
    "camera": (lambda: bw.render(QUAD, camera=(0, 0, 1)), TypeError, "Camera"),
    "lights": (lambda: bw.render(QUAD, lights=[(0, 0, 1)]), TypeError, r"lights\[0\]"),
    "ambient": (lambda: bw.render(QUAD, ambient=-1), ValueError, "ambient"),
    "background": (lambda: bw.render(QUAD, background=(2, 0, 0)), ValueError, "0..1"),
    "shadows": (lambda: bw.render(QUAD, shadows="yes"), TypeError, "shadows"),
    "eye": (lambda: bw.Camera.look_at((0, 0, 0), (0, 0, 0)), ValueError, "same point"),
    "up": (lambda: bw.Camera.look_at((0, 1, 0), (0, 0, 0)), ValueError, "parallel"),
    "no up": (lambda: bw.Camera.look_at((0, 0, 1), (0, 0, 0), (0, 0, 0)), ValueError, "zero"),
    "far eye": (lambda: bw.Camera.look_at((0, 0, np.nan), (0, 0, 0)), ValueError, "finite"),
    "fov": (lambda: bw.Camera.look_at((0, 0, 1), (0, 0, 0), fov_y=180), ValueError, "fov_y"),
    "eye shape": (lambda: bw.Camera.look_at((0, 1), (0, 0, 0)), ValueError, "3 numbers"),
    "eye type": (lambda: bw.Camera.look_at("abc", (0, 0, 0)), TypeError, "3 numbers"),
    "light": (lambda: bw.Light.directional((0, 0, 0)), ValueError, "zero"),
    "light color": (lambda: bw.Light.point((0, 0, 1), (-1, 0, 0)), ValueError, "color"),
    "light power": (lambda: bw.Light.point((0, 0, 1), intensity=np.inf), ValueError, "intensity"),
    "light kind": (lambda: bw.Light("spot", (0, 0, 1)), ValueError, "point"),
    "specular": (lambda: bw.Material(specular=2), ValueError, "specular"),
    "shininess": (lambda: bw.Material(shininess=0), ValueError, "shininess"),
    "albedo": (lambda: bw.Material(albedo=(2.0, 0, 0)), ValueError, "albedo"),
    "albedo 5": (lambda: bw.Material(albedo=np.zeros((2, 2, 5))), ValueError, "albedo"),
    "albedo NaN": (lambda: bw.Material(albedo=np.full((2, 2), np.nan)), ValueError, "NaN"),
    "albedo empty": (lambda: bw.Material(albedo=np.zeros((0, 2, 3))), ValueError, "albedo"),
    "albedo name": (lambda: bw.Material(albedo="red"), FileNotFoundError, "red"),
    "normal": (lambda: bw.Material(normal=np.full((2, 2, 3), 3.0)), ValueError, "-1..1"),
    "normal 1": (lambda: bw.Material(normal=np.zeros((2, 2))), ValueError, "2 channels"),
    "height": (lambda: bw.Material(height=[[2.0]]), ValueError, "height_range"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_refused(name: str) -> None:
    call, kind, message = REFUSED[name]
    with pytest.raises(kind, match=message):
        call()


def test_scene_objects_do_not_change() -> None:
    for thing, name in ((FRONT, "fov_y"), (FACING, "intensity"), (bw.Material(), "specular")):
        with pytest.raises(AttributeError):
            setattr(thing, name, 1.0)


def test_without_a_device_everything_but_render_works(tmp_path: Path) -> None:
    code = (
        "import bumpwgpu as bw\n"
        "hm = bw.HeightMap.procedural('bricks', 16)\n"
        "bw.bake(hm); bw.march(hm, [[0, 0, 1]], [[0, 0, -1]]); bw.info()\n"
        "bw.march(hm, [[0, 0, 1]], [[0, 0, -1]], device='auto')\n"
        "for call in (lambda: bw.render(bw.Mesh.quad()),\n"
        "             lambda: bw.march(hm, [[0, 0, 1]], [[0, 0, -1]], device='gpu')):\n"
        "    try: call()\n"
        "    except bw.RenderError as error: print(error)\n"
    )
    missing = str(tmp_path / "none.json")
    environment = {**os.environ, "VK_DRIVER_FILES": missing, "VK_ICD_FILENAMES": missing}
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stderr
    assert len(done.stdout.splitlines()) == 2
    assert all("install" in line for line in done.stdout.splitlines())
    assert "panicked" not in done.stderr
