//! Solids that have been built, for as long as their mesh and heights exist.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::{Arc, Weak};

use glam::DVec3;
use heightfield::HeightField;
use mesh::Mesh;

use super::Solid;
use super::common::Common;
use crate::device::lock;
use crate::triangles::MeshArrays;
use crate::{Device, Draw, Held, RenderError};

/// Mesh and field by their addresses, which their weak references keep from being given to anything else; and which
/// triangles, and whether rays may be traced through them.
type Key = (usize, usize, Range<u32>, bool);

struct Kept {
    mesh: Weak<Mesh>,
    field: Weak<HeightField>,
    solid: Arc<Solid>,
}

/// What is kept.
#[derive(Default)]
pub(crate) struct Store {
    kept: HashMap<Key, Kept>,
    /// The buffers of the last scene.
    pub(super) common: Option<Common>,
}

impl Store {
    /// Forgets what belongs to meshes and height fields that are gone.
    fn tidy(&mut self) {
        self.kept.retain(|_, kept| kept.mesh.strong_count() > 0 && kept.field.strong_count() > 0);
        if self.common.as_ref().is_some_and(|common| !common.is_alive()) {
            self.common = None;
        }
    }

    /// The arrays of a mesh that is part of another solid.
    fn arrays(&self, mesh: &Arc<Mesh>) -> Option<Arc<MeshArrays>> {
        let same = |kept: &&Kept| std::ptr::eq(kept.mesh.as_ptr(), Arc::as_ptr(mesh));
        self.kept.values().find(same).map(|kept| Arc::clone(&kept.solid.arrays))
    }
}

impl Device {
    /// The solid of a draw, built if there is none; with what rays need where they are to be `traced`. Those of meshes
    /// that are only lent are not kept.
    pub(super) fn solid(
        &self,
        draw: &Draw<'_>,
        centre: DVec3,
        traced: bool,
    ) -> Result<Arc<Solid>, RenderError> {
        let field = &draw.material.field;
        let build = |arrays: Option<Arc<MeshArrays>>| {
            let arrays = arrays.unwrap_or_else(|| Arc::new(MeshArrays::new(&draw.mesh, centre)));
            if !traced {
                return Ok(Arc::new(Solid::untraced(arrays)));
            }
            Solid::new(arrays, &draw.mesh, &draw.triangles, field, centre).map(Arc::new)
        };
        let Held::Shared(mesh) = &draw.mesh else { return build(None) };
        let key = |traced| {
            (Arc::as_ptr(mesh) as usize, Arc::as_ptr(field) as usize, draw.triangles.clone(), traced)
        };
        let arrays = {
            let mut store = lock(&self.solids);
            store.tidy();
            let ready = store.kept.get(&key(true));
            if let Some(kept) = ready.or_else(|| store.kept.get(&key(false)).filter(|_| !traced)) {
                return Ok(Arc::clone(&kept.solid));
            }
            store.arrays(mesh)
        };
        // Made outside the lock: it takes its time.
        let solid = build(arrays)?;
        let kept =
            Kept { mesh: Arc::downgrade(mesh), field: Arc::downgrade(field), solid: Arc::clone(&solid) };
        lock(&self.solids).kept.insert(key(traced), kept);
        Ok(solid)
    }

    /// Shells kept on the device for meshes and height fields that still exist.
    pub fn shells_kept(&self) -> usize {
        let mut store = lock(&self.solids);
        store.tidy();
        store.kept.len()
    }
}
