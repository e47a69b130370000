"""Exported shaders do what the package does: held against `march` on the same rays.

GLSL is compiled and drawn by OpenGL ES, without a window. MSL is compiled as C++, which it is but for its
library, of which `tests/metal` has as much as searches use.
"""

from __future__ import annotations

import ctypes
import ctypes.util
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import bumpwgpu as bw

#: Techniques that read nothing but a height texture, so that WebGL 2 takes them.
TEXTURED = (
    "parallax", "parallax_limited", "steep", "steep_linear", "steep_exponential", "binary", "relief", "pom",
    "interval",
)  # fmt: skip
RAYS = 1500
#: Of the way through the relief: what 32 bits leave of a hit, below half the last step of any search here.
CLOSE = 2e-6

SURFACELESS = 0x31DD
GL = {
    "FRAGMENT_SHADER": 0x8B30, "VERTEX_SHADER": 0x8B31, "COMPILE_STATUS": 0x8B81, "LINK_STATUS": 0x8B82,
    "TEXTURE_2D": 0x0DE1, "R32F": 0x822E, "RED": 0x1903, "RGBA": 0x1908, "RGBA32F": 0x8814, "FLOAT": 0x1406,
    "MIN": 0x2801, "MAG": 0x2800, "WRAP_S": 0x2802, "WRAP_T": 0x2803, "NEAREST": 0x2600, "LINEAR": 0x2601,
    "repeat": 0x2901, "clamp": 0x812F, "mirror": 0x8370, "FRAMEBUFFER": 0x8D40, "COLOR": 0x8CE0,
    "COMPLETE": 0x8CD5, "ARRAY_BUFFER": 0x8892, "UNIFORM_BUFFER": 0x8A11, "STATIC_DRAW": 0x88E4, "POINTS": 0,
}  # fmt: skip

VERTEX = """#version 300 es
precision highp float;
in vec3 start; in vec3 delta; in float cosine; in vec3 light;
uniform float rays;
out vec3 _vs2fs_location0; out vec3 _vs2fs_location1; out float _vs2fs_location2; out vec3 _vs2fs_location3;
void main() {
    _vs2fs_location0 = start; _vs2fs_location1 = delta; _vs2fs_location2 = cosine; _vs2fs_location3 = light;
    gl_Position = vec4((2.0 * float(gl_VertexID) + 1.0) / rays - 1.0, 0.0, 0.0, 1.0);
    gl_PointSize = 1.0;
}
"""


