"""Rendering meshes with relief, headless, on a Vulkan device."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from . import _bumpwgpu
from ._atomic import replace_file
from ._checks import choice, flag, number, numbers, strings, whole, width_and_height
from .errors import BumpWarning, RenderError
from .instances import Instance, framing, instances_of
from .meshes import Mesh
from .scene import Camera, Light, Material
from .techniques import Technique, get

if TYPE_CHECKING:
    from PIL import Image

__all__ = ["AOVS", "SKIPS", "SKIP_CODES", "Frame", "HorizonShadows", "render"]

#: Additional outputs.
AOVS: tuple[str, ...] = (
    "uv",
    "depth",
    "position",
    "normal",
    "height",
    "steps",
    "shadow",
    "mask",
    "ray_start",
    "ray_delta",
    "skip",
)
#: Kinds of work that a picture may not need.
SKIPS: tuple[str, ...] = (
    "frustum",
    "backface",
    "occlusion",
    "depth_first",
    "flat",
    "parallax",
    "range",
    "shadow",
)
#: What stands for each kind in the output "skip", to be added up; "normal" besides "parallax" where what is
#: seen stays on the mesh. From 65536 on, the number of shadow rays left out of the pixel.
SKIP_CODES: dict[str, int] = {
    "flat": 16,
    "parallax": 32,
    "range": 64,
    "shadow": 128,
    "normal": 256,
}
#: Longest side of a picture, in pixels.
MAX_SIDE = 1 << 16

_DEFAULT_LIGHTS = (Light.directional((-0.6, -0.7, -0.9)),)


@dataclass(frozen=True)
class HorizonShadows:
    """Self-shadows looked up in a horizon map, without a ray (Max 1988): what `shadows` of `render` takes.

    The map is baked from the material's heights when it is first needed and kept with them. It stands
    for the relief on a plane: on a curved mesh each point takes its tangent plane for the whole mesh.
    It does not tell what stands behind a point light from what stands before it, and what is narrower
    than a texel or lies between two azimuths is interpolated.

    Attributes
    ----------
    azimuths : int, default 32
        Directions in which the horizon is known, 4 to 256. The map takes 2 bytes for each of them and
        texel.
    softness : float, default 0.0
        Width of every light as an angle in degrees, 0 to 90; 0 gives hard edges. The sun has 0.5.

    Examples
    --------
    >>> import bumpwgpu as bw
    >>> bw.HorizonShadows(softness=5.0)
    HorizonShadows(azimuths=32, softness=5.0)
    """

    azimuths: int = 32
    softness: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "azimuths", whole("azimuths", self.azimuths, 4, 256))
        object.__setattr__(self, "softness", number("softness", self.softness, 0.0, 90.0))


class Frame:
    """A picture and what came with it.

    Attributes
    ----------
    color : ndarray of uint8, (H, W, 4)
        sRGB with alpha, row 0 on top.
    aovs : dict of str to ndarray of float32
        The additional outputs that were asked for; see :func:`render`.
    stats : dict
        Times in milliseconds (``prepare_ms``, ``compile_ms``, ``draw_ms``, ``readback_ms``,
        ``total_ms``), what was prepared for it (``maps_baked``, ``pipelines_compiled``, ``bytes_uploaded``),
        ``triangles_drawn``, ``triangles_culled``, ``pixels_covered``,
        ``pixels_marched``, ``pixels_skipped``, ``pixels_unconverged``, ``steps``, ``shadow_rays``,
        ``skipped`` (see `skip` of :func:`render`), and whether ``draw_ms`` is from the
        device's own clock.
    warnings : tuple of str
        Settings that could not take effect; also given as Python warnings.
    """

    __slots__ = ("_aovs", "_color", "_stats", "_warnings")

    def __init__(
        self,
        color: NDArray[np.uint8],
        aovs: dict[str, NDArray[np.float32]],
        stats: dict[str, Any],
        warnings: tuple[str, ...] = (),
    ) -> None:
        self._color = color
        self._aovs = aovs
        self._stats = stats
        self._warnings = warnings

    @property
    def color(self) -> NDArray[np.uint8]:
        """sRGB with alpha, uint8 (H, W, 4), row 0 on top."""
        return self._color

    @property
    def aovs(self) -> dict[str, NDArray[np.float32]]:
        """Additional outputs by name, float32."""
        return self._aovs

    @property
    def stats(self) -> dict[str, Any]:
        """Times in milliseconds and counts."""
        return self._stats

    @property
    def warnings(self) -> tuple[str, ...]:
        """Settings that could not take effect."""
        return self._warnings

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the picture; the suffix decides the format (PNG, TIFF, or what Pillow writes).

        Parameters
        ----------
        path : path
            Where to. Its folder must exist. The file appears only when it is complete.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        ValueError
            A suffix that no writer knows.
        OSError
            The file cannot be written.
        TypeError
            `path` is no path.
        """
        if not isinstance(path, str | os.PathLike):
            raise TypeError(f"path must be a string or a path, got {type(path).__name__}")
        target = Path(path)
        from PIL import Image

        Image.init()
        kind = Image.EXTENSION.get(target.suffix.lower())
        if kind is None or kind not in Image.SAVE:
            raise ValueError(
                f"cannot write {target.name!r}: unknown image suffix {target.suffix!r}; use .png"
            )
        image = self.to_pil()
        if kind in ("JPEG", "BMP", "PPM"):
            image = image.convert("RGB")
        data = BytesIO()
        image.save(data, format=kind)
        return replace_file(target, data.getvalue())

    def to_pil(self) -> Image.Image:
        """The picture as a PIL image, mode RGBA.

        Returns
        -------
        PIL.Image.Image
        """
        from PIL import Image

        return Image.fromarray(self._color)

    def _repr_png_(self) -> bytes:
        buffer = BytesIO()
        self.to_pil().save(buffer, format="PNG")
        return buffer.getvalue()

    def __repr__(self) -> str:
        height, width = self._color.shape[:2]
        outputs = f", aovs: {', '.join(self._aovs)}" if self._aovs else ""
        return f"<Frame {width} x {height}{outputs}>"


