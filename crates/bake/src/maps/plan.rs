//! How large a map will be, before anything is allocated.

use heightfield::{HeightField, Wrap};

use super::MapInfo;
use crate::BakeError;
use crate::memory::available_memory;

/// Bakes up to this many bytes start without asking how much memory there is.
const SMALL: u128 = 64 << 20;

/// What the size of a map depends on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Grid {
    /// Texels across.
    pub width: usize,
    /// Texels down.
    pub height: usize,
    /// What lies beyond the edge.
    pub wrap: Wrap,
}

impl Grid {
    /// The grid of a height field.
    pub fn of(field: &HeightField) -> Self {
        Self { width: field.width(), height: field.height(), wrap: field.wrap() }
    }

    /// Bilinear patches across and down, as [`HeightField::cells`].
    pub fn cells(self) -> [usize; 2] {
        [self.width, self.height].map(|n| match self.wrap {
            Wrap::Repeat => n,
            Wrap::Clamp => n + 1,
            Wrap::Mirror => 2 * n,
        })
    }

    /// Texels.
    pub fn texels(self) -> u128 {
        self.width as u128 * self.height as u128
    }
}

/// The pictures of a map, and the memory that its bake needs besides.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Plan {
    /// Texels across, texels down, slices.
    pub layers: Vec<[usize; 3]>,
    /// Bytes of everything but the pictures at the worst moment.
    pub working_bytes: u128,
}

impl Plan {
    /// One picture of the size of the height map.
    pub fn single(grid: Grid) -> Self {
        Self::stack(grid, 1)
    }

    /// `depth` slices of the size of the height map.
    pub fn stack(grid: Grid, depth: usize) -> Self {
        Self { layers: vec![[grid.width, grid.height, depth]], working_bytes: 0 }
    }

    /// Pictures that halve, rounded up, from the given size down to one texel.
    pub fn levels([mut width, mut height]: [usize; 2]) -> Self {
        let mut layers = vec![[width, height, 1]];
        while (width, height) != (1, 1) {
            (width, height) = (width.div_ceil(2), height.div_ceil(2));
            layers.push([width, height, 1]);
        }
        Self { layers, working_bytes: 0 }
    }

    /// The same pictures with a bake that needs `bytes` besides them.
    pub fn working(mut self, bytes: u128) -> Self {
        self.working_bytes = bytes;
        self
    }

    /// Bytes of the finished map with that many channels.
    pub fn bytes(&self, channels: usize) -> u128 {
        let texels: u128 = self.layers.iter().map(|l| l.iter().map(|&n| n as u128).product::<u128>()).sum();
        texels * channels as u128 * size_of::<f32>() as u128
    }

    /// Makes sure that the machine can hold it as floats.
    ///
    /// # Errors
    /// [`BakeError::Memory`].
    pub fn check(&self, info: &MapInfo) -> Result<(), BakeError> {
        self.check_samples(info, size_of::<f32>())
    }

    /// Makes sure that the machine can hold it with that many bytes a sample.
    ///
    /// # Errors
    /// [`BakeError::Memory`].
    pub(crate) fn check_samples(&self, info: &MapInfo, bytes: usize) -> Result<(), BakeError> {
        let needed = self.bytes(info.channels.len()) / size_of::<f32>() as u128 * bytes as u128;
        Self::fits(needed + self.working_bytes, &self.layers, info, available_memory())
    }

    fn fits(
        needed: u128,
        layers: &[[usize; 3]],
        info: &MapInfo,
        available: Option<u64>,
    ) -> Result<(), BakeError> {
        let available = available.map_or(u128::from(u64::MAX) / 2, u128::from);
        if needed > SMALL && needed > available {
            let [width, height, depth] = layers.first().copied().unwrap_or_default();
            let slices = if depth > 1 { format!(" x {depth}") } else { String::new() };
            return Err(BakeError::Memory {
                what: format!("map {:?} of {width} x {height}{slices} texels", info.name),
                bytes: needed,
                available,
            });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_those_of_the_arrays() {
        let grid = Grid { width: 5, height: 3, wrap: Wrap::Clamp };
        assert_eq!(Plan::single(grid).bytes(3), 5 * 3 * 3 * 4);
        assert_eq!(Plan::stack(grid, 7).bytes(1), 5 * 3 * 7 * 4);
        let levels = Plan::levels(grid.cells());
        assert_eq!(levels.layers, [[6, 4, 1], [3, 2, 1], [2, 1, 1], [1, 1, 1]]);
    }

    #[test]
    fn what_does_not_fit_is_said_with_its_bytes() {
        let grid = Grid { width: 40_000, height: 40_000, wrap: Wrap::Repeat };
        let plan = Plan::stack(grid, 10).working(1000);
        let info = &crate::normal::NORMAL.info;
        let check = |plan: &Plan, available| {
            Plan::fits(plan.bytes(3) + plan.working_bytes, &plan.layers, info, available)
        };
        let error = check(&plan, Some(1 << 30)).unwrap_err().to_string();
        assert!(error.contains("needs 192000001000 bytes"), "{error}");
        assert!(error.contains("40000 x 40000 x 10") && error.contains("1073741824"), "{error}");
        assert!(check(&plan, Some(1 << 40)).is_ok());
        assert!(check(&plan, None).is_ok());
        let small = Grid { width: 64, height: 64, wrap: Wrap::Repeat };
        assert!(check(&Plan::single(small), Some(10)).is_ok(), "small ones always start");
    }
}
