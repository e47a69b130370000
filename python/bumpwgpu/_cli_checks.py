"""The commands that check: ``bumpwgpu stress`` and ``bumpwgpu lint``."""

from __future__ import annotations

import math
from enum import Enum
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table

from ._cli_tools import (
    CHECK_FAILED,
    WrapChoice,
    _check_suffix,
    _Json,
    _names,
    _Quiet,
    _session,
    _techniques,
    _Tile,
    _Verbose,
    _WrapOption,
)
from .baking import MAPS
from .frames import TANGENT_METHODS
from .linting import lint as lint_sources
from .stressing import stress as stress_everything

__all__ = ["lint", "stress"]


class ConventionChoice(Enum):
    """Values of --convention."""

    OPENGL = "opengl"
    DIRECTX = "directx"


class SeverityChoice(Enum):
    """Values of --fail-on."""

    ERROR = "error"
    WARNING = "warning"
    INFO = "info"


def stress(
    technique_list: Annotated[
        str, typer.Option("--techniques", help="Searches, with commas between; none.", show_default="all")
    ] = "",
    maps: Annotated[
        str, typer.Option(help="Maps to bake, with commas between; none.", show_default="all")
    ] = "",
    frames: Annotated[
        str, typer.Option(help="Tangent methods, with commas between; none.", show_default="all")
    ] = "",
    only: Annotated[str | None, typer.Option(help="Only cases whose group or name contains this.")] = None,
    gpu: Annotated[
        bool | None,
        typer.Option("--gpu/--cpu", help="Run searches on the device or the processor.", show_default="both"),
    ] = None,
    rays: Annotated[int, typer.Option(help="Rays of a case.", min=8, max=65536)] = 128,
    seed: Annotated[int, typer.Option(help="Fixes rays and maps.", min=0)] = 0,
    rows: Annotated[Path | None, typer.Option(help="Write all rows: .json or .csv.")] = None,
    plot: Annotated[
        Path | None, typer.Option(help="Plot error against angle and offset (.png, .svg, .pdf).")
    ] = None,
    json_output: _Json = False,
    quiet: _Quiet = False,
    verbose: _Verbose = False,
) -> None:
    """Try searches, bakes and tangent frames on what breaks them; exit with 3 if something fails."""
    chosen = [] if technique_list == "none" else _techniques(technique_list) or None
    baked = [] if maps == "none" else _names(maps, MAPS, "map") or None
    methods = [] if frames == "none" else _names(frames, tuple(TANGENT_METHODS), "method") or None
    for path, known in ((plot, (".png", ".svg", ".pdf")), (rows, (".json", ".csv"))):
        if path is not None:
            _check_suffix(path, known)
    with _session(json_output, quiet, verbose) as out:
        with out.progress("stress") as advance:
            result = stress_everything(
                chosen,
                maps=baked,
                frames=methods,
                only=only,
                device="all" if gpu is None else "gpu" if gpu else "cpu",
                rays=rays,
                seed=seed,
                progress=advance,
            )
        files = []
        if rows is not None:
            files.append(result.to_csv(rows) if rows.suffix.lower() == ".csv" else result.to_json(rows))
        if plot is not None:
            files.append(result.plot(plot))
        summary = result.summary()
        out.show(_stress_table(summary if verbose else _worst_of_subjects(summary)))
        out.say(f"{len(result.rows)} checks, {len(result.failures)} failed")
        if gpu is None and chosen != [] and "device" not in result.environment:
            out.say("no Vulkan device answers: searches ran on the processor alone")
        for path in files:
            out.say(str(path))
        out.result(
            {
                "passed": bool(result),
                "checks": len(result.rows),
                "failures": [_jsonable(row) for row in result.failures],
                "summary": [_jsonable(row) for row in summary],
                "environment": result.environment,
                "files": files,
            }
        )
        if not result:
            raise typer.Exit(CHECK_FAILED)


