"""What the commands share: options, output, and reading of words."""

from __future__ import annotations

import json
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from enum import Enum
from pathlib import Path
from typing import Annotated, Any, TypeVar

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn
from rich.table import Table

from . import techniques
from .errors import BumpError
from .meshes import Mesh

#: What a command ends with when it ran and what it checked did not hold.
CHECK_FAILED = 3
_T = TypeVar("_T")
_MESHES: dict[str, Callable[[], Mesh]] = {
    "quad": Mesh.quad,
    "cube": Mesh.cube,
    "sphere": Mesh.sphere,
    "torus": Mesh.torus,
}


class WrapChoice(Enum):
    """Values of --wrap."""

    REPEAT = "repeat"
    CLAMP = "clamp"
    MIRROR = "mirror"


class DeviceChoice(Enum):
    """Values of --device."""

    AUTO = "auto"
    CPU = "cpu"
    GPU = "gpu"


# Options that several commands share.
_Scale = Annotated[float, typer.Option(help="Height range, mesh units.", min=0.0)]
_Base = Annotated[
    float, typer.Option(help="Height that lies on the mesh: 1 carves in, 0 raises.", min=0.0, max=1.0)
]
_Tile = Annotated[tuple[float, float], typer.Option(help="Mesh units covered by one tile along u and v.")]
_WrapOption = Annotated[WrapChoice, typer.Option(help="What lies beyond the edge.")]
_Channel = Annotated[
    str | None, typer.Option(help="Channel with the heights: r, g, b, a, an index, or an EXR name.")
]
_Invert = Annotated[bool, typer.Option("--invert", help="The map holds depth: 1 is low.")]
_Range = Annotated[
    str | None,
    typer.Option(help="What becomes height 0 and 1: 'auto' or 'low,high', in the units of the data."),
]
_Json = Annotated[bool, typer.Option("--json", help="Print the result as JSON and nothing else.")]
_Quiet = Annotated[bool, typer.Option("-q", "--quiet", help="Print errors only.")]
_Verbose = Annotated[bool, typer.Option("-v", "--verbose", help="Print more; on errors, a traceback.")]


class _Output:
    """Where results, warnings and progress go: results to stdout, all else to stderr."""

    def __init__(self, json_wanted: bool, quiet: bool, verbose: bool) -> None:
        self.json = json_wanted
        self.quiet = quiet
        self.verbose = verbose
        self.out = Console(soft_wrap=True, highlight=False)
        self.err = Console(stderr=True, soft_wrap=True, highlight=False)

    def say(self, text: str) -> None:
        if not (self.json or self.quiet):
            self.out.print(text, markup=False)

    def show(self, table: Table) -> None:
        if not (self.json or self.quiet):
            self.out.print(table)

    def result(self, data: dict[str, Any]) -> None:
        if self.json:
            sys.stdout.write(json.dumps(data, indent=1, allow_nan=False, default=str) + "\n")

    def warn(self, text: str) -> None:
        if not self.quiet:
            self.err.print(f"warning: {text}", markup=False)

    @contextmanager
    def progress(self, text: str) -> Iterator[Callable[..., None]]:
        """A progress bar on stderr, for people only: none with -q or where stderr is no terminal."""
        bar = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            TaskProgressColumn(),
            TimeElapsedColumn(),
            console=self.err,
            transient=True,
            disable=self.quiet or not self.err.is_terminal,
        )
        with bar:
            task = bar.add_task(text, total=None)

            def advance(done: int, total: int, now: str = text) -> None:
                bar.update(task, completed=done, total=total, description=now)

            yield advance


@contextmanager
def _session(json_wanted: bool, quiet: bool, verbose: bool) -> Iterator[_Output]:
    """Turns warnings into lines and exceptions into one line and an exit code."""
    output = _Output(json_wanted, quiet, verbose)
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        warnings.showwarning = lambda message, *_args, **_kwargs: output.warn(str(message))
        try:
            yield output
        except KeyboardInterrupt:
            output.err.print("interrupted", markup=False)
            raise typer.Exit(130) from None
        except (BumpError, OSError, ValueError, TypeError, MemoryError) as error:
            if verbose:
                output.err.print_exception()
            lines = str(error).split("\n")
            output.err.print(f"error: {lines[0] or type(error).__name__}", markup=False)
            raise typer.Exit(1) from None


def _usage(check: Callable[..., _T], *arguments: Any, **options: Any) -> _T:
    """Calls a check of options; what it finds wrong is a usage error."""
    try:
        return check(*arguments, **options)
    except (ValueError, TypeError) as error:
        raise typer.BadParameter(str(error)) from None


def _names(text: str, known: tuple[str, ...], what: str) -> list[str]:
    names = [name.strip() for name in text.split(",") if name.strip()]
    for name in names:
        if name not in known:
            raise typer.BadParameter(f"unknown {what} {name!r}; known: {', '.join(known)}")
    return names


def _numbers(text: str, what: str, count: int | None = None) -> tuple[float, ...]:
    try:
        values = tuple(float(part) for part in text.split(","))
    except ValueError:
        raise typer.BadParameter(f"{what} must be numbers with commas between, got {text!r}") from None
    if count is not None and len(values) != count:
        raise typer.BadParameter(f"{what} must be {count} numbers with commas between, got {text!r}")
    return values


def _technique(text: str) -> techniques.Technique:
    """``relief`` or ``relief(linear=16, refine=4)``."""
    name, bracket, rest = text.strip().partition("(")
    chosen = _usage(techniques.get, name.strip())
    if not bracket:
        return chosen
    parameters: dict[str, int] = {}
    for part in rest.rstrip().removesuffix(")").split(","):
        key, _, value = part.partition("=")
        try:
            parameters[key.strip()] = int(value)
        except ValueError:
            raise typer.BadParameter(f"technique {text!r}: write {name}(parameter=number)") from None
    return _usage(type(chosen), **parameters)


def _techniques(text: str) -> list[techniques.Technique]:
    """Several of the above; commas inside brackets belong to the parameters."""
    parts, depth = [""], 0
    for letter in text:
        depth += {"(": 1, ")": -1}.get(letter, 0)
        if letter == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += letter
    return [_technique(part) for part in parts if part.strip()]


def _channel(text: str | None) -> int | str | None:
    return int(text) if text is not None and text.isdigit() else text


def _range(text: str | None) -> Any:
    return text if text in (None, "auto") else _numbers(text, "--height-range", 2)


def _check_suffix(path: Path, known: tuple[str, ...]) -> None:
    if path.suffix.lower() not in known:
        raise typer.BadParameter(f"{path.name!r} must end in one of {', '.join(known)}")


def _open_mesh(name: str) -> Mesh:
    return _MESHES[name]() if name in _MESHES else Mesh.open(name)
