"""The public face: names, signatures, docstrings, stubs, import time."""

from __future__ import annotations

import ast
import doctest
import importlib
import inspect
import json
import os
import pickle
import pkgutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import bumpwgpu as bw
from bumpwgpu import _bumpwgpu, techniques
from bumpwgpu.baking import MAPS
from bumpwgpu.rendering import AOVS, SKIP_CODES, SKIPS

PACKAGE = Path(bw.__file__).parent
MODULES = sorted(
    f"bumpwgpu.{info.name}" for info in pkgutil.iter_modules([str(PACKAGE)]) if info.name != "_bumpwgpu"
)
GPU = doctest.register_optionflag("GPU")

# The promised parameters: keyword-only ones after the star.
SIGNATURES = {
    "HeightMap": "source * scale base tile_size wrap channel invert height_range",
    "HeightMap.procedural": "name size seed * scale base tile_size wrap",
    "HeightMap.from_function": "function size * scale base tile_size wrap",
    "march": "height_map origins directions technique * device outputs from_surface out progress",
    "march_stream": "height_map chunks technique * outputs from_surface overlap",
    "bake": "source maps * dtype progress **options",
    "bake_file": (
        "source target map * bits scale base tile_size wrap channel invert height_range progress **options"
    ),
    "Maps.save": "self folder * format bits prefix",
    "HorizonShadows": "azimuths softness",
    "Instance": "mesh material world_from_object",
    "Maps.open": "folder * prefix",
    "Mesh": "positions indices uvs * normals tangents",
    "Mesh.open": "path",
    "Mesh.tangents": "self method",
    "tangents": "positions indices uvs normals method * weld flip_v",
    "Camera.look_at": "eye target up fov_y",
    "Light.directional": "direction color intensity",
    "Light.point": "position color intensity",
    "Material": "height albedo normal * specular shininess normal_convention double_sided",
    "render": (
        "mesh material * camera lights technique size shadows silhouettes samples specular_aa aovs skip "
        "skip_error device ambient background"
    ),
    "Renderer": (
        "mesh material * camera lights technique size shadows silhouettes samples specular_aa aovs skip "
        "skip_error device ambient background"
    ),
    "Renderer.render": "self camera",
    "Renderer.render_many": "self cameras",
    "compare": "source techniques * elevations formats device rays repeats seed progress",
    "dequantise": "source * bits progress **options",
    "tile_report": "source **options",
    "heights_from_normals": "normals * convention wrap tile_size base kernel steepest progress",
    "check_normals": "normals heights * wrap",
    "info": "",
}
DEFAULTS = {
    ("HeightMap", "scale"): 0.1,
    ("HeightMap", "base"): 1.0,
    ("HeightMap", "tile_size"): (1.0, 1.0),
    ("HeightMap", "wrap"): "repeat",
    ("march", "technique"): "exact",
    ("march", "device"): "cpu",
    ("march", "outputs"): ("t", "uv", "z", "normal", "steps", "status"),
    ("bake", "maps"): ("normal",),
    ("Mesh.tangents", "method"): "mikktspace",
    ("Camera.look_at", "fov_y"): 45.0,
    ("render", "size"): (512, 512),
    ("render", "technique"): "relief",
    ("render", "device"): "auto",
    ("compare", "elevations"): (90, 45, 20, 10, 5),
    ("compare", "device"): "auto",
}


def find(name: str) -> Any:
    thing: Any = bw
    for part in name.split("."):
        thing = getattr(thing, part)
    return thing


def shown(signature: inspect.Signature) -> str:
    words, starred = [], False
    for parameter in signature.parameters.values():
        if parameter.kind is inspect.Parameter.KEYWORD_ONLY and not starred:
            words.append("*")
            starred = True
        prefix = "**" if parameter.kind is inspect.Parameter.VAR_KEYWORD else ""
        words.append(prefix + parameter.name)
    return " ".join(words)


@pytest.mark.parametrize("name", SIGNATURES)
def test_signatures(name: str) -> None:
    assert shown(inspect.signature(find(name))) == SIGNATURES[name]


