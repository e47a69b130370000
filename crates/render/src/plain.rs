//! The techniques that do not search: the surface stays on the mesh, or the mesh itself is displaced. A new one is a file in `surface/`, its twin in
//! `shaders_wgsl/surface/`, and an entry here.

use heightfield::technique::Reads;

use crate::layouts::MaterialMaps;

/// What there is to know of a technique that does not search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlainTechnique {
    /// The name used everywhere.
    pub name: &'static str,
    /// What it does, in one line.
    pub summary: &'static str,
    /// The work it comes from; empty when there is none to name.
    pub source: &'static str,
    /// File in `shaders_wgsl/entry/`.
    pub(crate) entry: &'static str,
    /// File in `shaders_wgsl/surface/`.
    pub(crate) surface: &'static str,
    /// What it binds besides the albedo.
    pub(crate) maps: MaterialMaps,
    /// What it reads of the height field.
    pub(crate) reads: Option<Reads>,
    /// Entry and surface that take their place when the material has a normal map of its own.
    pub(crate) own_normals: Option<(&'static str, &'static str)>,
    /// Whether the mesh is cut into micro-polygons that are moved.
    pub displaces: bool,
}

/// Reads heights at the point, in the axes of the mapping.
const BUMP: PlainTechnique = PlainTechnique {
    name: "bump",
    summary: "normals bent by the heights: central differences, axes at any angle",
    source: "Blinn, Simulation of Wrinkled Surfaces, SIGGRAPH 1978; Mikkelsen, Surface Gradient-Based Bump \
             Mapping Framework, JCGT 2020",
    entry: "sloped",
    surface: "bump",
    maps: MaterialMaps::None,
    reads: Some(Reads::Heights),
    own_normals: None,
    displaces: false,
};

/// Nothing but the mesh.
pub(crate) const FLAT: PlainTechnique = PlainTechnique {
    name: "flat",
    summary: "the bare mesh, no relief",
    source: "",
    entry: "plain",
    surface: "flat",
    reads: None,
    ..BUMP
};

/// All of them, the plainest first.
pub const PLAIN_TECHNIQUES: [PlainTechnique; 10] = [
    FLAT,
    PlainTechnique {
        name: "bump_forward",
        summary: "as bump, from forward differences: a read less, first order",
        surface: "bump_forward",
        ..BUMP
    },
    BUMP,
    PlainTechnique {
        name: "bump_orthogonal",
        summary: "as bump, as if the axes of the mapping were orthogonal",
        source: "Kilgard, A Practical and Robust Bump-mapping Technique for Today's GPUs, GDC 2000",
        surface: "bump_orthogonal",
        ..BUMP
    },
    PlainTechnique {
        name: "bump_derivative",
        summary: "as bump, the axes from derivatives along the screen: needs no tangents",
        source: "Mikkelsen, Bump Mapping Unparametrized Surfaces on the GPU, 2010",
        entry: "plain",
        surface: "bump_derivative",
        ..BUMP
    },
    PlainTechnique {
        name: "bump_blinn",
        summary: "as bump, by the published formula, which bends the normal of the axes",
        source: "Blinn, Simulation of Wrinkled Surfaces, SIGGRAPH 1978",
        surface: "bump_blinn",
        ..BUMP
    },
    PlainTechnique {
        name: "bump_exact",
        summary: "the normal of the displaced surface, with the term h dN/du that the others drop",
        source: "Blinn, Simulation of Wrinkled Surfaces, SIGGRAPH 1978, before the approximation",
        entry: "bent",
        surface: "bump_exact",
        ..BUMP
    },
    PlainTechnique {
        name: "normal",
        summary: "normals from a map baked from the heights, or the material's own",
        source: "Cohen, Olano, Manocha, Appearance-Preserving Simplification, SIGGRAPH 1998",
        surface: "normal",
        maps: MaterialMaps::Map,
        reads: None,
        own_normals: Some(("mapped", "tangent")),
        ..BUMP
    },
    PlainTechnique {
        name: "dot3",
        summary: "8-bit fixed-function diffuse with a normalisation cube map, one light",
        source: "Kilgard, A Practical and Robust Bump-mapping Technique for Today's GPUs, GDC 2000",
        entry: "dot3",
        surface: "dot3",
        maps: MaterialMaps::MapAndCube,
        reads: None,
        ..BUMP
    },
    PlainTechnique {
        name: "displacement",
        summary: "micro-polygons below a pixel, moved along the normals: real geometry, watertight",
        source: "Cook, Shade Trees, SIGGRAPH 1984; Cook, Carpenter, Catmull, The Reyes Image Rendering \
                 Architecture, SIGGRAPH 1987",
        entry: "displaced",
        surface: "displaced",
        maps: MaterialMaps::Map,
        reads: None,
        own_normals: Some(("displaced", "tangent")),
        displaces: true,
    },
];