class Context:
    """OpenGL ES 3 without a window; one point a ray, drawn into a row of floats."""

    def __init__(self) -> None:
        names = [ctypes.util.find_library(name) for name in ("EGL", "GLESv2")]
        if not all(names):
            pytest.skip("no libEGL and libGLESv2")
        egl, self.gl = (ctypes.CDLL(name) for name in names)
        pointer, whole = ctypes.c_void_p, ctypes.c_int
        egl.eglGetPlatformDisplay.restype = pointer
        egl.eglGetPlatformDisplay.argtypes = [whole, pointer, pointer]
        egl.eglInitialize.argtypes = [pointer, pointer, pointer]
        egl.eglChooseConfig.argtypes = [pointer, pointer, pointer, whole, pointer]
        egl.eglCreateContext.restype = pointer
        egl.eglCreateContext.argtypes = [pointer] * 4
        egl.eglMakeCurrent.argtypes = [pointer] * 4
        display = egl.eglGetPlatformDisplay(SURFACELESS, None, None)
        if not display or not egl.eglInitialize(display, None, None):
            pytest.skip("EGL opens no display without a window")
        egl.eglBindAPI(0x30A0)
        config, found = pointer(), whole()
        wanted = (whole * 5)(0x3033, 0, 0x3040, 0x40, 0x3038)
        egl.eglChooseConfig(display, wanted, ctypes.byref(config), 1, ctypes.byref(found))
        asked = (whole * 3)(0x3098, 3, 0x3038)
        context = egl.eglCreateContext(display, config, None, asked)
        if not context or not egl.eglMakeCurrent(display, None, None, context):
            pytest.skip("EGL makes no context of OpenGL ES 3")

    def compiled(self, kind: str, text: str) -> int:
        shader: int = self.gl.glCreateShader(GL[kind])
        source = ctypes.c_char_p(text.encode())
        self.gl.glShaderSource(shader, 1, ctypes.byref(source), None)
        self.gl.glCompileShader(shader)
        done, said = ctypes.c_int(), ctypes.create_string_buffer(4096)
        self.gl.glGetShaderiv(shader, GL["COMPILE_STATUS"], ctypes.byref(done))
        self.gl.glGetShaderInfoLog(shader, 4096, None, said)
        assert done.value, said.value.decode()
        return shader

    def texture(
        self, internal: str, layout: str, data: NDArray[np.float32] | None, size: Any, how: str
    ) -> int:
        gl, made = self.gl, ctypes.c_uint()
        gl.glGenTextures(1, ctypes.byref(made))
        gl.glBindTexture(GL["TEXTURE_2D"], made)
        texels = None if data is None else data.ctypes.data_as(ctypes.c_void_p)
        gl.glTexImage2D(GL["TEXTURE_2D"], 0, GL[internal], *size, 0, GL[layout], GL["FLOAT"], texels)
        filtering = GL["NEAREST"] if data is None else GL["LINEAR"]
        for name, value in (("MIN", filtering), ("MAG", filtering), ("WRAP_S", GL[how]), ("WRAP_T", GL[how])):
            gl.glTexParameteri(GL["TEXTURE_2D"], GL[name], value)
        return made.value

    def buffer(self, kind: str, data: bytes) -> int:
        made = ctypes.c_uint()
        self.gl.glGenBuffers(1, ctypes.byref(made))
        self.gl.glBindBuffer(GL[kind], made)
        self.gl.glBufferData(GL[kind], ctypes.c_ssize_t(len(data)), data, GL["STATIC_DRAW"])
        return made.value

    def drawn(
        self, fragment: str, height_map: bw.HeightMap, inputs: dict[str, NDArray[np.float32]]
    ) -> NDArray[np.float32]:
        """What the fragment shader answers for each ray, ``(N, 4)``."""
        gl, count = self.gl, len(inputs["start"])
        program = gl.glCreateProgram()
        for kind, text in (("VERTEX_SHADER", VERTEX), ("FRAGMENT_SHADER", fragment)):
            gl.glAttachShader(program, self.compiled(kind, text))
        gl.glLinkProgram(program)
        done = ctypes.c_int()
        gl.glGetProgramiv(program, GL["LINK_STATUS"], ctypes.byref(done))
        assert done.value
        gl.glUseProgram(program)
        target, frame = self.texture("RGBA32F", "RGBA", None, (count, 1), "clamp"), ctypes.c_uint()
        gl.glGenFramebuffers(1, ctypes.byref(frame))
        gl.glBindFramebuffer(GL["FRAMEBUFFER"], frame)
        gl.glFramebufferTexture2D(GL["FRAMEBUFFER"], GL["COLOR"], GL["TEXTURE_2D"], target, 0)
        assert gl.glCheckFramebufferStatus(GL["FRAMEBUFFER"]) == GL["COMPLETE"]
        gl.glViewport(0, 0, count, 1)
        rows, columns = height_map.shape
        self.texture("R32F", "RED", height_map.array, (columns, rows), height_map.wrap)
        # HeightInfo up to its wrap; what follows is for searches that read buffers.
        info = np.zeros(24, np.float32)
        info[:6] = (columns, rows, height_map.base, height_map.scale, *height_map.tile_size)
        info.view(np.uint32)[6] = ("repeat", "clamp", "mirror").index(height_map.wrap)
        block = gl.glGetUniformBlockIndex(program, b"HeightInfo_block_0Fragment")
        if block != 0xFFFFFFFF - (1 << 32) and block >= 0:
            gl.glUniformBlockBinding(program, block, 0)
            gl.glBindBufferBase(GL["UNIFORM_BUFFER"], 0, self.buffer("UNIFORM_BUFFER", info.tobytes()))
        gl.glUniform1f(gl.glGetUniformLocation(program, b"rays"), ctypes.c_float(count))
        for name, values in inputs.items():
            at = gl.glGetAttribLocation(program, name.encode())
            if at >= 0:
                self.buffer("ARRAY_BUFFER", np.ascontiguousarray(values, np.float32).tobytes())
                width = 1 if values.ndim == 1 else values.shape[1]
                gl.glVertexAttribPointer(at, width, GL["FLOAT"], 0, 0, None)
                gl.glEnableVertexAttribArray(at)
        gl.glDrawArrays(GL["POINTS"], 0, count)
        out = np.empty((count, 4), np.float32)
        gl.glReadPixels(0, 0, count, 1, GL["RGBA"], GL["FLOAT"], out.ctypes.data_as(ctypes.c_void_p))
        assert gl.glGetError() == 0
        return out


@pytest.fixture(scope="module")
def gles() -> Context:
    return Context()


def rays(height_map: bw.HeightMap) -> dict[str, NDArray[np.float32]]:
    """View rays from the lid to the floor, lights, and the cosine between ray and normal in mesh units."""
    rng = np.random.default_rng(17)
    azimuth, elevation = rng.uniform(0.0, 6.28, RAYS), np.radians(rng.uniform(8.0, 90.0, RAYS))
    run = height_map.scale / np.tan(elevation)
    lateral = np.stack([np.cos(azimuth), np.sin(azimuth)], 1) * run[:, None] / height_map.tile_size
    delta = np.concatenate([lateral, -np.ones((RAYS, 1))], 1)
    start = np.concatenate([rng.uniform(-2.0, 2.0, (RAYS, 2)), np.ones((RAYS, 1))], 1)
    made = {"start": start, "delta": delta, "cosine": np.sin(elevation), "light": delta * (1.0, 1.0, -1.0)}
    return {name: values.astype(np.float32) for name, values in made.items()}


