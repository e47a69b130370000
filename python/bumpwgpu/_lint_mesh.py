"""What can be wrong with the UVs and tangents of a mesh."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .errors import BumpError, BumpWarning
from .meshes import Mesh

__all__ = ["inside_one_tile", "mesh_findings"]

Found = tuple[str, str, str, str]

#: Quotient of texel sizes of triangles that share an edge from which one sees it.
MOST_DENSITY_JUMP = 2.0
#: Share of edges with such a jump from which it counts as more than a detail.
MOST_JUMPS = 1e-3
#: Angle to MikkTSpace that stored tangents may have at their 99th percentile, degrees.
MOST_TANGENT_ANGLE = 5.0
#: Components of tangents that differ by less come from the same program.
_SAME = 1e-4


def mesh_findings(source: Mesh | Path) -> list[Found]:
    """Looks at a mesh."""
    try:
        mesh = _opened(source)
    except (BumpError, ValueError, TypeError, OSError) as error:
        text = str(error).splitlines()
        return [("unreadable", "error", text[0] if text else type(error).__name__, "Export the file again.")]
    faces = mesh.indices.reshape(-1, 3).astype(np.int64)
    positions, uvs = mesh.positions.astype(np.float64), mesh.uvs.astype(np.float64)
    if len(faces) == 0:
        return [("unreadable", "error", "there are no triangles", "Export the mesh again.")]
    if uvs.size == 0 or np.ptp(uvs, axis=0).max() == 0.0:
        return [("no-uvs", "error", "there are no texture coordinates", "Unwrap the mesh.")]
    bare = (uvs[faces] == 0.0).all(axis=(1, 2))
    found = []
    if bare.any():
        what = f"{int(bare.sum())} triangles have no texture coordinates, or all of them 0"
        found.append(
            ("no-uvs", "info", f"{what}; the first is {int(bare.argmax())}", "Unwrap what is textured.")
        )
    return [
        *found,
        *_degenerate(positions, uvs, faces, bare),
        *_density(positions, uvs, faces),
        *_tangents(mesh, uvs, faces),
    ]


def inside_one_tile(source: Mesh | Path) -> bool:
    """Whether all UVs of a mesh lie in 0..1, as those of charts in an atlas do."""
    try:
        uvs = _opened(source).uvs
    except (BumpError, ValueError, TypeError, OSError):
        return False
    return bool(uvs.size and uvs.min() >= -1e-3 and uvs.max() <= 1.001)


def _opened(source: Mesh | Path) -> Mesh:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", BumpWarning)
        return source if isinstance(source, Mesh) else Mesh.open(source)


def _areas(
    positions: NDArray[np.float64], uvs: NDArray[np.float64], faces: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Areas in space, and with their sign in UV."""
    a, b, c = (positions[faces[:, corner]] for corner in range(3))
    space = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    p, q, r = (uvs[faces[:, corner]] for corner in range(3))
    first, second = q - p, r - p
    return space, 0.5 * (first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])


def _degenerate(
    positions: NDArray[np.float64],
    uvs: NDArray[np.float64],
    faces: NDArray[np.int64],
    bare: NDArray[np.bool_],
) -> list[Found]:
    space, flat = _areas(positions, uvs, faces)
    solid = ~bare & (space > 1e-12 * max(float(space.max()), 1e-300))
    bad = solid & (np.abs(flat) <= 1e-12 * max(float(np.abs(flat).max()), 1e-300))
    if not bad.any():
        return []
    share = float(space[bad].sum() / space.sum())
    return [
        (
            "degenerate-uvs",
            "error" if share > 0.01 else "warning",
            f"{int(bad.sum())} triangles, {share:.2%} of the surface, have no area in UV; the first is "
            f"{int(bad.argmax())}",
            "Unwrap them.",
        )
    ]


def _density(
    positions: NDArray[np.float64], uvs: NDArray[np.float64], faces: NDArray[np.int64]
) -> list[Found]:
    """Jumps of texel size over edges that two triangles share in space."""
    space, flat = _areas(positions, uvs, faces)
    usable = (space > 1e-12 * space.max()) & (np.abs(flat) > 1e-12 * max(float(np.abs(flat).max()), 1e-300))
    with np.errstate(divide="ignore", invalid="ignore"):
        density = np.sqrt(np.abs(flat) / space)
    pairs = _neighbours(positions, faces)
    pairs = pairs[usable[pairs].all(axis=1)]
    if len(pairs) == 0:
        return []
    ratio = density[pairs].max(axis=1) / density[pairs].min(axis=1)
    jumps = ratio > MOST_DENSITY_JUMP
    if jumps.mean() <= MOST_JUMPS:
        return []
    at = int(ratio.argmax())
    return [
        (
            "uv-density-jump",
            "warning",
            f"texels change size by more than {MOST_DENSITY_JUMP:g} over {jumps.mean():.1%} of the edges, by "
            f"{ratio[at]:.1f} between triangles {pairs[at, 0]} and {pairs[at, 1]}",
            "Unwrap with an even texel density: heights and steps change with it.",
        )
    ]


