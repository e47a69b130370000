"""Mesh: generated shapes against their closed forms, files, tangents, and what is refused."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

import bumpwgpu as bw

TRIANGLE: dict[str, Any] = {
    "positions": [[0, 0, 0], [2, 0, 0], [0, 2, 0]],
    "indices": [[0, 1, 2]],
    "uvs": [[0, 1], [1, 1], [0, 0]],
}
SHAPES: dict[str, Callable[[], bw.Mesh]] = {
    "quad": lambda: bw.Mesh.quad((2.0, 1.0)),
    "cube": lambda: bw.Mesh.cube(2.0),
    "sphere": lambda: bw.Mesh.sphere(2.0, 24),
    "torus": lambda: bw.Mesh.torus(2.0, 0.5, 24, 12),
}


@pytest.mark.parametrize("name", SHAPES)
def test_generated_shapes_are_whole(name: str) -> None:
    mesh = SHAPES[name]()
    count = len(mesh.positions)
    for array, width in (
        (mesh.positions, 3),
        (mesh.normals, 3),
        (mesh.uvs, 2),
        (mesh.dpdu, 3),
        (mesh.dpdv, 3),
        (mesh.vertex_tangents, 4),
    ):
        assert array.shape == (count, width)
        assert array.dtype == np.float32
        assert np.isfinite(array).all()
    assert mesh.indices.dtype == np.uint32
    assert mesh.indices.max() < count
    assert mesh.warnings == ()
    assert mesh.parts[0].name == name
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1, atol=1e-6)
    # Counter-clockwise triangles face the way of their normals.
    a, b, c = (mesh.positions[mesh.indices[:, at]] for at in range(3))
    faces = np.cross(b - a, c - a)
    assert (np.einsum("ij,ij->i", faces, mesh.normals[mesh.indices].mean(axis=1)) > 0).all()
    # w (N x T) points up the image: against dP/dv.
    tangent, w = mesh.vertex_tangents[:, :3], mesh.vertex_tangents[:, 3:]
    up = w * np.cross(mesh.normals, tangent)
    flat = np.linalg.norm(mesh.dpdv, axis=1) > 1e-6
    assert (np.einsum("ij,ij->i", up, mesh.dpdv)[flat] < 0).all()


def sphere_point(radius: float, uv: NDArray[np.float64]) -> NDArray[np.float64]:
    """Longitude from -Z eastwards, colatitude from +Y."""
    longitude, colatitude = 2 * np.pi * (uv[:, 0] - 0.5), np.pi * uv[:, 1]
    return radius * np.column_stack(
        (np.sin(colatitude) * np.sin(longitude), np.cos(colatitude), np.sin(colatitude) * np.cos(longitude))
    )


def test_sphere_in_closed_form() -> None:
    mesh = bw.Mesh.sphere(2.0, 32)
    uv = mesh.uvs.astype(np.float64)
    np.testing.assert_allclose(mesh.positions, sphere_point(2.0, uv), atol=1e-5)
    np.testing.assert_allclose(mesh.normals, sphere_point(1.0, uv), atol=1e-6)
    step = 1e-5
    # dP/du vanishes at the poles; there the mesh has that of its triangle, as the map is drawn.
    inside = (uv[:, 1] > 0) & (uv[:, 1] < 1)
    for at, derivative, where in ((0, mesh.dpdu, inside), (1, mesh.dpdv, inside | True)):
        shift = np.eye(2)[at] * step
        expected = (sphere_point(2.0, uv + shift) - sphere_point(2.0, uv - shift)) / (2 * step)
        np.testing.assert_allclose(derivative[where], expected[where], atol=1e-4)
    ring = np.linalg.norm(mesh.dpdu[uv[:, 1] == uv[inside, 1].min()], axis=1)
    np.testing.assert_allclose(np.linalg.norm(mesh.dpdu[~inside], axis=1), ring[0], rtol=2e-3)


def test_quad_in_closed_form() -> None:
    mesh = bw.Mesh.quad((3.0, 2.0))
    np.testing.assert_allclose(mesh.dpdu, np.tile([3, 0, 0], (4, 1)))
    np.testing.assert_allclose(mesh.dpdv, np.tile([0, -2, 0], (4, 1)))
    corner = mesh.positions[(mesh.uvs == [0, 0]).all(axis=1)][0]
    assert corner.tolist() == [-1.5, 1.0, 0.0]
    assert mesh.bounds == ((-1.5, -1.0, 0.0), (1.5, 1.0, 0.0))


def test_arrays() -> None:
    mesh = bw.Mesh(**TRIANGLE)
    np.testing.assert_array_equal(mesh.normals, [[0, 0, 1]] * 3)
    np.testing.assert_allclose(mesh.dpdu, [[2, 0, 0]] * 3, atol=1e-6)
    np.testing.assert_allclose(mesh.dpdv, [[0, -2, 0]] * 3, atol=1e-6)
    np.testing.assert_allclose(mesh.vertex_tangents, [[1, 0, 0, 1]] * 3, atol=1e-6)
    given = bw.Mesh(**TRIANGLE, normals=[[0, 0, 5]] * 3, tangents=[[0, 1, 0, -1]] * 3)
    np.testing.assert_allclose(given.vertex_tangents, [[0, 1, 0, -1]] * 3)
    given.positions[:] = 9
    assert given.positions.max() == 2


def test_mirrored_charts_split_their_seam() -> None:
    """Two triangles share an edge; u grows away from it on both sides."""
    mesh = bw.Mesh(
        [[0, 0, 0], [0, 1, 0], [1, 0, 0], [-1, 0, 0]],
        [[0, 2, 1], [0, 1, 3]],
        [[0, 1], [0, 0], [1, 1], [1, 1]],
    )
    tangents, indices, source = mesh.tangents("mikktspace")
    assert len(tangents) == len(source) == 6
    right, left = tangents[indices[0]], tangents[indices[1]]
    np.testing.assert_allclose(right, [[1, 0, 0, 1]] * 3, atol=1e-6)
    np.testing.assert_allclose(left, [[-1, 0, 0, -1]] * 3, atol=1e-6)


@pytest.mark.parametrize("method", ["mikktspace", "dietrich"])
def test_tangents_follow_the_texture(method: str) -> None:
    mesh = bw.Mesh.torus(2.0, 0.7, 64, 48)
    tangents, indices, source = mesh.tangents(method)
    assert indices.shape == mesh.indices.shape
    along = mesh.dpdu[source] / np.linalg.norm(mesh.dpdu[source], axis=1, keepdims=True)
    cosine = np.einsum("ij,ij->i", tangents[:, :3], along)
    # Finite triangles: within a few degrees of the true direction.
    assert np.degrees(np.arccos(np.clip(cosine, -1, 1))).max() < 6


def write_obj(folder: Path) -> Path:
    Image.fromarray(np.full((4, 4, 3), (200, 50, 50), np.uint8)).save(folder / "red.png")
    ramp = (np.arange(64, dtype=np.uint8) * 4).reshape(8, 8)
    Image.fromarray(ramp).save(folder / "my bump.png")
    (folder / "wall.mtl").write_text(
        "newmtl brick\nKd 0.5 0.5 0.5\nKs 0.25 0.25 0.25\nNs 40\nmap_Kd red.png\nmap_Bump -bm 2 my bump.png\n"
    )
    path = folder / "wall.obj"
    path.write_text(
        "mtllib wall.mtl\nv 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
        "usemtl brick\nf 1/1 2/2 3/3 4/4\n"
    )
    return path


def test_obj_with_materials(tmp_path: Path) -> None:
    mesh = bw.Mesh.open(write_obj(tmp_path))
    assert mesh.indices.shape == (2, 3)
    # v runs down: the corner at the origin is the bottom left of the image.
    corner = (mesh.positions == 0).all(axis=1)
    assert mesh.uvs[corner][0].tolist() == [0, 1]
    np.testing.assert_allclose(mesh.dpdv[0], [0, -4, 0], atol=1e-6)
    (described,) = mesh.materials
    assert described.name == "brick"
    assert isinstance(described.bump, Path)
    assert described.bump.name == "my bump.png"
    assert described.bump_scale == 2
    (material,) = mesh.load_materials()
    assert material.height is not None
    # 5 % of the tile's 4 units, times -bm.
    assert material.height.scale == pytest.approx(0.4)
    assert material.albedo is not None
    assert material.albedo[0, 0].tolist() == [200, 50, 50, 255]
    assert material.albedo_factor[0] == pytest.approx(0.5)
    assert (material.specular, material.shininess) == (pytest.approx(0.25), 40)
    scaled = mesh.load_materials(scale=0.1)[0].height
    assert scaled is not None
    assert scaled.scale == pytest.approx(0.1)


def test_missing_texture_warns(tmp_path: Path) -> None:
    path = write_obj(tmp_path)
    (tmp_path / "red.png").unlink()
    with pytest.warns(bw.BumpWarning, match=r"red\.png"):
        mesh = bw.Mesh.open(path)
    assert mesh.materials[0].albedo is None
    assert any("red.png" in text for text in mesh.warnings)


def test_broken_texture_is_an_error(tmp_path: Path) -> None:
    path = write_obj(tmp_path)
    (tmp_path / "red.png").write_bytes(b"no image")
    mesh = bw.Mesh.open(path)
    with pytest.raises(bw.BakeError, match=r"red\.png"):
        mesh.load_materials()


def bad(**changes: Any) -> Callable[[], bw.Mesh]:
    return lambda: bw.Mesh(**{**TRIANGLE, **changes})


REFUSED: dict[str, tuple[Callable[[], Any], type[Exception], str]] = {
    "index": (bad(indices=[[0, 1, 3]]), ValueError, "triangle 0 uses vertex 3"),
    "negative": (bad(indices=[[0, 1, -1]]), ValueError, "triangle 0"),
    "vast index": (bad(indices=np.array([[0, 1, 2**40]])), ValueError, "triangle 0"),
    "float index": (bad(indices=[[0.0, 1.0, 2.0]]), TypeError, "whole"),
    "quads": (bad(indices=[[0, 1, 2, 0]]), ValueError, r"\(N, 3\)"),
    "no triangle": (bad(indices=np.empty((0, 3), int)), ValueError, "at least"),
    "no vertex": (bad(positions=np.empty((0, 3))), ValueError, "0 vertices"),
    "uv count": (bad(uvs=[[0, 0]]), ValueError, "1 uvs for 3 positions"),
    "uv shape": (bad(uvs=[[0, 0, 0]] * 3), ValueError, r"\(N, 2\)"),
    "NaN": (bad(positions=[[0, 0, np.nan], [1, 0, 0], [0, 1, 0]]), ValueError, "vertex 0"),
    "overflow": (bad(positions=[[0, 0, 1e300], [1, 0, 0], [0, 1, 0]]), ValueError, "vertex 0"),
    "infinite uv": (bad(uvs=[[0, 0], [np.inf, 0], [0, 1]]), ValueError, "uv of vertex 1"),
    "text": (bad(positions=[["a", "b", "c"]] * 3), TypeError, "numbers"),
    "ragged": (bad(positions=[[0, 0], [1, 2, 3]]), ValueError, "not an array"),
    "quad 0": (lambda: bw.Mesh.quad(0), ValueError, "width"),
    "quad -1": (lambda: bw.Mesh.quad((1, -1)), ValueError, "height"),
    "quad 3": (lambda: bw.Mesh.quad((1, 1, 1)), ValueError, "size"),
    "cube NaN": (lambda: bw.Mesh.cube(float("nan")), ValueError, "size"),
    "sphere": (lambda: bw.Mesh.sphere(segments=2), ValueError, "segments"),
    "sphere vast": (lambda: bw.Mesh.sphere(segments=10**9), ValueError, "segments"),
    "sphere half": (lambda: bw.Mesh.sphere(segments=8.5), TypeError, "segments"),
    "torus": (lambda: bw.Mesh.torus(1, 2), ValueError, "minor|ring|tube"),
    "method": (lambda: bw.Mesh.quad().tangents("nope"), ValueError, "mikktspace"),
    "missing": (lambda: bw.Mesh.open("nowhere.obj"), FileNotFoundError, "nowhere.obj"),
    "suffix": (lambda: bw.Mesh.open(__file__), bw.MeshError, "obj"),
    "path": (lambda: bw.Mesh.open(3), TypeError, "path"),
    "null": (lambda: bw.Mesh.open("a\0.obj"), ValueError, "null"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_refused(name: str) -> None:
    call, kind, message = REFUSED[name]
    with pytest.raises(kind, match=message):
        call()


def test_degenerate_uvs_warn_and_work() -> None:
    with pytest.warns(bw.BumpWarning, match="degenerate"):
        mesh = bw.Mesh(TRIANGLE["positions"], TRIANGLE["indices"], [[0, 0]] * 3)
    assert np.isfinite(mesh.vertex_tangents).all()
    assert np.isfinite(mesh.dpdu).all()


def test_real_meshes(assets: Path) -> None:
    helmet = bw.Mesh.open(next(assets.rglob("NormalTangentTest.glb")))
    assert len(helmet.indices) == 7774
    assert helmet.load_materials()[0].normal is not None
