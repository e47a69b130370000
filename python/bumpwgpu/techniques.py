"""Techniques with their parameters, one class each.

The classes are made from the registry of the Rust core, so names, parameters, ranges and defaults
cannot differ from what runs. ``bumpwgpu.techniques.Relief(linear=16)`` and the string ``"relief"``
are both accepted wherever a technique is asked for.

Examples
--------
>>> import bumpwgpu as bw
>>> bw.techniques.Relief(linear=16)
Relief(linear=16, refine=8)
>>> bw.techniques.names()[:3]
('flat', 'bump_forward', 'bump')
"""

from __future__ import annotations

import inspect
import operator
from typing import Any, ClassVar, NamedTuple

from . import _bumpwgpu

__all__ = ["Parameter", "Technique", "get", "marching", "names"]


class Parameter(NamedTuple):
    """One whole-number parameter of a technique."""

    name: str
    summary: str
    default: int
    min: int
    max: int


class Technique:
    """Base class of all techniques: a name, and values for its parameters. Immutable and hashable.

    Attributes
    ----------
    name : str
        The name used everywhere.
    summary : str
        What it does, in one line.
    source : str
        The work it comes from; empty where there is none to name.
    parameters : dict of str to int
        The values of this object.
    """

    name: ClassVar[str] = ""
    summary: ClassVar[str] = ""
    source: ClassVar[str] = ""
    casts_shadows: ClassVar[bool] = False
    marches: ClassVar[bool] = False
    PARAMETERS: ClassVar[tuple[Parameter, ...]] = ()

    __slots__ = ("_values",)
    _values: tuple[int, ...]

    def __init__(self, **parameters: int) -> None:
        cls = type(self)
        if not cls.name:
            raise TypeError("use one of the technique classes, for example bumpwgpu.techniques.Relief()")
        known = [parameter.name for parameter in cls.PARAMETERS]
        for given in parameters:
            if given not in known:
                listed = ", ".join(known) if known else "none"
                raise TypeError(f"{cls.__name__} has no parameter {given!r}; its parameters: {listed}")
        values = tuple(_whole(cls, spec, parameters.get(spec.name, spec.default)) for spec in cls.PARAMETERS)
        object.__setattr__(self, "_values", values)

    @property
    def parameters(self) -> dict[str, int]:
        """Parameter values by name."""
        return {spec.name: value for spec, value in zip(self.PARAMETERS, self._values, strict=True)}

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"{type(self).__name__} is immutable; make a new one to change {name!r}")

    def __delattr__(self, name: str) -> None:
        raise AttributeError(f"{type(self).__name__} is immutable")

    def __repr__(self) -> str:
        arguments = ", ".join(f"{name}={value}" for name, value in self.parameters.items())
        return f"{type(self).__name__}({arguments})"

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Technique):
            return NotImplemented
        return type(self) is type(other) and self._values == other._values

    def __hash__(self) -> int:
        return hash((self.name, self._values))

    def __reduce__(self) -> tuple[Any, ...]:
        return (_restore, (self.name, self.parameters))


def _restore(name: str, parameters: dict[str, int]) -> Technique:
    return _CLASSES[name](**parameters)


def _whole(cls: type[Technique], spec: Parameter, value: Any) -> int:
    try:
        whole = operator.index(value)
    except TypeError:
        raise TypeError(f"{cls.__name__}: {spec.name} must be a whole number, got {value!r}") from None
    if not spec.min <= whole <= spec.max:
        raise ValueError(f"{cls.__name__}: {spec.name} must be in {spec.min}..{spec.max}, got {whole}")
    return whole


def _class_name(name: str) -> str:
    return "".join(part.capitalize() for part in name.split("_"))


def _make(entry: dict[str, Any]) -> type[Technique]:
    specs = tuple(Parameter(*spec) for spec in entry["parameters"])
    lines = [entry["summary"]]
    if entry["source"]:
        lines += ["", f"Source: {entry['source']}"]
    if specs:
        lines += ["", "Parameters", "----------"]
    for spec in specs:
        lines.append(f"{spec.name} : int, default {spec.default}")
        lines.append(f"    {spec.summary} {spec.min} to {spec.max}.")
    members: dict[str, Any] = {
        "__slots__": (),
        "__module__": __name__,
        "__doc__": "\n".join(lines),
        "__init__": _initializer(specs),
        "name": entry["name"],
        "summary": entry["summary"],
        "source": entry["source"],
        "casts_shadows": entry["casts_shadows"],
        "marches": entry["marches"],
        "PARAMETERS": specs,
    }
    for at, spec in enumerate(specs):
        members[spec.name] = _parameter(at, spec)
    return type(_class_name(entry["name"]), (Technique,), members)


def _initializer(specs: tuple[Parameter, ...]) -> Any:
    """``__init__`` that shows its parameters to ``help`` and to type checkers."""

    def __init__(self: Technique, **parameters: int) -> None:
        Technique.__init__(self, **parameters)

    keyword = inspect.Parameter.KEYWORD_ONLY
    shown = [inspect.Parameter("self", inspect.Parameter.POSITIONAL_OR_KEYWORD)]
    shown += [inspect.Parameter(spec.name, keyword, default=spec.default, annotation=int) for spec in specs]
    __init__.__signature__ = inspect.Signature(shown)  # type: ignore[attr-defined]
    return __init__


def _parameter(at: int, spec: Parameter) -> property:
    return property(lambda self: self._values[at], doc=spec.summary)


_CLASSES: dict[str, type[Technique]] = {entry["name"]: _make(entry) for entry in _bumpwgpu.techniques()}
globals().update({made.__name__: made for made in _CLASSES.values()})
__all__ += [made.__name__ for made in _CLASSES.values()]


def names() -> tuple[str, ...]:
    """Names of all techniques that ``render`` draws.

    Returns
    -------
    tuple of str
        Shading techniques first, then the searches.
    """
    return tuple(_CLASSES)


def marching() -> tuple[str, ...]:
    """Names of the techniques that search the height map, which ``march`` and ``compare`` take.

    Returns
    -------
    tuple of str
        Cheapest guarantee first.
    """
    return tuple(name for name, made in _CLASSES.items() if made.marches)


def get(technique: str | Technique) -> Technique:
    """The technique object of a name; an object is returned as it is.

    Parameters
    ----------
    technique : str or Technique
        A name out of :func:`names`, or an object.

    Returns
    -------
    Technique

    Raises
    ------
    ValueError
        For an unknown name.
    TypeError
        For anything else.
    """
    if isinstance(technique, Technique):
        return technique
    if isinstance(technique, type) and issubclass(technique, Technique):
        name = technique.__name__
        raise TypeError(f"technique must be an object: write {name}() instead of {name}")
    if not isinstance(technique, str):
        raise TypeError(f"technique must be a name or a techniques object, got {type(technique).__name__}")
    if technique not in _CLASSES:
        raise ValueError(f"unknown technique {technique!r}; known: {', '.join(_CLASSES)}")
    return _CLASSES[technique]()