@pytest.mark.parametrize(("name", "parameter"), DEFAULTS)
def test_defaults(name: str, parameter: str) -> None:
    assert inspect.signature(find(name)).parameters[parameter].default == DEFAULTS[name, parameter]


def public() -> Iterator[tuple[str, Any]]:
    """Everything in `bumpwgpu.__all__` with its public methods."""
    for name in bw.__all__:
        thing = getattr(bw, name)
        if inspect.ismodule(thing) or isinstance(thing, str):
            continue
        yield name, thing
        if inspect.isclass(thing) and not issubclass(thing, BaseException):
            for method, member in vars(thing).items():
                function = member.__func__ if isinstance(member, staticmethod | classmethod) else member
                if not method.startswith("_") and inspect.isfunction(function):
                    yield f"{name}.{method}", function


@pytest.mark.parametrize(("name", "thing"), list(public()), ids=[name for name, _ in public()])
def test_docstrings(name: str, thing: Any) -> None:
    text = inspect.getdoc(thing) or ""
    assert len(text) > 15
    if not inspect.isfunction(thing):
        return
    takes = [parameter for parameter in inspect.signature(thing).parameters if parameter != "self"]
    if takes:
        assert "Parameters\n---" in text, name
        body = text.split("Parameters\n")[1]
        for parameter in takes:
            assert parameter in body, f"{name} does not say what {parameter} is"
        assert "Raises\n---" in text, name
    if inspect.signature(thing).return_annotation not in ("None", None):
        kind = "Yields" if inspect.isgeneratorfunction(thing) else "Returns"
        assert f"{kind}\n---" in text, name


@pytest.mark.parametrize("module", [name for name in MODULES if name != "bumpwgpu.cli"])
def test_examples_run(module: str, request: pytest.FixtureRequest) -> None:
    finder, runner = doctest.DocTestFinder(), doctest.DocTestRunner(optionflags=doctest.ELLIPSIS)
    for test in finder.find(importlib.import_module(module)):
        if any(GPU in example.options for example in test.examples):
            request.getfixturevalue("gpu")
        runner.run(test)
    assert runner.summarize(verbose=False).failed == 0


def test_errors() -> None:
    for error in (bw.MeshError, bw.BakeError, bw.RenderError, bw.CompareError):
        assert issubclass(error, bw.BumpError)
        assert error.__module__ == "bumpwgpu"
        assert str(pickle.loads(pickle.dumps(error("what, where")))) == "what, where"
    assert issubclass(bw.BumpWarning, UserWarning)


def test_info() -> None:
    found = bw.info()
    assert found["version"] == bw.__version__
    assert found["threads"] >= 1
    assert found["techniques"] == list(techniques.names())
    assert found["simd"] in ("baseline", "avx2", "avx512", "neon")
    json.dumps(found)


