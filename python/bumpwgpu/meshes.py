"""Triangle meshes."""

from __future__ import annotations

import os
import warnings
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _bumpwgpu
from ._checks import choice, number, whole
from ._images import read_encoded
from .errors import BumpWarning
from .frames import TANGENT_METHODS, Tangents, floats, whole_rows
from .heightmap import HeightMap
from .scene import Material

__all__ = ["Mesh", "MeshMaterial", "Part"]

#: Height range of a bump or displacement map whose file says nothing about its unit, as a share of
#: the width of one texture tile.
RELIEF_SHARE = 0.05


class Part(NamedTuple):
    """A run of triangles with one name and one material.

    Attributes
    ----------
    name : str
        Object, group or node name; may be empty.
    triangles : slice
        Rows of :attr:`Mesh.indices`.
    material : int or None
        Index into :attr:`Mesh.materials`.
    """

    name: str
    triangles: slice
    material: int | None


@dataclass(frozen=True)
class MeshMaterial:
    """A material as the mesh file describes it, with nothing decoded.

    Images are a path, the bytes of an encoded image carried inside the mesh file, or None.

    Attributes
    ----------
    name : str
        Name in the file; may be empty.
    albedo, normal, bump, displacement : path, bytes or None
        Colour (sRGB), normal map (+Y up), height map, displacement map.
    albedo_factor : tuple of 4 floats
        Linear RGBA that multiplies the albedo.
    specular : float
        Strength of the highlight, 0..1.
    shininess : float
        Exponent of the highlight.
    bump_scale, displacement_scale, normal_scale : float
        Factors on heights and on the slopes of the normal map.
    """

    name: str = ""
    albedo: Path | bytes | None = field(default=None, repr=False)
    normal: Path | bytes | None = field(default=None, repr=False)
    bump: Path | bytes | None = field(default=None, repr=False)
    displacement: Path | bytes | None = field(default=None, repr=False)
    albedo_factor: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    specular: float = 0.5
    shininess: float = 32.0
    bump_scale: float = 1.0
    displacement_scale: float = 1.0
    normal_scale: float = 1.0


