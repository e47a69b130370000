"""Techniques with their parameters, one class each."""

from typing import Any, ClassVar, NamedTuple

__all__ = [
    "Binary",
    "Bump",
    "BumpBlinn",
    "BumpDerivative",
    "BumpExact",
    "BumpForward",
    "BumpOrthogonal",
    "Dot3",
    "Exact",
    "Flat",
    "Interval",
    "Normal",
    "Parallax",
    "ParallaxLimited",
    "Parameter",
    "Pom",
    "Relief",
    "Steep",
    "SteepExponential",
    "SteepLinear",
    "Technique",
    "get",
    "marching",
    "names",
]

class Parameter(NamedTuple):
    name: str
    summary: str
    default: int
    min: int
    max: int

class Technique:
    name: ClassVar[str]
    summary: ClassVar[str]
    source: ClassVar[str]
    casts_shadows: ClassVar[bool]
    marches: ClassVar[bool]
    PARAMETERS: ClassVar[tuple[Parameter, ...]]
    def __init__(self, **parameters: int) -> None: ...
    @property
    def parameters(self) -> dict[str, int]: ...
    def __eq__(self, other: object) -> bool: ...
    def __hash__(self) -> int: ...
    def __setattr__(self, name: str, value: object) -> None: ...
    def __delattr__(self, name: str) -> None: ...
    def __reduce__(self) -> tuple[Any, ...]: ...

class Flat(Technique):
    def __init__(self) -> None: ...

class Bump(Technique):
    def __init__(self) -> None: ...

class BumpForward(Technique):
    def __init__(self) -> None: ...

class BumpOrthogonal(Technique):
    def __init__(self) -> None: ...

class BumpDerivative(Technique):
    def __init__(self) -> None: ...

class BumpBlinn(Technique):
    def __init__(self) -> None: ...

class BumpExact(Technique):
    def __init__(self) -> None: ...

class Normal(Technique):
    def __init__(self) -> None: ...

class Dot3(Technique):
    def __init__(self) -> None: ...

class Parallax(Technique):
    def __init__(self) -> None: ...

class ParallaxLimited(Technique):
    def __init__(self) -> None: ...

class Steep(Technique):
    def __init__(self, *, steps: int = 32) -> None: ...
    @property
    def steps(self) -> int: ...

class SteepLinear(Technique):
    def __init__(self, *, min_steps: int = 8, max_steps: int = 64) -> None: ...
    @property
    def min_steps(self) -> int: ...
    @property
    def max_steps(self) -> int: ...

class SteepExponential(Technique):
    def __init__(self, *, min_steps: int = 8, max_steps: int = 64) -> None: ...
    @property
    def min_steps(self) -> int: ...
    @property
    def max_steps(self) -> int: ...

class Binary(Technique):
    def __init__(self, *, steps: int = 16) -> None: ...
    @property
    def steps(self) -> int: ...

class Relief(Technique):
    def __init__(self, *, linear: int = 32, refine: int = 8) -> None: ...
    @property
    def linear(self) -> int: ...
    @property
    def refine(self) -> int: ...

class Pom(Technique):
    def __init__(self, *, steps: int = 32) -> None: ...
    @property
    def steps(self) -> int: ...

class Interval(Technique):
    def __init__(self, *, linear: int = 24, refine: int = 4) -> None: ...
    @property
    def linear(self) -> int: ...
    @property
    def refine(self) -> int: ...

class Distance(Technique):
    def __init__(self, *, steps: int = 16384) -> None: ...
    @property
    def steps(self) -> int: ...

class Exact(Technique):
    def __init__(self) -> None: ...

def names() -> tuple[str, ...]: ...
def marching() -> tuple[str, ...]: ...
def get(technique: str | Technique) -> Technique: ...
