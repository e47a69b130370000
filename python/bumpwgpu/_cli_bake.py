"""The command that bakes: ``bumpwgpu bake``."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from enum import Enum
from pathlib import Path
from typing import Annotated, Any

import typer

from ._cli_tools import (
    WrapChoice,
    _Base,
    _Channel,
    _channel,
    _Invert,
    _Json,
    _names,
    _Output,
    _Quiet,
    _Range,
    _range,
    _Scale,
    _session,
    _Tile,
    _usage,
    _Verbose,
    _WrapOption,
)
from ._map_info import MAPS as MAP_INFO
from ._map_info import OPTIONS, MapOption
from .baking import MAPS
from .baking import bake as bake_maps
from .baking import bake_file as bake_map_file
from .heightmap import HeightMap
from .mesh_maps import MESH_MAPS, MeshMaps

__all__ = ["MESH_SUFFIXES", "bake"]

#: Files that hold a mesh.
MESH_SUFFIXES = (".obj", ".gltf", ".glb")


class FormatChoice(Enum):
    """Values of --format."""

    PNG = "png"
    TIFF = "tiff"
    EXR = "exr"
    NPY = "npy"


class BitsChoice(Enum):
    """Values of --bits."""

    EIGHT = "8"
    SIXTEEN = "16"
    THIRTY_TWO = "32"


class SpaceChoice(Enum):
    """Values of --space."""

    TANGENT = "tangent"
    OBJECT = "object"


def _map_option(name: str, text: str) -> Any:
    """The value of a map's option out of the words of a command."""
    option = OPTIONS[name][0]
    value: Any = text
    try:
        if option.kind == "flag":
            value = {"true": True, "false": False}[text.lower()]
        elif option.kind == "whole":
            value = int(text)
        elif option.kind == "number":
            value = float(text)
    except (KeyError, ValueError):
        expected = {"flag": "true or false", "whole": "a whole number", "number": "a number"}[option.kind]
        raise typer.BadParameter(f"--{name.replace('_', '-')} must be {expected}, got {text!r}") from None
    _usage(_any_takes, OPTIONS[name], value)
    return value


def _any_takes(options: tuple[MapOption, ...], value: Any) -> None:
    """Raises what the last option says when none takes the value; which maps are asked for comes later."""
    for option in options[:-1]:
        try:
            option.check(value)
        except ValueError:
            continue
        return
    options[-1].check(value)


def _with_map_options(command: Callable[..., None]) -> Callable[..., None]:
    """Gives a command one flag for each option of the registry of maps, in place of `map_options`."""
    # Typer does not evaluate the annotations of a signature that is given to it.
    signature = inspect.signature(command, eval_str=True)
    own = [part for part in signature.parameters.values() if part.kind is not inspect.Parameter.VAR_KEYWORD]
    flags = []
    for name, options in OPTIONS.items():
        takers = [info.name for info in MAP_INFO.values() if info.option(name)]
        about = typer.Option(
            help=f"{options[0].describe()} [{', '.join(takers)}]",
            show_default=False,
            metavar=options[0].kind.upper(),
            rich_help_panel="Options of maps",
        )
        flags.append(
            inspect.Parameter(
                name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=Annotated[str | None, about]
            )
        )
    command.__signature__ = signature.replace(parameters=[*own, *flags])  # type: ignore[attr-defined]
    command.__annotations__ = {
        **{name: hint for name, hint in command.__annotations__.items() if name != "map_options"},
        **{flag.name: flag.annotation for flag in flags},
    }
    return command


def _bake_mesh(
    out: _Output,
    source: Path,
    wanted: list[str],
    options: dict[str, Any],
    output: Path,
    format: Any,
    bits: Any,
    prefix: str,
) -> None:
    with out.progress("baking") as advance:
        made = bake_maps(source, wanted, progress=advance, **options)
    assert isinstance(made, MeshMaps)
    paths = made.save(output, format=format, bits=bits, prefix=prefix)
    for path in paths:
        out.say(str(path))
    report = {} if made.report is None else made.report._asdict()
    if report:
        out.say(f"heights from {-report['rear']:g} to {report['front']:g} mesh units")
    height, width = made[wanted[0]].shape[:2]
    out.result({"source": str(source), "width": width, "height": height, "files": paths, "report": report})


