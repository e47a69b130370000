"""The rules of ARCHITECTURE.md that a compiler does not check."""

from __future__ import annotations

import json
import re
import subprocess
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
SEARCHES = ROOT / "crates" / "heightfield" / "src" / "search"
SHADERS = ROOT / "shaders_wgsl"

# Workspace crate -> workspace crates it may use directly.
ALLOWED = {
    "heightfield": set(),
    "shaders": set(),
    "bake": {"heightfield"},
    "mesh": {"heightfield"},
    "render": {"heightfield", "bake", "mesh", "shaders"},
    "compare": {"heightfield", "bake", "mesh"},
    "python": {"heightfield", "bake", "mesh", "shaders", "render", "compare"},
}


@cache
def dependencies() -> dict[str, set[str]]:
    """Package name -> names of the packages it links, from cargo's own resolution (no dev-dependencies)."""
    command = ["cargo", "metadata", "--format-version", "1", "--locked", "--offline"]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    if run.returncode:
        # Right after a clone the registry has not been read yet.
        command.remove("--offline")
        run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    metadata = json.loads(run.stdout)
    names = {package["id"]: package["name"] for package in metadata["packages"]}
    found: dict[str, set[str]] = {}
    for node in metadata["resolve"]["nodes"]:
        linked = found.setdefault(names[node["id"]], set())
        for dependency in node["deps"]:
            if any(kind["kind"] is None for kind in dependency["dep_kinds"]):
                linked.add(names[dependency["pkg"]])
    return found


def closure(name: str) -> set[str]:
    """Everything `name` links, directly or not."""
    seen: set[str] = set()
    todo = [name]
    while todo:
        for dependency in dependencies()[todo.pop()] - seen:
            seen.add(dependency)
            todo.append(dependency)
    return seen


def test_every_crate_has_a_place() -> None:
    assert {path.parent.name for path in ROOT.glob("crates/*/Cargo.toml")} == set(ALLOWED)


@pytest.mark.parametrize("crate", ALLOWED)
def test_arrows_point_one_way(crate: str) -> None:
    assert dependencies()[crate] & set(ALLOWED) <= ALLOWED[crate]


@pytest.mark.parametrize(
    ("library", "owner"),
    [("wgpu", "render"), ("wgpu-core", "render"), ("pyo3", "python"), ("numpy", "python")],
)
def test_one_crate_knows_it(library: str, owner: str) -> None:
    reached = {crate for crate in ALLOWED if library in closure(crate)}
    above = {crate for crate in ALLOWED if owner == crate or owner in closure(crate)}
    assert owner in reached
    assert reached == above


def test_the_closure_sees_a_violation() -> None:
    # Negative control: were the arrows reversed, the check above would notice.
    assert "wgpu" in closure("python")
    assert "wgpu" not in closure("heightfield")


def registered() -> set[str]:
    """The search modules that the Rust registry names."""
    text = (SEARCHES / "mod.rs").read_text()
    registry = text[text.index("static REGISTRY") :]
    return set(re.findall(r"&(\w+)::INFO", registry))


def test_every_search_has_its_twin() -> None:
    rust = registered()
    assert len(rust) >= 10
    assert {name for name in rust if not (SEARCHES / f"{name}.rs").is_file()} == set()
    assert {path.stem for path in (SHADERS / "search").glob("*.wgsl")} == rust


def test_searches_define_both_functions() -> None:
    for path in (SHADERS / "search").glob("*.wgsl"):
        functions = set(re.findall(r"^fn (\w+)\(", path.read_text(), re.MULTILINE))
        assert {"search", "occluded"} <= functions, path.name


def without_comments(path: Path) -> str:
    return re.sub(r"//.*", "", path.read_text())


def test_shader_folders_hold_what_they_should() -> None:
    inside = ("lib", "search", "surface", "shading")
    for path in (path for folder in inside for path in (SHADERS / folder).rglob("*.wgsl")):
        text = without_comments(path)
        assert "@group" not in text, f"{path}: it has no bindings"
        assert not re.search(r"@(vertex|fragment|compute)", text), f"{path}: it has no entry points"
    for path in (SHADERS / "bindings").rglob("*.wgsl"):
        assert not re.search(r"@(vertex|fragment|compute)", without_comments(path)), path.name


@pytest.mark.parametrize(("pattern", "limit"), [("crates/**/*.rs", 600), ("shaders_wgsl/**/*.wgsl", 250)])
def test_files_stay_readable(pattern: str, limit: int) -> None:
    lengths = {str(path.relative_to(ROOT)): len(path.read_text().splitlines()) for path in ROOT.glob(pattern)}
    assert lengths
    assert {name: lines for name, lines in lengths.items() if lines > limit} == {}
