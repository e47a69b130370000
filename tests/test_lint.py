"""Lint finds each fault when it is planted, and nothing in what is sound."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image, PngImagePlugin

import bumpwgpu as bw
from bumpwgpu.linting import CODES


@pytest.fixture(scope="module")
def wall() -> bw.HeightMap:
    return bw.HeightMap.procedural("fbm", 64, scale=0.2)


@pytest.fixture(scope="module")
def normals(wall: bw.HeightMap) -> np.ndarray:
    return bw.bake(wall)["normal"]


def codes(report: bw.LintReport) -> list[str]:
    assert {finding.code for finding in report.findings} <= CODES.keys()
    return [finding.code for finding in report.findings]


def test_what_is_sound_has_no_findings(wall: bw.HeightMap, normals: np.ndarray) -> None:
    cones = bw.bake(wall, ("cone", "relaxed_cone"))
    report = bw.lint(
        height=wall.array,
        normal=normals,
        cone=cones["cone"],
        relaxed_cone=cones["relaxed_cone"],
        mesh=bw.Mesh.torus(),
        scale=0.2,
    )
    assert codes(report) == []
    assert report
    assert len(report.checked) == 5
    assert "5 checked: 0 errors, 0 warnings" in str(report)


def test_relaxed_cones_of_slopes_have_no_findings() -> None:
    # Looked at in steps of two texels, a hill that still rises seems to fall.
    hills = bw.HeightMap.procedural("sines", 128, scale=0.05)
    relaxed = bw.bake(hills, ("relaxed_cone",))["relaxed_cone"]
    assert codes(bw.lint(height=hills.array, relaxed_cone=relaxed)) == []
    wider = np.minimum(relaxed * np.float32(1.05), 1.0)
    assert codes(bw.lint(height=hills.array, relaxed_cone=wider)) == ["non-conservative-cone"]


# Heights


def test_heights_of_eight_bits(wall: bw.HeightMap) -> None:
    assert codes(bw.lint(height=np.rint(wall.array * 255).astype(np.uint8))) == ["8-bit-heights"]
    assert codes(bw.lint(height=np.rint(wall.array * 65535).astype(np.uint16))) == []


def test_heights_without_relief_or_range(wall: bw.HeightMap) -> None:
    assert codes(bw.lint(height=np.full((16, 16), 0.5))) == ["flat-heights"]
    assert codes(bw.lint(height=wall.array * 0.1)) == ["unused-range"]


def test_seams(wall: bw.HeightMap) -> None:
    cut = wall.array[:, :41]
    assert "tile-seam" in codes(bw.lint(height=cut))
    assert codes(bw.lint(height=cut, wrap="clamp")) == []


def test_srgb_tags_and_photographs(wall: bw.HeightMap, normals: np.ndarray, tmp_path: Path) -> None:
    tagged = PngImagePlugin.PngInfo()
    tagged.add(b"sRGB", b"\0")
    levels = np.rint(wall.array * 65535).astype(np.uint16)
    Image.fromarray(levels).save(tmp_path / "wall_height.png", pnginfo=tagged)
    assert codes(bw.lint(tmp_path / "wall_height.png")) == ["srgb-tagged"]
    colour = np.rint((normals * 0.5 + 0.5) * 255).astype(np.uint8)
    Image.fromarray(colour).save(tmp_path / "wall_normal.jpg", quality=60)
    assert "lossy" in codes(bw.lint(tmp_path / "wall_normal.jpg"))


# Normals


def test_green_the_other_way(wall: bw.HeightMap, normals: np.ndarray) -> None:
    flipped = normals * np.array([1, -1, 1], np.float32)
    assert codes(bw.lint(normal=flipped, height=wall.array)) == ["wrong-green"]
    assert codes(bw.lint(normal=flipped)) == ["wrong-green"], "the curl alone decides"
    assert codes(bw.lint(normal=flipped, convention="directx")) == []
    assert not bw.lint(normal=flipped)


def test_the_name_says_which_way_green_should_point(normals: np.ndarray, tmp_path: Path) -> None:
    colour = np.rint((normals * 0.5 + 0.5) * 255).astype(np.uint8)
    for name, expected in (("Rock_NormalGL.png", []), ("Rock_NormalDX.png", ["wrong-green"])):
        Image.fromarray(colour).save(tmp_path / name)
        assert codes(bw.lint(tmp_path / name)) == expected


def test_vectors_that_are_none(normals: np.ndarray, wall: bw.HeightMap) -> None:
    assert codes(bw.lint(normal=normals * np.float32(0.9))) == ["non-unit"]
    inside_out = normals.copy()
    inside_out[:8, :8, 2] *= -1
    assert "inward" in codes(bw.lint(normal=inside_out))
    exchanged = np.ascontiguousarray(normals[:, :, [1, 0, 2]])
    assert "swapped-channels" in codes(bw.lint(normal=exchanged, height=wall.array))


def test_normals_of_other_heights(wall: bw.HeightMap, normals: np.ndarray) -> None:
    other = bw.HeightMap.procedural("fbm", 64, seed=5)
    assert codes(bw.lint(normal=normals, height=other.array)) == ["height-mismatch"]
    assert codes(bw.lint(normal=normals, height=wall.array, invert=True)) == ["inverted-heights"]
    assert codes(bw.lint(normal=normals, height=wall.array, scale=0.02)) == ["scale-mismatch"]
    assert codes(bw.lint(normal=normals, height=wall.array, scale=0.21)) == []
    halves = np.ascontiguousarray(wall.array[::2, ::2])
    assert "size-mismatch" in codes(bw.lint(normal=normals, height=halves))


def test_seams_of_normals(normals: np.ndarray) -> None:
    assert codes(bw.lint(normal=np.ascontiguousarray(normals[:, :37]))) == ["tile-seam"]


# Cones


@pytest.mark.parametrize("name", ["cone", "relaxed_cone"])
def test_cones_that_cut_the_surface(wall: bw.HeightMap, name: str) -> None:
    sound = bw.bake(wall, name)[name]
    wide = np.minimum(sound * 1.3, 1.0)
    assert codes(bw.lint(height=wall.array, **{name: wide})) == ["non-conservative-cone"]
    textbook = bw.bake(wall, name, mode="texel")[name]
    assert codes(bw.lint(height=wall.array, **{name: textbook})) == ["non-conservative-cone"]
    down = np.floor(sound * 255).astype(np.uint8)
    assert codes(bw.lint(height=wall.array, **{name: down})) == []
    half = np.ascontiguousarray(sound[::2, ::2])
    assert codes(bw.lint(height=wall.array, **{name: half})) == ["size-mismatch"]
    assert codes(bw.lint(**{name: sound})) == ["unknown-role"]


# Meshes


def grid(uvs: Any = None, tangents: Any = None) -> bw.Mesh:
    x, y = np.meshgrid(np.linspace(0, 1, 5), np.linspace(0, 1, 5))
    positions = np.stack([x.ravel(), y.ravel(), 0.0 * x.ravel()], axis=1)
    at = np.arange(25).reshape(5, 5)
    lower = np.stack([at[:-1, :-1], at[:-1, 1:], at[1:, :-1]], axis=-1).reshape(-1, 3)
    upper = np.stack([at[:-1, 1:], at[1:, 1:], at[1:, :-1]], axis=-1).reshape(-1, 3)
    flat = np.stack([x.ravel(), 1.0 - y.ravel()], axis=1)
    return bw.Mesh(
        positions, np.concatenate([lower, upper]), flat if uvs is None else uvs(flat), tangents=tangents
    )


@pytest.mark.filterwarnings("ignore::bumpwgpu.BumpWarning")
def test_uvs() -> None:
    assert codes(bw.lint(mesh=grid())) == []
    assert codes(bw.lint(mesh=grid(lambda uv: 0.0 * uv))) == ["no-uvs"]
    flattened = grid(lambda uv: np.where(uv[:, :1] < 0.5, [0.0, 1.0], [1.0, 1.0]) * uv)
    assert "degenerate-uvs" in codes(bw.lint(mesh=flattened))
    uneven = grid(
        lambda uv: np.stack([np.where(uv[:, 0] > 0.5, 4 * uv[:, 0] - 1.5, uv[:, 0]), uv[:, 1]], axis=1)
    )
    assert codes(bw.lint(mesh=uneven)) == []
    steeper = grid(
        lambda uv: np.stack([np.where(uv[:, 0] > 0.5, 9 * uv[:, 0] - 4.0, uv[:, 0]), uv[:, 1]], axis=1)
    )
    assert codes(bw.lint(mesh=steeper)) == ["uv-density-jump"]


@pytest.mark.filterwarnings("ignore::bumpwgpu.BumpWarning")
def test_tangents_on_mirrored_seams() -> None:
    def mirrored(uv: Any) -> Any:
        return np.stack([np.abs(uv[:, 0] - 0.5), uv[:, 1]], axis=1)

    assert codes(bw.lint(mesh=grid(mirrored))) == [], "no tangents, none to share"
    along = np.tile([1.0, 0.0, 0.0, 1.0], (25, 1))
    stored = bw.lint(mesh=grid(mirrored, along))
    assert ("mirrored-seam-tangents", "error") in [(f.code, f.severity) for f in stored.findings]
    assert codes(bw.lint(mesh=grid(None, along))) == []


def test_tangents_of_this_package_are_none_that_were_stored(assets: Path) -> None:
    # An OBJ has none; what it is given is MikkTSpace's, mirrored seams and all.
    for name in ("obj/meshoptimizer/pirate.obj", "obj/mikktspace/rancid_geometry.obj"):
        found = codes(bw.lint(mesh=assets / name))
        assert not {"mirrored-seam-tangents", "bad-tangents", "tangent-space"} & set(found), name


@pytest.mark.filterwarnings("ignore::bumpwgpu.BumpWarning")
def test_parts_without_texture_coordinates_are_no_fault() -> None:
    def half(uv: Any) -> Any:
        return np.where(np.arange(len(uv))[:, None] < 15, 0.0, uv)

    found = bw.lint(mesh=grid(half)).findings
    assert ("no-uvs", "info") in [(f.code, f.severity) for f in found]
    whole = bw.lint(mesh=grid()).findings
    assert not whole


def test_stored_tangents() -> None:
    turned = np.tile([1.0, 0.0, 0.0, -1.0], (25, 1))
    assert codes(bw.lint(mesh=grid(None, turned))) == ["wrong-handedness"]
    leaning = np.tile([0.6, 0.0, 0.8, 1.0], (25, 1))
    assert "bad-tangents" in codes(bw.lint(mesh=grid(None, leaning)))
    across = np.tile([0.6, 0.8, 0.0, 1.0], (25, 1))
    assert codes(bw.lint(mesh=grid(None, across))) == ["tangent-space"]


# Files


def test_files_find_each_other_by_name(wall: bw.HeightMap, normals: np.ndarray, tmp_path: Path) -> None:
    other = bw.HeightMap.procedural("fbm", 64, seed=5)
    for name, heights in (("wall", wall), ("rock", other)):
        levels = np.rint(heights.array * 65535).astype(np.uint16)
        Image.fromarray(levels).save(tmp_path / f"{name}_height.png")
        colour = np.rint((bw.bake(heights)["normal"] * 0.5 + 0.5) * 255).astype(np.uint8)
        Image.fromarray(colour).save(tmp_path / f"{name}_normal.png")
    Image.fromarray(colour).save(tmp_path / "wall_albedo.png")
    (tmp_path / "notes.txt").write_text("no image")
    sound = bw.lint(tmp_path)
    assert codes(sound) == []
    assert len(sound.checked) == 5
    (tmp_path / "rock_normal.png").rename(tmp_path / "keep.png")
    (tmp_path / "wall_normal.png").rename(tmp_path / "rock_normal.png")
    assert codes(bw.lint(tmp_path)) == ["height-mismatch"]
    assert codes(bw.lint(tmp_path / "keep.png")) == ["unknown-role"]


def test_names_of_one_letter_and_of_terrains(wall: bw.HeightMap, tmp_path: Path) -> None:
    levels = np.rint(wall.array * 65535).astype(np.uint16)
    turned = bw.bake(wall, convention="directx")["normal"]
    for name in ("rock-h", "heightfield", "elevation_surface"):
        Image.fromarray(levels).save(tmp_path / f"{name}.png")
    Image.fromarray(np.rint((turned * 0.5 + 0.5) * 255).astype(np.uint8)).save(tmp_path / "rock-n.png")
    report = bw.lint(tmp_path, scale=0.2)
    assert len(report.checked) == 4
    assert codes(report) == ["wrong-green"]


def test_charts_need_not_tile(wall: bw.HeightMap, tmp_path: Path) -> None:
    levels = np.rint(wall.array[:, :41] * 65535).astype(np.uint16)
    Image.fromarray(levels).save(tmp_path / "wall_height.png")
    assert not bw.lint(tmp_path)
    corners = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
    faces = "f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n"
    for far, passes in ((1, True), (3, False)):
        uvs = f"vt 0 0\nvt {far} 0\nvt {far} {far}\nvt 0 {far}\n"
        (tmp_path / "wall.obj").write_text(corners + uvs + faces)
        report = bw.lint(tmp_path)
        assert bool(report) is passes
        assert codes(report) == ["tile-seam"] * len(report.findings)


def test_damaged_files_are_findings(tmp_path: Path) -> None:
    for name in ("a_height.png", "a_normal.png", "a_cone.png", "a.obj"):
        (tmp_path / name).write_bytes(b"\x89PNG\r\n\x1a\nnot really")
    report = bw.lint(tmp_path)
    assert codes(report) == ["unreadable"] * 4
    data = json.loads(report.to_json(tmp_path / "lint.json").read_text())
    assert len(data["findings"]) == 4
    assert len(report.worse_than("error")) == 4
    with pytest.raises(ValueError, match="severity"):
        report.worse_than("fatal")  # type: ignore[arg-type]


def test_senseless_calls_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="nothing to check"):
        bw.lint()
    with pytest.raises(FileNotFoundError, match="no file"):
        bw.lint(tmp_path / "nowhere.png")
    with pytest.raises(FileNotFoundError, match="no file"):
        bw.lint(height=tmp_path / "nowhere.png")
    with pytest.raises(TypeError, match="paths"):
        bw.lint(np.zeros((4, 4)))  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="mesh"):
        bw.lint(mesh=3)
    with pytest.raises(ValueError, match="convention"):
        bw.lint(height=[[0.5]], convention="vulkan")  # type: ignore[arg-type]


def test_real_assets_get_real_findings(assets: Path) -> None:
    rock = bw.lint(assets / "ambientcg" / "rock058")
    assert {"lossy", "8-bit-heights"} <= set(codes(rock))
    assert "wrong-green" not in codes(rock)
    helmet = bw.lint(assets / "bevy" / "FlightHelmet" / "FlightHelmet.gltf")
    assert "mirrored-seam-tangents" in codes(helmet)


@pytest.mark.slow
def test_real_materials_are_told_apart(assets: Path) -> None:
    # What fits of heights to normals, made elsewhere, say: depths; green down; both; another surface.
    for folder, expected in (
        ("paramap_earth", {"inverted-heights"}),
        ("playcanvas", {"wrong-green"}),
        ("panda3d", {"inverted-heights", "wrong-green"}),
        ("godot", {"height-mismatch"}),
        ("ambientcg/facade005", set()),
        ("bevy/parallax_example", set()),
    ):
        found = set(codes(bw.lint(assets / folder)))
        assert found & {"inverted-heights", "wrong-green", "height-mismatch"} == expected, folder


# Textures of engines


def _packed(normals: np.ndarray, heights: np.ndarray) -> Image.Image:
    """Normals with heights in alpha."""
    vectors = np.rint((normals * 0.5 + 0.5) * 255)
    return Image.fromarray(np.dstack([vectors, np.rint(heights * 255)]).astype(np.uint8), "RGBA")


@pytest.mark.parametrize("suffix", ["png", "tga", "dds"])
def test_heights_in_alpha(wall: bw.HeightMap, normals: np.ndarray, tmp_path: Path, suffix: str) -> None:
    texture = _packed(normals, wall.array)
    texture.save(tmp_path / f"wall_nh.{suffix}")
    report = bw.lint(tmp_path)
    assert codes(report) == ["8-bit-heights"], str(report)
    assert {part.rsplit("(", 1)[1] for part in report.checked} == {"normal)", "alpha height)"}
    assert "wrong-green" in codes(bw.lint(tmp_path, convention="directx"))
    # Heights of another surface, upside down, and none at all.
    _packed(normals, bw.HeightMap.procedural("fbm", 64, seed=9).array).save(tmp_path / f"wall_nh.{suffix}")
    assert "height-mismatch" in codes(bw.lint(tmp_path))
    _packed(normals, 1.0 - wall.array).save(tmp_path / f"wall_nh.{suffix}")
    assert "inverted-heights" in codes(bw.lint(tmp_path))
    assert "inverted-heights" not in codes(bw.lint(tmp_path, invert=True))
    texture.convert("RGB").save(tmp_path / f"wall_nh.{suffix}")
    assert "unreadable" in codes(bw.lint(tmp_path))


def test_an_alpha_channel_that_nobody_expects(
    wall: bw.HeightMap, normals: np.ndarray, tmp_path: Path
) -> None:
    _packed(normals, wall.array).save(tmp_path / "wall_normal.png")
    assert "data-in-alpha" in codes(bw.lint(tmp_path))
    _packed(normals, np.ones_like(wall.array)).save(tmp_path / "wall_normal.png")
    assert "data-in-alpha" not in codes(bw.lint(tmp_path))


def test_textures_in_blocks(normals: np.ndarray, tmp_path: Path) -> None:
    texture = _packed(normals, np.ones(normals.shape[:2])).convert("RGB")
    path = tmp_path / "wall_normal.dds"
    try:
        texture.save(path, pixel_format="BC5")
    except OSError:
        pytest.skip("this Pillow writes no blocks")
    if path.stat().st_size > 3 * 64 * 64:
        pytest.skip("this Pillow writes no blocks")
    assert not {"lossy", "non-unit", "unreadable"} & {*codes(bw.lint(path))}
    texture.convert("RGBA").save(path, pixel_format="DXT1")
    assert "lossy" in codes(bw.lint(path))


def test_tagged_and_hostile_textures(normals: np.ndarray, tmp_path: Path) -> None:
    path = tmp_path / "wall_normal.dds"
    _packed(normals, np.ones(normals.shape[:2])).save(path)
    plain = path.read_bytes()
    # 28 and 29 are DXGI's R8G8B8A8, linear and sRGB; Pillow alone does not know 72, BC1 in sRGB.
    for kind, tagged in ((28, False), (29, True), (71, False), (72, True)):
        newer = struct.pack("<5I", kind, 3, 0, 1, 0)
        path.write_bytes(plain[:80] + struct.pack("<I4s", 4, b"DX10") + plain[88:128] + newer + plain[128:])
        assert ("srgb-tagged" in codes(bw.lint(path))) == tagged, kind
    larger = plain[:12] + struct.pack("<2I", 60_000, 60_000) + plain[20:]
    for broken in (b"", plain[:60], plain[: len(plain) // 2], b"DDX " + plain[4:], larger):
        path.write_bytes(broken)
        assert codes(bw.lint(path)) == ["unreadable"]
        with pytest.raises(bw.BumpError):
            bw.HeightMap(path, channel="r")


def test_textures_of_several_pictures(tmp_path: Path) -> None:
    path = tmp_path / "wall_height.dds"
    Image.fromarray(np.arange(256, dtype=np.uint8).reshape(16, 16)).convert("RGBA").save(path)
    plain = path.read_bytes()
    first, texels = bw.HeightMap(path, channel="r").array, plain[128:]
    newer = plain[:80] + struct.pack("<I4s", 4, b"DX10") + plain[88:128]
    for head, count in (
        (plain[:112] + struct.pack("<I", 0xFE00) + plain[116:128], 6),
        (plain[:24] + struct.pack("<I", 3) + plain[28:112] + struct.pack("<I", 0x200000) + plain[116:128], 3),
        (newer + struct.pack("<5I", 28, 3, 0, 4, 0), 4),
        (newer + struct.pack("<5I", 28, 3, 4, 1, 0), 6),
    ):
        path.write_bytes(head + texels + bytes(len(texels)) * (count - 1))
        with pytest.warns(bw.BumpWarning, match=f"holds {count} pictures .*; the first is read"):
            found = bw.HeightMap(path, channel="r").array
        np.testing.assert_array_equal(found, first)
        assert "several-pictures" in codes(bw.lint(path)), count


def test_signed_blocks(tmp_path: Path) -> None:
    """BC5 of numbers with a sign, -127 to 127: a block of its larger end, one of its smaller one."""
    path = tmp_path / "wall_normal.dds"
    head = b"DDS " + struct.pack("<7I", 124, 0x1007, 4, 8, 0, 0, 0) + bytes(44)
    head += struct.pack("<2I4s5I", 32, 4, b"DX10", 0, 0, 0, 0, 0) + struct.pack("<5I", 0x1000, 0, 0, 0, 0)
    high, low = struct.pack("<2b", 90, -90) + bytes(6), struct.pack("<2b", -90, 90) + bytes(6)
    path.write_bytes(head + struct.pack("<5I", 84, 3, 0, 1, 0) + (high + low) + (low + high))
    for channel, (left, right) in (("r", (90, -90)), ("g", (-90, 90))):
        read = 2.0 * bw.HeightMap(path, channel=channel).array - 1.0
        np.testing.assert_allclose(read[:, :4], left / 127, atol=4e-5)
        np.testing.assert_allclose(read[:, 4:], right / 127, atol=4e-5)


def test_palettes_are_looked_up(tmp_path: Path) -> None:
    path = tmp_path / "wall_height.dds"
    Image.new("RGBA", (16, 16)).save(path)
    header = bytearray(path.read_bytes()[:128])
    # 8 bits a texel, indices into 256 colours.
    struct.pack_into("<2I4s5I", header, 76, 32, 0x20, bytes(4), 8, 0, 0, 0, 0)
    palette = b"".join(bytes([255 - index, 0, 0, 255]) for index in range(256))
    path.write_bytes(bytes(header) + palette + bytes(range(256)))
    heights = bw.HeightMap(path, channel="r").array
    np.testing.assert_allclose(heights.ravel(), np.arange(255, -1, -1) / 255, atol=1e-6)


def test_a_texture_of_a_terrain(assets: Path) -> None:
    path = assets / "ogre" / "Bricks076C_normheight.dds"
    if not path.exists():
        pytest.skip(f"no {path}")
    report = bw.lint(path)
    assert codes(report) == ["8-bit-heights", "lossy", "non-unit"], str(report)
    assert "wrong-green" in codes(bw.lint(path, convention="directx"))
    assert "inverted-heights" in codes(bw.lint(path, invert=True))
