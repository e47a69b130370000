"""Many pictures of one scene."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Iterator, Sequence
from types import TracebackType
from typing import Any, Literal

from . import _bumpwgpu
from .errors import BumpWarning
from .instances import Instance
from .meshes import Mesh
from .rendering import Frame, HorizonShadows, camera_values, frame_of, prepared
from .scene import Camera, Light, Material
from .techniques import Technique

__all__ = ["Renderer"]


class Renderer:
    """A scene on the device, for many pictures of it.

    What a view shows is prepared and uploaded when it is first seen, once; after that a picture costs little
    more than its drawing. :func:`render` is the use of it for one picture.

    It holds memory on the device until it is closed, deleted, or its ``with`` block ends. It may be used from
    several threads, one at a time.

    Parameters
    ----------
    mesh : Mesh, Instance, or iterable of them
        As in :func:`render`, and so are the following.
    material : Material, sequence of Material or None
        For a single mesh.
    camera : Camera or None
        Where :meth:`render` looks from when it is given no camera. None looks at everything from the front.
    lights : iterable of Light or None
        They stay where they are.
    technique : str or Technique, default "relief"
        One of :func:`bumpwgpu.techniques.names`.
    size : int or (int, int), default (512, 512)
        Pixels.
    shadows : bool, "horizon", HorizonShadows or None
        Whether the relief shadows itself.
    silhouettes : bool, default False
        True outlines, with ``technique="exact"``.
    samples : {1, 4, 16}, default 1
        Samples a pixel.
    specular_aa : bool, default True
        Whether highlights widen where a pixel holds many slopes.
    aovs : str or iterable of str
        Additional outputs.
    skip : bool or iterable of str, default True
        What to leave out where the picture does not need it.
    skip_error : (float, float), default (0.125, 0.25)
        How far what is seen may be off for it, in texels and in pixels.
    device : {"auto", "gpu"}
        The Vulkan device.
    ambient : float or (float, float, float), default 0.1
        Light from everywhere.
    background : tuple of 3 or 4 floats, default transparent black
        Colour where nothing is.

    Raises
    ------
    RenderError, BakeError, ValueError, TypeError
        As :func:`render`.

    Examples
    --------
    >>> import bumpwgpu as bw
    >>> wall = bw.Material(height=bw.HeightMap.procedural("bricks", 64))
    >>> around = [bw.Camera.look_at((x, 0, 2), (0, 0, 0)) for x in (-1, 0, 1)]
    >>> with bw.Renderer(bw.Mesh.quad(), wall, size=32) as renderer:  # doctest: +GPU
    ...     [frame.color.shape for frame in renderer.render_many(around)]
    [(32, 32, 4), (32, 32, 4), (32, 32, 4)]
    """

    def __init__(
        self,
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
    ) -> None:
        self._core, self._camera, self._texts = prepared(
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
        self._given: set[str] = set()

    @property
    def camera(self) -> Camera:
        """Where :meth:`render` looks from when it is given no camera."""
        return self._camera

    @property
    def closed(self) -> bool:
        """Whether it has been closed."""
        return self._core.closed

    def render(self, camera: Camera | None = None) -> Frame:
        """Draw one view.

        Parameters
        ----------
        camera : Camera or None
            None is :attr:`camera`.

        Returns
        -------
        Frame
            What was prepared for it counts in its ``stats``: little after the first.

        Raises
        ------
        RenderError
            The renderer is closed, or the device fails.
        TypeError
            No camera.

        Warns
        -----
        BumpWarning
            A setting that cannot take effect; each once.
        """
        frame = self._frame(self._core.render(camera_values(self._camera if camera is None else camera)))
        self._warn(frame)
        return frame

    def render_many(self, cameras: Iterable[Camera]) -> Iterator[Frame]:
        """Draw many views; each picture is read back while the device draws the next one.

        Parameters
        ----------
        cameras : iterable of Camera
            Taken one ahead of the frame that is returned.

        Yields
        ------
        Frame
            In the order of the cameras.

        Raises
        ------
        RenderError, TypeError
            As :meth:`render`, when the camera's turn comes.

        Examples
        --------
        >>> import bumpwgpu as bw
        >>> renderer = bw.Renderer(bw.Mesh.cube(), technique="flat", size=16)  # doctest: +GPU
        >>> sum(1 for _ in renderer.render_many([renderer.camera] * 5))  # doctest: +GPU
        5
        """
        waiting = None
        try:
            for camera in cameras:
                started = self._core.start(camera_values(camera))
                ready, waiting = waiting, started
                if ready is not None:
                    yield self._taken(ready)
            ready, waiting = waiting, None
            if ready is not None:
                yield self._taken(ready)
        finally:
            if waiting is not None:
                self._core.abandon(waiting)

    def _taken(self, ticket: _bumpwgpu.Ticket) -> Frame:
        frame = self._frame(self._core.finish(ticket))
        self._warn(frame)
        return frame

    def _frame(self, result: Any) -> Frame:
        return frame_of(result, self._texts)

    def _warn(self, frame: Frame) -> None:
        for text in frame.warnings:
            if text not in self._given:
                self._given.add(text)
                warnings.warn(text, BumpWarning, stacklevel=3)

    def close(self) -> None:
        """Free what the scene takes on the device. Rendering is an error afterwards; closing again is not."""
        self._core.close()

    def __enter__(self) -> Renderer:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        return "<Renderer, closed>" if self.closed else "<Renderer>"
