"""Marching rays that come in chunks, more than memory holds."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _bumpwgpu
from ._checks import flag, rows
from .heightmap import HeightMap
from .marching import OUTPUTS, Hits, _ready, _searching, empty_places, wanted_outputs
from .techniques import Technique

if TYPE_CHECKING:
    from concurrent.futures import Future

__all__ = ["march_stream"]


def march_stream(
    height_map: HeightMap,
    chunks: Iterable[tuple[ArrayLike, ArrayLike]],
    technique: str | Technique = "exact",
    *,
    outputs: Iterable[str] = OUTPUTS,
    from_surface: bool = False,
    overlap: bool = True,
) -> Iterator[Hits]:
    """March rays chunk by chunk, as they are made; memory holds a few chunks, whatever their number.

    Parameters
    ----------
    height_map : HeightMap
        The surface, bilinear between texel centres.
    chunks : iterable of (origins, directions)
        Each (N, 3), as for :func:`march`; N may differ from chunk to chunk and be 0. Chunks of a hundred
        thousand to a million rays keep all cores busy.
    technique : str or Technique, default "exact"
        One of :func:`bumpwgpu.techniques.marching`.
    outputs : iterable of str
        Any of "t", "uv", "z", "normal", "steps", "status"; fewer are faster.
    from_surface : bool, default False
        The origins lie on the surface: the march leaves it first (shadow rays).
    overlap : bool, default True
        March one chunk while the next is being made. Turn it off for chunks that are made in the same
        arrays over and over: those would change under the march.

    Returns
    -------
    iterator of Hits
        One for each chunk, in order.

    Raises
    ------
    ValueError
        As :func:`march`; the message names the chunk and the ray in it. The hits of the chunks before it
        have been yielded by then.
    TypeError
        Arguments of the wrong type.

    Notes
    -----
    Rays that lie in files are for ``march(..., out=...)`` on memory-mapped arrays. Closing the iterator,
    an exception, or Ctrl-C stops the march that is under way.

    Examples
    --------
    >>> import numpy as np
    >>> import bumpwgpu as bw
    >>> hm = bw.HeightMap.procedural("ridge", 64)
    >>> def chunks():
    ...     for row in range(4):
    ...         origins = np.float32([[0.25, row / 4, 1.0]] * 1000)
    ...         yield origins, np.float32([[0.0, 0.0, -1.0]] * 1000)
    >>> sum(float(hits.t.sum()) for hits in bw.march_stream(hm, chunks(), outputs=("t",)))
    2000.0
    """
    if not isinstance(height_map, HeightMap):
        raise TypeError(f"height_map must be a HeightMap, got {type(height_map).__name__}")
    chosen = _searching(technique)
    wanted = wanted_outputs(outputs)
    from_surface = flag("from_surface", from_surface)
    overlap = flag("overlap", overlap)
    try:
        source = iter(chunks)
    except TypeError:
        raise TypeError(f"chunks must be iterable, got {type(chunks).__name__}") from None
    parameters = list(chosen.parameters.items())
    cancel = _bumpwgpu.Cancel()

    def work(number: int, starts: NDArray[Any], ways: NDArray[Any]) -> Hits:
        places = empty_places(wanted, len(starts))
        if len(starts) or len(ways):
            try:
                _bumpwgpu.march(
                    height_map._field,
                    _ready(starts),
                    _ready(ways),
                    chosen.name,
                    parameters,
                    places,
                    from_surface,
                    cancel=cancel,
                )
            except ValueError as error:
                raise ValueError(f"chunk {number}: {error}") from None
        return Hits(places)

    def stream() -> Iterator[Hits]:
        # Only streams pay for the import.
        from concurrent.futures import ThreadPoolExecutor

        # One worker: the calling thread stays free to make the next chunk, and to be interrupted.
        executor = ThreadPoolExecutor(1, thread_name_prefix="bumpwgpu-stream")
        waiting: Future[Hits] | None = None
        try:
            for number, chunk in enumerate(source):
                job = executor.submit(work, number, *_chunk(number, chunk))
                if not overlap:
                    yield job.result()
                    continue
                if waiting is not None:
                    yield waiting.result()
                waiting = job
            if waiting is not None:
                yield waiting.result()
        finally:
            cancel.set()
            executor.shutdown(wait=True, cancel_futures=True)

    return stream()


def _chunk(number: int, chunk: Any) -> tuple[NDArray[Any], NDArray[Any]]:
    if isinstance(chunk, np.ndarray) or not isinstance(chunk, tuple | list) or len(chunk) != 2:
        raise TypeError(f"chunk {number} must be a pair (origins, directions), got {type(chunk).__name__}")
    starts, ways = chunk
    return rows(f"chunk {number}: origins", starts, 3), rows(f"chunk {number}: directions", ways, 3)
