"""A mesh scene to compare techniques on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ._checks import flag, whole
from .meshes import Mesh
from .scene import Camera, Light, Material

__all__ = ["Scene"]


@dataclass(frozen=True)
class Scene:
    """A mesh with its material, seen by a camera: what `compare` takes besides a height map.

    Attributes
    ----------
    mesh : Mesh
        The mesh.
    material : Material
        Its material, with a height map.
    camera : Camera or sequence of Camera
        Where it is seen from; several are a path, and all of their pixels count.
    lights : sequence of Light
        None at all is one directional light from the upper right.
    size : int or (int, int), default (512, 512)
        Pixels: the side of a square, or (width, height).
    shadows : bool, default True
        Whether the relief casts shadows on itself.
    """

    mesh: Mesh
    material: Material
    camera: Camera | Sequence[Camera]
    lights: Sequence[Light] = ()
    size: tuple[int, int] = (512, 512)
    shadows: bool = True

    def __post_init__(self) -> None:
        if not isinstance(self.mesh, Mesh):
            raise TypeError(f"mesh must be a Mesh, got {type(self.mesh).__name__}")
        if not isinstance(self.material, Material):
            raise TypeError(f"material must be a Material, got {type(self.material).__name__}")
        if self.material.height is None:
            raise ValueError("the material has no height map: there is nothing to compare")
        for camera in self.cameras:
            if not isinstance(camera, Camera):
                raise TypeError(f"camera must be a Camera or several, got {type(camera).__name__}")
        if not self.cameras:
            raise ValueError("the camera path is empty")
        lights = (self.lights,) if isinstance(self.lights, Light) else tuple(self.lights)
        for light in lights:
            if not isinstance(light, Light):
                raise TypeError(f"lights must be Light objects, got {type(light).__name__}")
        object.__setattr__(self, "lights", lights)
        object.__setattr__(self, "size", _size(self.size))
        flag("shadows", self.shadows)

    @property
    def cameras(self) -> tuple[Camera, ...]:
        """The camera path; one camera is a path of one."""
        return tuple(self.camera) if isinstance(self.camera, Sequence) else (self.camera,)


def _size(size: Any) -> tuple[int, int]:
    sides = tuple(size) if hasattr(size, "__len__") else (size, size)
    if len(sides) != 2:
        raise ValueError(f"size must be one number or (width, height), got {len(sides)} numbers")
    return whole("size[0]", sides[0], 1, 1 << 16), whole("size[1]", sides[1], 1, 1 << 16)
