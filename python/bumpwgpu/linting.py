"""Finds what breaks materials before a renderer shows it: in height, normal and cone maps, and in meshes."""

from __future__ import annotations

import itertools
import json
import os
import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, NamedTuple, TypeAlias

from ._atomic import replace_file
from ._checks import choice, number
from ._lint_maps import alpha_heights, cone_findings, height_findings, normal_findings, unreadable
from ._lint_mesh import inside_one_tile, mesh_findings
from .errors import BumpError
from .heightmap import HeightMap, Wrap, checked_extent
from .meshes import Mesh

__all__ = ["CODES", "Finding", "LintReport", "lint"]

Severity: TypeAlias = Literal["error", "warning", "info"]
SEVERITIES: tuple[Severity, ...] = ("error", "warning", "info")

#: What can be found, and why it matters.
CODES: dict[str, str] = {
    "unreadable": "the file cannot be read as what it should be",
    "unknown-role": "the name does not say what the file holds",
    "srgb-tagged": "data tagged as colour is bent by every viewer and importer that believes the tag",
    "lossy": "compression for photographs leaves blocks that light up as bumps",
    "several-pictures": "faces of a cube map, members of an array and slices of a volume are not looked at",
    "8-bit-heights": "256 levels show as terraces on anything smooth",
    "flat-heights": "there is no relief",
    "unused-range": "most of the levels are not used",
    "tile-seam": "the map is repeated but its edges do not meet",
    "wrong-green": "light comes from below: green points the other way",
    "swapped-channels": "red and green are exchanged",
    "undecided-green": "nothing tells which way green points",
    "non-unit": "vectors are not of length 1, which darkens or brightens",
    "inward": "vectors point into the surface",
    "height-mismatch": "normals and heights are of different surfaces",
    "inverted-heights": "the heights are depths: bumps go in",
    "scale-mismatch": "normals were made for another depth of the relief",
    "data-in-alpha": "an alpha channel that nobody expects is dropped, or its data lost in compression",
    "size-mismatch": "maps that belong together differ in size",
    "non-conservative-cone": "cones cut the surface: searches by them jump over features",
    "no-uvs": "there are no texture coordinates",
    "degenerate-uvs": "triangles without area in UV have no tangents",
    "uv-density-jump": "texels change size from one triangle to the next",
    "mirrored-seam-tangents": "tangents are shared across a mirrored seam, where they cancel out",
    "wrong-handedness": "stored tangents point the bitangent down the image",
    "bad-tangents": "stored tangents are not of unit length, upright and finite",
    "tangent-space": "stored tangents are far from MikkTSpace, for which normals are baked",
}

_IMAGES = (".png", ".tif", ".tiff", ".exr", ".jpg", ".jpeg", ".webp", ".bmp", ".tga", ".dds", ".npy")
_MESHES = (".obj", ".gltf", ".glb")
_OTHER = frozenset(
    (
        *("albedo", "basecolor", "color", "colour", "diffuse", "diff", "col", "ao", "occlusion", "mask"),
        *("roughness", "rough", "metallic", "metalness", "metal", "specular", "spec", "gloss", "opacity"),
        *("emissive", "orm", "arm", "occlusionroughmetal"),
    )
)
#: Normals with heights in the alpha channel.
_WITH_HEIGHTS = frozenset({"nh", "normalheight", "normheight", "normaldisp", "normaldisplacement"})
_ROLES: tuple[tuple[str, frozenset[str]], ...] = (
    (
        "normal",
        frozenset({"normal", "normals", "nrm", "nor", "norm", "normalgl", "normaldx", "ddn", *_WITH_HEIGHTS}),
    ),
    ("relaxed_cone", frozenset({"relaxedcone"})),
    ("cone", frozenset({"cone", "cones"})),
    (
        "height",
        frozenset(
            (
                *("height", "heights", "heightmap", "heightfield", "displacement", "disp", "bump", "depth"),
                *("elevation", "dem"),
            )
        ),
    ),
    ("other", _OTHER),
)
#: What a last word of one letter says, as in rock-h.
_LETTERS = {"h": "height", "n": "normal", "d": "other"}


class Finding(NamedTuple):
    """One thing that is wrong, or could be.

    Attributes
    ----------
    code : str
        A key of ``CODES`` in the module ``bumpwgpu.linting``.
    severity : {"error", "warning", "info"}
        "error": it shows; "warning": it may; "info": worth knowing.
    subject : str
        The file, or what was passed.
    message : str
        What was found, with figures.
    fix : str
        What helps.
    """

    code: str
    severity: Severity
    subject: str
    message: str
    fix: str

    def __str__(self) -> str:
        return f"{self.subject}: {self.severity}: {self.message} [{self.code}]. {self.fix}"