def _worst_of_subjects(summary: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """What failed, and of each subject what came nearest to its limit."""

    def severity(row: dict[str, Any]) -> float:
        return float(row["worst"] / row["limit"]) if 0.0 < row["limit"] < float("inf") else 0.0

    kept: dict[str, dict[str, Any]] = {}
    for row in summary:
        if row["subject"] not in kept or severity(row) > severity(kept[row["subject"]]):
            kept[row["subject"]] = row
    failed = [row for row in summary if not row["passed"]]
    return [*failed, *(row for row in kept.values() if row["passed"])]


def _jsonable(row: dict[str, Any]) -> dict[str, Any]:
    """Infinite numbers as None."""
    return {
        name: None if isinstance(value, float) and not math.isfinite(value) else value
        for name, value in row.items()
    }


def _stress_table(rows: list[dict[str, Any]]) -> Table:
    table = Table(title="worst of each check")
    for heading in ("", "subject", "check"):
        table.add_column(heading)
    for heading in ("worst", "limit"):
        table.add_column(heading, justify="right")
    for heading in ("unit", "where"):
        table.add_column(heading)
    for row in rows:
        where = row["case"] if row["passed"] else f"{row['case']}: {row['where']}"
        table.add_row(
            "pass" if row["passed"] else "FAIL",
            row["subject"],
            row["check"],
            f"{row['worst']:.3g}",
            "-" if row["limit"] == float("inf") else f"{row['limit']:.3g}",
            row["unit"],
            f"{row['group']}, {where}",
        )
    return table


def lint(
    sources: Annotated[
        list[Path] | None,
        typer.Argument(help="Files and folders; names say what they hold, such as rock_normal.png."),
    ] = None,
    height: Annotated[Path | None, typer.Option(help="A height map, whatever its name.")] = None,
    normal: Annotated[Path | None, typer.Option(help="A normal map.")] = None,
    cone: Annotated[Path | None, typer.Option(help="A cone map.")] = None,
    relaxed_cone: Annotated[Path | None, typer.Option(help="A relaxed cone map.")] = None,
    mesh: Annotated[Path | None, typer.Option(help="A mesh: OBJ, glTF or GLB.")] = None,
    convention: Annotated[
        ConventionChoice, typer.Option(help="Which way green should point.")
    ] = ConventionChoice.OPENGL,
    wrap: _WrapOption = WrapChoice.REPEAT,
    scale: Annotated[
        float | None, typer.Option(help="Depth of the relief, mesh units, to hold normals against.", min=0.0)
    ] = None,
    tile_size: _Tile = (1.0, 1.0),
    invert: Annotated[
        bool | None,
        typer.Option("--invert/--no-invert", help="Height maps hold depths.", show_default="by name"),
    ] = None,
    fail_on: Annotated[
        SeverityChoice, typer.Option(help="Exit with 3 if there is a finding as bad as this.")
    ] = SeverityChoice.ERROR,
    json_output: _Json = False,
    quiet: _Quiet = False,
    verbose: _Verbose = False,
) -> None:
    """Find what breaks materials: green channels, 8-bit heights, seams, cones that cut the surface, UVs."""
    given = [*(sources or []), height, normal, cone, relaxed_cone, mesh]
    if not any(given):
        raise typer.BadParameter(
            "nothing to check: give files, folders, --height, --normal, --cone or --mesh"
        )
    with _session(json_output, quiet, verbose) as out:
        report = lint_sources(
            *(sources or []),
            height=height,
            normal=normal,
            cone=cone,
            relaxed_cone=relaxed_cone,
            mesh=mesh,
            convention=convention.value,
            wrap=wrap.value,
            scale=scale,
            tile_size=tile_size,
            invert=invert,
        )
        if verbose:
            for name in report.checked:
                out.say(name)
        out.say(str(report))
        bad = report.worse_than(fail_on.value)
        out.result(
            {
                "checked": report.checked,
                "findings": [finding._asdict() for finding in report.findings],
                "failed": bool(bad),
            }
        )
        if bad:
            raise typer.Exit(CHECK_FAILED)