def render(
    mesh: Mesh | Instance | Iterable[Mesh | Instance],
    material: Material | Sequence[Material] | None = None,
    *,
    camera: Camera | None = None,
    lights: Iterable[Light] | None = None,
    technique: str | Technique = "relief",
    size: int | tuple[int, int] = (512, 512),
    shadows: bool | Literal["horizon"] | HorizonShadows | None = None,
    silhouettes: bool = False,
    samples: int = 1,
    specular_aa: bool = True,
    aovs: str | Iterable[str] = (),
    skip: bool | str | Iterable[str] = True,
    skip_error: tuple[float, float] = (0.125, 0.25),
    device: str = "auto",
    ambient: float | tuple[float, float, float] = 0.1,
    background: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0),
) -> Frame:
    """Draw meshes with relief.

    Parameters
    ----------
    mesh : Mesh, Instance, or iterable of them
        What to draw: a mesh where it is, or a whole scene of instances, each with its place and materials.
    material : Material, sequence of Material or None
        For a single mesh: one for the whole of it, or one for each of ``mesh.materials``, or None for the
        mesh file's own. Instances bring their own.
    camera : Camera or None
        None looks at everything from the front, a little from above.
    lights : iterable of Light or None
        None is one directional light from the upper right.
    technique : str or Technique, default "relief"
        One of :func:`bumpwgpu.techniques.names`.
    size : int or (int, int), default (512, 512)
        Pixels: the side of a square, or (width, height).
    shadows : bool, "horizon", HorizonShadows or None
        Whether the relief shadows itself, by the technique's own search towards each light. None:
        where the technique can. With ``silhouettes`` and ``technique="displacement"`` everything in the scene
        also shadows everything else. "horizon" looks shadows up in a baked horizon map instead, also for
        "bump" and "normal", which cast none; :class:`HorizonShadows` chooses its size and softness.
    silhouettes : bool, default False
        Trace rays through the shell around the mesh in which the relief lies, instead of bending the
        texture on its surface: outlines, depth, intersections and shadows are then those of
        ``technique="displacement"``, also on curved meshes, across seams and with the camera inside the
        shell. For ``technique="exact"``; on the others it has no effect, and a warning says so.
    samples : {1, 4, 16}, default 1
        Samples a pixel, in a square grid: each is searched and shaded for itself, so that edges inside a
        relief are smooth too, and they are averaged in linear light. The ``aovs`` are those of one sample in
        the middle of each pixel; counts in ``stats`` are of all samples.
    specular_aa : bool, default True
        Where a pixel holds many slopes of the relief, highlights are as wide as those spread them
        (Toksvig 2005), so that they neither vanish nor flicker. Close up it changes nothing.
    aovs : str or iterable of str
        Additional outputs, (H, W) or (H, W, C): "uv" (unwrapped), "depth" (along the view axis, mesh
        units, inf where nothing is), "position" (float32 as the others: half a
        millimetre off at 10 km where lengths are metres), "normal" (world axes), "height" (0..1), "steps",
        "shadow" (share of the lights that the relief hides), "mask" (1 where there is anything),
        "ray_start" and "ray_delta" (the segment searched, texture space), "skip" (what was left out of a
        pixel, by :data:`bumpwgpu.rendering.SKIP_CODES`).
    skip : bool or iterable of str, default True
        What to leave out where the picture does not need it: all of it, nothing, or some of
        :data:`bumpwgpu.rendering.SKIPS`. ``frame.stats["skipped"]`` counts what was left out: triangles
        outside the picture ("frustum"), facing away ("backface") and behind others ("occlusion"), draws
        moved ahead of what they hide ("depth_first"); pixels on flat ground ("flat"), with no visible
        parallax ("parallax") or marched over less of their ray ("range"); shadow rays that hide no light
        ("shadow").
    skip_error : (float, float), default (0.125, 0.25)
        How far what is seen may be off where a march is left out, in texels of the height map and in pixels
        measured on the mesh; whichever is more counts. (0, 0) leaves out what changes nothing.
    device : {"auto", "gpu"}
        Both render on the Vulkan device; the environment variable ``BUMPWGPU_ADAPTER`` picks one by
        a part of its name.
    ambient : float or (float, float, float), default 0.1
        Light from everywhere, linear RGB.
    background : tuple of 3 or 4 floats, default transparent black
        Colour where nothing is, linear RGB and alpha, 0..1.

    Returns
    -------
    Frame

    Raises
    ------
    RenderError
        No Vulkan device answers (the message says what to install), or the picture is too large for it.
    BakeError
        An image of the mesh's own materials is damaged.
    ValueError, TypeError
        A value out of range, or of the wrong kind.

    Warns
    -----
    BumpWarning
        A setting that cannot take effect, such as shadows with a technique that casts none.

    Examples
    --------
    >>> import bumpwgpu as bw
    >>> wall = bw.Material(height=bw.HeightMap.procedural("bricks", 64))
    >>> bw.render(bw.Mesh.quad(), wall, size=(32, 16)).color.shape  # doctest: +GPU
    (16, 32, 4)
    """
    core, view, texts = prepared(
        mesh,
        material,
        camera=camera,
        lights=lights,
        technique=technique,
        size=size,
        shadows=shadows,
        silhouettes=silhouettes,
        samples=samples,
        specular_aa=specular_aa,
        aovs=aovs,
        skip=skip,
        skip_error=skip_error,
        device=device,
        ambient=ambient,
        background=background,
    )
    frame = frame_of(core.render(camera_values(view)), texts)
    for text in frame.warnings:
        warnings.warn(text, BumpWarning, stacklevel=2)
    return frame


