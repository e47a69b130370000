//! What a rendering may leave out because the picture does not need it.

use crate::RenderError;

/// A set of kinds of work to leave out. Each can be switched by itself, so that what it saves can be measured and
/// what it changes can be seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Skips(u16);

impl Skips {
    /// Leave nothing out.
    pub const NONE: Self = Self(0);
    /// Clusters of triangles outside the picture.
    pub const FRUSTUM: Self = Self(1);
    /// Clusters that turn their backs to the camera.
    pub const BACKFACE: Self = Self(1 << 1);
    /// Draws and clusters behind walls and other meshes.
    pub const OCCLUSION: Self = Self(1 << 2);
    /// Light on what others hide: near draws come first.
    pub const DEPTH_FIRST: Self = Self(1 << 3);
    /// Marches over ground that is flat where the ray passes.
    pub const FLAT: Self = Self(1 << 4);
    /// Marches whose largest possible parallax nobody could see.
    pub const PARALLAX: Self = Self(1 << 5);
    /// The parts of rays above the highest and below the lowest height in reach.
    pub const RANGE: Self = Self(1 << 6);
    /// Shadow rays that can hide no light.
    pub const SHADOW: Self = Self(1 << 7);
    /// Kinds that the output "skip" shows.
    pub const IN_PIXELS: Self = Self(Self::FLAT.0 | Self::PARALLAX.0 | Self::RANGE.0 | Self::SHADOW.0);
    /// In the output "skip", besides [`Skips::PARALLAX`]: what is seen stays on the mesh.
    pub const ON_MESH: u32 = 1 << 8;
    /// Where the output "skip" counts the shadow rays left out of a pixel: bits from here on.
    pub const RAYS_FROM_BIT: u32 = 16;
    /// Everything that can be left out.
    pub const ALL: Self = Self((1 << 8) - 1);

    /// Names with their sets, in the order of [`Skipped`].
    pub const NAMED: [(&'static str, Self); 8] = [
        ("frustum", Self::FRUSTUM),
        ("backface", Self::BACKFACE),
        ("occlusion", Self::OCCLUSION),
        ("depth_first", Self::DEPTH_FIRST),
        ("flat", Self::FLAT),
        ("parallax", Self::PARALLAX),
        ("range", Self::RANGE),
        ("shadow", Self::SHADOW),
    ];

    /// The set of one kind by name.
    pub fn named(name: &str) -> Option<Self> {
        Self::NAMED.iter().find(|(known, _)| *known == name).map(|(_, set)| *set)
    }

    /// Whether any of `other` is in the set.
    pub fn intersects(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }

    /// What stands for the set in the output that shows why a pixel's work was left out.
    pub fn bits(self) -> u32 {
        u32::from(self.0)
    }

    /// Whether all of `other` is in the set.
    pub fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }
}

impl Default for Skips {
    fn default() -> Self {
        Self::ALL
    }
}

impl std::ops::BitOr for Skips {
    type Output = Self;
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl std::ops::Sub for Skips {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }
}

/// How far what is seen may be off where a march is left out or cut short: whichever of the two is more.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SkipError {
    /// Texels of the height map.
    pub texels: f32,
    /// Pixels, measured on the mesh.
    pub pixels: f32,
}

impl Default for SkipError {
    fn default() -> Self {
        Self { texels: 0.125, pixels: 0.25 }
    }
}

impl SkipError {
    /// # Errors
    /// [`RenderError::SkipError`] for anything but finite numbers from 0.
    pub(crate) fn validate(self) -> Result<(), RenderError> {
        let fine = |error: f32| error.is_finite() && error >= 0.0;
        if fine(self.texels) && fine(self.pixels) {
            return Ok(());
        }
        Err(RenderError::SkipError { texels: self.texels, pixels: self.pixels })
    }
}

/// How much was left out of each kind: triangles for "frustum", "backface" and "occlusion", draws moved ahead for
/// "depth_first", pixels for "flat", "parallax" and "range", shadow rays for "shadow".
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Skipped([u64; Skips::NAMED.len()]);

impl Skipped {
    /// Counts `count` more of one kind.
    pub fn add(&mut self, kind: Skips, count: u64) {
        for (sum, (_, known)) in self.0.iter_mut().zip(Skips::NAMED) {
            if known == kind {
                *sum += count;
            }
        }
    }

    /// How much was left out of one kind.
    pub fn of(&self, kind: Skips) -> u64 {
        self.0.iter().zip(Skips::NAMED).filter(|(_, (_, known))| *known == kind).map(|(count, _)| count).sum()
    }

    /// Triangles left out.
    pub fn culled(&self) -> u64 {
        [Skips::FRUSTUM, Skips::BACKFACE, Skips::OCCLUSION].map(|kind| self.of(kind)).iter().sum()
    }

    /// All names with their counts.
    pub fn iter(&self) -> impl Iterator<Item = (&'static str, u64)> {
        Skips::NAMED.into_iter().map(|(name, _)| name).zip(self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_the_whole_set_and_count_apart() {
        let all = Skips::NAMED.iter().fold(Skips::NONE, |set, (_, one)| {
            assert!(!set.contains(*one));
            set | *one
        });
        assert_eq!(all, Skips::ALL);
        assert_eq!(Skips::named("occlusion"), Some(Skips::OCCLUSION));
        assert_eq!(Skips::named("weather"), None);
        assert!(!(Skips::ALL - Skips::BACKFACE).contains(Skips::BACKFACE));

        let mut skipped = Skipped::default();
        skipped.add(Skips::DEPTH_FIRST, 3);
        skipped.add(Skips::DEPTH_FIRST, 4);
        assert_eq!((skipped.of(Skips::DEPTH_FIRST), skipped.of(Skips::BACKFACE)), (7, 0));
        assert_eq!(skipped.iter().filter(|(_, count)| *count > 0).collect::<Vec<_>>(), [("depth_first", 7)]);
    }
}
