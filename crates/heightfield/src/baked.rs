//! Maps that a height field carries for the searches that read them.
//!
//! They are baked elsewhere and attached once; a field cannot bake them itself.

use std::sync::OnceLock;

use crate::cone_map::{ConeKind, ConeMap};
use crate::distance_map::DistanceMap;
use crate::technique::Reads;

/// A map that is baked before some search can run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum BakedMap {
    /// A [`ConeMap`].
    Cone(ConeKind),
    /// A [`DistanceMap`].
    Distance,
}

impl BakedMap {
    /// The name of the map.
    pub fn name(self) -> &'static str {
        match self {
            BakedMap::Cone(kind) => kind.name(),
            BakedMap::Distance => "distance",
        }
    }
}

impl Reads {
    /// The maps that must be attached to the field.
    pub fn baked(self) -> &'static [BakedMap] {
        use BakedMap::{Cone, Distance};
        match self {
            Reads::Heights | Reads::Pyramid => &[],
            Reads::Cone => &[Cone(ConeKind::Cone)],
            Reads::ConeTexel => &[Cone(ConeKind::ConeTexel)],
            Reads::RelaxedCone => &[Cone(ConeKind::Cone), Cone(ConeKind::RelaxedCone)],
            Reads::Distance => &[Distance],
            Reads::RelaxedConeTexel => &[Cone(ConeKind::ConeTexel), Cone(ConeKind::RelaxedConeTexel)],
        }
    }
}

/// The slots of a field; each is filled at most once.
#[derive(Debug, Default)]
pub(crate) struct BakedMaps {
    cones: [OnceLock<ConeMap>; ConeKind::ALL.len()],
    distance: OnceLock<DistanceMap>,
}

impl BakedMaps {
    pub(crate) fn cone(&self, kind: ConeKind) -> Option<&ConeMap> {
        self.cones[kind as usize].get()
    }

    /// Keeps the map; the first one stays.
    pub(crate) fn keep_cone(&self, map: ConeMap) {
        let _ = self.cones[map.kind() as usize].set(map);
    }

    pub(crate) fn distance(&self) -> Option<&DistanceMap> {
        self.distance.get()
    }

    /// Keeps the map; the first one stays.
    pub(crate) fn keep_distance(&self, map: DistanceMap) {
        let _ = self.distance.set(map);
    }

    pub(crate) fn has(&self, map: BakedMap) -> bool {
        match map {
            BakedMap::Cone(kind) => self.cone(kind).is_some(),
            BakedMap::Distance => self.distance().is_some(),
        }
    }
}
