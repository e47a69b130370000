"""Arrays in blocks: what lies in a mapped file is read ahead and let go of again."""

from __future__ import annotations

import mmap
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: Rays marched at a time where not all of them should be in memory at once.
BLOCK = 1 << 20


def blocks(total: int) -> Iterator[tuple[int, int]]:
    """First and last-plus-one rows of each block."""
    for first in range(0, total, BLOCK):
        yield first, min(first + BLOCK, total)


def mapped_file(array: NDArray[Any]) -> mmap.mmap | None:
    """The file that an array lies in, if pages of it can be dropped and read again."""
    part: Any = array
    private = True
    while part is not None and not isinstance(part, mmap.mmap):
        if isinstance(part, np.memmap):
            # Copy-on-write pages exist nowhere else.
            private = part.mode == "c"
        part = getattr(part, "base", None)
    return None if private else part


class Window:
    """The pages of some rows of a mapped array; of no effect on arrays in memory."""

    __slots__ = ("_address", "_array", "_file")

    def __init__(self, array: NDArray[Any]) -> None:
        self._array = array
        self._file = mapped_file(array)
        if self._file is not None:
            self._address = np.frombuffer(self._file, np.uint8).ctypes.data

    @property
    def mapped(self) -> bool:
        """Whether the rows lie in a file."""
        return self._file is not None

    def read_ahead(self, first: int, last: int) -> None:
        """Has the system fetch rows that are wanted soon."""
        self._advise("MADV_WILLNEED", first, last)

    def let_go(self, first: int, last: int) -> None:
        """Takes rows out of this process's memory; what was written stays with the file."""
        self._advise("MADV_DONTNEED", first, last)

    def _advise(self, name: str, first: int, last: int) -> None:
        advice = getattr(mmap, name, None)
        if self._file is None or advice is None or first >= len(self._array):
            return
        rows = self._array[first:last]
        if min(rows.strides) < 0:
            return
        low = rows.ctypes.data
        high = (
            low
            + sum((n - 1) * step for n, step in zip(rows.shape, rows.strides, strict=True))
            + rows.itemsize
        )
        # Whole pages, all inside: the ones at the ends belong to the neighbours too.
        start = -(-(low - self._address) // mmap.PAGESIZE) * mmap.PAGESIZE
        end = (high - self._address) // mmap.PAGESIZE * mmap.PAGESIZE
        if end > start:
            self._file.madvise(advice, start, end - start)
