"""Surface detail from height maps: bake, march, render, compare.

>>> import bumpwgpu as bw
>>> bricks = bw.HeightMap.procedural("bricks", size=64)
>>> bw.bake(bricks)["normal"].shape
(64, 64, 3)
"""

from __future__ import annotations

import os as _os

from . import engines, surfaces, techniques
from ._bumpwgpu import VERSION as __version__
from .baking import bake, bake_file
from .compare import CompareResult, MipAdvice, Recommendation, Scene, compare
from .engines import EngineSettings
from .errors import BakeError, BumpError, BumpWarning, CompareError, MeshError, RenderError
from .frames import Tangents, tangents
from .heightmap import HeightMap
from .instances import Instance
from .lint import Finding, LintReport, lint
from .maps import Maps
from .marching import Hits, march
from .mesh_maps import MeshMaps, MeshReport
from .meshes import Mesh, MeshMaterial, Part
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
from .stress import StressResult, stress
from .system import info

if "XDG_RUNTIME_DIR" not in _os.environ:
    # Without a desktop there is none to ask which device it uses; Mesa's layer would complain on stderr.
    _os.environ.setdefault("NODEVICE_SELECT", "1")

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