def relief(wrap: Any) -> bw.HeightMap:
    heights = bw.HeightMap.procedural("fbm", size=48, seed=5).array
    return bw.HeightMap(heights, scale=0.08, tile_size=(1.5, 1.0), wrap=wrap)


def exported(name: str, height_map: bw.HeightMap, language: Any) -> str:
    parameters = bw.techniques.get(name).parameters
    return bw.Recommendation(name, parameters, None, None, None, "", _height_map=height_map).shader(language)


def check(
    name: str, found: NDArray[np.float32], height_map: bw.HeightMap, inputs: dict[str, NDArray[np.float32]]
) -> None:
    """Holds place, status and steps of each ray against those of the package."""
    technique = bw.techniques.get(name)
    hits = bw.march(height_map, inputs["start"], inputs["delta"], technique, device="cpu")
    assert (found[:, 1] == hits.status).mean() > 0.998, name
    both = (found[:, 1] == 0) & (hits.status == 0)
    off = np.abs(found[both, 0] - hits.t[both])
    # Rounding moves a hit where a ray grazes a layer; the rest agrees to what 32 bits hold.
    assert np.median(off) < 1e-6, name
    assert (off < CLOSE).mean() > 0.995, (name, np.sort(off)[-8:])
    assert (found[both, 2] == hits.steps[both]).mean() > 0.99, name
    if technique.PARAMETERS:
        # The comparison notices another setting.
        first = technique.PARAMETERS[0]
        other = type(technique)(**{first.name: technique.parameters[first.name] // 2})
        wrong = bw.march(height_map, inputs["start"], inputs["delta"], other, device="cpu")
        same = np.abs(found[both, 0] - wrong.t[both]) < CLOSE
        assert (same & (found[both, 2] == wrong.steps[both])).mean() < 0.9, name


@pytest.mark.parametrize("wrap", ["repeat", "clamp", "mirror"])
def test_exported_glsl_finds_the_same_hits(gles: Context, wrap: Any) -> None:
    height_map = relief(wrap)
    inputs = rays(height_map)
    for name in TEXTURED:
        check(name, gles.drawn(exported(name, height_map, "glsl"), height_map, inputs), height_map, inputs)


METAL = Path(__file__).parent / "metal"


def compiled(source: str, options: list[str]) -> None:
    compiler = shutil.which("g++")
    if compiler is None:
        pytest.skip("no g++")
    flags = (
        "-std=c++17",
        "-O1",
        "-fsingle-precision-constant",
        "-ffp-contract=off",
        "-Wno-attributes",
        "-x",
        "c++",
    )
    command = [compiler, *flags, "-I", str(METAL), source, *options]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr[:2000]


@pytest.mark.parametrize(
    ("name", "wrap"), [("relief", "repeat"), ("pom", "mirror"), ("steep_linear", "clamp")]
)
def test_exported_msl_finds_the_same_hits(name: str, wrap: Any, tmp_path: Path) -> None:
    height_map = relief(wrap)
    inputs = rays(height_map)
    search, program = tmp_path / "search.metal", tmp_path / "draw"
    search.write_text(exported(name, height_map, "msl"))
    compiled(str(METAL / "draw.cpp"), [f'-DSEARCH="{search}"', "-o", str(program)])
    rows, columns = height_map.shape
    sizes = np.array([columns, rows, ("repeat", "clamp", "mirror").index(wrap), RAYS], np.int32)
    extent = np.array([height_map.base, height_map.scale, *height_map.tile_size], np.float32)
    table = np.concatenate([values.reshape(RAYS, -1) for values in inputs.values()], 1)
    (tmp_path / "rays").write_bytes(
        sizes.tobytes() + extent.tobytes() + height_map.array.tobytes() + table.tobytes()
    )
    subprocess.run([program, tmp_path / "rays", tmp_path / "answers"], check=True, timeout=60)
    found = np.fromfile(tmp_path / "answers", np.float32).reshape(RAYS, 4)
    check(name, found, height_map, inputs)


@pytest.mark.slow
def test_all_msl_compiles(tmp_path: Path) -> None:
    height_map = relief("clamp")
    path = tmp_path / "search.metal"
    for name in bw.techniques.marching():
        path.write_text(exported(name, height_map, "msl"))
        compiled(str(path), ["-fsyntax-only"])
    path.write_text(path.read_text().replace("search(", "serach(", 1))
    with pytest.raises(AssertionError):
        compiled(str(path), ["-fsyntax-only"])
