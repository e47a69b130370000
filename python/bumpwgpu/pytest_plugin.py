"""A pytest fixture that holds hits, normals, heights and pictures to what they were.

The package registers it, so ``bump_regression`` is there wherever bumpwgpu is installed:

.. code-block:: python

    def test_wall(bump_regression):
        wall = bw.HeightMap("wall.png")
        bump_regression.hits("view", bw.march(wall, origins, directions, "relief"), wall.shape, texels=0.1)
        bump_regression.normals("normal", bw.bake(wall)["normal"], degrees=0.5)

Goldens lie beside the test in ``bump_goldens/`` and are written by ``pytest --bump-update`` only.
"""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

__all__ = ["BumpRegression", "bump_regression"]

_FOLDER = "bump_goldens"


def pytest_addoption(parser: pytest.Parser) -> None:
    """Adds ``--bump-update``."""
    group = parser.getgroup("bumpwgpu")
    group.addoption(
        "--bump-update", action="store_true", help="write the goldens of bump_regression instead of checking"
    )


@pytest.fixture
def bump_regression(request: pytest.FixtureRequest) -> BumpRegression:
    """Holds results to goldens; see :class:`BumpRegression`."""
    test = re.sub(r"[^\w.-]+", "-", request.node.name)
    folder = request.path.parent / _FOLDER / request.path.stem
    return BumpRegression(folder, test, bool(request.config.getoption("--bump-update")))


