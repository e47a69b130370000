//! Structs shared with the shaders. A test compares them with naga's layout.

use bytemuck::{Pod, Zeroable};
use glam::{DMat4, Mat4, Vec3, Vec4};

/// Twin of `FrameInfo` in `shaders_wgsl/bindings/frame.wgsl`.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub struct FrameInfo {
    /// Reversed-depth projection with no far plane.
    pub clip_from_relative: Mat4,
    /// Unit view axis; `w`: near plane, world units.
    pub forward: Vec4,
    /// Linear rgb.
    pub ambient: Vec4,
    /// Direction through the upper left corner of the picture, world axes; 1 along the view axis.
    pub corner: Vec4,
    /// How it changes from one pixel to the next.
    pub pixel_right: Vec4,
    /// And from one row to the next.
    pub pixel_down: Vec4,
    /// Lights in the buffer that count.
    pub light_count: u32,
    /// Padding.
    pub pad_0: u32,
    /// Padding.
    pub pad_1: u32,
    /// Padding.
    pub pad_2: u32,
}

/// Twin of `Light` in `shaders_wgsl/bindings/frame.wgsl`.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub struct LightInfo {
    /// Camera-relative position (`w` = 1) or direction towards the light (`w` = 0).
    pub place: Vec4,
    /// Linear rgb.
    pub color: Vec4,
}

/// Twin of `DrawInfo` in `shaders_wgsl/bindings/draw.wgsl`.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub struct DrawInfo {
    /// From the centred mesh to camera-relative world space.
    pub relative_from_object: Mat4,
    /// The inverse.
    pub object_from_relative: Mat4,
    /// Camera in the space of the centred mesh.
    pub eye: Vec4,
    /// Lower corner of the box around what shows of it, space of the centred mesh.
    pub low: Vec4,
    /// Upper corner.
    pub high: Vec4,
    /// The first light: [`LightInfo::place`] and [`LightInfo::color`].
    pub light_place: Vec4,
    /// Its colour.
    pub light_color: Vec4,
    /// Times the way from the camera: the heights that a hit may be off.
    pub most_heights: [f32; 3],
    /// Texels that it may be off in place of that.
    pub most_texels: f32,
    /// The lowest and the highest point of the map.
    pub span: [f32; 2],
    /// Its number among the instances, and that of its solid.
    pub own: [u32; 2],
}

impl DrawInfo {
    /// Of a mesh that stands there, and shows within the box `shown` around it; `light`: the first; `own` as in
    /// [`DrawInfo::own`].
    pub(crate) fn of(
        relative_from_object: DMat4,
        shown: [Vec3; 2],
        light: &LightInfo,
        own: [u32; 2],
    ) -> Self {
        let [low, high] = shown.map(|corner| corner.extend(0.0));
        let object_from_relative = relative_from_object.inverse();
        Self {
            relative_from_object: relative_from_object.as_mat4(),
            object_from_relative: object_from_relative.as_mat4(),
            eye: object_from_relative.w_axis.as_vec4(),
            low,
            high,
            light_place: light.place,
            light_color: light.color,
            own,
            ..Self::zeroed()
        }
    }
}

/// Twin of `Solid` in `shaders_wgsl/bindings/solids.wgsl`.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub struct SolidInfo {
    /// Of its heights, with the pyramid's part.
    pub heights: HeightInfo,
    /// First node of its tree.
    pub nodes: u32,
    /// First prism.
    pub prisms: u32,
    /// First corner of its strips.
    pub strips: u32,
    /// First vertex.
    pub vertices: u32,
    /// First triangle.
    pub triangles: u32,
    /// First corner height.
    pub corners: u32,
    /// First maximum of its pyramid.
    pub pyramid: u32,
    /// 1 where the cells at the border go on for ever.
    pub endless: u32,
    /// Tiles after which the map repeats, 0 for never.
    pub period: f32,
    /// Radius of everything around the middle, mesh units.
    pub radius: f32,
    /// Padding.
    pub pad_0: u32,
    /// Padding.
    pub pad_1: u32,
}

/// Twin of `Instance` in `shaders_wgsl/bindings/solids.wgsl`.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub struct InstanceInfo {
    /// From the centred mesh to camera-relative world space.
    pub relative_from_object: Mat4,
    /// The inverse.
    pub object_from_relative: Mat4,
    /// Camera in the space of the centred mesh.
    pub eye: Vec4,
    /// Which solid.
    pub solid: u32,
    /// Padding.
    pub pad_0: u32,
    /// Padding.
    pub pad_1: u32,
    /// Padding.
    pub pad_2: u32,
}

/// Twin of `MeshVertex` in `shaders_wgsl/bindings/solids.wgsl`.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub struct MeshVertex {
    /// Position, object space; `w`: u.
    pub place: Vec4,
    /// Unit normal; `w`: v.
    pub up: Vec4,
    /// `dP/du`; `w`: x of the tangent.
    pub dpdu: Vec4,
    /// `dP/dv`; `w`: y of the tangent.
    pub dpdv: Vec4,
    /// `dN/du`; `w`: z of the tangent.
    pub dndu: Vec4,
    /// `dN/dv`; `w`: w of the tangent.
    pub dndv: Vec4,
}