def prepared(
    mesh: Any,
    material: Any,
    *,
    camera: Any,
    lights: Any,
    technique: Any,
    size: Any,
    shadows: Any,
    silhouettes: Any,
    samples: Any,
    specular_aa: Any,
    aovs: Any,
    skip: Any,
    skip_error: Any,
    device: Any,
    ambient: Any,
    background: Any,
) -> tuple[_bumpwgpu.Renderer, Camera, list[str]]:
    """The arguments of :func:`render` checked: the scene on the device, its camera, and warnings."""
    instances = instances_of(mesh, material)
    chosen = get(technique)
    choice("device", device, ("auto", "gpu", "cpu"))
    if device == "cpu":
        raise ValueError(
            "render needs a Vulkan device: device='auto' or 'gpu'; Mesa's lavapipe is one in software"
        )
    outputs = strings("aovs", aovs, AOVS)
    width, height = _size(size)
    if camera is None:
        camera = framing(instances, width / height)
    core = _bumpwgpu.Renderer(
        [
            (part.mesh._core, first, end, used._core, part.world_from_object.T.ravel().tolist())
            for part in instances
            for first, end, used in part._draws
        ],
        camera_values(camera),
        [(lamp.kind == "directional", lamp.vector, lamp.color, lamp.intensity) for lamp in _lights(lights)],
        _ambient(ambient),
        _background(background),
        chosen.name,
        list(chosen.parameters.items()),
        (width, height),
        *_shadows(shadows),
        flag("silhouettes", silhouettes),
        _samples(samples),
        flag("specular_aa", specular_aa),
        outputs,
        _skips(skip),
        _skip_error(skip_error),
    )
    texts = []
    used = {used for part in instances for *_, used in part._draws}
    if chosen.name != "flat" and all(one.height is None and one.normal is None for one in used):
        texts.append(f"technique {chosen.name!r} has no effect: the material has no height map")
    return core, camera, texts


