//! What can go wrong between a scene and its picture.

use thiserror::Error;

/// Errors of this crate.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RenderError {
    /// An error that skipping may make which is none.
    #[error("skip_error is ({texels} texels, {pixels} pixels); both must be finite and not negative")]
    SkipError {
        /// In texels.
        texels: f32,
        /// In pixels.
        pixels: f32,
    },
    /// No Vulkan device answers.
    #[error(
        "no Vulkan device answers. On Debian and Ubuntu `apt-get install mesa-vulkan-drivers libvulkan1` gives a \
         software one; elsewhere install the Vulkan loader and your graphics card's driver, or Mesa's lavapipe"
    )]
    NoDevice,
    /// No Vulkan device has the name asked for.
    #[error("no Vulkan device is called {wanted:?} (BUMPWGPU_ADAPTER); found: {found}")]
    NoSuchAdapter {
        /// Part of the name asked for.
        wanted: String,
        /// Names of the devices there are.
        found: String,
    },
    /// The driver refused to open the device.
    #[error("cannot open the Vulkan device {adapter:?}: {reason}")]
    Open {
        /// Its name.
        adapter: String,
        /// The driver's words.
        reason: String,
    },
    /// The device stopped working; the next call opens it anew.
    #[error("the Vulkan device was lost: {0}")]
    DeviceLost(String),
    /// The device has no memory left.
    #[error("out of device memory while {0}")]
    OutOfMemory(&'static str),
    /// The device refused something; a fault of this crate or of the driver.
    #[error("device error while {during}: {message}")]
    Device {
        /// What was going on.
        during: &'static str,
        /// wgpu's message.
        message: String,
    },
    /// Something is larger than the device can take.
    #[error("{what} is {got}; this device takes at most {limit}")]
    Limit {
        /// What is too large.
        what: &'static str,
        /// Its size.
        got: u64,
        /// The device's limit.
        limit: u64,
    },
    /// The camera makes no sense.
    #[error("camera: {0}")]
    Camera(String),
    /// The picture has no pixels.
    #[error("picture size is {width} x {height}; each side must be at least 1")]
    Size {
        /// Pixels across.
        width: u32,
        /// Pixels down.
        height: u32,
    },
    /// A light makes no sense.
    #[error("light {index}: {problem}")]
    Light {
        /// Its place in the scene.
        index: usize,
        /// What is wrong.
        problem: String,
    },
    /// A material makes no sense.
    #[error("draw {index}: material: {problem}")]
    Material {
        /// The draw's place in the scene.
        index: usize,
        /// What is wrong.
        problem: String,
    },
    /// A mesh or its transform makes no sense.
    #[error("draw {index}: mesh: {problem}")]
    Mesh {
        /// The draw's place in the scene.
        index: usize,
        /// What is wrong.
        problem: String,
    },
    /// Ambient light or background makes no sense.
    #[error("scene: {0}")]
    Scene(String),
    /// No technique of that name.
    #[error("unknown technique {name:?}; known: {known}")]
    UnknownTechnique {
        /// The name asked for.
        name: String,
        /// All names.
        known: String,
    },
    /// A mesh cannot be displaced.
    #[error("displacement: {0}")]
    Displacement(#[source] mesh::MeshError),
    /// A map cannot be baked.
    #[error(transparent)]
    Bake(#[from] bake::BakeError),
    /// A ray or technique cannot be used.
    #[error(transparent)]
    HeightField(#[from] heightfield::HeightFieldError),
    /// A shader cannot be put together.
    #[error(transparent)]
    Compose(#[from] shaders::ComposeError),
}