/// What stands for the number of prisms of a node with children.
pub const INNER_NODE: u32 = u32::MAX;

/// In place of a strip: a prism full of heights.
pub const PRISM: u32 = u32::MAX;

/// In place of a strip: the bare triangle.
pub const PLAIN: u32 = u32::MAX - 1;

/// Twin of `ShellNode` in `shaders_wgsl/bindings/solids.wgsl`.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub struct ShellNode {
    /// Lower corner of the box, object space.
    pub low: [f32; 3],
    /// First of two children, or first prism.
    pub first: u32,
    /// Upper corner.
    pub high: [f32; 3],
    /// Prisms, or [`INNER_NODE`] where there are children.
    pub count: u32,
}

/// Twin of `ShellPrism` in `shaders_wgsl/bindings/solids.wgsl`.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub struct ShellPrism {
    /// The triangle it stands on.
    pub face: u32,
    /// Where it begins along the interpolated normals, mesh units.
    pub low: f32,
    /// Where it ends.
    pub high: f32,
    /// Number of a triangle of a strip, [`PRISM`] or [`PLAIN`].
    pub strip: u32,
}

/// Twin of `MaterialInfo` in `shaders_wgsl/bindings/material.wgsl`.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub struct MaterialInfo {
    /// Linear rgba.
    pub albedo_factor: Vec4,
    /// Texels of the height map across.
    pub map_width: f32,
    /// Texels of the height map down.
    pub map_height: f32,
    /// Height range, mesh units.
    pub scale: f32,
    /// Height that lies on the mesh.
    pub base: f32,
    /// Specular share, 0..1.
    pub specular: f32,
    /// Blinn-Phong exponent.
    pub shininess: f32,
    /// Tiles after which the map repeats, 0 for never.
    pub period: f32,
    /// [`wrap_code`].
    pub wrap: u32,
}

/// Twin of `HorizonInfo` in `shaders_wgsl/bindings/horizon.wgsl`.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub struct HorizonInfo {
    /// Mesh units of one tile, as the map was baked.
    pub tile_size: [f32; 2],
    /// Width of lights, radians.
    pub softness: f32,
    /// Layers of the map.
    pub azimuths: u32,
}

/// Twin of `DistanceInfo` in `shaders_wgsl/bindings/distance.wgsl`.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub struct DistanceInfo {
    /// Length of one unit of u, v and height, mesh units.
    pub metric: [f32; 3],
    /// What code 1 stands for, mesh units.
    pub unit: f32,
    /// Voxels along u, v and the height.
    pub size: [u32; 3],
    /// Padding.
    pub pad_0: u32,
}

/// Twin of `HeightInfo` in `shaders_wgsl/lib/height_info.wgsl`.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub struct HeightInfo {
    /// Texels along u and v.
    pub size: [f32; 2],
    /// Height that lies on the mesh.
    pub base: f32,
    /// Height range, mesh units.
    pub scale: f32,
    /// Mesh units covered by one tile.
    pub tile_size: [f32; 2],
    /// [`wrap_code`].
    pub wrap: u32,
    /// Finest depth of the skip pyramid.
    pub deepest: u32,
    /// Cells along x and y of one period.
    pub cells: [u32; 2],
    /// Depths at which the skip pyramid is still one node wide.
    pub lags: [u32; 2],
    /// Texel at the lower side of cell 0.
    pub first_texel: i32,
    /// Highest corner.
    pub highest: f32,
    /// A depth of `n` nodes starts at `offset_bits & (n - 1)`.
    pub offset_bits: u32,
    /// Finest depth of the quadtree of [`Bounds`](crate::bounds::Bounds).
    pub bounds_depth: u32,
}

/// Twin of `MarchSegment` in `shaders_wgsl/kernels/march.wgsl`.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub struct MarchSegment {
    /// Texture space.
    pub start: [f32; 3],
    /// Cosine between ray and normal.
    pub cos_theta: f32,
    /// End minus start.
    pub delta: [f32; 3],
    /// Padding.
    pub unused: f32,
    /// The part of it that can meet the surface.
    pub stretch: [f32; 2],
    /// Padding.
    pub unused_too: [f32; 2],
}

/// Twin of `MarchResult` in `shaders_wgsl/kernels/march.wgsl`.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub struct MarchResult {
    /// Position along the segment.
    pub tau: f32,
    /// 0 hit, 1 left, 2 unconverged.
    pub status: u32,
    /// Steps taken.
    pub steps: u32,
    /// Padding.
    pub unused: u32,
}

/// How the shaders name a wrap mode: 0 repeat, 1 clamp, 2 mirror.
pub fn wrap_code(wrap: heightfield::Wrap) -> u32 {
    match wrap {
        heightfield::Wrap::Repeat => 0,
        heightfield::Wrap::Clamp => 1,
        heightfield::Wrap::Mirror => 2,
    }
}
