"""The compiled half of bumpwgpu; use the package instead."""

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final, TypeAlias, TypedDict, final

import numpy as np
from numpy.typing import NDArray

_Path: TypeAlias = str | os.PathLike[str]
_Parameters: TypeAlias = Sequence[tuple[str, float]]
_Setting: TypeAlias = tuple[str, _Parameters, str, str]
_Measured: TypeAlias = tuple[str, Sequence[float], float, float, float]
_Progress: TypeAlias = Callable[..., object] | None
_Options: TypeAlias = Sequence[tuple[str, bool | int | float | str]]
_Vector: TypeAlias = tuple[float, float, float]
_Camera: TypeAlias = tuple[_Vector, _Vector, _Vector, float]
_Color: TypeAlias = tuple[float, float, float, float]
_Decoded: TypeAlias = tuple[NDArray[Any], list[str], list[str]]

__all__ = [
    "MAX_MAP_SIDE",
    "MAX_SIDE",
    "VERSION",
    "BakeError",
    "BumpError",
    "Cancel",
    "CompareError",
    "CompareView",
    "Field",
    "Material",
    "Mesh",
    "MeshError",
    "RenderError",
    "Renderer",
    "SegmentReference",
    "Ticket",
    "adapters",
    "aov_names",
    "bake_detail",
    "bake_file",
    "bake_map",
    "bake_rows",
    "bake_tangents",
    "bend_normals",
    "check_normals",
    "compare_front",
    "compare_memory",
    "compare_planar",
    "compare_recommend",
    "compare_verify",
    "decode_image",
    "dequantise",
    "derivatives",
    "effective_bits",
    "export_search",
    "finite_span",
    "integrate_normals",
    "judge",
    "map_bytes",
    "map_registry",
    "march",
    "march_gpu",
    "mesh_map_registry",
    "quantum",
    "read_image",
    "save_map",
    "seams",
    "simd_level",
    "skip_codes",
    "skip_names",
    "surface_points",
    "tangent_methods",
    "tangents",
    "techniques",
    "threads",
]

VERSION: Final[str]
MAX_MAP_SIDE: Final[int]
MAX_SIDE: Final[int]

class BumpError(Exception): ...
class BakeError(BumpError): ...
class CompareError(BumpError): ...
class MeshError(BumpError): ...
class RenderError(BumpError): ...

class _TechniqueEntry(TypedDict):
    name: str
    summary: str
    source: str
    casts_shadows: bool
    marches: bool
    parameters: list[tuple[str, str, int, int, int]]

class _RenderResult(TypedDict):
    color: NDArray[np.uint8]
    aovs: dict[str, NDArray[np.float32]]
    stats: dict[str, Any]
    warnings: list[str]

class _MaterialEntry(TypedDict):
    name: str
    albedo: Path | bytes | None
    normal: Path | bytes | None
    bump: Path | bytes | None
    displacement: Path | bytes | None
    albedo_factor: _Color
    specular: float
    shininess: float
    bump_scale: float
    displacement_scale: float
    normal_scale: float

@final
class Cancel:
    def __new__(cls) -> Cancel: ...
    def set(self) -> None: ...

@final
class Field:
    def __new__(
        cls, heights: NDArray[np.float32], wrap: str, extent: tuple[float, float, tuple[float, float]]
    ) -> Field: ...

@final
class Ticket: ...

@final
class Renderer:
    def __new__(
        cls,
        draws: Sequence[tuple[Mesh, int, int, Material, Sequence[float]]],
        camera: _Camera,
        lights: Sequence[tuple[bool, _Vector, _Vector, float]],
        ambient: _Vector,
        background: _Color,
        technique: str,
        parameters: _Parameters,
        size: tuple[int, int],
        shadows: bool | None,
        horizon: tuple[int, float] | None,
        silhouettes: bool,
        samples: int,
        specular_aa: bool,
        aovs: Sequence[str],
        skips: Sequence[str],
        skip_error: tuple[float, float],
    ) -> Renderer: ...
    def render(self, camera: _Camera) -> _RenderResult: ...
    def start(self, camera: _Camera) -> Ticket: ...
    def finish(self, ticket: Ticket) -> _RenderResult: ...
    def abandon(self, ticket: Ticket) -> None: ...
    def close(self) -> None: ...
    @property
    def closed(self) -> bool: ...

