"""What a picture is made of besides the mesh: material, camera and lights. All immutable."""

from __future__ import annotations

import math
import os
import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _bumpwgpu
from ._checks import choice, flag, number, numbers, vector
from ._images import read_any
from .errors import BumpWarning
from .heightmap import HeightMap, HeightSource

if TYPE_CHECKING:
    from PIL import Image

__all__ = ["Camera", "ImageInput", "Light", "Material", "Vector"]

Vector: TypeAlias = "tuple[float, float, float] | list[float] | NDArray[Any]"
ImageInput: TypeAlias = "str | os.PathLike[str] | ArrayLike | Image.Image"


class Material:
    """How a surface looks: its relief, colour and highlight.

    Parameters
    ----------
    height : HeightMap, path, array, PIL image or None
        The relief. Anything but a HeightMap is read with the defaults of :class:`HeightMap`. None is
        a smooth surface.
    albedo : colour, path, array, PIL image or None
        sRGB. A colour is 3 or 4 numbers in 0..1. Arrays are (H, W), (H, W, 3) or (H, W, 4), integers
        meaning 0..1 or floats in 0..1. None is white.
    normal : path, array, PIL image or None
        Tangent-space normal map for ``technique="normal"`` and ``"dot3"``: integers (and files of
        integers) hold ``(n + 1) / 2``, floats hold ``n`` in -1..1 as :func:`bumpwgpu.bake` returns
        it. None bakes one from `height` when it is needed.
    specular : float, default 0.3
        Strength of the highlight, 0..1.
    shininess : float, default 32
        Exponent of the Blinn-Phong highlight, 1 to 10000.
    normal_convention : {"opengl", "directx"}
        Whether green points up or down the image in `normal`.
    double_sided : bool, default False
        Whether back faces show, with the relief on their side.

    Raises
    ------
    FileNotFoundError, BakeError
        An image is missing or damaged.
    ValueError, TypeError
        A value out of range, or of the wrong kind.

    Examples
    --------
    >>> import bumpwgpu as bw
    >>> bw.Material(height=bw.HeightMap.procedural("bricks", 64), albedo=(0.7, 0.4, 0.3)).specular
    0.3
    """

    __slots__ = (
        "_albedo",
        "_core",
        "_double_sided",
        "_factor",
        "_height",
        "_normal",
        "_shininess",
        "_specular",
    )
    _height: HeightMap | None
    _albedo: NDArray[np.uint8] | None
    _normal: NDArray[np.float32] | None

    def __init__(
        self,
        height: HeightMap | HeightSource | None = None,
        albedo: ImageInput | None = None,
        normal: ImageInput | None = None,
        *,
        specular: float = 0.3,
        shininess: float = 32.0,
        normal_convention: Literal["opengl", "directx"] = "opengl",
        double_sided: bool = False,
    ) -> None:
        convention = choice("normal_convention", normal_convention, ("opengl", "directx"))
        if convention == "directx" and normal is None:
            warnings.warn("normal_convention has no effect without a normal map", BumpWarning, stacklevel=2)
        if height is None or isinstance(height, HeightMap):
            self._height = height
        else:
            self._height = HeightMap(height)
        self._factor = (1.0, 1.0, 1.0, 1.0)
        self._albedo = None
        if _is_colour(albedo):
            self._factor = _linear_colour(albedo)
        elif albedo is not None:
            self._albedo = _albedo_image(albedo)
        self._normal = None if normal is None else _normal_image(normal, convention == "directx")
        self._specular = number("specular", specular, 0.0, 1.0)
        self._shininess = number("shininess", shininess, 1.0, 10000.0)
        self._double_sided = flag("double_sided", double_sided)
        self._core = self._make_core()

    def _make_core(self) -> _bumpwgpu.Material:
        if self._height is not None:
            field = self._height._field
        else:
            field = _bumpwgpu.Field(np.ones((1, 1), np.float32), "repeat", (0.0, 1.0, (1.0, 1.0)))
        encoded = None if self._normal is None else self._normal * np.float32(0.5) + np.float32(0.5)
        return _bumpwgpu.Material(
            field, self._albedo, encoded, self._factor, self._specular, self._shininess, self._double_sided
        )

    @classmethod
    def _scaled(
        cls, normal_scale: float, factor: tuple[float, float, float, float], **given: Any
    ) -> Material:
        """A material whose normal map is scaled and whose albedo is multiplied, as mesh files ask."""
        made = cls(**given)
        made._factor = factor
        if made._normal is not None and normal_scale != 1.0:
            normal = made._normal * np.array([normal_scale, normal_scale, 1.0], np.float32)
            length = np.sqrt((normal * normal).sum(axis=2, keepdims=True))
            made._normal = normal / np.maximum(length, np.float32(1e-12))
            made._normal.flags.writeable = False
        made._core = made._make_core()
        return made

    @property
    def height(self) -> HeightMap | None:
        """The relief."""
        return self._height

    @property
    def albedo(self) -> NDArray[np.uint8] | None:
        """Colour image, uint8 sRGB (H, W, 4), read-only; None for a plain colour."""
        return self._albedo

    @property
    def albedo_factor(self) -> tuple[float, float, float, float]:
        """Linear RGBA that multiplies the albedo."""
        return self._factor

    @property
    def normal(self) -> NDArray[np.float32] | None:
        """Normal map, float32 (H, W, 3), -1..1, +Y up; read-only."""
        return self._normal

    @property
    def double_sided(self) -> bool:
        """Whether back faces show."""
        return self._double_sided

    @property
    def specular(self) -> float:
        """Strength of the highlight."""
        return self._specular

    @property
    def shininess(self) -> float:
        """Exponent of the highlight."""
        return self._shininess

    def __repr__(self) -> str:
        parts = [f"height={self._height!r}"]
        if self._albedo is not None:
            parts.append(f"albedo={self._albedo.shape[1]} x {self._albedo.shape[0]}")
        if self._normal is not None:
            parts.append(f"normal={self._normal.shape[1]} x {self._normal.shape[0]}")
        return f"<Material {', '.join(parts)}, specular={self._specular:g}, shininess={self._shininess:g}>"


