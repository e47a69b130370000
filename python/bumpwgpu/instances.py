"""Meshes with their materials, where they stand in the scene."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .meshes import Mesh
from .scene import Camera, Material

__all__ = ["Instance"]

#: Not a number of draws that anyone means.
MAX_INSTANCES = 1 << 20


class Instance:
    """A mesh with its materials at a place in the scene.

    A scene is a list of them. Instances of one mesh share it: it is prepared and uploaded once.

    The relief is part of the object. A transform stretches it along with the mesh, in height as well, into
    what the displaced mesh would become; normals follow by the inverse transpose, and mirroring transforms
    turn the mesh's winding around. Places are computed in 64 bits relative to the camera: a scene a million
    units away, its camera and lights with it, looks as it does at the origin.

    Parameters
    ----------
    mesh : Mesh
        What stands there.
    material : Material, sequence of Material or None
        One for the whole mesh, or one for each of ``mesh.materials``, or None for the mesh file's own.
    world_from_object : array_like of float, (4, 4), or None
        Where: takes columns ``(x, y, z, 1)`` of the mesh to the scene, translation in the last column, last
        row ``0, 0, 0, 1``. Any affine map with an inverse: rotation, non-uniform and negative scale, shear.
        None leaves the mesh where it is.

    Raises
    ------
    ValueError, TypeError
        A matrix of another shape, not finite, not affine or without an inverse; something else than a mesh
        or a material.

    Examples
    --------
    >>> import bumpwgpu as bw
    >>> import numpy as np
    >>> place = np.diag([2.0, 2.0, 2.0, 1.0])
    >>> place[:3, 3] = 1e6, 0.0, -3.0
    >>> wall = bw.Instance(bw.Mesh.quad(), bw.Material(bw.HeightMap.procedural("bricks", 64)), place)
    >>> wall.world_from_object[0].tolist()
    [2.0, 0.0, 0.0, 1000000.0]
    """

    __slots__ = ("_draws", "_material", "_mesh", "_world_from_object")

    def __init__(
        self,
        mesh: Mesh,
        material: Material | Sequence[Material] | None = None,
        world_from_object: ArrayLike | None = None,
    ) -> None:
        if not isinstance(mesh, Mesh):
            raise TypeError(f"mesh must be a Mesh, got {type(mesh).__name__}")
        self._mesh = mesh
        self._draws = _draws(mesh, material)
        self._material = tuple(material) if isinstance(material, Sequence) else material
        self._world_from_object = _affine(world_from_object)

    @property
    def mesh(self) -> Mesh:
        """What stands there."""
        return self._mesh

    @property
    def material(self) -> Material | tuple[Material, ...] | None:
        """How it looks, as given."""
        return self._material

    @property
    def world_from_object(self) -> NDArray[np.float64]:
        """Where it stands, float64 (4, 4), read-only."""
        return self._world_from_object

    def __repr__(self) -> str:
        x, y, z = self._world_from_object[:3, 3]
        return f"<Instance of {self._mesh!r} at ({x:g}, {y:g}, {z:g})>"


def _affine(matrix: Any) -> NDArray[np.float64]:
    """A read-only copy of a matrix that is fit to place a mesh."""
    if matrix is None:
        made = np.eye(4)
    else:
        try:
            made = np.array(matrix, np.float64)
        except (TypeError, ValueError) as error:
            raise TypeError(f"world_from_object must be numbers, (4, 4): {error}") from None
    if made.shape != (4, 4):
        raise ValueError(f"world_from_object must have shape (4, 4), got {made.shape}")
    if not np.isfinite(made).all():
        raise ValueError("world_from_object has NaN or infinite values")
    if made[3].tolist() != [0.0, 0.0, 0.0, 1.0]:
        raise ValueError(f"the last row of world_from_object must be 0, 0, 0, 1, got {made[3].tolist()}")
    # By its own size, so that small objects are not taken for flat ones.
    turn = made[:3, :3]
    size = float(np.abs(turn).max())
    if size == 0.0 or np.linalg.cond(turn / size) > 1e12:
        raise ValueError("world_from_object has no inverse: it makes everything flat")
    made.flags.writeable = False
    return made


def instances_of(what: Any, material: Any) -> list[Instance]:
    """The instances of a mesh with a material, of an instance, or of a sequence of instances."""
    if isinstance(what, Mesh):
        return [Instance(what, material)]
    if isinstance(what, Instance):
        listed = [what]
    elif isinstance(what, str | bytes | dict):
        raise TypeError(f"mesh must be a Mesh, an Instance or a sequence of them, got {type(what).__name__}")
    else:
        try:
            parts = list(what)
        except TypeError:
            raise TypeError(
                f"mesh must be a Mesh, an Instance or a sequence of them, got {type(what).__name__}"
            ) from None
        listed = [part if isinstance(part, Instance) else _alone(part, at) for at, part in enumerate(parts)]
    if material is not None:
        raise ValueError("material must be None where instances are given: each has its own")
    if not listed:
        raise ValueError("mesh is an empty sequence: nothing to draw")
    if len(listed) > MAX_INSTANCES:
        raise ValueError(f"{len(listed)} instances; at most {MAX_INSTANCES} are drawn")
    return listed


def _alone(part: Any, at: int) -> Instance:
    if not isinstance(part, Mesh):
        raise TypeError(f"mesh[{at}] must be a Mesh or an Instance, got {type(part).__name__}")
    return Instance(part)


def _draws(mesh: Mesh, material: Any) -> list[tuple[int, int, Material]]:
    """Runs of triangles with their material."""
    triangles = len(mesh.indices)
    if isinstance(material, Material):
        return [(0, triangles, material)]
    if material is None:
        loaded = mesh.load_materials()
    elif isinstance(material, Sequence) and all(isinstance(part, Material) for part in material):
        loaded = list(material)
        if len(loaded) != len(mesh.materials):
            raise ValueError(f"{len(loaded)} materials given, but the mesh has {len(mesh.materials)}")
    else:
        raise TypeError(
            f"material must be a Material, a sequence of them or None, got {type(material).__name__}"
        )
    return [
        (
            part.triangles.start,
            part.triangles.stop,
            loaded[part.material] if part.material is not None else _plain(),
        )
        for part in mesh.parts
    ]


@cache
def _plain() -> Material:
    """For parts of a mesh file that have no material."""
    return Material()


def framing(instances: list[Instance], aspect: float) -> Camera:
    """A camera that sees everything from the front, a little from above."""
    known: dict[int, tuple[NDArray[np.float64], float]] = {}
    middles, radii = [], []
    for instance in instances:
        mesh = instance.mesh
        if id(mesh) not in known:
            middle = np.mean(np.array(mesh.bounds, np.float64), axis=0)
            known[id(mesh)] = middle, float(np.linalg.norm(mesh.positions - middle, axis=1).max())
        middle, radius = known[id(mesh)]
        turn, shift = instance.world_from_object[:3, :3], instance.world_from_object[:3, 3]
        middles.append(turn @ middle + shift)
        radii.append(radius * float(np.linalg.norm(turn, 2)))
    balls, reach = np.array(middles), np.array(radii)
    low, high = (balls - reach[:, None]).min(axis=0), (balls + reach[:, None]).max(axis=0)
    centre = balls[0] if len(balls) == 1 else 0.5 * (low + high)
    radius = max(float((np.linalg.norm(balls - centre, axis=1) + reach).max()), 1e-6)
    fov_y = 40.0
    half = np.radians(fov_y / 2.0)
    narrow = min(half, np.arctan(np.tan(half) * aspect))
    way = np.array([0.35, 0.45, 1.0])
    eye = centre + way / np.linalg.norm(way) * (radius / np.sin(narrow) * 1.02)
    return Camera.look_at(eye, centre, fov_y=fov_y)
