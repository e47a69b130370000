"""What bumpwgpu runs on."""

from __future__ import annotations

import platform
from typing import Any

import numpy as np

from . import _bumpwgpu

__all__ = ["info"]


def info() -> dict[str, Any]:
    """Versions, Vulkan devices and the processor. Lists the devices, but opens none.

    Returns
    -------
    dict
        ``version``, ``python``, ``numpy``, ``platform``, ``threads``, ``simd`` (the instruction set
        of the processor that the exact search can use), ``techniques``, and ``adapters``: a list of
        dicts with ``name``, ``driver``, ``driver_info`` and ``kind`` ("discrete", "integrated",
        "virtual", "software" or "other"), the preferred one first; empty without a Vulkan device.

    Examples
    --------
    >>> import bumpwgpu as bw
    >>> bw.info()["version"] == bw.__version__
    True
    """
    names = ("name", "driver", "driver_info", "kind")
    adapters = [dict(zip(names, adapter, strict=True)) for adapter in _bumpwgpu.adapters()]
    from .techniques import names as technique_names

    return {
        "version": _bumpwgpu.VERSION,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "platform": platform.platform(),
        "threads": _bumpwgpu.threads(),
        "simd": _bumpwgpu.simd_level(),
        "techniques": list(technique_names()),
        "adapters": adapters,
    }