def _is_colour(value: Any) -> bool:
    if isinstance(value, tuple | list | np.ndarray) and len(value) in (3, 4):
        return all(isinstance(part, int | float | np.integer | np.floating) for part in value)
    return False


def _linear_colour(value: Any) -> tuple[float, float, float, float]:
    parts = [number(f"albedo[{at}]", part, 0.0, 1.0) for at, part in enumerate(value)]
    red, green, blue = (_linear(part) for part in parts[:3])
    return (red, green, blue, parts[3] if len(parts) == 4 else 1.0)


def _linear(srgb: float) -> float:
    """IEC 61966-2-1."""
    return srgb / 12.92 if srgb <= 0.04045 else ((srgb + 0.055) / 1.055) ** 2.4


def _picture(name: str, source: Any) -> NDArray[Any]:
    """(H, W, C) samples of an image input, not empty."""
    values = read_any(source, name).values
    if values.ndim == 2:
        values = values[:, :, np.newaxis]
    if values.ndim != 3 or values.size == 0 or values.shape[2] > 4:
        raise ValueError(f"{name} must have shape (H, W) or (H, W, 1 to 4), got {values.shape}")
    if values.dtype.kind == "f" and not np.isfinite(values).all():
        raise ValueError(f"{name} has NaN or infinite values")
    if values.dtype.kind not in "f" and values.dtype not in (np.uint8, np.uint16):
        raise TypeError(f"{name} must be uint8, uint16 or float, got {values.dtype}")
    return values