@_with_map_options
def bake(
    source: Annotated[
        Path,
        typer.Argument(
            help="Height map: PNG, TIFF, EXR, JPEG, WebP, BMP, TGA or npy. Or a mesh: OBJ, glTF or GLB."
        ),
    ],
    maps: Annotated[
        str,
        typer.Option(
            help=f"Maps to bake, with commas between: {', '.join(MAPS)}; of a mesh: {', '.join(MESH_MAPS)}."
        ),
    ] = "normal",
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder for the maps.")] = Path("maps"),
    format: Annotated[FormatChoice, typer.Option(help="File format.")] = FormatChoice.PNG,
    bits: Annotated[
        BitsChoice | None,
        typer.Option(help="Bits a sample of a PNG (8, 16) or TIFF (8, 16, 32).", show_default="8"),
    ] = None,
    prefix: Annotated[str, typer.Option(help="First part of the file names.")] = "",
    by_rows: Annotated[
        bool,
        typer.Option("--by-rows", help="For height maps larger than memory: read and write them row by row."),
    ] = False,
    scale: _Scale = 0.1,
    base: _Base = 1.0,
    tile_size: _Tile = (1.0, 1.0),
    wrap: _WrapOption = WrapChoice.REPEAT,
    channel: _Channel = None,
    invert: _Invert = False,
    height_range: _Range = None,
    detail: Annotated[Path | None, typer.Option(help="Of a mesh: the detailed mesh to bake from.")] = None,
    cage: Annotated[
        Path | None, typer.Option(help="Of a mesh: the same triangles further out; rays start there.")
    ] = None,
    size: Annotated[
        tuple[int, int] | None, typer.Option(help="Of a mesh: width and height, texels.", min=1)
    ] = None,
    front: Annotated[
        float | None, typer.Option(help="Of a mesh: how far above it rays start, mesh units.", min=0.0)
    ] = None,
    rear: Annotated[
        float | None, typer.Option(help="Of a mesh: how far below it rays end, mesh units.", min=0.0)
    ] = None,
    samples: Annotated[
        int | None, typer.Option(help="Of a mesh: samples along each side of a texel.", min=1, max=8)
    ] = None,
    padding: Annotated[
        int | None, typer.Option(help="Of a mesh: texels that charts are grown by.", min=0)
    ] = None,
    space: Annotated[SpaceChoice | None, typer.Option(help="Of a mesh: space of the normals.")] = None,
    back_faces: Annotated[
        bool | None, typer.Option("--back-faces", help="Of a mesh: stop at triangles seen from behind.")
    ] = None,
    rays: Annotated[
        int | None, typer.Option(help="Of a mesh: rays a sample of ao sends.", min=1, max=65536)
    ] = None,
    distance: Annotated[
        float | None, typer.Option(help="Of a mesh: how far things shade in ao, mesh units.", min=0.0)
    ] = None,
    json_output: _Json = False,
    quiet: _Quiet = False,
    verbose: _Verbose = False,
    **map_options: str | None,
) -> None:
    """Make the maps a renderer needs from a height map, or from a detailed mesh for a plain one."""
    own = {
        "detail": detail,
        "cage": cage,
        "size": size,
        "front": front,
        "rear": rear,
        "samples": samples,
        "padding": padding,
        "space": space and space.value,
        "back_faces": back_faces,
        "rays": rays,
        "distance": distance,
    }
    own = {name: value for name, value in own.items() if value is not None}
    if source.suffix.lower() in MESH_SUFFIXES:
        wanted = _names(maps, MESH_MAPS, "map")
        own |= {name: _map_option(name, text) for name, text in map_options.items() if text is not None}
        with _session(json_output, quiet, verbose) as out:
            _bake_mesh(out, source, wanted, own, output, format.value, bits and int(bits.value), prefix)
        return
    if own:
        flags = ", ".join(f"--{name.replace('_', '-')}" for name in own)
        raise typer.BadParameter(f"{flags} need a mesh; SOURCE is none")
    wanted = _names(maps, MAPS, "map")
    options = {name: _map_option(name, text) for name, text in map_options.items() if text is not None}
    depth: Any = int(bits.value) if bits is not None else None
    span = _range(height_range)
    settings: dict[str, Any] = {
        "scale": scale,
        "base": base,
        "tile_size": tile_size,
        "wrap": wrap.value,
        "channel": _channel(channel),
        "invert": invert,
        "height_range": span,
    }
    if by_rows:
        if format not in (FormatChoice.PNG, FormatChoice.NPY):
            raise typer.BadParameter("--by-rows writes png and npy")
        with _session(json_output, quiet, verbose) as out:
            _bake_by_rows(out, source, wanted, output, format.value, depth, prefix, settings, options)
        return
    with _session(json_output, quiet, verbose) as out:
        heights = HeightMap(source, **settings)
        with out.progress("baking") as advance:
            made = bake_maps(heights, wanted, progress=advance, **options)
        paths = made.save(output, format=format.value, bits=depth, prefix=prefix)
        if verbose:
            out.say(repr(heights))
        for path in paths:
            out.say(str(path))
        rows, columns = heights.shape
        out.result(
            {"source": str(source), "width": columns, "height": rows, "bits": heights.bits, "files": paths}
        )


def _bake_by_rows(
    out: _Output,
    source: Path,
    maps: list[str],
    folder: Path,
    format: str,
    bits: Any,
    prefix: str,
    settings: dict[str, Any],
    options: dict[str, Any],
) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    files = []
    for name in maps:
        target = folder / f"{prefix}{'_' if prefix else ''}{name}.{format}"
        taken = {key: value for key, value in options.items() if MAP_INFO[name].option(key)}
        with out.progress(name) as advance:
            files.append(
                bake_map_file(source, target, name, bits=bits, progress=advance, **settings, **taken)
            )
        out.say(str(files[-1]))
    out.result({"source": str(source), "files": files})
