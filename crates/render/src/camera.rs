//! The camera, in `f64`: positions reach the device relative to it.

use glam::{DMat4, DVec3, DVec4, Vec3};

use crate::RenderError;

/// Distance of the near plane as a share of the distance to the target. Depth is a reversed float with
/// no far plane, which resolves near and far alike, so nearly nothing need be clipped.
const NEAR_SHARE: f64 = 1e-5;

/// A perspective camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// Where it stands, world space.
    pub eye: DVec3,
    /// What it looks at.
    pub target: DVec3,
    /// What is up in the picture.
    pub up: DVec3,
    /// Vertical field of view, radians.
    pub fov_y: f64,
}

impl Camera {
    /// A camera at `eye` that looks at `target`, +Y up, 45 degrees high.
    pub fn look_at(eye: DVec3, target: DVec3) -> Self {
        Self { eye, target, up: DVec3::Y, fov_y: 45.0_f64.to_radians() }
    }

    /// The unit view axis.
    pub fn forward(&self) -> DVec3 {
        (self.target - self.eye).normalize_or_zero()
    }

    /// Unit axes to the right and up in the picture, and into it.
    pub(crate) fn axes(&self) -> (DVec3, DVec3, DVec3) {
        let forward = self.forward();
        let right = forward.cross(self.up).normalize_or_zero();
        (right, right.cross(forward), forward)
    }

    /// Distance of the near plane, world units.
    pub fn near(&self) -> f64 {
        (self.target - self.eye).length() * NEAR_SHARE
    }

    /// # Errors
    /// [`RenderError::Camera`].
    pub fn validate(&self) -> Result<(), RenderError> {
        let fail = |problem: String| Err(RenderError::Camera(problem));
        for (name, vector) in [("eye", self.eye), ("target", self.target), ("up", self.up)] {
            if !vector.is_finite() || vector.abs().max_element() > 1e30 {
                return fail(format!("{name} is {vector}; it must be finite"));
            }
        }
        if !(self.fov_y > 1e-4 && self.fov_y < std::f64::consts::PI - 1e-4) {
            return fail(format!(
                "field of view is {} degrees; it must be in 0..180",
                self.fov_y.to_degrees()
            ));
        }
        let forward = self.forward();
        if self.near() <= 1e-30 || forward == DVec3::ZERO {
            return fail(format!("eye and target are both at {}", self.eye));
        }
        if forward.cross(self.up.normalize_or_zero()).length() < 1e-6 {
            return fail(format!("up {} is zero or along the view direction {forward}", self.up));
        }
        Ok(())
    }

    /// Projection of camera-relative world positions onto rows `first_row..first_row + rows` of a
    /// picture of `size` pixels: 1 at the near plane, 0 at infinity.
    pub fn clip_from_relative(&self, size: [u32; 2], first_row: u32, rows: u32) -> DMat4 {
        let [width, height] = size.map(f64::from);
        let (right, up, forward) = self.axes();
        let view =
            DMat4::from_cols(right.extend(0.0), up.extend(0.0), (-forward).extend(0.0), DVec4::W).transpose();
        let focal = 1.0 / (0.5 * self.fov_y).tan();
        let projection = DMat4::from_cols(
            DVec4::X * (focal * height / width),
            DVec4::Y * focal,
            DVec4::new(0.0, 0.0, 0.0, -1.0),
            DVec4::Z * self.near(),
        );
        let (first, rows) = (f64::from(first_row), f64::from(rows));
        let centre = 1.0 - (2.0 * first + rows) / height;
        let share = height / rows;
        let mut band = DMat4::IDENTITY;
        band.y_axis.y = share;
        band.w_axis.y = -centre * share;
        band * projection * view
    }

    /// Directions of a band of rows as the picture has them, world axes, 1 along the view axis: through its
    /// upper left corner, and how that changes from one pixel to the next and from one row to the next.
    pub fn pixel_directions(&self, size: [u32; 2], first_row: u32) -> [DVec3; 3] {
        let (right, up, forward) = self.axes();
        let [width, height] = size.map(f64::from);
        let pixel = 2.0 * (0.5 * self.fov_y).tan() / height;
        let corner =
            forward - right * (0.5 * width * pixel) + up * ((0.5 * height - f64::from(first_row)) * pixel);
        [corner, right * pixel, -up * pixel]
    }

    /// What is in a picture of that aspect.
    pub(crate) fn frustum(&self, aspect: f64) -> Frustum {
        let (right, up, forward) = self.axes();
        let tangent = (0.5 * self.fov_y).tan();
        Frustum { right, up, forward, tangents: [tangent * aspect, tangent] }
    }

    /// Unit direction through the middle of a pixel, world axes.
    pub fn direction(&self, size: [u32; 2], x: u32, y: u32) -> Vec3 {
        let (right, up, forward) = self.axes();
        let [width, height] = size.map(f64::from);
        let tangent = (0.5 * self.fov_y).tan();
        let across = (2.0 * (f64::from(x) + 0.5) / width - 1.0) * tangent * width / height;
        let above = (1.0 - 2.0 * (f64::from(y) + 0.5) / height) * tangent;
        (forward + right * across + up * above).normalize().as_vec3()
    }
}

/// The part of the world that a picture shows, without an end, around the camera.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Frustum {
    /// Unit axes of the camera.
    pub right: DVec3,
    pub up: DVec3,
    pub forward: DVec3,
    /// Half the picture's extent across and down at distance 1.
    tangents: [f64; 2],
}

impl Frustum {
    /// Whether a ball in camera-relative world space lies wholly outside.
    pub fn misses(&self, centre: DVec3, radius: f64) -> bool {
        if centre.dot(self.forward) < -radius {
            return true;
        }
        let ways = [(self.right, 0), (-self.right, 0), (self.up, 1), (-self.up, 1)];
        ways.iter().any(|&(side, axis)| {
            let tangent = self.tangents[axis];
            // Outward normal of the side plane through the eye.
            centre.dot(side - self.forward * tangent) > radius * tangent.hypot(1.0)
        })
    }
}