def _albedo_image(source: Any) -> NDArray[np.uint8]:
    values = _picture("albedo", source)
    if values.dtype == np.uint16:
        values = ((values.astype(np.uint32) * 255 + 32767) // 65535).astype(np.uint8)
    elif values.dtype != np.uint8:
        low, high = float(values.min()), float(values.max())
        if low < -0.01 or high > 1.01:
            raise ValueError(f"albedo: floats must be in 0..1, got {low:g} to {high:g}")
        values = np.rint(np.clip(values, 0.0, 1.0) * 255.0).astype(np.uint8)
    channels = values.shape[2]
    rgba = np.full((*values.shape[:2], 4), 255, np.uint8)
    rgba[:, :, :3] = values[:, :, :1] if channels <= 2 else values[:, :, :3]
    if channels in (2, 4):
        rgba[:, :, 3] = values[:, :, -1]
    rgba.flags.writeable = False
    return rgba


def _normal_image(source: Any, flip_green: bool) -> NDArray[np.float32]:
    values = _picture("normal", source)
    if values.shape[2] < 2:
        raise ValueError(f"normal must have at least 2 channels (x, y), got shape {values.shape}")
    if values.dtype.kind == "f":
        if float(np.abs(values[:, :, :3]).max()) > 1.01:
            raise ValueError("normal: floats must be in -1..1, as bake() returns them")
        normal = values[:, :, :3].astype(np.float32)
    else:
        normal = values[:, :, :3].astype(np.float32) * np.float32(2.0 / np.iinfo(values.dtype).max) - 1.0
    if flip_green:
        normal[:, :, 1] *= -1.0
    if normal.shape[2] == 2:
        z = np.sqrt(np.clip(1.0 - (normal * normal).sum(axis=2), 0.0, 1.0))
        normal = np.dstack((normal, z))
    normal = np.ascontiguousarray(normal, dtype=np.float32)
    normal.flags.writeable = False
    return normal


@dataclass(frozen=True)
class Camera:
    """A perspective camera; make one with :meth:`look_at`.

    Nothing need be clipped: the near plane lies at a hundred-thousandth of the distance to the
    target, and there is no far plane.

    Attributes
    ----------
    eye : (float, float, float)
        Where it is, mesh units.
    target : (float, float, float)
        What it looks at.
    up : (float, float, float)
        What is up in the picture.
    fov_y : float
        Vertical field of view, degrees.
    """

    eye: tuple[float, float, float]
    target: tuple[float, float, float]
    up: tuple[float, float, float] = (0.0, 1.0, 0.0)
    fov_y: float = 45.0

    def __post_init__(self) -> None:
        settle = object.__setattr__
        for name in ("eye", "target", "up"):
            settle(self, name, vector(name, getattr(self, name)))
        settle(self, "fov_y", number("fov_y", self.fov_y, 0.1, 179.0))
        view = np.subtract(self.target, self.eye)
        distance, tall = math.hypot(*view), math.hypot(*self.up)
        if distance == 0.0:
            raise ValueError(f"eye and target are the same point, {self.eye}")
        if tall == 0.0:
            raise ValueError("up is zero")
        if math.hypot(*np.cross(view / distance, np.divide(self.up, tall))) < 1e-6:
            raise ValueError(f"up {self.up} is parallel to the view direction; choose another up")

    @staticmethod
    def look_at(
        eye: Vector,
        target: Vector,
        up: Vector = (0.0, 1.0, 0.0),
        fov_y: float = 45.0,
    ) -> Camera:
        """A camera at one point that looks at another.

        Parameters
        ----------
        eye, target : (float, float, float)
            Mesh units; right-handed axes, +Y up.
        up : (float, float, float), default (0, 1, 0)
            What is up in the picture; need not be perpendicular to the view.
        fov_y : float, default 45
            Vertical field of view, degrees, 0.1 to 179.

        Returns
        -------
        Camera

        Raises
        ------
        ValueError
            `eye` equals `target`, `up` is parallel to the view, or a value out of range.
        TypeError
            Arguments of the wrong type.

        Examples
        --------
        >>> import bumpwgpu as bw
        >>> bw.Camera.look_at((0, 1, 3), (0, 0, 0)).fov_y
        45.0
        """
        return Camera(eye, target, up, fov_y)  # type: ignore[arg-type]


@dataclass(frozen=True)
class Light:
    """A light; make one with :meth:`directional` or :meth:`point`.

    Attributes
    ----------
    kind : {"directional", "point"}
        Which kind.
    vector : (float, float, float)
        Unit direction the light travels in, or position in mesh units.
    color : (float, float, float)
        Linear RGB, not negative.
    intensity : float
        Factor on the colour, not negative. A white surface that faces a directional light of
        intensity 1 shows white; a point light does so at a distance of 1 and falls off with the
        square of the distance.
    """

    kind: Literal["directional", "point"]
    vector: tuple[float, float, float]
    color: tuple[float, float, float] = (1.0, 1.0, 1.0)
    intensity: float = 1.0

    def __post_init__(self) -> None:
        settle = object.__setattr__
        choice("kind", self.kind, ("directional", "point"))
        at = vector("direction" if self.kind == "directional" else "position", self.vector)
        if self.kind == "directional":
            length = math.hypot(*at)
            if length == 0.0:
                raise ValueError("direction is zero")
            at = (at[0] / length, at[1] / length, at[2] / length)
        settle(self, "vector", at)
        settle(self, "color", numbers("color", self.color, 3, 0.0))
        settle(self, "intensity", number("intensity", self.intensity, 0.0))

    @staticmethod
    def directional(direction: Vector, color: Vector = (1.0, 1.0, 1.0), intensity: float = 1.0) -> Light:
        """Light from far away, such as the sun.

        Parameters
        ----------
        direction : (float, float, float)
            The way the light *travels*, as in glTF: (0, -1, 0) shines down. Any length but zero.
        color : (float, float, float), default white
            Linear RGB.
        intensity : float, default 1
            Factor on the colour.

        Returns
        -------
        Light

        Raises
        ------
        ValueError
            A zero direction, or a negative or infinite value.
        TypeError
            Arguments of the wrong type.

        Examples
        --------
        >>> import bumpwgpu as bw
        >>> bw.Light.directional((0, -2, 0)).vector
        (0.0, -1.0, 0.0)
        """
        return Light("directional", direction, color, intensity)  # type: ignore[arg-type]

    @staticmethod
    def point(position: Vector, color: Vector = (1.0, 1.0, 1.0), intensity: float = 1.0) -> Light:
        """Light from one point, in all directions.

        Parameters
        ----------
        position : (float, float, float)
            Mesh units.
        color : (float, float, float), default white
            Linear RGB.
        intensity : float, default 1
            Factor on the colour; falls off with the square of the distance.

        Returns
        -------
        Light

        Raises
        ------
        ValueError
            A negative or infinite value.
        TypeError
            Arguments of the wrong type.

        Examples
        --------
        >>> import bumpwgpu as bw
        >>> bw.Light.point((0, 2, 0), intensity=4).intensity
        4.0
        """
        return Light("point", position, color, intensity)  # type: ignore[arg-type]