@final
class Material:
    def __new__(
        cls,
        field: Field,
        albedo: NDArray[np.uint8] | None,
        normal: NDArray[np.float32] | None,
        albedo_factor: _Color,
        specular: float,
        shininess: float,
        double_sided: bool,
    ) -> Material: ...

@final
class Mesh:
    @staticmethod
    def open(path: _Path) -> Mesh: ...
    @staticmethod
    def rectangle(width: float, height: float) -> Mesh: ...
    @staticmethod
    def cube(size: float) -> Mesh: ...
    @staticmethod
    def sphere(radius: float, segments: int) -> Mesh: ...
    @staticmethod
    def torus(major: float, minor: float, major_segments: int, minor_segments: int) -> Mesh: ...
    @staticmethod
    def from_arrays(
        positions: NDArray[np.float32],
        indices: NDArray[np.uint32],
        uvs: NDArray[np.float32],
        normals: NDArray[np.float32] | None,
        tangents: NDArray[np.float32] | None,
    ) -> Mesh: ...
    @property
    def positions(self) -> NDArray[np.float32]: ...
    @property
    def normals(self) -> NDArray[np.float32]: ...
    @property
    def uvs(self) -> NDArray[np.float32]: ...
    @property
    def indices(self) -> NDArray[np.uint32]: ...
    @property
    def stored_tangents(self) -> NDArray[np.float32]: ...
    @property
    def dpdu(self) -> NDArray[np.float32]: ...
    @property
    def dpdv(self) -> NDArray[np.float32]: ...
    @property
    def warnings(self) -> list[str]: ...
    @property
    def parts(self) -> list[tuple[str, int, int, int | None]]: ...
    @property
    def materials(self) -> list[_MaterialEntry]: ...
    @property
    def counts(self) -> tuple[int, int]: ...
    @property
    def bounds(self) -> tuple[_Vector, _Vector]: ...
    def tangents(
        self, method: str
    ) -> tuple[NDArray[np.float32], NDArray[np.uint32], NDArray[np.uint32], list[str]]: ...

@final
class CompareView:
    def __new__(cls, field: Field, width: int, height: int) -> CompareView: ...
    def picture(
        self, technique: str, parameters: _Parameters
    ) -> tuple[NDArray[np.uint8], NDArray[np.float32], NDArray[np.float32]]: ...

@final
class SegmentReference:
    def __new__(
        cls, field: Field, starts: NDArray[np.float32], deltas: NDArray[np.float32]
    ) -> SegmentReference: ...
    def silhouettes(self) -> NDArray[np.bool_]: ...
    def measure(
        self,
        uv: NDArray[np.float32],
        z: NDArray[np.float32],
        status: NDArray[np.uint8],
        group: NDArray[np.uint8],
        sets: Sequence[Sequence[int]],
    ) -> tuple[dict[str, Any], list[dict[str, Any]], NDArray[np.float32]]: ...

