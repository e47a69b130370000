"""Surface detail from height maps: bake, march, render, compare.

>>> import bumpwgpu as bw
>>> bricks = bw.HeightMap.procedural("bricks", size=64)
>>> bw.bake(bricks)["normal"].shape
(64, 64, 3)
"""

from __future__ import annotations

import os as _os
from typing import TYPE_CHECKING as _TYPE_CHECKING

from ._bumpwgpu import VERSION as __version__

if _TYPE_CHECKING:
    from . import engines, surfaces, techniques
    from .baking import bake, bake_file
    from .compare_result import CompareResult
    from .compare_scene import Scene
    from .comparing import compare
    from .engines import EngineSettings
    from .errors import BakeError, BumpError, BumpWarning, CompareError, MeshError, RenderError
    from .frames import Tangents, tangents
    from .heightmap import HeightMap
    from .instances import Instance
    from .linting import Finding, LintReport, lint
    from .maps import Maps
    from .marching import Hits, march
    from .mesh_maps import MeshMaps, MeshReport
    from .meshes import Mesh, MeshMaterial, Part
    from .recommending import MipAdvice, Recommendation
    from .renderer import Renderer
    from .rendering import Frame, HorizonShadows, render
    from .repair import (
        CurlEvidence,
        HeightEvidence,
        IntegratedHeights,
        NormalReport,
        Seam,
        TileReport,
        check_normals,
        dequantise,
        heights_from_normals,
        tile_report,
    )
    from .scene import Camera, Light, Material
    from .streaming import march_stream
    from .stressing import StressResult, stress
    from .system import info

if "XDG_RUNTIME_DIR" not in _os.environ:
    # Without a desktop there is none to ask which device it uses; Mesa's layer would complain on stderr.
    _os.environ.setdefault("NODEVICE_SELECT", "1")

#: Public names by the module that has them, loaded when first asked for (PEP 562): importing the package
#: takes a few milliseconds. No module may have the name of what it is loaded for, which would hide it.
_HOMES = {
    "baking": ("bake", "bake_file"),
    "compare_result": ("CompareResult",),
    "compare_scene": ("Scene",),
    "comparing": ("compare",),
    "engines": ("EngineSettings",),
    "errors": ("BakeError", "BumpError", "BumpWarning", "CompareError", "MeshError", "RenderError"),
    "frames": ("Tangents", "tangents"),
    "heightmap": ("HeightMap",),
    "instances": ("Instance",),
    "linting": ("Finding", "LintReport", "lint"),
    "maps": ("Maps",),
    "marching": ("Hits", "march"),
    "mesh_maps": ("MeshMaps", "MeshReport"),
    "meshes": ("Mesh", "MeshMaterial", "Part"),
    "recommending": ("MipAdvice", "Recommendation"),
    "renderer": ("Renderer",),
    "rendering": ("Frame", "HorizonShadows", "render"),
    "repair": (
        "CurlEvidence",
        "HeightEvidence",
        "IntegratedHeights",
        "NormalReport",
        "Seam",
        "TileReport",
        "check_normals",
        "dequantise",
        "heights_from_normals",
        "tile_report",
    ),
    "scene": ("Camera", "Light", "Material"),
    "streaming": ("march_stream",),
    "stressing": ("StressResult", "stress"),
    "system": ("info",),
}
_MODULES = ("engines", "surfaces", "techniques")
_HOME = {name: home for home, names in _HOMES.items() for name in names}

__all__ = [
    "BakeError",
    "BumpError",
    "BumpWarning",
    "Camera",
    "CompareError",
    "CompareResult",
    "CurlEvidence",
    "EngineSettings",
    "Finding",
    "Frame",
    "HeightEvidence",
    "HeightMap",
    "Hits",
    "HorizonShadows",
    "Instance",
    "IntegratedHeights",
    "Light",
    "LintReport",
    "Maps",
    "Material",
    "Mesh",
    "MeshError",
    "MeshMaps",
    "MeshMaterial",
    "MeshReport",
    "MipAdvice",
    "NormalReport",
    "Part",
    "Recommendation",
    "RenderError",
    "Renderer",
    "Scene",
    "Seam",
    "StressResult",
    "Tangents",
    "TileReport",
    "__version__",
    "bake",
    "bake_file",
    "check_normals",
    "compare",
    "dequantise",
    "engines",
    "heights_from_normals",
    "info",
    "lint",
    "march",
    "march_stream",
    "render",
    "stress",
    "surfaces",
    "tangents",
    "techniques",
    "tile_report",
]


def __getattr__(name: str) -> object:
    from importlib import import_module

    if name in _MODULES or name in _HOMES:
        return import_module(f"{__name__}.{name}")
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found: object = getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
