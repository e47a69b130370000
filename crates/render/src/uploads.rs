//! What the device keeps between renderings: textures and buffers of height fields and images.
//!
//! An entry lives as long as the height field or image it was made from. The entry's weak reference
//! keeps that address from being given to anything else, so the address can be the key.

use std::any::Any;
use std::collections::HashMap;
use std::sync::{Arc, Weak};

use heightfield::technique::Reads;

use crate::device::lock;
use crate::{Device, RenderError};

/// What an entry holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Kind {
    /// Group 1 of searches.
    Field(Reads),
    /// What rays can meet.
    Bounds,
    /// Slope map.
    Slopes,
    /// 8-bit normal map baked from heights.
    Baked8Bit,
    /// Horizon map of so many azimuths.
    Horizon(u32),
    /// Colour map.
    Albedo,
    /// The material's own normal map.
    OwnNormals,
    /// The same in 8 bits.
    OwnNormals8Bit,
}

/// A thing on the device.
#[derive(Clone)]
pub(crate) enum Resource {
    Group(wgpu::BindGroup),
    View(wgpu::TextureView),
    Ground(Ground),
}

/// What rays can meet over a map.
#[derive(Clone)]
pub(crate) struct Ground {
    /// The nodes of its [`Bounds`](crate::bounds::Bounds).
    pub nodes: wgpu::Buffer,
    /// Its lowest and its highest point.
    pub span: [f32; 2],
}

/// Everything that is kept.
#[derive(Default)]
pub(crate) struct Uploads {
    kept: HashMap<(usize, Kind), (Weak<dyn Any + Send + Sync>, Resource)>,
    cube: Option<wgpu::TextureView>,
    white: Option<wgpu::TextureView>,
}

impl Device {
    /// The entry of `owner`, made if there is none. Also says whether it had to be made.
    pub(crate) fn keep<T: Any + Send + Sync>(
        &self,
        owner: &Arc<T>,
        kind: Kind,
        make: impl FnOnce() -> Result<Resource, RenderError>,
    ) -> Result<(Resource, bool), RenderError> {
        let key = (Arc::as_ptr(owner) as usize, kind);
        {
            let mut uploads = lock(&self.uploads);
            uploads.kept.retain(|_, (owner, _)| owner.strong_count() > 0);
            if let Some((_, resource)) = uploads.kept.get(&key) {
                return Ok((resource.clone(), false));
            }
        }
        // Made outside the lock: baking takes its time, and two threads baking the same map is no harm.
        let resource = make()?;
        let owner: Arc<dyn Any + Send + Sync> = Arc::<T>::clone(owner);
        lock(&self.uploads).kept.insert(key, (Arc::downgrade(&owner), resource.clone()));
        Ok((resource, true))
    }

    /// The normalisation cube.
    pub(crate) fn keep_cube(
        &self,
        make: impl FnOnce() -> Result<wgpu::TextureView, RenderError>,
    ) -> Result<wgpu::TextureView, RenderError> {
        let mut uploads = lock(&self.uploads);
        if let Some(view) = &uploads.cube {
            return Ok(view.clone());
        }
        let view = make()?;
        uploads.cube = Some(view.clone());
        Ok(view)
    }

    /// The white texel of materials without a colour map.
    pub(crate) fn keep_white(
        &self,
        make: impl FnOnce() -> Result<wgpu::TextureView, RenderError>,
    ) -> Result<wgpu::TextureView, RenderError> {
        let mut uploads = lock(&self.uploads);
        if let Some(view) = &uploads.white {
            return Ok(view.clone());
        }
        let view = make()?;
        uploads.white = Some(view.clone());
        Ok(view)
    }

    /// Maps kept on the device for height fields and images that still exist.
    pub fn maps_kept(&self) -> usize {
        let mut uploads = lock(&self.uploads);
        uploads.kept.retain(|_, (owner, _)| owner.strong_count() > 0);
        uploads.kept.len()
    }
}