@dataclass(frozen=True)
class LintReport:
    """What was found. True in a condition when there is no error.

    Attributes
    ----------
    findings : list of Finding
        Errors first.
    checked : list of str
        What was looked at, with the role it was taken for.
    """

    findings: list[Finding]
    checked: list[str]

    def __bool__(self) -> bool:
        return not any(finding.severity == "error" for finding in self.findings)

    def __str__(self) -> str:
        counts = [
            f"{sum(finding.severity == severity for finding in self.findings)} {severity}s"
            for severity in SEVERITIES[:2]
        ]
        return "\n".join([*map(str, self.findings), f"{len(self.checked)} checked: {', '.join(counts)}"])

    def worse_than(self, severity: Severity) -> list[Finding]:
        """The findings of this severity and worse.

        Parameters
        ----------
        severity : {"error", "warning", "info"}
            The least that counts.

        Returns
        -------
        list of Finding

        Raises
        ------
        ValueError
            No such severity.
        """
        choice("severity", severity, SEVERITIES)
        counted = SEVERITIES[: SEVERITIES.index(severity) + 1]
        return [finding for finding in self.findings if finding.severity in counted]

    def to_json(self, path: str | os.PathLike[str]) -> Path:
        """Write the findings as JSON.

        Parameters
        ----------
        path : path
            The file; replaced whole or not at all.

        Returns
        -------
        Path

        Raises
        ------
        FileNotFoundError
            The folder does not exist.
        """
        data = {"checked": self.checked, "findings": [finding._asdict() for finding in self.findings]}
        return replace_file(path, json.dumps(data, indent=1, ensure_ascii=False).encode())


class _Part(NamedTuple):
    """Something to look at."""

    role: str
    source: Any
    subject: str
    #: Files of one folder whose names differ in the role alone belong together.
    family: tuple[str, str]
    words: frozenset[str]


def lint(
    *sources: str | os.PathLike[str],
    height: Any = None,
    normal: Any = None,
    cone: Any = None,
    relaxed_cone: Any = None,
    mesh: Any = None,
    convention: Literal["opengl", "directx"] = "opengl",
    wrap: Wrap = "repeat",
    scale: float | None = None,
    tile_size: float | tuple[float, float] = (1.0, 1.0),
    invert: bool | None = None,
) -> LintReport:
    """Find what breaks materials: wrong green channels, 8-bit heights, seams, cones that cut the surface, ...

    Parameters
    ----------
    *sources : path
        Files and folders. What a file holds is read off its name, such as ``rock_normal.png`` and
        ``rock_height.png``, or ``rock_nh.dds`` for normals with heights in alpha; files whose names
        differ in that alone are checked against each other.
    height, normal, cone, relaxed_cone : path, array, PIL image or None
        Maps that belong together, whatever their names.
    mesh : Mesh, path or None
        A mesh: its UVs and the tangents stored with it.
    convention : {"opengl", "directx"}
        Which way green should point. A file name that says so (``_gl``, ``_dx``) goes before.
    wrap : {"repeat", "clamp", "mirror"}
        How maps are used: seams matter for "repeat".
    scale : float or None
        Height range in mesh units that the relief is drawn with; None does not compare it with the
        normals.
    tile_size : float or (float, float), default (1, 1)
        Mesh units covered by one tile.
    invert : bool or None
        Whether height maps hold depths; None reads it off the name (``_depth``).

    Returns
    -------
    LintReport
        ``CODES`` in the module ``bumpwgpu.linting`` says what each code means.

    Raises
    ------
    FileNotFoundError
        A source does not exist.
    ValueError, TypeError
        Nothing to look at, or a setting of the wrong kind.

    Examples
    --------
    >>> import bumpwgpu as bw
    >>> wall = bw.HeightMap.procedural("fbm", 64)
    >>> green_down = bw.bake(wall, convention="directx")["normal"]
    >>> [finding.code for finding in bw.lint(normal=green_down, height=wall.array).findings]
    ['wrong-green']
    """
    choice("convention", convention, ("opengl", "directx"))
    choice("wrap", wrap, ("repeat", "clamp", "mirror"))
    depth = None if scale is None else number("scale", scale, 0.0)
    _, _, tile = checked_extent(0.1, 1.0, tile_size)
    if invert is not None and not isinstance(invert, bool):
        raise TypeError(f"invert must be True, False or None, got {type(invert).__name__}")
    parts = [part for source in sources for part in _found(source)]
    named = {"height": height, "normal": normal, "cone": cone, "relaxed_cone": relaxed_cone, "mesh": mesh}
    parts += [_given(role, source) for role, source in named.items() if source is not None]
    in_alpha = [part for part in parts if part.role == "normal" and part.words & _WITH_HEIGHTS]
    parts += [part._replace(role="alpha height", subject=f"{part.subject}, alpha") for part in in_alpha]
    if not parts:
        raise ValueError("nothing to check: give files, folders, or height=, normal=, cone=, mesh=")
    settings = {"convention": convention, "wrap": wrap, "scale": depth, "tile_size": tile, "invert": invert}
    findings: list[Finding] = []
    heights: dict[tuple[str, str], HeightMap] = {}
    # Maps beside a mesh whose UVs stay inside one tile need not tile.
    charts = {part.family[0] for part in parts if part.role == "mesh" and inside_one_tile(part.source)}
    # Heights first: the other maps are held against them.
    order = {"height": 0, "alpha height": 1}
    for part in sorted(parts, key=lambda part: order.get(part.role, 2)):
        for code, severity, message, fix in _check(part, settings, heights):
            if code == "tile-seam" and severity == "error" and part.family[0] in charts:
                severity, message = "warning", f"{message}; the mesh beside it stays inside one tile"
            findings.append(Finding(code, severity, part.subject, message, fix))
    findings.sort(key=lambda finding: SEVERITIES.index(finding.severity))
    return LintReport(findings, [f"{part.subject} ({part.role})" for part in parts])


