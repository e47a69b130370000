"""The picture of the README: one brick height map on a torus, a column a technique.

python examples/techniques_picture.py docs/images/techniques.png
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

import bumpwgpu as bw

TECHNIQUES = ("flat", "normal", "parallax_limited", "steep", "exact")
SIDE = 220
CAPTION = 24


def main(path: Path) -> None:
    """Renders at twice the size and scales down."""
    bricks = bw.HeightMap.procedural("bricks", size=512, scale=0.07)
    ring = bw.Mesh.torus()
    ring = bw.Mesh(ring.positions, ring.indices, ring.uvs * np.float32((5, 2)), normals=ring.normals)
    clay, mortar = np.array([172, 84, 58]), np.array([158, 152, 142])
    share = np.clip((bricks.array[..., None] - 0.45) / 0.15, 0.0, 1.0)
    albedo = (mortar + share * (clay - mortar)).astype(np.uint8)
    material = bw.Material(height=bricks, albedo=albedo, specular=0.1)
    camera = bw.Camera.look_at((0.55, 0.62, 0.85), (0.3, 0.05, 0.45), fov_y=52.0)
    light = bw.Light.directional((0.9, -0.7, -0.35))
    strip = Image.new("RGB", (len(TECHNIQUES) * SIDE, SIDE + CAPTION), "white")
    draw = ImageDraw.Draw(strip)
    font = ImageFont.load_default(size=15)
    for at, technique in enumerate(TECHNIQUES):
        frame = bw.render(
            ring, material, camera=camera, lights=[light], technique=technique, size=(2 * SIDE, 2 * SIDE)
        )
        small = frame.to_pil().resize((SIDE, SIDE), Image.Resampling.LANCZOS)
        strip.paste(small, (at * SIDE, CAPTION), small)
        draw.text((at * SIDE + SIDE / 2, CAPTION / 2), technique, fill="black", font=font, anchor="mm")
    path.parent.mkdir(parents=True, exist_ok=True)
    strip.quantize(192, dither=Image.Dither.NONE).save(path, optimize=True)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "docs/images/techniques.png"))
