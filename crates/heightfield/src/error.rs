//! What can go wrong with a height field or a batch of rays.

use thiserror::Error;

/// Errors of this crate. The messages say what, where, what was expected and what was found.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum HeightFieldError {
    /// A side of the map is zero, or too long to be indexed.
    #[error("height map is {width} x {height} texels; each side must be 1 to {max}")]
    Size {
        /// Texels across.
        width: usize,
        /// Texels down.
        height: usize,
        /// Longest side accepted.
        max: usize,
    },
    /// The number of heights does not match the size.
    #[error("height map of {width} x {height} needs {expected} heights, got {got}")]
    Length {
        /// Texels across.
        width: usize,
        /// Texels down.
        height: usize,
        /// `width * height`.
        expected: usize,
        /// Heights given.
        got: usize,
    },
    /// A height is NaN, infinite or outside 0..1.
    #[error("height at row {row}, column {column} is {value}; heights must be finite and in 0..1")]
    Height {
        /// Row of the first offending texel.
        row: usize,
        /// Column of the first offending texel.
        column: usize,
        /// Its value.
        value: f32,
    },
    /// More cells than can be numbered.
    #[error("{width} x {height} texels wrapped as {wrap:?} have too many corners: at most 2^31 - 1")]
    Cells {
        /// Texels across.
        width: usize,
        /// Texels down.
        height: usize,
        /// What lies beyond the edge; mirrored maps have four times the corners.
        wrap: crate::Wrap,
    },
    /// Scale, base or tile size make no sense.
    #[error("{name} is {value}; {expected}")]
    Extent {
        /// Which setting.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What it should be.
        expected: &'static str,
    },
    /// Origins and directions differ in number.
    #[error("{origins} ray origins but {directions} directions")]
    RayCount {
        /// Origins given.
        origins: usize,
        /// Directions given.
        directions: usize,
    },
    /// A place for results has the wrong length.
    #[error("the array for {name} holds {got} numbers; these rays need {expected}")]
    OutputLength {
        /// Which result.
        name: &'static str,
        /// Numbers needed.
        expected: usize,
        /// Numbers there is room for.
        got: usize,
    },
    /// A ray has a component that is NaN or infinite.
    #[error("ray {index}: {what} is not finite")]
    RayNotFinite {
        /// Index of the first such ray.
        index: usize,
        /// `"origin"` or `"direction"`.
        what: &'static str,
    },
    /// A ray has no direction.
    #[error("ray {index}: direction is zero")]
    RayZeroDirection {
        /// Index of the first such ray.
        index: usize,
    },
    /// No technique of that name.
    #[error("unknown technique {name:?}; known: {known}")]
    UnknownTechnique {
        /// The name asked for.
        name: String,
        /// All names, comma separated.
        known: String,
    },
    /// A technique has no such parameter, or the value is out of range.
    #[error("technique {technique:?}, parameter {parameter:?}: {problem}")]
    Parameter {
        /// Technique name.
        technique: &'static str,
        /// Parameter name.
        parameter: String,
        /// What is wrong.
        problem: String,
    },
    /// A technique reads a baked map that the field does not have.
    #[error("technique {technique:?} reads the map {map:?}, which was not baked for this height map")]
    MapMissing {
        /// Technique name.
        technique: &'static str,
        /// Map name.
        map: &'static str,
    },
    /// A baked map does not fit the height map.
    #[error("map {map:?} of {width} x {height} texels needs {expected} values, got {got}")]
    BakedLength {
        /// Map name.
        map: &'static str,
        /// Texels across.
        width: usize,
        /// Texels down.
        height: usize,
        /// Values needed.
        expected: usize,
        /// Values given.
        got: usize,
    },
    /// A value of a baked map is NaN or out of range.
    #[error("map {map:?}: value at row {row}, column {column} is {value}; it must be in 0..1")]
    BakedValue {
        /// Map name.
        map: &'static str,
        /// Row of the first offending texel.
        row: usize,
        /// Column of the first offending texel.
        column: usize,
        /// Its value.
        value: f32,
    },
    /// The caller asked to stop.
    #[error("interrupted")]
    Interrupted,
}