def _check(part: _Part, settings: dict[str, Any], heights: dict[tuple[str, str], HeightMap]) -> Iterable[Any]:
    if part.role == "mesh":
        return mesh_findings(part.source)
    if part.role == "unknown":
        fix = "Pass it as height=, normal=, cone= or mesh=, or name it for what it holds."
        return [("unknown-role", "info", "its name does not say what it holds", fix)]
    if part.role == "other":
        return []
    wrap, tile = settings["wrap"], settings["tile_size"]
    if part.role in ("height", "alpha height"):
        source = part.source
        if part.role != "height":
            try:
                source = alpha_heights(source)
            except (BumpError, ValueError, TypeError, OSError) as error:
                return [unreadable(error)]
        inverted = "depth" in part.words if settings["invert"] is None else settings["invert"]
        found, checked = height_findings(source, wrap, tile, inverted)
        if checked is not None:
            # Heights that are given go before those in the alpha channel, which come later.
            heights.setdefault(part.family, checked)
        return found
    partner = _partner(part, heights)
    if part.role == "normal":
        says = {"opengl": {"gl", "opengl", "normalgl"}, "directx": {"dx", "directx", "normaldx"}}
        wanted = next((name for name, words in says.items() if words & part.words), settings["convention"])
        in_alpha = bool(part.words & _WITH_HEIGHTS)
        return normal_findings(part.source, partner, wanted, wrap, settings["scale"], in_alpha)
    return cone_findings(part.source, part.role, partner)


def _partner(part: _Part, heights: dict[tuple[str, str], HeightMap]) -> HeightMap | None:
    """Heights of the same family, or the only ones in the folder."""
    if part.family in heights:
        return heights[part.family]
    beside = [checked for (folder, _), checked in heights.items() if folder == part.family[0]]
    return beside[0] if len(beside) == 1 else None


def _found(source: Any) -> list[_Part]:
    """What a file or folder holds."""
    if not isinstance(source, str | os.PathLike):
        raise TypeError(
            f"sources must be paths, got {type(source).__name__}; pass arrays as height=, normal=, ..."
        )
    path = Path(source)
    if path.is_dir():
        inside = sorted(path.rglob("*"))
        files = [file for file in inside if file.suffix.lower() in (*_IMAGES, *_MESHES) and file.is_file()]
        return [part for part in map(_part, files) if part.role != "unknown"]
    if not path.is_file():
        raise FileNotFoundError(f"there is no file {path}")
    return [_part(path)]


def _part(path: Path) -> _Part:
    if path.suffix.lower() in _MESHES:
        return _Part("mesh", path, str(path), (str(path.parent), path.stem), frozenset())
    # rock_NormalGL, rock-normal, RockNormal
    words = re.findall(r"[A-Z]{2,}(?![a-z])|[A-Z]?[a-z]+|[0-9]+", path.stem)
    lowered = [word.lower() for word in words]
    joined = {first + second for first, second in itertools.pairwise(lowered)}
    for role, names in _ROLES:
        if names & {*lowered, *joined}:
            said = [word for word in lowered if word not in names and word not in ("gl", "dx", "relaxed")]
            family = "_".join(said)
            return _Part(role, path, str(path), (str(path.parent), family), frozenset({*lowered, *joined}))
    if len(lowered) > 1 and lowered[-1] in _LETTERS:
        kept = (str(path.parent), "_".join(lowered[:-1]))
        return _Part(_LETTERS[lowered[-1]], path, str(path), kept, frozenset(lowered))
    return _Part("unknown", path, str(path), (str(path.parent), path.stem), frozenset(lowered))


def _given(role: str, source: Any) -> _Part:
    family = ("", "given")
    if isinstance(source, str | os.PathLike):
        path = Path(source)
        if not path.is_file():
            raise FileNotFoundError(f"there is no file {path}")
        return _Part(role, path, str(path), family, _part(path).words)
    if role == "mesh" and not isinstance(source, Mesh):
        raise TypeError(f"mesh must be a Mesh or a path, got {type(source).__name__}")
    return _Part(role, source, role, family, frozenset())
