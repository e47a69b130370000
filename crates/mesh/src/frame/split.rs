//! A frame for each corner of each triangle, and a vertex for each: nothing is shared.
//!
//! The directions are those of [`dietrich`](super::dietrich). What it adds is the layout, three
//! vertices a triangle, in which no frame can leak into a neighbour.

use super::{FrameInfo, dietrich};

pub(super) const INFO: FrameInfo = FrameInfo {
    name: "split",
    summary: "one frame and one vertex for each corner of each triangle, nothing shared",
    guarantee: "the directions of dietrich; three vertices a triangle, so nothing can cancel or leak over \
                seams",
    source: "the usual remedy for averages that cancel; Lengyel 2001, Mikkelsen 2008",
    shares: false,
    corners: dietrich::corners,
};
