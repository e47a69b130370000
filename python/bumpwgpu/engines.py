"""Technique and parameters in the words of engines' materials.

Names, units and ranges are those of the engines' sources:

* Bevy 0.16 and later: ``crates/bevy_pbr/src/parallax.rs`` and ``pbr_material.rs``; what is done with them,
  ``render/parallax_mapping.wgsl`` there.
* Godot 4: ``BaseMaterial3D`` in ``scene/resources/material.cpp``. Its shader multiplies ``heightmap_scale``
  by 0.01; the editor's sliders end at 16 and at 64 layers.
* three.js: ``src/materials/MeshStandardMaterial.js``; a vertex moves by
  ``texel * displacementScale + displacementBias`` (``ShaderChunk/displacementmap_vertex.glsl.js``).
* Unity HDRP: ``Editor/Material/UIBlocks/SurfaceOptionUIBlock.cs`` and ``LitSurfaceInputsUIBlock.cs`` of
  com.unity.render-pipelines.high-definition. Pixel displacement has an amplitude in centimetres and no base:
  its highest point always lies on the mesh. Steps are 1 to 64.
"""

from __future__ import annotations

import json
from typing import Any, NamedTuple

from ._checks import choice
from .heightmap import HeightMap

__all__ = ["BUILT_IN", "ENGINES", "EngineSettings", "engine_settings"]

#: Engines whose terms are known.
ENGINES = ("bevy", "godot", "threejs", "unity_hdrp")
#: Techniques that an engine's own material has; `recommend(among=...)` takes these.
BUILT_IN: dict[str, tuple[str, ...]] = {
    "bevy": ("pom", "relief"),
    "godot": ("parallax_limited",),
    "threejs": ("displacement",),
    "unity_hdrp": ("pom", "displacement"),
}
#: Most layers that the sliders of an engine reach.
_MOST_LAYERS = {"godot": 64, "unity_hdrp": 64}
#: End of HDRP's slider for the mip level from which pixel displacement fades out.
_LAST_MIP = 16
#: Least length and width of a primitive that HDRP's editor takes, metres.
_LEAST_PRIMITIVE = 0.01


class EngineSettings(NamedTuple):
    """Settings of an engine's material. ``str(settings)`` is text to paste or to follow.

    Attributes
    ----------
    engine : str
        Which engine.
    built_in : bool
        Whether the engine's own material does it; otherwise a shader of one's own is needed, for which
        :meth:`Recommendation.shader` has the search.
    values : dict of str to value
        Names and values as the engine spells them.
    notes : tuple of str
        What to mind.
    """

    engine: str
    built_in: bool
    values: dict[str, Any]
    notes: tuple[str, ...]

    def __str__(self) -> str:
        return _WRITERS[self.engine](self)


def engine_settings(
    technique: str, parameters: dict[str, int], height_map: HeightMap, engine: str
) -> EngineSettings:
    """Settings of an engine's material for a technique on a height map.

    Parameters
    ----------
    technique : str
        Its name.
    parameters : dict of str to int
        Its parameters.
    height_map : HeightMap
        Whose scale, base and tile size the material gets.
    engine : {"bevy", "godot", "threejs", "unity_hdrp"}
        Which engine.

    Returns
    -------
    EngineSettings

    Raises
    ------
    ValueError
        No such engine.

    Notes
    -----
    Engines that vary the number of layers with the view angle get the same number for all angles: that
    is the setting that was measured.
    """
    choice("engine", engine, ENGINES)
    layers = parameters.get("steps", parameters.get("linear"))
    built_in = technique in BUILT_IN[engine]
    notes = []
    nearest = engine == "godot" and technique == "pom"
    if (built_in or nearest) and layers is not None and layers > _MOST_LAYERS.get(engine, 1 << 30):
        built_in = False
        notes.append(f"the material takes at most {_MOST_LAYERS[engine]} layers, and {layers} are needed")
    elif not built_in and not nearest:
        notes.append(f"no built-in material does {technique}; take the search from shader()")
    values, more = _MATERIALS[engine](technique, parameters, layers, height_map, built_in)
    return EngineSettings(engine, built_in, values, (*notes, *more))


def _depth_uv(height_map: HeightMap) -> float:
    """Depth of the relief in units of u."""
    return height_map.scale / height_map.tile_size[0]


def _base_note(height_map: HeightMap, base: float, engine: str) -> list[str]:
    if height_map.base == base:
        return []
    lies = "highest" if base == 1.0 else "lowest"
    return [f"{engine} lays the {lies} point on the mesh; this map's base is {height_map.base:g}"]


def _square_note(height_map: HeightMap) -> list[str]:
    across, along = height_map.tile_size
    if across == along:
        return []
    return [f"depth is in units of u here; the tile is {across:g} by {along:g}, so it differs along v"]


def _bevy(
    technique: str, parameters: dict[str, int], layers: int | None, height_map: HeightMap, built_in: bool
) -> tuple[dict[str, Any], list[str]]:
    values: dict[str, Any] = {"parallax_depth_scale": _depth_uv(height_map)}
    if built_in:
        method = "ParallaxMappingMethod::Occlusion"
        if technique == "relief":
            method = f"ParallaxMappingMethod::Relief {{ max_steps: {parameters['refine']} }}"
        values["parallax_mapping_method"] = method
        values["max_parallax_layer_count"] = float(layers or 0)
    notes = ["depth_map is a depth map: 0 is highest, so invert the heights; load it as linear data"]
    if built_in:
        notes.append("Bevy takes fewer layers for views along the normal; the error is then larger there")
    return values, [*notes, *_base_note(height_map, 1.0, "Bevy"), *_square_note(height_map)]


