"""The command ``bumpwgpu compare``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table

from ._atomic import replace_file
from ._cli_tools import (
    CHECK_FAILED,
    DeviceChoice,
    WrapChoice,
    _Base,
    _Channel,
    _channel,
    _check_suffix,
    _Invert,
    _Json,
    _names,
    _numbers,
    _open_mesh,
    _Quiet,
    _Range,
    _range,
    _Scale,
    _session,
    _techniques,
    _Tile,
    _usage,
    _Verbose,
    _WrapOption,
)
from .compare_result import FORMATS, advice_dict
from .compare_scene import Scene
from .comparing import ELEVATIONS
from .comparing import compare as compare_techniques
from .engines import ENGINES
from .heightmap import HeightMap
from .recommending import LANGUAGES
from .scene import Camera, Light, Material

__all__ = ["compare"]

_ANGLES = ",".join(f"{angle:g}" for angle in ELEVATIONS)
_SHADERS = tuple(f".{language}" for language in LANGUAGES)


def compare(
    source: Annotated[Path, typer.Argument(help="Height map.")],
    technique_list: Annotated[
        str,
        typer.Option(
            "--techniques", help="Which, with commas between.", show_default="all, over step counts"
        ),
    ] = "",
    elevations: Annotated[str, typer.Option(help="View angles above the surface, degrees.")] = _ANGLES,
    device: Annotated[
        DeviceChoice, typer.Option(help="Whose time to take besides the CPU's.")
    ] = DeviceChoice.AUTO,
    max_error: Annotated[float, typer.Option(help="Error budget: texels at p99.", min=0.0)] = 0.5,
    max_time: Annotated[float | None, typer.Option(help="Time budget: nanoseconds a ray.", min=0.0)] = None,
    memory: Annotated[int | None, typer.Option(help="Memory budget: bytes of texture.", min=0)] = None,
    fail_above: Annotated[
        float | None,
        typer.Option(
            help="For CI: exit with 3 if a technique's p99 error, texels, is above this, or if more than 0.1 "
            "% of its rays fail.",
            min=0.0,
        ),
    ] = None,
    formats: Annotated[
        str, typer.Option(help=f"Texture formats to try --techniques with: {', '.join(FORMATS)}.")
    ] = "",
    mips: Annotated[int, typer.Option(help="Also recommend for this many mip levels.", min=0, max=16)] = 0,
    engine: Annotated[
        str, typer.Option(help=f"Also give the recommendation in the words of: {', '.join(ENGINES)}.")
    ] = "",
    shader: Annotated[
        Path | None,
        typer.Option(help=f"Write the recommended search as a shader: {', '.join(_SHADERS)}."),
    ] = None,
    rays: Annotated[int, typer.Option(help="Rays at each elevation.", min=1)] = 8192,
    repeats: Annotated[int, typer.Option(help="Timed repeats.", min=1)] = 5,
    seed: Annotated[int, typer.Option(help="Fixes the rays.", min=0)] = 0,
    mesh: Annotated[
        str, typer.Option(help="Compare on this mesh: quad, cube, sphere, torus or a file. Needs a device.")
    ] = "",
    eye: Annotated[
        list[str] | None,
        typer.Option(
            help="With --mesh: where the camera is, x,y,z. Given again, a path.", show_default="0,-1.2,0.8"
        ),
    ] = None,
    target: Annotated[str, typer.Option(help="With --mesh: what it looks at.")] = "0,0,0",
    size: Annotated[tuple[int, int], typer.Option(help="With --mesh: width and height, pixels.", min=1)] = (
        512,
        512,
    ),
    report: Annotated[Path | None, typer.Option(help="Write an HTML page.")] = None,
    plot: Annotated[
        Path | None, typer.Option(help="Write a plot (.png, .svg, .pdf); needs matplotlib.")
    ] = None,
    rows: Annotated[Path | None, typer.Option(help="Write all rows: .json or .csv.")] = None,
    scale: _Scale = 0.1,
    base: _Base = 1.0,
    tile_size: _Tile = (1.0, 1.0),
    wrap: _WrapOption = WrapChoice.REPEAT,
    channel: _Channel = None,
    invert: _Invert = False,
    height_range: _Range = None,
    json_output: _Json = False,
    quiet: _Quiet = False,
    verbose: _Verbose = False,
) -> None:
    """Measure what each technique costs and how wrong it is, and recommend one."""
    chosen = _techniques(technique_list) or None
    angles = _numbers(elevations, "--elevations")
    if not all(0.0 < angle <= 90.0 for angle in angles):
        raise typer.BadParameter(f"--elevations must be above 0 and at most 90 degrees, got {elevations}")
    span = _range(height_range)
    cameras = [
        _usage(Camera.look_at, _numbers(place, "--eye", 3), _numbers(target, "--target", 3))
        for place in eye or ["0,-1.2,0.8"]
    ]
    stored = _names(formats, FORMATS, "format") or None
    if stored and chosen is None:
        raise typer.BadParameter("--formats go with --techniques; without, formats are tried by themselves")
    if engine:
        _names(engine, ENGINES, "engine")
    for path, known in ((plot, (".png", ".svg", ".pdf")), (shader, _SHADERS), (rows, (".json", ".csv"))):
        if path is not None:
            _check_suffix(path, known)
    with _session(json_output, quiet, verbose) as out:
        heights = HeightMap(
            source,
            scale=scale,
            base=base,
            tile_size=tile_size,
            wrap=wrap.value,
            channel=_channel(channel),
            invert=invert,
            height_range=span,
        )
        subject: HeightMap | Scene = heights
        if mesh:
            light = Light.directional((-0.6, -0.7, -0.9))
            subject = Scene(_open_mesh(mesh), Material(height=heights), tuple(cameras), (light,), size)
        with out.progress("comparing") as advance:
            result = compare_techniques(
                subject,
                chosen,
                elevations=angles,
                formats=stored,
                device=device.value,
                rays=rays,
                repeats=repeats,
                seed=seed,
                progress=advance,
            )
        budget: dict[str, Any] = {"max_time": max_time, "memory": memory}
        advice = result.recommend(max_error, **budget)
        by_mip = []
        if mips:
            with out.progress("mips") as advance:
                by_mip = result.recommend_by_mip(max_error, levels=mips, progress=advance, **budget)
        files = []
        if report is not None:
            files.append(result.report(report))
        if plot is not None:
            files.append(result.plot(plot))
        if rows is not None:
            files.append(result.to_csv(rows) if rows.suffix.lower() == ".csv" else result.to_json(rows))
        if shader is not None and advice:
            language: Any = shader.suffix.lower()[1:]
            files.append(replace_file(shader, advice.shader(language).encode()))
        listed = result.select("all") if verbose else result.pareto()
        out.show(_table(listed, result.timed_on))
        out.say(str(advice))
        for part in by_mip:
            out.say(f"mip {part.level}, from {part.distance():.3g} mesh units on: {part.recommendation}")
        if engine and advice:
            out.say(str(advice.settings(engine)))  # type: ignore[arg-type]
        for path in files:
            out.say(str(path))
        above = [] if fail_above is None else result.exceeding(fail_above)
        for row in above:
            out.warn(
                f"{row['label']}: p99 error {row['uv_error_p99_texels']:.3g} texels, "
                f"{row['failure_rate']:.2%} failing; allowed: {fail_above:g}, 0.10%"
            )
        out.result(
            {
                **{name: value for name, value in advice_dict(advice).items() if name != "technique"},
                "recommendation": advice.technique,
                "timed_on": result.timed_on,
                "pareto": [row["label"] for row in result.pareto()],
                "by_mip": [
                    {"level": part.level, "size": part.size, **advice_dict(part.recommendation)}
                    for part in by_mip
                ],
                "settings": dict(advice.settings(engine).values) if engine and advice else None,  # type: ignore[arg-type]
                "above": [row["label"] for row in above],
                "rows": result.rows,
                "dropped": result.dropped,
                "files": files,
            }
        )
        if above:
            raise typer.Exit(CHECK_FAILED)


def _table(rows: list[dict[str, Any]], timed_on: str) -> Table:
    table = Table(title="time against error, all elevations")
    table.add_column("technique")
    for heading in (f"ns/ray ({timed_on})", "p99 texels", "max texels", "failing", "KiB"):
        table.add_column(heading, justify="right")
    if any(row.get("tied_with") for row in rows):
        table.add_column("time tied with")
    for row in rows:
        errors = (row["uv_error_p99_texels"], row["uv_error_max_texels"])
        table.add_row(
            row["label"],
            f"{row[f'time_{timed_on}_ns_per_ray']:.1f}",
            *("-" if error is None else f"{error:.3g}" for error in errors),
            f"{row['failure_rate']:.2%}",
            f"{row['memory_bytes'] / 1024:.4g}",
            *([", ".join(row["tied_with"])] if "tied_with" in row else []),
        )
    return table
