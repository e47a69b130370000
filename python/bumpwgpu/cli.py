"""The command line: ``bumpwgpu bake | render | compare | stress | lint | info``."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from . import __version__
from ._atomic import replace_file
from ._cli_bake import MESH_SUFFIXES, bake
from ._cli_checks import lint, stress
from ._cli_compare import compare
from ._cli_tools import (
    WrapChoice,
    _Base,
    _Channel,
    _channel,
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
    _technique,
    _Tile,
    _usage,
    _Verbose,
    _WrapOption,
)
from .heightmap import HeightMap
from .rendering import AOVS
from .rendering import render as render_frame
from .scene import Camera, Light, Material
from .system import info as system_info

__all__ = ["app", "main"]

app = typer.Typer(
    name="bumpwgpu",
    help="Bake, render and compare surface detail from height maps.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


app.command()(bake)


@app.command()
def render(
    source: Annotated[
        Path | None, typer.Argument(help="Height map, or a mesh file with its own materials.")
    ] = None,
    mesh: Annotated[
        str, typer.Option(help="quad, cube, sphere, torus, or a file: OBJ, glTF, GLB.", show_default="quad")
    ] = "",
    technique: Annotated[
        str, typer.Option(help="For example relief or 'relief(linear=16,refine=8)'.")
    ] = "relief",
    output: Annotated[Path, typer.Option("-o", "--output", help="The picture.")] = Path("render.png"),
    albedo: Annotated[Path | None, typer.Option(help="Colour image, sRGB.")] = None,
    normal: Annotated[Path | None, typer.Option(help="Normal map, +Y up.")] = None,
    specular: Annotated[float, typer.Option(help="Strength of the highlight.", min=0.0, max=1.0)] = 0.3,
    shininess: Annotated[float, typer.Option(help="Exponent of the highlight.", min=1.0, max=10000.0)] = 32.0,
    size: Annotated[tuple[int, int], typer.Option(help="Width and height, pixels.", min=1)] = (512, 512),
    eye: Annotated[str | None, typer.Option(help="Where the camera is: x,y,z.")] = None,
    target: Annotated[str, typer.Option(help="What it looks at: x,y,z.")] = "0,0,0",
    fov_y: Annotated[float, typer.Option(help="Vertical field of view, degrees.", min=0.1, max=179.0)] = 45.0,
    light: Annotated[
        list[str] | None, typer.Option(help="Direction a light travels in: x,y,z. May be given again.")
    ] = None,
    shadows: Annotated[
        bool | None, typer.Option(help="Self-shadowing.", show_default="where the technique can")
    ] = None,
    silhouettes: Annotated[
        bool, typer.Option("--silhouettes", help="Outlines, depth and shadows of displacement, with exact.")
    ] = False,
    aovs: Annotated[
        str, typer.Option(help=f"Further outputs, as npy beside the picture: {', '.join(AOVS)}.")
    ] = "",
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
    """Draw a mesh with a relief. Needs a Vulkan device; Mesa's lavapipe is one in software."""
    chosen = _technique(technique)
    outputs = _names(aovs, AOVS, "output")
    span = _range(height_range)
    camera = None
    if eye is not None:
        camera = _usage(
            Camera.look_at, _numbers(eye, "--eye", 3), _numbers(target, "--target", 3), fov_y=fov_y
        )
    lights = [_usage(Light.directional, _numbers(part, "--light", 3)) for part in light or []]
    own = source is not None and source.suffix.lower() in MESH_SUFFIXES
    if own and mesh:
        raise typer.BadParameter("SOURCE is a mesh already; give --mesh a mesh only with a height map")
    if source is None and not mesh:
        raise typer.BadParameter("nothing to draw: give a height map, a mesh file, or --mesh")
    with _session(json_output, quiet, verbose) as out:
        shape = _open_mesh(str(source) if own else mesh or "quad")
        heights = None
        if source is not None and not own:
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
        material = None
        if heights is not None or albedo is not None or normal is not None:
            material = Material(
                height=heights, albedo=albedo, normal=normal, specular=specular, shininess=shininess
            )
        with out.progress("rendering"):
            frame = render_frame(
                shape,
                material,
                camera=camera,
                lights=lights or None,
                technique=chosen,
                size=size,
                shadows=shadows,
                silhouettes=silhouettes,
                aovs=outputs,
            )
        files = [frame.save(output), *_save_aovs(frame.aovs, output)]
        for path in files:
            out.say(str(path))
        if verbose:
            out.say(", ".join(f"{name} {value}" for name, value in frame.stats.items()))
        out.result({"technique": repr(chosen), "files": files, "stats": frame.stats})


def _save_aovs(aovs: dict[str, Any], output: Path) -> list[Path]:
    from io import BytesIO

    import numpy as np

    made = []
    for name, values in aovs.items():
        data = BytesIO()
        np.save(data, values, allow_pickle=False)
        made.append(replace_file(output.with_name(f"{output.stem}_{name}.npy"), data.getvalue()))
    return made


app.command()(compare)
app.command()(stress)
app.command()(lint)


@app.command()
def info(json_output: _Json = False, quiet: _Quiet = False, verbose: _Verbose = False) -> None:
    """Show versions, Vulkan devices and the processor."""
    with _session(json_output, quiet, verbose) as out:
        found = system_info()
        out.say(f"bumpwgpu {found['version']}, Python {found['python']}, NumPy {found['numpy']}")
        out.say(f"{found['platform']}, {found['threads']} threads, {found['simd']}")
        for adapter in found["adapters"]:
            out.say(f"{adapter['name']} ({adapter['kind']}; {adapter['driver_info']})")
        if not found["adapters"]:
            out.say("no Vulkan device: bake, march and compare work, render does not")
        if verbose:
            out.say(f"techniques: {', '.join(found['techniques'])}")
        out.result(found)


def _version(wanted: bool) -> None:
    if wanted:
        sys.stdout.write(f"bumpwgpu {__version__}\n")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Bake, render and compare surface detail from height maps."""


def main() -> None:
    """Entry point of the command ``bumpwgpu``."""
    app()
