"""A mesh scene to compare techniques on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ._checks import flag, whole
from .heightmap import HeightMap
from .instances import Instance, instances_of
from .meshes import Mesh
from .scene import Camera, Light, Material

__all__ = ["Scene"]


@dataclass(frozen=True)
class Scene:
    """Meshes with their material, seen by a camera: what `compare` takes besides a height map.

    Attributes
    ----------
    mesh : Mesh, or Instance or sequence of Instance
        The mesh, or meshes where they stand. Instances may differ in all but the height map, in whose
        texels errors are counted.
    material : Material or None
        The mesh's material, with a height map; None for instances, which have their own.
    camera : Camera or sequence of Camera
        Where it is seen from; several are a path, and all of their pixels count.
    lights : sequence of Light
        None at all is one directional light from the upper right.
    size : int or (int, int), default (512, 512)
        Pixels: the side of a square, or (width, height).
    shadows : bool, default True
        Whether the relief casts shadows on itself.
    """

    mesh: Mesh | Instance | Sequence[Instance]
    material: Material | None
    camera: Camera | Sequence[Camera]
    lights: Sequence[Light] = ()
    size: tuple[int, int] = (512, 512)
    shadows: bool = True

    def __post_init__(self) -> None:
        if isinstance(self.mesh, Mesh) and not isinstance(self.material, Material):
            raise TypeError(f"material must be a Material, got {type(self.material).__name__}")
        if not isinstance(self.mesh, Mesh | Instance):
            object.__setattr__(self, "mesh", tuple(instances_of(self.mesh, self.material)))
        heights = {id(height): height for height in self._heights()}
        if None in heights.values():
            raise ValueError("a material has no height map: there is nothing to compare")
        if len(heights) != 1:
            raise ValueError(f"{len(heights)} height maps: errors are counted in texels of one")
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

    def _heights(self) -> list[HeightMap | None]:
        """The height maps of all that is drawn."""
        placed = instances_of(self.mesh, self.material)
        return [material.height for instance in placed for *_, material in instance._draws]

    @property
    def height(self) -> HeightMap:
        """The height map."""
        height = self._heights()[0]
        assert height is not None
        return height

    @property
    def cameras(self) -> tuple[Camera, ...]:
        """The camera path; one camera is a path of one."""
        return tuple(self.camera) if isinstance(self.camera, Sequence) else (self.camera,)


def _size(size: Any) -> tuple[int, int]:
    sides = tuple(size) if hasattr(size, "__len__") else (size, size)
    if len(sides) != 2:
        raise ValueError(f"size must be one number or (width, height), got {len(sides)} numbers")
    return whole("size[0]", sides[0], 1, 1 << 16), whole("size[1]", sides[1], 1, 1 << 16)
