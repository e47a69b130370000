"""What maps there are and what they take, from the registry of the Rust core."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Any, Literal, NamedTuple

from . import _bumpwgpu
from ._checks import choice, flag, number, whole

__all__ = ["MAPS", "OPTIONS", "MapChannel", "MapInfo", "MapOption"]


class MapOption(NamedTuple):
    """One option of a map."""

    name: str
    summary: str
    kind: Literal["whole", "number", "flag", "choice"]
    default: int | float | bool | str
    range: tuple[int, int] | tuple[float, float] | None = None
    choices: tuple[str, ...] = ()

    def check(self, value: Any) -> Any:
        """The value as the core takes it; raises ValueError or TypeError."""
        if self.kind == "choice":
            return choice(self.name, value, self.choices)
        if self.kind == "flag":
            return flag(self.name, value)
        low, high = self.range or (None, None)
        if self.kind == "whole":
            return whole(self.name, value, low, high)  # type: ignore[arg-type]
        return number(self.name, value, low, high)

    def describe(self) -> str:
        """One line: what it does, its range and default."""
        accepted = ", ".join(self.choices)
        if self.range is not None:
            accepted = f"{self.range[0]:g} to {self.range[1]:g}"
        elif self.kind == "flag":
            accepted = "True or False"
        return f"{self.summary}: {accepted} (default {self.default})"


class MapChannel(NamedTuple):
    """One channel of a map: its numbers, and which way integers round them."""

    name: str
    range: tuple[float, float] | None
    rounding: Literal["nearest", "down", "up"]


class MapInfo(NamedTuple):
    """What a map is.

    `form` is "single" (one array), "levels" (a tuple of arrays, finest first) or "stack" (one array
    whose first axis is `axis`). `by_rows`: a row of it takes but a few rows of heights. A channel without
    a range takes that of the data.
    """

    name: str
    summary: str
    source: str
    version: int
    costly: bool
    by_rows: bool
    form: Literal["single", "levels", "stack"]
    axis: str | None
    channels: tuple[MapChannel, ...]
    options: tuple[MapOption, ...]

    def option(self, name: str) -> MapOption | None:
        """The option of that name, if the map takes it."""
        return next((option for option in self.options if option.name == name), None)

    def complete(self, given: Mapping[str, Any]) -> dict[str, Any]:
        """A value for every option: those given, checked, and defaults."""
        return {
            option.name: option.check(given[option.name]) if option.name in given else option.default
            for option in self.options
        }


def _read(entry: dict[str, Any]) -> MapInfo:
    channels = tuple(MapChannel(*channel) for channel in entry["channels"])
    options = tuple(
        MapOption(**{**option, "choices": tuple(option.get("choices", ()))}) for option in entry["options"]
    )
    return MapInfo(**{**entry, "channels": channels, "options": options})


#: Maps that can be baked from heights, by name.
MAPS: Mapping[str, MapInfo] = MappingProxyType(
    {entry["name"]: _read(entry) for entry in _bumpwgpu.map_registry()}
)

#: Maps that only a mesh gives, by name.
FROM_MESH: Mapping[str, MapInfo] = MappingProxyType(
    {entry["name"]: _read(entry) for entry in _bumpwgpu.mesh_map_registry()}
)


#: All maps, whatever they are made from.
ALL_MAPS: Mapping[str, MapInfo] = MappingProxyType({**MAPS, **FROM_MESH})


def _all_options() -> dict[str, tuple[MapOption, ...]]:
    found: dict[str, tuple[MapOption, ...]] = {}
    for info in MAPS.values():
        for option in info.options:
            if option not in found.get(option.name, ()):
                found[option.name] = (*found.get(option.name, ()), option)
    return found


#: Options by name; one name may have several ranges or defaults, by map.
OPTIONS: Mapping[str, tuple[MapOption, ...]] = MappingProxyType(_all_options())


def takers(option: str) -> list[str]:
    """Names of the maps that take an option."""
    return [info.name for info in MAPS.values() if info.option(option) is not None]


def listing(names: Iterable[str]) -> str:
    """What some maps take, for messages."""
    taken = dict.fromkeys(option.name for name in names for option in MAPS[name].options)
    return ", ".join(taken) if taken else "no options"
