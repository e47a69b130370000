//! Host structs against naga's layout of their WGSL twins, and programs against what the host binds.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::mem::offset_of;

use render::uniforms::{
    DistanceInfo, DrawInfo, FrameInfo, HeightInfo, HorizonInfo, InstanceInfo, LightInfo, MarchResult,
    MarchSegment, MaterialInfo, MeshVertex, ShellNode, ShellPrism, SolidInfo,
};
use shaders::{Field, Layout};

macro_rules! layout {
    ($type:ty: $($field:ident),* $(,)?) => {
        Layout {
            fields: vec![$(Field {
                name: stringify!($field).to_owned(),
                offset: offset_of!($type, $field) as u32,
                size: {
                    let blank: $type = bytemuck::Zeroable::zeroed();
                    size_of_val(&blank.$field) as u32
                },
            },)*],
            size: size_of::<$type>() as u32,
        }
    };
}

fn check(host: Layout, source: &str, name: &str) {
    let theirs = shaders::layout_of(source, name).unwrap();
    assert_eq!(host.fields, theirs.fields, "{name}");
    // Arrays of structs and uniforms both go by the rounded size.
    assert_eq!(host.size, theirs.size, "size of {name}");
}

#[test]
fn host_structs_match() {
    let relief = shaders::compose("relief", Some("relief"), Some("displaced")).unwrap();
    check(
        layout!(FrameInfo: clip_from_relative, forward, ambient, corner, pixel_right, pixel_down, light_count, pad_0, pad_1, pad_2),
        &relief,
        "FrameInfo",
    );
    check(layout!(LightInfo: place, color), &relief, "Light");
    let displaced = shaders::compose("shell", Some("exact"), Some("displaced")).unwrap();
    check(layout!(MeshVertex: place, up, dpdu, dpdv, dndu, dndv), &displaced, "MeshVertex");
    check(layout!(ShellNode: low, first, high, count), &displaced, "ShellNode");
    check(layout!(ShellPrism: face, low, high, strip), &displaced, "ShellPrism");
    check(
        layout!(SolidInfo: heights, nodes, prisms, strips, vertices, triangles, corners, pyramid, endless, period, radius, pad_0, pad_1),
        &displaced,
        "Solid",
    );
    check(
        layout!(InstanceInfo: relative_from_object, object_from_relative, eye, solid, pad_0, pad_1, pad_2),
        &displaced,
        "Instance",
    );
    check(
        layout!(DrawInfo: relative_from_object, object_from_relative, eye, low, high, light_place, light_color, most_heights, most_texels, span, own),
        &relief,
        "DrawInfo",
    );
    check(
        layout!(MaterialInfo: albedo_factor, map_width, map_height, scale, base, specular, shininess, period, wrap),
        &relief,
        "MaterialInfo",
    );
    check(
        layout!(HeightInfo: size, base, scale, tile_size, wrap, deepest, cells, lags, first_texel, highest, offset_bits, bounds_depth),
        &relief,
        "HeightInfo",
    );
    let horizon = shaders::compose_with_horizon("sloped", None, Some("bump")).unwrap();
    check(layout!(HorizonInfo: tile_size, softness, azimuths), &horizon, "HorizonInfo");
    let distance = shaders::compose("kernels/march", Some("distance"), None).unwrap();
    check(layout!(DistanceInfo: metric, unit, size, pad_0), &distance, "DistanceInfo");
    let march = shaders::compose("kernels/march", Some("exact"), None).unwrap();
    check(
        layout!(MarchSegment: start, cos_theta, delta, unused, stretch, unused_too),
        &march,
        "MarchSegment",
    );
    check(layout!(MarchResult: tau, status, steps, unused), &march, "MarchResult");
}

#[test]
#[should_panic(expected = "MarchResult")]
fn a_wrong_order_is_noticed() {
    let march = shaders::compose("kernels/march", Some("exact"), None).unwrap();
    check(layout!(MarchResult: status, tau, steps, unused), &march, "MarchResult");
}
