"""The main job on real input: bake, render and compare a terrain and a brick wall.

    python examples/demo.py --output demo_output

The terrain is the elevation model that matplotlib ships (Jacksboro fault, metres); the bricks and both
albedos are made here. Only the public API is used. Everything it writes is listed in report.html.
"""

from __future__ import annotations

import argparse
import html
import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import matplotlib.cbook
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

import bumpwgpu as bw

SIZE = (320, 320)
MAPS = ("normal", "normal_xy", "relief", "pyramid")
TECHNIQUES = (
    "flat",
    "bump",
    "normal",
    "dot3",
    "parallax",
    "parallax_limited",
    "steep",
    "binary",
    "relief",
    "pom",
    "interval",
    "exact",
)
# None: every technique, on a height map with several step counts.
COMPARED: tuple[str, ...] | None = None
ELEVATIONS = (90, 45, 20, 10, 5)
MAX_ERROR_TEXELS = 0.5
# Share of a comparison in the progress bar, in pictures.
COMPARE_STEPS = 20
# The terrain's relief is 1/36 of its width: pictures show it steeper, maps and comparisons true to scale.
EXAGGERATION = 3.0
Step = Callable[[str, int], None]
METRES_PER_DEGREE = 111_320.0


@dataclass
class Subject:
    """A height map with its albedo, and what the demo found out about it."""

    name: str
    about: str
    height: bw.HeightMap
    albedo: NDArray[np.uint8]
    tiles: bool
    pictures: dict[str, list[tuple[str, Path]]] = field(default_factory=dict)
    maps: list[Path] = field(default_factory=list)
    results: dict[str, bw.CompareResult] = field(default_factory=dict)


def ramp(
    heights: NDArray[np.float32], stops: list[tuple[float, tuple[int, int, int]]]
) -> NDArray[np.float32]:
    """Colours 0..255 looked up by height."""
    levels = [level for level, _ in stops]
    channels = [np.interp(heights, levels, [colour[i] for _, colour in stops]) for i in range(3)]
    return np.stack(channels, axis=-1).astype(np.float32)


def terrain() -> Subject:
    """The Jacksboro fault, true to scale: one unit of the mesh is the width of the model."""
    model = matplotlib.cbook.get_sample_data("jacksboro_fault_dem.npz")
    metres = model["elevation"].astype(np.float32)
    low, high = float(metres.min()), float(metres.max())
    rows, columns = metres.shape
    latitude = math.radians(float(model["ymin"] + model["ymax"]) / 2)
    width = columns * float(model["dx"]) * METRES_PER_DEGREE * math.cos(latitude)
    depth = rows * float(model["dy"]) * METRES_PER_DEGREE
    height = bw.HeightMap(
        metres,
        height_range="auto",
        scale=(high - low) / width,
        tile_size=(1.0, depth / width),
        wrap="mirror",
    )
    albedo = ramp(
        height.array,
        [(0.0, (72, 92, 50)), (0.35, (116, 118, 68)), (0.7, (150, 124, 92)), (1.0, (214, 208, 200))],
    )
    about = (
        f"Jacksboro fault, Tennessee: {columns} x {rows} samples, "
        f"{width / 1000:.1f} x {depth / 1000:.1f} km, {low:.0f} to {high:.0f} m; pictures with "
        f"heights x {EXAGGERATION:g}, maps and comparison true to scale"
    )
    return Subject("terrain", about, height, albedo.astype(np.uint8), tiles=False)


def bricks() -> Subject:
    """A made brick wall whose albedo follows its own heights."""
    height = bw.HeightMap.procedural("bricks", size=512, seed=7, scale=0.06)
    grain = bw.HeightMap.procedural("fbm", size=512, seed=3).array
    albedo = ramp(
        height.array,
        [(0.0, (150, 146, 138)), (0.45, (140, 130, 120)), (0.6, (142, 66, 46)), (1.0, (176, 88, 62))],
    )
    albedo *= (0.75 + 0.5 * grain)[..., None]
    about = "Bricks made by the package: 512 x 512, tiling"
    return Subject("bricks", about, height, albedo.clip(0, 255).astype(np.uint8), tiles=True)


@dataclass(frozen=True)
class View:
    """A mesh, the camera that looks at it and the light on it."""

    mesh: bw.Mesh
    camera: bw.Camera
    lights: tuple[bw.Light, ...]


def tiled(mesh: bw.Mesh, repeats: tuple[int, int]) -> bw.Mesh:
    """The same mesh with the image repeated over it."""
    return bw.Mesh(mesh.positions, mesh.indices, mesh.uvs * np.float32(repeats), normals=mesh.normals)


