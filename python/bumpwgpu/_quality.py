"""How far two pictures are apart: FLIP, PSNR and SSIM."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .errors import CompareError

__all__ = ["flip", "psnr", "ssim"]

#: Wang et al. 2004: 11 x 11 Gaussian window of standard deviation 1.5.
_RADIUS, _SIGMA = 5, 1.5
#: Wang et al. 2004: stabilising constants, relative to the range of values.
_K1, _K2 = 0.01, 0.03


def _unit(picture: NDArray[Any]) -> NDArray[np.float64]:
    """(H, W, 3) in 0..1 from uint8 with or without alpha."""
    return picture[:, :, :3].astype(np.float64) / 255.0


def psnr(reference: NDArray[np.uint8], test: NDArray[np.uint8]) -> float:
    """Peak signal-to-noise ratio in dB over all sRGB samples; infinite for equal pictures."""
    error = float(np.mean((_unit(reference) - _unit(test)) ** 2))
    return math.inf if error == 0.0 else -10.0 * math.log10(error)


def ssim(reference: NDArray[np.uint8], test: NDArray[np.uint8]) -> float:
    """Mean structural similarity of the luma (Wang, Bovik, Sheikh and Simoncelli 2004), 1 = equal.

    Gaussian window of 11 x 11 and standard deviation 1.5, K1 = 0.01, K2 = 0.03, population
    covariances, windows that reach over the edge left out; pictures smaller than the window are
    one window.
    """
    weights = np.array([0.2126, 0.7152, 0.0722])
    x, y = _unit(reference) @ weights, _unit(test) @ weights
    mean_x, mean_y = _blur(x), _blur(y)
    var_x, var_y = _blur(x * x) - mean_x**2, _blur(y * y) - mean_y**2
    covariance = _blur(x * y) - mean_x * mean_y
    c1, c2 = _K1**2, _K2**2
    similarity = ((2.0 * mean_x * mean_y + c1) * (2.0 * covariance + c2)) / (
        (mean_x**2 + mean_y**2 + c1) * (var_x + var_y + c2)
    )
    return float(similarity.mean())


def _blur(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Gaussian mean around every pixel whose window lies inside."""
    if min(values.shape) <= 2 * _RADIUS:
        return np.full((1, 1), values.mean())
    offsets = np.arange(-_RADIUS, _RADIUS + 1)
    kernel = np.exp(-0.5 * (offsets / _SIGMA) ** 2)
    kernel /= kernel.sum()
    for axis in (0, 1):
        count = values.shape[axis] - 2 * _RADIUS
        parts = [np.take(values, range(at, at + count), axis=axis) for at in range(2 * _RADIUS + 1)]
        values = np.sum([weight * part for weight, part in zip(kernel, parts, strict=True)], axis=0)
    return values


def flip(reference: NDArray[np.uint8], test: NDArray[np.uint8]) -> tuple[float, NDArray[np.float32]]:
    """Mean and map (H, W) of the FLIP error (Andersson et al. 2020), 0 equal to 1, by NVIDIA's evaluator.

    67 pixels a degree: 0.7 m in front of a 0.7 m wide screen of 3840 pixels.
    """
    try:
        import flip_evaluator
    except ImportError:
        raise CompareError(
            "comparing pictures needs NVIDIA's flip-evaluator: pip install 'bumpwgpu[compare]'"
        ) from None
    first, second = (_unit(picture).astype(np.float32) for picture in (reference, test))
    errors, mean, _ = flip_evaluator.evaluate(first, second, "LDR", applyMagma=False)
    return float(mean), np.asarray(errors, np.float32).reshape(first.shape[:2])