def adapters() -> list[tuple[str, str, str, str]]: ...
def aov_names() -> list[str]: ...
def bake_file(
    source: _Path,
    target: _Path,
    map: str,
    options: _Options,
    dtype: str,
    wrap: str,
    extent: tuple[float, float, tuple[float, float]],
    reading: tuple[int | None, tuple[float, float] | None, bool, bool],
    progress: _Progress,
) -> tuple[int, int, int, list[float]]: ...
def bake_map(
    field: Field,
    map: str,
    options: _Options,
    dtype: str,
    progress: _Progress,
    first: int,
    total: int,
) -> tuple[list[NDArray[Any]], list[tuple[float, float]]]: ...
def bake_rows(
    heights: NDArray[np.float32],
    wrap: str,
    extent: tuple[float, float, tuple[float, float]],
    map: str,
    options: _Options,
    dtype: str,
    progress: _Progress,
    first: int,
    total: int,
) -> tuple[list[NDArray[Any]], list[tuple[float, float]]]: ...
def check_normals(normals: NDArray[np.float32], wrap: str, heights: Field | None) -> dict[str, Any]: ...
def compare_front(
    measured: Sequence[_Measured], max_failure_rate: float
) -> list[tuple[int, list[int], list[int]]]: ...
def compare_memory(field: Field, setting: _Setting) -> int: ...
def compare_planar(
    field: Field,
    settings: Sequence[_Setting],
    elevations: Sequence[float],
    rays: int,
    repeats: int,
    seed: int,
    device: str,
    progress: _Progress,
) -> tuple[list[dict[str, Any]], list[dict[str, Any]], str | None]: ...
def compare_recommend(
    measured: Sequence[_Measured], budget: tuple[float, float, float, float]
) -> tuple[int | None, str]: ...
def compare_verify(
    field: Field, setting: _Setting, elevations: Sequence[float], rays: int, seed: int
) -> dict[str, Any]: ...
def decode_image(data: bytes) -> _Decoded: ...
def dequantise(field: Field, quantum: float, progress: _Progress) -> NDArray[np.float32]: ...
def derivatives() -> list[str]: ...
def effective_bits(samples: NDArray[Any]) -> int: ...
def export_search(technique: str, parameters: _Parameters, wrap: str, language: str) -> str: ...
def finite_span(plane: NDArray[np.float32]) -> tuple[float, float] | None: ...
def integrate_normals(
    normals: NDArray[np.float32],
    convention: str,
    wrap: str,
    tile_size: tuple[float, float],
    derivative: str,
    steepest: float,
    progress: _Progress,
) -> tuple[NDArray[np.float32], dict[str, Any]]: ...
def judge(
    heights: NDArray[np.float32],
    wrap: str,
    origins: NDArray[np.float64],
    directions: NDArray[np.float64],
    reported: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]: ...
def map_bytes(map: str, options: _Options, width: int, height: int, wrap: str) -> tuple[int, int]: ...
def map_registry() -> list[dict[str, Any]]: ...
def mesh_map_registry() -> list[dict[str, Any]]: ...
def bake_detail(
    plain: Mesh,
    detail: Mesh,
    cage: Mesh | None,
    wanted: dict[str, Any],
    progress: _Progress,
) -> tuple[dict[str, NDArray[np.float32]], dict[str, Any]]: ...
def bake_tangents(
    mesh: Mesh, size: tuple[int, int], padding: int, progress: _Progress
) -> NDArray[np.float32]: ...
def march(
    field: Field,
    origins: NDArray[Any],
    directions: NDArray[Any],
    technique: str,
    parameters: _Parameters,
    out: dict[str, NDArray[Any]],
    from_surface: bool,
    first: int = 0,
    cancel: Cancel | None = None,
) -> None: ...
def march_gpu(
    field: Field,
    origins: NDArray[np.float32],
    directions: NDArray[np.float32],
    technique: str,
    parameters: _Parameters,
    outputs: Sequence[str],
) -> tuple[dict[str, NDArray[Any]], float]: ...
def quantum(heights: NDArray[np.float32]) -> float | None: ...
def read_image(path: _Path) -> _Decoded: ...
def save_map(
    map: str,
    layers: Sequence[NDArray[Any]],
    ranges: Sequence[tuple[float, float]],
    folder: _Path,
    prefix: str,
    format: str,
    bits: int,
) -> tuple[list[tuple[Path, int, int, str | None]], list[tuple[float, float]]]: ...
def seams(field: Field) -> list[dict[str, Any]]: ...
def simd_level() -> str: ...
def skip_codes() -> list[tuple[str, int]]: ...
def skip_names() -> list[str]: ...
def surface_points(
    shape: str, radii: tuple[float, float], uv: NDArray[np.float64]
) -> list[NDArray[np.float64]]: ...
def bend_normals(
    formula: str,
    normals: NDArray[np.float64],
    dpdu: NDArray[np.float64],
    dpdv: NDArray[np.float64],
    dndu: NDArray[np.float64],
    dndv: NDArray[np.float64],
    slopes: NDArray[np.float64],
    rise: NDArray[np.float64],
) -> NDArray[np.float64]: ...
def tangents(
    positions: NDArray[np.float32],
    indices: NDArray[np.uint32],
    uvs: NDArray[np.float32],
    normals: NDArray[np.float32] | None,
    method: str,
    weld: bool,
) -> tuple[NDArray[np.float32], NDArray[np.uint32], NDArray[np.uint32], list[str]]: ...
def tangent_methods() -> list[list[str]]: ...
def techniques() -> list[_TechniqueEntry]: ...
def threads() -> int: ...
