//! What a rendering may leave out because the picture does not need it.

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
    /// Draws and clusters behind walls.
    pub const OCCLUSION: Self = Self(1 << 2);
    /// Light on what others hide: near draws come first.
    pub const DEPTH_FIRST: Self = Self(1 << 3);
    /// Everything that can be left out.
    pub const ALL: Self = Self((1 << 4) - 1);

    /// Names with their sets, in the order of [`Skipped`].
    pub const NAMED: [(&'static str, Self); 4] = [
        ("frustum", Self::FRUSTUM),
        ("backface", Self::BACKFACE),
        ("occlusion", Self::OCCLUSION),
        ("depth_first", Self::DEPTH_FIRST),
    ];

    /// The set of one kind by name.
    pub fn named(name: &str) -> Option<Self> {
        Self::NAMED.iter().find(|(known, _)| *known == name).map(|(_, set)| *set)
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

/// How much was left out of each kind: triangles for "frustum", "backface" and "occlusion", draws moved ahead for
/// "depth_first".
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
