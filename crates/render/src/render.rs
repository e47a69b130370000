//! One picture of a scene.

use crate::renderer::BAND_PIXELS;
use crate::{Device, Frame, RenderError, Renderer, Request, Scene};

/// Renders a scene once. [`Renderer`] is for many views of one.
///
/// # Errors
/// [`RenderError`]: senseless scenes name the draw or light, device faults say what was going on.
pub fn render(device: &Device, scene: &Scene<'_>, request: &Request) -> Result<Frame, RenderError> {
    render_in_bands(device, scene, request, BAND_PIXELS)
}

/// [`render`] with at most `band_pixels` pixels, but at least one row, at a time.
///
/// # Errors
/// As [`render`].
pub fn render_in_bands(
    device: &Device,
    scene: &Scene<'_>,
    request: &Request,
    band_pixels: u64,
) -> Result<Frame, RenderError> {
    Renderer::in_bands(device, scene.clone(), *request, band_pixels)?.render(scene.camera)
}