def _godot(
    technique: str, parameters: dict[str, int], layers: int | None, height_map: HeightMap, built_in: bool
) -> tuple[dict[str, Any], list[str]]:
    # Godot multiplies heightmap_scale by 0.01.
    deep = technique == "pom" and layers is not None and layers <= _MOST_LAYERS["godot"]
    values: dict[str, Any] = {
        "heightmap_enabled": built_in or deep,
        "heightmap_scale": 100.0 * _depth_uv(height_map),
    }
    notes = []
    if built_in or deep:
        values["heightmap_deep_parallax"] = deep
    if deep:
        values["heightmap_min_layers"] = layers
        values["heightmap_max_layers"] = layers
    if technique == "pom":
        # Its shader steps by the view direction's x and y without dividing them by z.
        notes.append(
            "Godot's deep parallax flattens the relief at low angles, to half its depth at 30 degrees: the "
            "error is not the one that was measured; take the search from shader() for that"
        )
    values["heightmap_flip_texture"] = False
    notes.append("import the height texture as linear data, lossless or VRAM uncompressed")
    if height_map.scale > 0.0 and abs(values["heightmap_scale"]) > 16.0:
        notes.append("the editor's slider for heightmap_scale ends at 16; set it from a script")
    return values, [*notes, *_base_note(height_map, 1.0, "Godot"), *_square_note(height_map)]


def _threejs(
    technique: str, parameters: dict[str, int], layers: int | None, height_map: HeightMap, built_in: bool
) -> tuple[dict[str, Any], list[str]]:
    notes = ["set colorSpace = NoColorSpace on the height texture"]
    if built_in:
        # A vertex goes along its normal by displacementScale * texel + displacementBias.
        values: dict[str, Any] = {
            "displacementScale": height_map.scale,
            "displacementBias": -height_map.scale * height_map.base,
        }
        return values, ["give the texture as displacementMap; the mesh must be as fine as the relief", *notes]
    values = {
        "uniforms.scale": height_map.scale,
        "uniforms.base": height_map.base,
        "uniforms.tileSize": list(height_map.tile_size),
    }
    notes.append(
        "these are for a ShaderMaterial of one's own; three.js' materials know displacementMap alone"
    )
    return values, notes


def _unity(
    technique: str, parameters: dict[str, int], layers: int | None, height_map: HeightMap, built_in: bool
) -> tuple[dict[str, Any], list[str]]:
    notes = [
        "mesh units are taken for metres",
        "turn sRGB off in the import settings of the height texture; single channel, 16 bits",
    ]
    amplitude = 100.0 * height_map.scale
    if technique == "displacement":
        values: dict[str, Any] = {
            "Displacement Mode": "Tessellation displacement",
            "Parametrization": "Amplitude",
            "Amplitude (cm)": amplitude,
            "Base": height_map.base,
            "Offset": 0.0,
        }
        return values, [*notes, "it is the shader HDRP/LitTessellation that has this mode"]
    if not built_in:
        return {"Displacement Mode": "None"}, notes
    across, along = height_map.tile_size
    values = {
        "Displacement Mode": "Pixel displacement",
        "Minimum steps": layers,
        "Maximum steps": layers,
        "Fading mip level start": _LAST_MIP,
        "Primitive length": across,
        "Primitive width": along,
        "Amplitude (cm)": amplitude,
    }
    notes.append(
        "primitive sizes are those of the mesh that UV 0 to 1 covers, length along u and width along v"
    )
    notes.append("what was measured reads the finest mip: a lower fading level flattens the relief far away")
    if min(across, along) < _LEAST_PRIMITIVE:
        notes.append(f"primitive sizes below {_LEAST_PRIMITIVE:g} m are not taken; scale the mesh up")
    return values, [*notes, *_base_note(height_map, 1.0, "HDRP's pixel displacement")]


_MATERIALS = {"bevy": _bevy, "godot": _godot, "threejs": _threejs, "unity_hdrp": _unity}


def _comment(lines: tuple[str, ...], mark: str) -> str:
    return "".join(f"{mark} {line}\n" for line in lines)


def _plain(value: Any) -> str:
    if isinstance(value, float):
        text = f"{value:.6g}"
        return text if any(letter in text for letter in ".en") else f"{text}.0"
    return str(value)


def _write_bevy(settings: EngineSettings) -> str:
    body = "".join(f"    {name}: {_plain(value)},\n" for name, value in settings.values.items())
    start = _comment(settings.notes, "//") + "StandardMaterial {\n    depth_map: Some(depth_texture),\n"
    return f"{start}{body}    ..default()\n}}\n"


def _write_godot(settings: EngineSettings) -> str:
    def said(value: Any) -> str:
        return str(value).lower() if isinstance(value, bool) else _plain(value)

    body = "".join(f"material.{name} = {said(value)}\n" for name, value in settings.values.items())
    return _comment(settings.notes, "#") + "var material := StandardMaterial3D.new()\n" + body


def _write_threejs(settings: EngineSettings) -> str:
    return _comment(settings.notes, "//") + f"const relief = {json.dumps(settings.values, indent=2)};\n"


def _write_unity(settings: EngineSettings) -> str:
    body = "".join(f"{name}: {_plain(value)}\n" for name, value in settings.values.items())
    return f"HDRP/Lit\n{body}" + _comment(settings.notes, "Note:")


_WRITERS = {
    "bevy": _write_bevy,
    "godot": _write_godot,
    "threejs": _write_threejs,
    "unity_hdrp": _write_unity,
}