def views(subject: Subject) -> dict[str, View]:
    """The three meshes; the quad is seen at a low angle under a low sun, where techniques differ most."""
    width, depth = subject.height.tile_size
    sun = bw.Light.directional((0.75, 0.3, -0.5))
    lamp = bw.Light.point((-1.6, 1.4, 1.6), intensity=2.5)
    above = bw.Light.directional((0.4, -0.8, -0.6), intensity=0.7)
    quad = bw.Mesh.quad((width, depth))
    ring = tiled(bw.Mesh.torus(), (6, 3) if subject.tiles else (4, 2))
    return {
        "quad": View(
            quad, bw.Camera.look_at((0.0, -1.05, 0.55), (0.0, -0.14, 0.0), up=(0, 0, 1), fov_y=46.0), (sun,)
        ),
        "cube": View(
            bw.Mesh.cube(), bw.Camera.look_at((1.25, 1.0, 1.55), (0, 0, 0), fov_y=40.0), (above, lamp)
        ),
        "torus": View(ring, bw.Camera.look_at((0, 1.9, 2.0), (0, -0.05, 0), fov_y=42.0), (above, lamp)),
    }


def contact_sheet(rows: dict[str, list[tuple[str, Path]]], path: Path, cell: int = 160) -> None:
    """All pictures of one subject in one: a row a mesh, a column a technique."""
    columns = max(len(row) for row in rows.values())
    sheet = Image.new("RGB", (columns * cell, len(rows) * (cell + 16)), "white")
    draw = ImageDraw.Draw(sheet)
    for j, (mesh, row) in enumerate(rows.items()):
        for i, (technique, picture) in enumerate(row):
            corner = (i * cell, j * (cell + 16))
            draw.text((corner[0] + 4, corner[1] + 2), f"{mesh}: {technique}", fill="black")
            with Image.open(picture) as image:
                small = image.convert("RGBA").resize((cell, cell), Image.Resampling.LANCZOS)
            sheet.paste(small, (corner[0], corner[1] + 16), small)
    sheet.save(path)


def material(subject: Subject, specular: float = 0.15) -> bw.Material:
    """Height and colour; a renderer needs no more, every other map is baked from them."""
    scale = subject.height.scale * (1.0 if subject.tiles else EXAGGERATION)
    return bw.Material(
        height=subject.height.replace(scale=scale), albedo=subject.albedo, specular=specular, shininess=24.0
    )


def bake(subject: Subject, folder: Path, step: Step) -> None:
    """All maps of a subject, as files."""
    step(f"baking {subject.name}", 0)
    subject.maps = bw.bake(subject.height, maps=MAPS).save(folder / "maps", prefix=subject.name)
    step(f"baked {subject.name}", len(MAPS))


def draw(subject: Subject, folder: Path, step: Step) -> None:
    """Each mesh with each technique, and the contact sheet."""
    (folder / "pictures").mkdir(exist_ok=True)
    surface, matt = material(subject), material(subject, specular=0.0)
    for name, view in views(subject).items():
        row = subject.pictures.setdefault(name, [])
        for technique in TECHNIQUES:
            step(f"{subject.name}: {name}, {technique}", 0)
            # The fixed-function hardware that dot3 models had one light and no highlight.
            used, lights = (matt, view.lights[:1]) if technique == "dot3" else (surface, view.lights)
            frame = bw.render(
                view.mesh, used, camera=view.camera, lights=lights, technique=technique, size=SIZE
            )
            path = folder / "pictures" / f"{subject.name}_{name}_{technique}.png"
            row.append((technique, frame.save(path)))
            step(f"{subject.name}: {name}, {technique}", 1)
    contact_sheet(subject.pictures, folder / f"{subject.name}_pictures.png")


def compare(subject: Subject, name: str, source: Any, folder: Path, step: Step) -> None:
    """One comparison with its plot, table and report of its own."""
    last = 0

    def progress(done: int, total: int, text: str) -> None:
        nonlocal last
        now = done * COMPARE_STEPS // max(total, 1)
        step(f"comparing {subject.name}, {name}: {text}", now - last)
        last = now

    result = bw.compare(source, COMPARED, elevations=ELEVATIONS, rays=4096, repeats=3, progress=progress)
    stem = folder / f"{subject.name}_{name}"
    result.plot(stem.with_suffix(".png"))
    result.to_json(stem.with_suffix(".json"))
    result.report(stem.with_suffix(".html"), title=f"{subject.name}, {name}: {subject.about}")
    subject.results[name] = result
    step(f"compared {subject.name}, {name}", COMPARE_STEPS - last)


def advice(result: bw.CompareResult) -> str:
    """What a comparison recommends, in one sentence."""
    return str(result.recommend(max_error=MAX_ERROR_TEXELS))