def test_lesser_instructions_are_named() -> None:
    environment = {**os.environ, "BUMPWGPU_SIMD": "baseline"}
    command = [sys.executable, "-c", "import bumpwgpu as bw; print(bw.info()['simd'])"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.strip() in ("baseline", "neon")


def stub_classes() -> dict[str, dict[str, int]]:
    """Technique classes of the stub, with their parameters and defaults."""
    tree = ast.parse((PACKAGE / "techniques.pyi").read_text())
    found = {}
    for node in tree.body:
        if isinstance(node, ast.ClassDef) and any(ast.unparse(base) == "Technique" for base in node.bases):
            init = next(f for f in node.body if isinstance(f, ast.FunctionDef) and f.name == "__init__")
            names = [argument.arg for argument in init.args.kwonlyargs]
            values = [ast.literal_eval(default) for default in init.args.kw_defaults if default is not None]
            found[node.name] = dict(zip(names, values, strict=True))
    return found


def test_technique_stubs_agree_with_the_registry() -> None:
    registry = {}
    for entry in _bumpwgpu.techniques():
        name = "".join(part.capitalize() for part in entry["name"].split("_"))
        registry[name] = {spec[0]: spec[2] for spec in entry["parameters"]}
    assert stub_classes() == registry
    for name, parameters in registry.items():
        made = getattr(techniques, name)
        assert made().parameters == parameters
        assert name in techniques.__all__
        assert list(inspect.signature(made).parameters) == list(parameters)
        assert made.summary in made.__doc__


def test_technique_objects() -> None:
    relief = bw.techniques.Relief(linear=16)
    assert (relief.linear, relief.refine, relief.name) == (16, 8, "relief")
    assert repr(relief) == "Relief(linear=16, refine=8)"
    assert relief == bw.techniques.Relief(linear=16, refine=8)
    assert relief != bw.techniques.Relief()
    assert len({relief, bw.techniques.Relief(linear=16), bw.techniques.Steep()}) == 2
    assert pickle.loads(pickle.dumps(relief)) == relief
    with pytest.raises(AttributeError):
        relief.linear = 3
    with pytest.raises(AttributeError):
        relief.steps  # noqa: B018
    with pytest.raises(TypeError):
        techniques.Technique()
    assert techniques.get(relief) is relief


def test_names_agree_with_the_core() -> None:
    assert [entry["name"] for entry in _bumpwgpu.map_registry()] == list(MAPS)
    assert tuple(_bumpwgpu.aov_names()) == AOVS
    assert tuple(_bumpwgpu.skip_names()) == SKIPS
    assert dict(_bumpwgpu.skip_codes()) == SKIP_CODES


def python(code: str) -> str:
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=True
    )
    return done.stdout


def test_importing_loads_nothing_heavy() -> None:
    heavy = ("PIL", "typer", "rich", "matplotlib", "flip_evaluator", "importlib.metadata")
    loaded = python(f"import sys, bumpwgpu; print([m for m in {heavy!r} if m in sys.modules])")
    assert loaded == "[]\n"


def test_importing_is_quick() -> None:
    """The package alone, and with what baking and marching load; without NumPy's own share."""
    timed = "import time, numpy; start = time.perf_counter(); {}; print(time.perf_counter() - start)"
    for code, limit in (
        ("import bumpwgpu", 0.05),
        ("from bumpwgpu import HeightMap, bake, march", 0.15),
    ):
        # Measured 0.017 and 0.05 s. The best of several, since other work may be running.
        assert min(float(python(timed.format(code))) for _ in range(5)) < limit, code


def test_names_are_loaded_when_asked_for() -> None:
    code = (
        "import sys, bumpwgpu as bw\n"
        "own = lambda: sorted(m for m in sys.modules if m.startswith('bumpwgpu.'))\n"
        "print(own(), 'numpy' in sys.modules)\n"
        "bw.HeightMap\n"
        "print([m for m in ('comparing', 'linting', 'stressing', 'engines', 'rendering')"
        " if 'bumpwgpu.' + m in sys.modules])\n"
        "bw.CompareResult; import bumpwgpu.comparing, bumpwgpu.linting\n"
        "print(callable(bw.compare), callable(bw.lint), bw.baking.about.__name__)\n"
    )
    assert python(code).splitlines() == ["['bumpwgpu._bumpwgpu'] False", "[]", "True True about"]
    homes = {name for names in bw._HOMES.values() for name in names}
    assert homes | set(bw._MODULES) | {"__version__"} == set(bw.__all__)
    assert not homes & {path.stem for path in PACKAGE.glob("*.py")}, "a module would hide a name"
    assert set(bw.__all__) <= set(dir(bw))
    with pytest.raises(AttributeError, match="no attribute 'nonsense'"):
        bw.nonsense  # noqa: B018


def test_importing_opens_no_device() -> None:
    code = (
        "import bumpwgpu, os\n"
        "maps = open('/proc/self/maps').read() if os.path.exists('/proc/self/maps') else ''\n"
        "print('vulkan' in maps)"
    )
    assert python(code) == "False\n"
