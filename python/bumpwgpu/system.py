"""What bumpwgpu runs on."""

from __future__ import annotations

import os
import platform
from typing import Any

import numpy as np

from . import _bumpwgpu

__all__ = ["info", "machine"]


def info() -> dict[str, Any]:
    """Versions, Vulkan devices and the processor. Lists the devices, but opens none.

    Returns
    -------
    dict
        ``version``, ``python``, ``numpy``, ``platform``, ``threads``, ``simd`` (the vector instructions
        that searches use: "baseline", "avx2", "avx512" or "neon"; the environment variable
        ``BUMPWGPU_SIMD`` may name lesser ones), ``techniques``, and ``adapters``: a list of
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


def machine(uses_device: bool) -> dict[str, Any]:
    """Device and versions, for every comparison to state."""
    found = info()
    wanted = os.environ.get("BUMPWGPU_ADAPTER", "").lower()
    device = next((known for known in found["adapters"] if wanted in known["name"].lower()), None)
    stated = {"cpu": f"{_processor()}, {found['threads']} threads, {found['simd']}"}
    if uses_device and device is not None:
        driver = f"{device['driver']} {device['driver_info']}"
        stated["device"] = f"{device['name']} ({device['kind']}), driver {driver}"
    return {**stated, **{key: found[key] for key in ("version", "python", "numpy", "platform")}}


def _processor() -> str:
    """What the processor calls itself, where the system says."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as lines:
            for line in lines:
                if line.startswith("model name"):
                    return line.split(":", 1)[1].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()