def camera_values(camera: Any) -> _bumpwgpu._Camera:
    """A camera as the core takes it."""
    if not isinstance(camera, Camera):
        raise TypeError(f"camera must be a Camera, got {type(camera).__name__}")
    return camera.eye, camera.target, camera.up, camera.fov_y


def frame_of(result: _bumpwgpu._RenderResult, texts: list[str]) -> Frame:
    """A frame from what the core returns, with further warnings."""
    return Frame(result["color"], result["aovs"], result["stats"], (*result["warnings"], *texts))


def _samples(samples: Any) -> int:
    if isinstance(samples, bool) or samples not in (1, 4, 16):
        raise ValueError(f"samples must be 1, 4 or 16, got {samples!r}")
    return int(samples)


def _shadows(shadows: Any) -> tuple[bool | None, tuple[int, float] | None]:
    """Whether there are shadows, and the azimuths and softness (radians) of a horizon map."""
    if isinstance(shadows, str) and shadows == "horizon":
        shadows = HorizonShadows()
    if isinstance(shadows, HorizonShadows):
        return True, (shadows.azimuths, float(np.radians(shadows.softness)))
    if shadows is None:
        return None, None
    try:
        return flag("shadows", shadows), None
    except TypeError:
        raise TypeError(
            f"shadows must be True, False, None, 'horizon' or HorizonShadows, got {shadows!r}"
        ) from None


def _skips(skip: Any) -> list[str]:
    if isinstance(skip, bool | np.bool_):
        return list(SKIPS) if skip else []
    return strings("skip", skip, SKIPS)


def _skip_error(error: Any) -> tuple[float, float]:
    texels, pixels = numbers("skip_error", error, 2, low=0.0)
    return texels, pixels


def _size(size: Any) -> tuple[int, int]:
    width, height = width_and_height(size)
    if width < 1 or height < 1:
        raise ValueError(f"size is {width} x {height}; each side must be at least 1")
    if width > MAX_SIDE or height > MAX_SIDE:
        raise RenderError(f"size is {width} x {height}; each side may be at most {MAX_SIDE}")
    return width, height


def _lights(lights: Any) -> list[Light]:
    if lights is None:
        return list(_DEFAULT_LIGHTS)
    if isinstance(lights, Light):
        return [lights]
    try:
        listed = list(lights)
    except TypeError:
        raise TypeError(f"lights must be a list of Light, got {type(lights).__name__}") from None
    for at, light in enumerate(listed):
        if not isinstance(light, Light):
            raise TypeError(f"lights[{at}] must be a Light, got {type(light).__name__}")
    return listed


def _ambient(ambient: Any) -> tuple[float, float, float]:
    if not hasattr(ambient, "__len__"):
        ambient = (ambient,) * 3
    red, green, blue = numbers("ambient", ambient, 3, 0.0)
    return (red, green, blue)


def _background(background: Any) -> tuple[float, float, float, float]:
    count = 3 if hasattr(background, "__len__") and len(background) == 3 else 4
    parts = numbers("background", background, count, 0.0)
    if max(parts) > 1.0:
        raise ValueError(f"background must be in 0..1, got {background!r}")
    return (parts[0], parts[1], parts[2], parts[3] if count == 4 else 1.0)
