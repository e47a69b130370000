"""Baking maps from meshes: normals, heights and occlusion of a detailed mesh on the UVs of a plain one."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import _bumpwgpu
from ._checks import choice, flag, number, strings, whole, width_and_height
from ._map_info import ALL_MAPS
from .errors import BumpWarning
from .heightmap import HeightMap
from .maps import BakedMap, Maps
from .meshes import Mesh

__all__ = ["MESH_MAPS", "MeshMaps", "MeshReport"]

#: Maps that can be baked from a mesh: the last one from the mesh alone.
MESH_MAPS: tuple[str, ...] = ("normal", "height", "ao", "tangents")
#: Names of meshes' files.
SUFFIXES = (".obj", ".gltf", ".glb")

_OPTIONS = {
    "size": 1024,
    "padding": 16,
    "detail": None,
    "cage": None,
    "front": None,
    "rear": None,
    "samples": 1,
    "space": "tangent",
    "convention": "opengl",
    "back_faces": False,
    "rays": 64,
    "distance": None,
    "seed": 0,
}
#: Options that count for some maps only.
_FOR = {
    "space": ("normal",),
    "convention": ("normal",),
    "rays": ("ao",),
    "distance": ("ao",),
    "seed": ("ao",),
}


class MeshReport(NamedTuple):
    """How a bake from a detailed mesh went.

    Attributes
    ----------
    front, rear : float
        What height 1 and height 0 stand for: mesh units above and below the plain mesh.
    met : (float, float) or None
        Lowest and highest point of the detailed mesh that was met, mesh units above the plain one.
    texels : int
        Texels that a chart covers or touches.
    rays : int
        Rays sent from the plain mesh.
    missed : int
        Rays that met nothing.
    averted : int
        Those among them that would have met a triangle seen from behind.
    empty : int
        Texels all of whose rays met nothing; they show the plain surface.
    overlapping : int
        Samples that more than one chart claims; the first triangle has them.
    warnings : tuple of str
        What was warned about.
    """

    front: float
    rear: float
    met: tuple[float, float] | None
    texels: int
    rays: int
    missed: int
    averted: int
    empty: int
    overlapping: int
    warnings: tuple[str, ...]


class MeshMaps(Maps):
    """Maps baked from a mesh, by name.

    ``maps["normal"]`` (H, W, 3): unit normals in the tangent frame of the plain mesh, or in its own
    space. ``maps["height"]`` (H, W): 0 where rays end, `report.rear` below the plain mesh, to 1 where
    they start, `report.front` above it. ``maps["ao"]`` (H, W): 0 enclosed to 1 open.
    ``maps["tangents"]`` (H, W, 4): the unit tangent in the space of the mesh and w, +1 or -1, as in
    glTF; 0 where there is no chart.

    Attributes
    ----------
    report : MeshReport or None
        How the bake went; None without a detailed mesh.
    """

    __slots__ = ("report",)
    report: MeshReport | None

    def __init__(
        self,
        layers: dict[str, NDArray[np.float32]],
        report: MeshReport | None,
        options: Mapping[str, Any],
    ) -> None:
        settings = {name: value for name, value in options.items() if name not in ("detail", "cage", "size")}
        extent = {}
        if report is not None:
            # What puts the heights back on the plain mesh.
            span = report.front + report.rear
            extent = {"scale": span, "base": report.rear / span if span > 0.0 else 0.0, "wrap": "clamp"}
        made = {}
        for name, layer in layers.items():
            ranges = tuple(channel.range or (0.0, 1.0) for channel in ALL_MAPS[name].channels)
            source = {"size": [layer.shape[1], layer.shape[0]], **extent}
            made[name] = BakedMap((layer,), ranges, settings, source)
        super().__init__(made)
        self.report = report

    def height_map(self) -> HeightMap:
        """The heights with the scale and base that put the relief back on the plain mesh.

        Returns
        -------
        HeightMap
            `scale` is front + rear, `base` the height of the plain mesh.

        Raises
        ------
        ValueError
            "height" was not baked.

        Examples
        --------
        >>> import bumpwgpu as bw
        >>> maps = bw.bake(bw.Mesh.quad(), "height", detail=bw.Mesh.quad(), size=8, front=0.3, rear=0.1)
        >>> relief = maps.height_map()
        >>> round(relief.scale, 3), round(relief.base, 3)
        (0.4, 0.25)
        """
        if "height" not in self or self.report is None:
            raise ValueError('no heights: bake with maps=("height",)')
        span = self.report.front + self.report.rear
        return HeightMap(self["height"], scale=span, base=self.report.rear / span, wrap="clamp")


def bake_mesh(
    mesh: Mesh, maps: Any, progress: Callable[[int, int], object] | None, given: Mapping[str, Any]
) -> MeshMaps:
    """The part of :func:`bumpwgpu.bake` for meshes."""
    names = strings("maps", maps, MESH_MAPS)
    if not names:
        raise ValueError(f"maps is empty; ask for at least one of {', '.join(MESH_MAPS)}")
    unknown = [name for name in given if name not in _OPTIONS]
    if unknown:
        raise TypeError(f"unexpected options {', '.join(unknown)}; meshes take {', '.join(_OPTIONS)}")
    options = {**_OPTIONS, **given}
    traced = [name for name in names if name != "tangents"]
    size = _size(options["size"])
    padding = whole("padding", options["padding"], 0, _bumpwgpu.MAX_MAP_SIDE)
    wanted = _wanted(options, traced, size, padding)
    detail = _mesh("detail", options["detail"])
    cage = _mesh("cage", options["cage"])
    if traced and detail is None:
        raise ValueError(f"{', '.join(traced)} of a mesh needs detail=, the mesh to bake from")
    _say_unused(given, names, traced, cage)
    layers: dict[str, NDArray[np.float32]] = {}
    report = None
    if traced and detail is not None:
        made, found = _bumpwgpu.bake_detail(
            mesh._core, detail._core, None if cage is None else cage._core, wanted, progress
        )
        layers.update(made)
        report = MeshReport(**{**found, "warnings": tuple(found["warnings"])})
        for text in report.warnings:
            warnings.warn(text, BumpWarning, stacklevel=3)
    if "tangents" in names:
        layers["tangents"] = _bumpwgpu.bake_tangents(mesh._core, size, padding, progress)
    return MeshMaps({name: layers[name] for name in names}, report, options)


def opened(source: Any) -> Any:
    """A path to a mesh file as the mesh, anything else as it is."""
    if isinstance(source, str | os.PathLike) and Path(source).suffix.lower() in SUFFIXES:
        return Mesh.open(source)
    return source


def _mesh(name: str, source: Any) -> Mesh | None:
    mesh = opened(source)
    if mesh is None or isinstance(mesh, Mesh):
        return mesh
    raise TypeError(f"{name} must be a Mesh or a path to one, got {type(source).__name__}")


def _size(size: Any) -> tuple[int, int]:
    width, height = width_and_height(size)
    limit = _bumpwgpu.MAX_MAP_SIDE
    if not (1 <= width <= limit and 1 <= height <= limit):
        raise ValueError(f"size is {width} x {height}; each side must be 1 to {limit}")
    return width, height


def _optional(name: str, value: Any) -> float | None:
    return None if value is None else number(name, value, 0.0)


def _wanted(
    options: Mapping[str, Any], traced: list[str], size: tuple[int, int], padding: int
) -> dict[str, Any]:
    distance = _optional("distance", options["distance"])
    if distance == 0.0:
        raise ValueError("distance must be more than 0")
    return {
        "normal": "normal" in traced,
        "height": "height" in traced,
        "ao": "ao" in traced,
        "size": size,
        "padding": padding,
        "front": _optional("front", options["front"]),
        "rear": _optional("rear", options["rear"]),
        "samples": whole("samples", options["samples"], 1, 8),
        "object_space": choice("space", options["space"], ("tangent", "object")) == "object",
        "green_down": choice("convention", options["convention"], ("opengl", "directx")) == "directx",
        "back_faces": flag("back_faces", options["back_faces"]),
        "rays": whole("rays", options["rays"], 1, 65536),
        "distance": distance,
        "seed": whole("seed", options["seed"], 0, 2**64 - 1),
    }


def _say_unused(given: Mapping[str, Any], names: list[str], traced: list[str], cage: Mesh | None) -> None:
    for name in given:
        if name in ("size", "padding"):
            continue
        if not traced:
            reason = f"{', '.join(names)} needs no rays"
        elif not set(_FOR.get(name, names)) & set(names):
            reason = f"only {', '.join(_FOR[name])} takes it"
        elif name == "front" and cage is not None and given[name] is not None:
            reason = "rays start at the cage"
        elif name == "convention" and given.get("space") == "object":
            reason = "normals are in object space"
        else:
            continue
        warnings.warn(f"{name} has no effect: {reason}", BumpWarning, stacklevel=4)