def front_table(result: bw.CompareResult) -> str:
    """The settings worth having, as HTML."""
    clock = "time_device_ns_per_ray" if result.timed_on == "device" else "time_cpu_ns_per_ray"
    rows = "".join(
        f"<tr><td>{html.escape(row['label'])}</td><td>{row[clock]:.3g}</td>"
        f"<td>{row['uv_error_p99_texels']:.3g}</td><td>{100 * row['failure_rate']:.3g}</td></tr>"
        for row in result.pareto()
    )
    unit = "pixel" if result.kind == "scene" else "ray"
    return (
        f"<table><tr><th>worth having</th><th>ns a {unit} ({result.timed_on})</th>"
        f"<th>p99 error, texels</th><th>failed, %</th></tr>{rows}</table>"
    )


def section(subject: Subject, folder: Path) -> str:
    """What the page says about one subject."""
    parts = [f"<h2>{html.escape(subject.name)}</h2><p>{html.escape(subject.about)}.</p>"]
    maps = [path for path in subject.maps if "pyramid" not in path.stem]
    parts.append("<div class=row>")
    parts += [
        f"<figure><img src='{path.relative_to(folder)}' width=200>"
        f"<figcaption>{path.stem}</figcaption></figure>"
        for path in maps
    ]
    sheet = f"{subject.name}_pictures.png"
    parts.append(f"</div><a href='{sheet}'><img src='{sheet}' class=wide></a>")
    for name, result in subject.results.items():
        stem = f"{subject.name}_{name}"
        parts.append(
            f"<h3>{html.escape(subject.name)}, {html.escape(name)}</h3>"
            f"<p class=advice>{html.escape(advice(result))}</p>{front_table(result)}"
            f"<a href='{stem}.html'>Every setting, side by side</a> "
            f"<a href='{stem}.json'>as JSON</a><img src='{stem}.png' class=wide>"
        )
    return "".join(parts)


def page(subjects: list[Subject], folder: Path, seconds: float) -> Path:
    """One page about everything."""
    adapters = ", ".join(f"{adapter['name']} ({adapter['driver']})" for adapter in bw.info()["adapters"])
    path = folder / "report.html"
    path.write_text(
        "<!doctype html><html lang=en><meta charset=utf-8><title>bumpwgpu demo</title><style>"
        "body{font:15px/1.5 system-ui,sans-serif;max-width:1100px;margin:2em auto;padding:0 1em}"
        ".row{display:flex;gap:1em;flex-wrap:wrap}figure{margin:0}.wide{width:100%}"
        "td,th{padding:.2em 1em .2em 0;text-align:left}.advice{background:#eef6ee;padding:.6em 1em}"
        "a{margin-right:1em}</style><h1>Which technique should this asset use?</h1>"
        f"<p>bumpwgpu {html.escape(bw.__version__)} on {html.escape(adapters)}; {seconds:.0f} s. "
        f"Budget: {MAX_ERROR_TEXELS:g} texels at the 99th percentile against the exact surface.</p>"
        + "".join(section(subject, folder) for subject in subjects)
        + "</html>",
        encoding="utf-8",
    )
    return path


def main() -> None:
    """Bake, render, compare; say where things are and what to use."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--output", type=Path, default=Path("demo_output"), help="folder to write into")
    folder: Path = parser.parse_args().output
    folder.mkdir(parents=True, exist_ok=True)
    console = Console()
    began = time.monotonic()
    columns = (
        TextColumn("{task.percentage:>3.0f}%"),
        BarColumn(30),
        TimeElapsedColumn(),
        TextColumn("{task.description}"),
    )
    subjects = [terrain(), bricks()]
    meshes = len(views(subjects[0]))
    total = len(subjects) * (len(MAPS) + meshes * len(TECHNIQUES) + COMPARE_STEPS) + COMPARE_STEPS
    with Progress(*columns, console=console) as bar:
        task = bar.add_task("", total=total)

        def step(text: str, advance: int) -> None:
            bar.update(task, description=text, advance=advance)

        for subject in subjects:
            bake(subject, folder, step)
            draw(subject, folder, step)
            compare(subject, "map", subject.height, folder, step)
        wall = subjects[-1]
        view = views(wall)["torus"]
        scene = bw.Scene(view.mesh, material(wall), view.camera, view.lights, size=SIZE)
        compare(wall, "torus", scene, folder, step)
    report = page(subjects, folder, time.monotonic() - began)
    console.print(f"\nDone in {time.monotonic() - began:.0f} s.", highlight=False)
    for subject in subjects:
        for name, result in subject.results.items():
            console.print(f"[bold]{subject.name}, {name}:[/] {advice(result)}", highlight=False)
    console.print(
        f"Report: {report}\nPictures: {folder / 'pictures'}\nMaps: {folder / 'maps'}", highlight=False
    )


if __name__ == "__main__":
    main()
