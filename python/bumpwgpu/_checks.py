"""Checks of arguments that several modules share."""

from __future__ import annotations

import math
import operator
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: Largest finite 32-bit float: what the core computes with.
FLOAT32_MAX = float(np.finfo(np.float32).max)


def number(name: str, value: Any, low: float | None = None, high: float | None = None) -> float:
    """A finite float out of any real number, within bounds where given."""
    if isinstance(value, str | bytes | bool | np.bool_) or value is None:
        raise TypeError(f"{name} must be a number, got {value!r}")
    try:
        converted = float(value)
    except OverflowError:
        raise ValueError(f"{name} is too large for 32-bit floats") from None
    except (TypeError, ValueError):
        raise TypeError(f"{name} must be a number, got {type(value).__name__}") from None
    if not math.isfinite(converted) or abs(converted) > FLOAT32_MAX:
        raise ValueError(f"{name} must be finite and fit 32-bit floats, got {converted}")
    if low is not None and converted < low:
        raise ValueError(f"{name} must be at least {low:g}, got {converted:g}")
    if high is not None and converted > high:
        raise ValueError(f"{name} must be at most {high:g}, got {converted:g}")
    return converted


def numbers(name: str, value: Any, count: int, low: float | None = None) -> tuple[float, ...]:
    """`count` finite floats out of any sequence."""
    if isinstance(value, str | bytes | dict | set) or not hasattr(value, "__len__"):
        raise TypeError(f"{name} must be {count} numbers, got {value!r}")
    if len(value) != count:
        raise ValueError(f"{name} must be {count} numbers, got {len(value)}")
    return tuple(number(f"{name}[{at}]", part, low) for at, part in enumerate(value))


def vector(name: str, value: Any) -> tuple[float, float, float]:
    """Three finite floats."""
    x, y, z = numbers(name, value, 3)
    return (x, y, z)


def whole(name: str, value: Any, low: int | None = None, high: int | None = None) -> int:
    """A whole number, within bounds where given."""
    if isinstance(value, bool | np.bool_):
        raise TypeError(f"{name} must be a whole number, got {value!r}")
    try:
        converted = operator.index(value)
    except TypeError:
        raise TypeError(f"{name} must be a whole number, got {value!r}") from None
    if (low is not None and converted < low) or (high is not None and converted > high):
        raise ValueError(f"{name} must be in {low}..{high}, got {converted}")
    return converted


def flag(name: str, value: Any) -> bool:
    """A boolean and nothing that merely looks like one."""
    if not isinstance(value, bool | np.bool_):
        raise TypeError(f"{name} must be True or False, got {value!r}")
    return bool(value)


def choice(name: str, value: Any, known: tuple[str, ...]) -> str:
    """One of some strings."""
    if not isinstance(value, str):
        raise TypeError(f"{name} must be a string, got {type(value).__name__}")
    if value not in known:
        raise ValueError(f"unknown {name} {value!r}; known: {', '.join(known)}")
    return value


def strings(name: str, value: Any, known: tuple[str, ...]) -> list[str]:
    """Some of some strings, each once, in the order given; a single string stands for itself."""
    if isinstance(value, str):
        value = (value,)
    try:
        parts = list(value)
    except TypeError:
        raise TypeError(f"{name} must be names, got {type(value).__name__}") from None
    for part in parts:
        if not isinstance(part, str):
            raise TypeError(f"{name} must be names, got {part!r}")
        if part not in known:
            raise ValueError(f"unknown name {part!r} in {name}; known: {', '.join(known)}")
    return list(dict.fromkeys(parts))


def width_and_height(size: Any) -> tuple[int, int]:
    """Two whole numbers out of one side or (width, height); their range is the caller's to check."""
    if not isinstance(size, tuple | list):
        side = whole("size", size)
        return side, side
    if len(size) != 2:
        raise ValueError(f"size must be one number or (width, height), got {len(size)} numbers")
    return whole("size[0]", size[0]), whole("size[1]", size[1])


def rows(name: str, values: Any, width: int) -> NDArray[Any]:
    """Numbers of shape (N, width); copied only when they are no array yet."""
    try:
        array = np.asarray(values)
    except Exception as error:
        raise ValueError(f"{name} is not an array of shape (N, {width}): {error}") from None
    if array.dtype.kind not in "fiu":
        raise TypeError(f"{name} must hold numbers, got dtype {array.dtype}")
    if array.ndim != 2 or array.shape[1] != width:
        raise ValueError(f"{name} must have shape (N, {width}), got {array.shape}")
    return array
