"""What bumpwgpu raises and warns.

Wrong values raise ``ValueError``, wrong types ``TypeError``, missing files ``FileNotFoundError``;
everything that is wrong with an asset or a device raises one of the classes below.
"""

from __future__ import annotations

from ._bumpwgpu import BakeError, BumpError, CompareError, MeshError, RenderError

__all__ = ["BakeError", "BumpError", "BumpWarning", "CompareError", "MeshError", "RenderError"]


class BumpWarning(UserWarning):
    """Something in an asset or a setting deserves a look: a lossy height map, an option without effect."""