class Mesh:
    """An indexed triangle mesh with a tangent frame and UV derivatives at every vertex.

    Parameters
    ----------
    positions : array_like, (V, 3)
        Mesh units.
    indices : array_like of int, (T, 3)
        Triangles, counter-clockwise seen from outside.
    uvs : array_like, (V, 2)
        Texture coordinates, origin at the top left of the image, v down.
    normals : array_like, (V, 3), optional
        Any length but zero; without them, the angle-weighted mean over the triangles at a vertex.
    tangents : array_like, (V, 4), optional
        As in glTF. Without them MikkTSpace is run, and vertices are split where its tangents differ:
        vertex i stays vertex i, the extra ones follow at the end.

    Raises
    ------
    ValueError
        Wrong shapes, an index out of range, NaN or infinity.
    TypeError
        Arrays that do not hold numbers.
    MeshError
        A mesh too large to be used.

    Examples
    --------
    >>> import bumpwgpu as bw
    >>> mesh = bw.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], [[0, 1], [1, 1], [0, 0]])
    >>> mesh.normals[0].tolist()
    [0.0, 0.0, 1.0]
    """

    __slots__ = ("_core", "_loaded")
    _loaded: dict[float | None, list[Material]]

    def __init__(
        self,
        positions: ArrayLike,
        indices: ArrayLike,
        uvs: ArrayLike,
        *,
        normals: ArrayLike | None = None,
        tangents: ArrayLike | None = None,
    ) -> None:
        self._adopt(
            _bumpwgpu.Mesh.from_arrays(
                floats("positions", positions, 3),
                whole_rows(indices),
                floats("uvs", uvs, 2),
                None if normals is None else floats("normals", normals, 3),
                None if tangents is None else floats("tangents", tangents, 4),
            )
        )
        _tell(self)

    def _adopt(self, core: _bumpwgpu.Mesh) -> None:
        self._core = core
        self._loaded = {}

    @classmethod
    def _wrap(cls, core: _bumpwgpu.Mesh) -> Mesh:
        made = object.__new__(cls)
        made._adopt(core)
        return made

    @staticmethod
    def open(path: str | os.PathLike[str]) -> Mesh:
        """Read an OBJ, glTF or GLB file.

        glTF: the default scene, node transforms applied, given tangents kept. OBJ: objects, groups
        and materials become parts; ``v`` is flipped to run down.

        Parameters
        ----------
        path : path
            The suffix decides the format.

        Returns
        -------
        Mesh

        Raises
        ------
        FileNotFoundError
            The file does not exist.
        MeshError
            The file is damaged, needs something that is not supported, or is too large.
        TypeError
            `path` is no path.

        Warns
        -----
        BumpWarning
            Something was repaired or left out, such as a missing texture; also in :attr:`warnings`.
        """
        if not isinstance(path, str | os.PathLike):
            raise TypeError(f"path must be a string or a path, got {type(path).__name__}")
        mesh = Mesh._wrap(_bumpwgpu.Mesh.open(_checked_path(path)))
        _tell(mesh)
        return mesh

    @staticmethod
    def quad(size: float | tuple[float, float] = 1.0) -> Mesh:
        """A rectangle in the plane z = 0 around the origin, facing +Z, the image upright.

        Parameters
        ----------
        size : float or (float, float), default 1
            Side, or (width, height), mesh units; positive.

        Returns
        -------
        Mesh

        Raises
        ------
        ValueError, TypeError
            A size that is not positive, or no number.

        Examples
        --------
        >>> import bumpwgpu as bw
        >>> bw.Mesh.quad(2.0).bounds
        ((-1.0, -1.0, 0.0), (1.0, 1.0, 0.0))
        """
        if isinstance(size, tuple | list):
            if len(size) != 2:
                raise ValueError(f"size must be one number or (width, height), got {len(size)} numbers")
            width, height = number("size[0]", size[0]), number("size[1]", size[1])
        else:
            width = height = number("size", size)
        return Mesh._wrap(_bumpwgpu.Mesh.rectangle(width, height))

    @staticmethod
    def cube(size: float = 1.0) -> Mesh:
        """A cube around the origin; each face shows the whole image, upright and unmirrored.

        Parameters
        ----------
        size : float, default 1
            Side, mesh units; positive.

        Returns
        -------
        Mesh

        Raises
        ------
        ValueError, TypeError
            A size that is not positive, or no number.

        Examples
        --------
        >>> import bumpwgpu as bw
        >>> len(bw.Mesh.cube().indices)
        12
        """
        return Mesh._wrap(_bumpwgpu.Mesh.cube(number("size", size)))

    @staticmethod
    def sphere(radius: float = 0.5, segments: int = 64) -> Mesh:
        """A sphere around the origin, mapped by longitude and latitude, north at +Y.

        Parameters
        ----------
        radius : float, default 0.5
            Mesh units; positive.
        segments : int, default 64
            Around the equator, 3 to 2048; half as many from pole to pole.

        Returns
        -------
        Mesh

        Raises
        ------
        ValueError, TypeError
            A value out of range, or of the wrong kind.

        Examples
        --------
        >>> import bumpwgpu as bw
        >>> mesh = bw.Mesh.sphere(2.0)
        >>> bool((abs((mesh.positions ** 2).sum(1) - 4) < 1e-5).all())
        True
        """
        return Mesh._wrap(
            _bumpwgpu.Mesh.sphere(number("radius", radius), whole("segments", segments, 3, 2048))
        )

    @staticmethod
    def torus(
        major: float = 0.7, minor: float = 0.3, major_segments: int = 96, minor_segments: int = 48
    ) -> Mesh:
        """A torus in the plane y = 0 around the origin; u runs around the ring, v around the tube.

        Parameters
        ----------
        major : float, default 0.7
            From the centre to the middle of the tube, mesh units.
        minor : float, default 0.3
            Radius of the tube, mesh units; less than `major`.
        major_segments, minor_segments : int, default 96 and 48
            Around the ring and around the tube, 3 to 2048.

        Returns
        -------
        Mesh

        Raises
        ------
        ValueError, TypeError
            A value out of range, or of the wrong kind.

        Examples
        --------
        >>> import bumpwgpu as bw
        >>> round(bw.Mesh.torus(2.0, 0.5).bounds[1][1], 3)
        0.5
        """
        return Mesh._wrap(
            _bumpwgpu.Mesh.torus(
                number("major", major),
                number("minor", minor),
                whole("major_segments", major_segments, 3, 2048),
                whole("minor_segments", minor_segments, 3, 2048),
            )
        )

    @property
    def positions(self) -> NDArray[np.float32]:
        """Positions, float32 (V, 3), mesh units; a copy."""
        return self._core.positions

    @property
    def normals(self) -> NDArray[np.float32]:
        """Unit normals, float32 (V, 3); a copy."""
        return self._core.normals

    @property
    def uvs(self) -> NDArray[np.float32]:
        """Texture coordinates, float32 (V, 2), v down; a copy."""
        return self._core.uvs

    @property
    def indices(self) -> NDArray[np.uint32]:
        """Triangles, uint32 (T, 3), counter-clockwise seen from outside; a copy."""
        return self._core.indices

    @property
    def dpdu(self) -> NDArray[np.float32]:
        """dP/du, float32 (V, 3), mesh units per UV unit, not normalised; a copy."""
        return self._core.dpdu

    @property
    def dpdv(self) -> NDArray[np.float32]:
        """dP/dv with v down, float32 (V, 3), mesh units per UV unit, not normalised; a copy."""
        return self._core.dpdv

    @property
    def vertex_tangents(self) -> NDArray[np.float32]:
        """The tangents the mesh is drawn with, float32 (V, 4): the file's, or MikkTSpace's; a copy."""
        return self._core.stored_tangents

    @property
    def parts(self) -> tuple[Part, ...]:
        """Runs of triangles, which cover the mesh in order."""
        return tuple(
            Part(name, slice(first, end), material) for name, first, end, material in self._core.parts
        )

    @property
    def materials(self) -> tuple[MeshMaterial, ...]:
        """Materials as the file describes them; see :meth:`load_materials`."""
        return tuple(MeshMaterial(**entry) for entry in self._core.materials)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What was repaired, replaced or left out while the mesh was made."""
        return tuple(self._core.warnings)

    @property
    def bounds(self) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        """Smallest and largest corner of the bounding box, mesh units."""
        (x0, y0, z0), (x1, y1, z1) = self._core.bounds
        return (x0, y0, z0), (x1, y1, z1)

    def tangents(self, method: str = "mikktspace") -> Tangents:
        """Tangent frames by some method; the mesh itself stays as it is.

        MikkTSpace sees the quads of an OBJ file whole, as Blender does; the other methods see triangles.
        :func:`bumpwgpu.tangents` does the same for plain arrays.

        Parameters
        ----------
        method : str, default "mikktspace"
            ``"mikktspace"``: the standard of glTF, Blender and Unreal (Mikkelsen 2008). ``"dietrich"``,
            ``"edge"``, ``"derivative"``: one frame a triangle. ``"averaged"``, ``"uv_gradient"``: one
            frame a vertex. ``"split"``: a vertex for each corner. ``"axis"``: blind to the texture.
            ``bumpwgpu.frames.TANGENT_METHODS`` says what each guarantees and where it comes from.

        Returns
        -------
        Tangents
            Vertices are split where the frames of their triangles differ.

        Raises
        ------
        ValueError, TypeError
            An unknown method.
        MeshError
            Splitting would make too many vertices.

        Examples
        --------
        >>> import bumpwgpu as bw
        >>> bw.Mesh.quad().tangents().tangents[0].tolist()
        [1.0, 0.0, 0.0, 1.0]
        """
        choice("method", method, tuple(TANGENT_METHODS))
        tangents, indices, source, texts = self._core.tangents(method)
        for text in texts:
            warnings.warn(text, BumpWarning, stacklevel=2)
        return Tangents(tangents, indices, source)

    def load_materials(self, *, scale: float | None = None) -> list[Material]:
        """The file's materials with their images read, in the order of :attr:`materials`.

        ``render(mesh)`` without a material uses these. A displacement map is preferred to a bump
        map. Files do not say how high such a map is; None takes 5 % of the width of a texture tile
        times the file's own factor.

        Parameters
        ----------
        scale : float or None
            Height range, mesh units.

        Returns
        -------
        list of Material

        Raises
        ------
        BakeError
            An image of the mesh is damaged.
        ValueError, TypeError
            A negative scale, or no number.
        """
        if scale is not None:
            scale = number("scale", scale, 0.0)
        if scale not in self._loaded:
            self._loaded[scale] = [self._load(source, scale) for source in self.materials]
        return list(self._loaded[scale])

    def _load(self, source: MeshMaterial, scale: float | None) -> Material:
        height = None
        image, factor = source.displacement, source.displacement_scale
        if image is None:
            image, factor = source.bump, source.bump_scale
        if image is not None:
            tile = float(np.median(np.linalg.norm(self.dpdu, axis=1)))
            span = RELIEF_SHARE * tile * abs(factor) if scale is None else scale
            # A negative factor turns the relief inside out.
            height = HeightMap(_image(image), scale=span, invert=factor < 0.0)
        return Material._scaled(
            source.normal_scale,
            source.albedo_factor,
            height=height,
            albedo=_image(source.albedo),
            normal=_image(source.normal),
            specular=min(max(source.specular, 0.0), 1.0),
            shininess=min(max(source.shininess, 1.0), 10000.0),
        )

    def __repr__(self) -> str:
        vertices, triangles = self._core.counts
        return f"<Mesh of {vertices} vertices, {triangles} triangles, {len(self.parts)} parts>"


def _tell(mesh: Mesh) -> None:
    for text in mesh.warnings:
        warnings.warn(text, BumpWarning, stacklevel=3)


def _checked_path(path: str | os.PathLike[str]) -> Path:
    checked = Path(path)
    if "\0" in str(checked):
        raise ValueError("path contains a null character")
    return checked


def _image(source: Path | bytes | None) -> Any:
    return read_encoded(source) if isinstance(source, bytes) else source
