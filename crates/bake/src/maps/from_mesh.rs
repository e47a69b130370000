//! Maps that are made from meshes: what they are, so that they are described and stored like all others.
//!
//! They are baked by the crate `mesh`, which knows meshes and rays and nothing of files.

use super::{Channel, Form, MapInfo, REGISTRY};
use crate::BakeError;
use crate::encode::Range;

/// Height of a detailed mesh over a plain one.
pub static HEIGHT: MapInfo = MapInfo {
    name: "height",
    summary: "height of the detailed mesh, 0 at the ends of the rays to 1 at their starts",
    source: "Cignoni et al. 1998",
    version: 1,
    costly: true,
    form: Form::Single,
    channels: &[Channel::fixed("height", Range::UNIT)],
    options: &[],
};

/// Tangent frame of a mesh.
pub static TANGENTS: MapInfo = MapInfo {
    name: "tangents",
    summary: "unit tangent x, y, z in the space of the mesh and handedness, -1..1",
    source: "Mikkelsen 2008",
    version: 1,
    costly: false,
    form: Form::Single,
    channels: &[
        Channel::fixed("x", Range::SIGNED),
        Channel::fixed("y", Range::SIGNED),
        Channel::fixed("z", Range::SIGNED),
        Channel::fixed("w", Range::SIGNED),
    ],
    options: &[],
};

/// Maps that only a mesh gives. `"normal"` and `"ao"` are made of meshes as well as of heights and hold
/// the same.
pub static FROM_MESH: &[&MapInfo] = &[&HEIGHT, &TANGENTS];

/// The description of any map.
///
/// # Errors
/// [`BakeError::UnknownName`].
pub fn about(name: &str) -> Result<&'static MapInfo, BakeError> {
    let all = || REGISTRY.iter().map(|map| &map.info).chain(FROM_MESH.iter().copied());
    all().find(|info| info.name == name).ok_or_else(|| BakeError::UnknownName {
        what: "map",
        name: name.to_owned(),
        known: all().map(|info| info.name).collect::<Vec<_>>().join(", "),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_map_is_found_by_its_name() {
        for info in REGISTRY.iter().map(|map| &map.info).chain(FROM_MESH.iter().copied()) {
            assert!(std::ptr::eq(about(info.name).unwrap(), info), "{}", info.name);
            assert!(!info.summary.is_empty() && !info.source.is_empty() && !info.channels.is_empty());
        }
        assert!(about("heights").unwrap_err().to_string().contains("height, tangents"));
    }
}
