//! Slope kernels: how the gradient at a texel is estimated from its neighbours.
//!
//! Every kernel is a derivative along one axis times a smoothing across it, scaled so that a plane
//! of known slope gives exactly that slope. Taps are listed from -2 to +2 texels.
//!
//! | kernel | derivative | smoothing | source |
//! |---|---|---|---|
//! | `forward` | (0, 0, -1, 1, 0) | 1 | one-sided difference; half a texel off to the right and down |
//! | `central` | (-1, 0, 1) / 2 | 1 | central difference |
//! | `sobel3` | (-1, 0, 1) / 2 | (1, 2, 1) / 4 | Sobel and Feldman 1968 |
//! | `sobel5` | (-1, -2, 0, 2, 1) / 8 | (1, 4, 6, 4, 1) / 16 | binomial extension of Sobel's |
//! | `scharr` | (-1, 0, 1) / 2 | (3, 10, 3) / 16 | Scharr 2000: least rotation error of 3 x 3 |
//! | `prewitt` | (-1, 0, 1) / 2 | (1, 1, 1) / 3 | Prewitt 1970 |
//! | `bilinear` | (-1, 0, 1) / 2 | (1, 6, 1) / 8 | mean gradient of the bilinear surface over the texel |
//!
//! `bilinear` belongs to the surface the searches march through. At a texel centre four patches
//! meet and the gradient jumps, so there is no single value to take; its mean over the texel's own
//! square is well defined, favours no corner, and is what a map that holds one normal a texel
//! should store. Integrating the patch gradients over that square gives the taps above.

use crate::BakeError;

/// How the slope at a texel is estimated; the module's table has the taps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Kernel {
    /// One-sided difference.
    Forward,
    /// Central difference.
    Central,
    /// Sobel 3 x 3.
    #[default]
    Sobel3,
    /// Sobel 5 x 5.
    Sobel5,
    /// Scharr 3 x 3.
    Scharr,
    /// Prewitt 3 x 3.
    Prewitt,
    /// Mean gradient of the bilinear surface over the texel.
    Bilinear,
}

/// Taps of a kernel, folded by symmetry.
///
/// The derivative at distance `k` weighs `h[+k] - h[-k]`, the smoothing `h[+k] + h[-k]`. Folding
/// makes a constant map exactly flat and mirrored maps exactly mirrored, whatever the rounding.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Taps {
    /// 0 for the one-sided difference, else the reach in texels.
    pub radius: usize,
    pub derivative: [f32; 2],
    pub centre: f32,
    pub smoothing: [f32; 2],
}

impl Kernel {
    /// All kernels.
    pub const ALL: [Kernel; 7] = [
        Kernel::Forward,
        Kernel::Central,
        Kernel::Sobel3,
        Kernel::Sobel5,
        Kernel::Scharr,
        Kernel::Prewitt,
        Kernel::Bilinear,
    ];

    /// The names of all kernels.
    pub const NAMES: &'static [&'static str] =
        &["forward", "central", "sobel3", "sobel5", "scharr", "prewitt", "bilinear"];

    /// The kernel's name, lower case.
    pub fn name(self) -> &'static str {
        match self {
            Kernel::Forward => "forward",
            Kernel::Central => "central",
            Kernel::Sobel3 => "sobel3",
            Kernel::Sobel5 => "sobel5",
            Kernel::Scharr => "scharr",
            Kernel::Prewitt => "prewitt",
            Kernel::Bilinear => "bilinear",
        }
    }

    /// The kernel of that name; `"sobel"` means [`Kernel::Sobel3`].
    ///
    /// # Errors
    /// [`BakeError::UnknownName`].
    pub fn named(name: &str) -> Result<Self, BakeError> {
        let wanted = if name == "sobel" { "sobel3" } else { name };
        Self::ALL.into_iter().find(|kernel| kernel.name() == wanted).ok_or_else(|| BakeError::UnknownName {
            what: "slope kernel",
            name: name.to_owned(),
            known: Self::ALL.map(Kernel::name).join(", "),
        })
    }

    pub(crate) fn taps(self) -> Taps {
        let small = |centre, side| Taps { radius: 1, derivative: [0.5, 0.0], centre, smoothing: [side, 0.0] };
        match self {
            Kernel::Forward => Taps { radius: 0, derivative: [0.0; 2], centre: 1.0, smoothing: [0.0; 2] },
            Kernel::Central => small(1.0, 0.0),
            Kernel::Sobel3 => small(0.5, 0.25),
            Kernel::Scharr => small(10.0 / 16.0, 3.0 / 16.0),
            Kernel::Prewitt => small(1.0 / 3.0, 1.0 / 3.0),
            Kernel::Bilinear => small(0.75, 0.125),
            Kernel::Sobel5 => Taps {
                radius: 2,
                derivative: [2.0 / 8.0, 1.0 / 8.0],
                centre: 6.0 / 16.0,
                smoothing: [4.0 / 16.0, 1.0 / 16.0],
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kernel_is_exact_on_a_plane() {
        for kernel in Kernel::ALL {
            let Taps { radius, derivative, centre, smoothing } = kernel.taps();
            assert!((centre + 2.0 * smoothing.iter().sum::<f32>() - 1.0).abs() < 1e-7, "{kernel:?}");
            if radius > 0 {
                assert_eq!(2.0 * (derivative[0] + 2.0 * derivative[1]), 1.0, "{kernel:?}");
            }
        }
    }

    #[test]
    fn names_round_trip() {
        assert_eq!(Kernel::ALL.map(Kernel::name), Kernel::NAMES);
        for kernel in Kernel::ALL {
            assert_eq!(Kernel::named(kernel.name()).unwrap(), kernel);
        }
        assert_eq!(Kernel::named("sobel").unwrap(), Kernel::Sobel3);
        assert!(Kernel::named("roberts").unwrap_err().to_string().contains("scharr"));
    }
}