class BumpRegression:
    """Compares results with goldens, in texels and degrees, and fails the test where they differ.

    Parameters
    ----------
    folder : Path
        Where goldens lie.
    test : str
        First part of their names.
    update : bool
        Write them instead of checking.
    """

    def __init__(self, folder: Path, test: str, update: bool) -> None:
        self._folder, self._test, self._update = folder, test, update
        self._used: set[str] = set()

    def hits(
        self,
        name: str,
        hits: Any,
        shape: tuple[int, int],
        *,
        texels: float = 0.1,
        degrees: float = 1.0,
        share: float = 0.0,
    ) -> None:
        """Check hits of `march`: where they are, which way the surface faces, and which rays have none.

        Parameters
        ----------
        name : str
            Name of the golden within the test.
        hits : Hits
            With "uv" and "status"; normals are checked where they are there.
        shape : (int, int)
            Rows and columns of the height map, for distances in texels.
        texels : float, default 0.1
            Largest distance of a hit.
        degrees : float, default 1.0
            Largest angle of a normal.
        share : float, default 0
            Share of rays that may exceed either, or hit where none did, 0..1.

        Raises
        ------
        AssertionError
            More than that.
        """
        now = {key: np.asarray(getattr(hits, key)) for key in ("uv", "status")}
        if "normal" in hits.outputs:
            now["normal"] = np.asarray(hits.normal)
        golden = self._golden(name, now)
        if golden is None:
            return
        both = (now["status"] == 0) & (golden["status"] == 0)
        away = _distance(now["uv"], golden["uv"], shape)
        bad = np.where(both, away > texels, now["status"] != golden["status"])
        worst = {"texels": _largest(away[both])}
        if "normal" in now and "normal" in golden:
            angle = _angle(now["normal"], golden["normal"])
            bad |= both & (angle > degrees)
            worst["degrees"] = _largest(angle[both])
        self._judge(name, bad, worst, {"texels": texels, "degrees": degrees}, share)

    def normals(self, name: str, normals: Any, *, degrees: float = 0.5, share: float = 0.0) -> None:
        """Check a normal map.

        Parameters
        ----------
        name : str
            Name of the golden within the test.
        normals : array_like, (..., 3)
            Vectors of any length but zero.
        degrees : float, default 0.5
            Largest angle.
        share : float, default 0
            Share of texels that may exceed it, 0..1.

        Raises
        ------
        AssertionError
            More than that.
        """
        now = {"normal": np.asarray(normals, np.float32)}
        golden = self._golden(name, now)
        if golden is not None:
            angle = _angle(now["normal"], golden["normal"])
            self._judge(name, ~(angle <= degrees), {"degrees": _largest(angle)}, {"degrees": degrees}, share)

    def values(self, name: str, values: Any, *, tolerance: float = 1e-4, share: float = 0.0) -> None:
        """Check numbers: heights, cones, occlusion, or any array.

        Parameters
        ----------
        name : str
            Name of the golden within the test.
        values : array_like
            Any shape.
        tolerance : float, default 1e-4
            Largest difference.
        share : float, default 0
            Share of values that may exceed it, 0..1.

        Raises
        ------
        AssertionError
            More than that.
        """
        now = {"values": np.asarray(values, np.float32)}
        golden = self._golden(name, now)
        if golden is not None:
            off = np.abs(now["values"].astype(np.float64) - golden["values"])
            self._judge(name, ~(off <= tolerance), {"value": _largest(off)}, {"value": tolerance}, share)

    def frame(
        self,
        name: str,
        frame: Any,
        shape: tuple[int, int] | None = None,
        *,
        levels: float = 4.0,
        texels: float = 0.5,
        degrees: float = 2.0,
        share: float = 0.01,
    ) -> None:
        """Check a rendered picture, and its "uv" and "normal" outputs where it has them.

        Parameters
        ----------
        name : str
            Name of the golden within the test.
        frame : Frame
            Of `render`.
        shape : (int, int) or None
            Rows and columns of the height map; None leaves "uv" out.
        levels : float, default 4
            Largest difference of a colour, of 255.
        texels : float, default 0.5
            Largest distance of a texture coordinate.
        degrees : float, default 2
            Largest angle of a normal.
        share : float, default 0.01
            Share of pixels that may exceed any: edges move by a rounding.

        Raises
        ------
        AssertionError
            More than that.
        """
        now = {"color": np.asarray(frame.color)}
        for key in ("uv", "normal"):
            if key in frame.aovs and (key != "uv" or shape is not None):
                now[key] = np.asarray(frame.aovs[key])
        golden = self._golden(name, now)
        if golden is None:
            return
        off = np.abs(now["color"].astype(np.int64) - golden["color"]).max(axis=-1)
        bad, worst = off > levels, {"levels": _largest(off)}
        if "uv" in now and "uv" in golden and shape is not None:
            away = np.nan_to_num(_distance(now["uv"], golden["uv"], shape), nan=0.0)
            bad |= away > texels
            worst["texels"] = _largest(away)
        if "normal" in now and "normal" in golden:
            there = (np.linalg.norm(now["normal"], axis=-1) > 0.5) & (
                np.linalg.norm(golden["normal"], axis=-1) > 0.5
            )
            angle = np.where(there, _angle(now["normal"], golden["normal"]), 0.0)
            bad |= angle > degrees
            worst["degrees"] = _largest(angle)
        limits = {"levels": levels, "texels": texels, "degrees": degrees}
        self._judge(name, bad, worst, limits, share)

    def _golden(self, name: str, now: dict[str, NDArray[Any]]) -> dict[str, NDArray[Any]] | None:
        """What was there; None when it was just written."""
        if not re.fullmatch(r"[\w.-]+", name):
            raise ValueError(f"name must be letters, digits, '_', '-' and '.', got {name!r}")
        if name in self._used:
            raise ValueError(f"{name!r} is checked twice in this test: each golden needs a name of its own")
        self._used.add(name)
        path = self._folder / f"{self._test}--{name}.npz"
        if self._update:
            from ._atomic import replace_file

            self._folder.mkdir(parents=True, exist_ok=True)
            buffer = io.BytesIO()
            np.savez_compressed(buffer, **now)  # type: ignore[arg-type]
            replace_file(path, buffer.getvalue())
            return None
        if not path.is_file():
            pytest.fail(f"there is no golden {path}; write it with pytest --bump-update", pytrace=False)
        with np.load(path, allow_pickle=False) as data:
            golden = {key: data[key] for key in data.files}
        for key, values in now.items():
            if key in golden and golden[key].shape != values.shape:
                pytest.fail(
                    f"{name}: {key} has shape {values.shape}, and the golden {golden[key].shape}",
                    pytrace=False,
                )
        return golden

    def _judge(
        self,
        name: str,
        bad: NDArray[np.bool_],
        worst: dict[str, float],
        limits: dict[str, float],
        share: float,
    ) -> None:
        found = float(bad.mean()) if bad.size else 0.0
        if found <= share:
            return
        first = tuple(int(part) for part in np.argwhere(bad)[0])
        figures = ", ".join(f"{value:.4g} {unit} (allowed {limits[unit]:g})" for unit, value in worst.items())
        pytest.fail(
            f"{name} differs from its golden: {found:.2%} beyond tolerance, {share:.2%} allowed; worst "
            f"{figures}; first at {first}",
            pytrace=False,
        )


def _distance(now: NDArray[Any], golden: NDArray[Any], shape: tuple[int, int]) -> NDArray[np.float64]:
    """Between texture coordinates, texels; whole tiles do not count."""
    off = now.astype(np.float64) - golden
    off -= np.round(off)
    distance: NDArray[np.float64] = np.hypot(off[..., 0] * shape[1], off[..., 1] * shape[0])
    return distance


def _angle(now: NDArray[Any], golden: NDArray[Any]) -> NDArray[np.float64]:
    """Between directions, degrees, sharp for small ones too."""
    a, b = (vectors.astype(np.float64) for vectors in (now, golden))
    with np.errstate(invalid="ignore", divide="ignore"):
        a, b = (vectors / np.linalg.norm(vectors, axis=-1, keepdims=True) for vectors in (a, b))
    apart, together = np.linalg.norm(a - b, axis=-1), np.linalg.norm(a + b, axis=-1)
    angle: NDArray[np.float64] = np.degrees(2.0 * np.arctan2(apart, together))
    return angle


def _largest(values: NDArray[Any]) -> float:
    return float(values.max()) if values.size else 0.0