def _neighbours(positions: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """Pairs of triangles that share an edge in space, whatever their vertices are numbered."""
    _, same = np.unique(np.round(positions, 9), axis=0, return_inverse=True)
    corners = same.reshape(-1)[faces]
    edges = np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]])
    edges.sort(axis=1)
    owner = np.tile(np.arange(len(faces)), 3)
    order = np.lexsort((edges[:, 1], edges[:, 0]))
    sorted_edges, sorted_owner = edges[order], owner[order]
    equal = (sorted_edges[1:] == sorted_edges[:-1]).all(axis=1)
    return np.stack([sorted_owner[:-1][equal], sorted_owner[1:][equal]], axis=1)


def _tangents(mesh: Mesh, uvs: NDArray[np.float64], faces: NDArray[np.int64]) -> list[Found]:
    _, flat = _areas(mesh.positions.astype(np.float64), uvs, faces)
    # With v down, charts that are not mirrored run clockwise.
    sides = np.zeros((len(uvs), 2), bool)
    for corner in range(3):
        sides[faces[flat < 0.0, corner], 0] = True
        sides[faces[flat > 0.0, corner], 1] = True
    shared = sides[:, 0] & sides[:, 1]
    found: list[Found] = []
    stored = mesh.vertex_tangents.astype(np.float64)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", BumpWarning)
        made = mesh.tangents()
    source = np.asarray(made.source)
    if stored.size == 0 or np.abs(made.tangents - stored[source]).max() < _SAME:
        # A mesh that comes without tangents is given MikkTSpace's, which are split at such seams.
        return []
    if shared.any():
        found.append(
            (
                "mirrored-seam-tangents",
                "error",
                f"{int(shared.sum())} vertices share a stored tangent across a mirrored seam; the first is "
                f"{int(shared.argmax())}",
                "Split them and find tangents again: mesh.tangents().",
            )
        )
    return [*found, *_stored(mesh, stored, made.tangents.astype(np.float64), source, sides, shared)]


def _stored(
    mesh: Mesh,
    stored: NDArray[np.float64],
    made: NDArray[np.float64],
    source: NDArray[np.integer[Any]],
    sides: NDArray[np.bool_],
    shared: NDArray[np.bool_],
) -> list[Found]:
    """Tangents that came with the mesh."""
    found: list[Found] = []
    used = sides[:, 0] | sides[:, 1]
    length = np.linalg.norm(stored[:, :3], axis=1)
    upright = np.abs((stored[:, :3] * mesh.normals).sum(axis=1))
    bad = used & (~np.isfinite(stored).all(axis=1) | (np.abs(length - 1.0) > 0.05) | (upright > 0.1))
    if bad.any():
        found.append(
            (
                "bad-tangents",
                "error",
                f"{int(bad.sum())} stored tangents are not of unit length, upright and finite; the first is "
                f"{int(bad.argmax())}",
                "Find them again: mesh.tangents().",
            )
        )
    # glTF: the bitangent w (N x T) points up the image, against v.
    expected = np.where(sides[:, 0], 1.0, -1.0)
    wrong = used & ~shared & (np.sign(stored[:, 3]) != expected)
    if wrong.sum() > 0.01 * used.sum():
        found.append(
            (
                "wrong-handedness",
                "error",
                f"{int(wrong.sum())} stored tangents have the wrong sign of w; the first is "
                f"{int(wrong.argmax())}",
                "Find them again: mesh.tangents().",
            )
        )
    cosine = (made[:, :3] * stored[source, :3]).sum(axis=1)
    angle = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))[used[source] & ~shared[source]]
    worst = float(np.quantile(angle, 0.99)) if angle.size else 0.0
    if worst > MOST_TANGENT_ANGLE:
        found.append(
            (
                "tangent-space",
                "warning",
                f"stored tangents are {worst:.1f} degrees from MikkTSpace at the 99th percentile",
                "Normals baked for MikkTSpace will not fit; find tangents again: mesh.tangents().",
            )
        )
    return found
