//! Rays with their exact answers, kept while the process lives: the same map, angle and seed ask for them
//! again and again.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

use heightfield::HeightField;

use crate::{CompareError, Rays, Reference, rays};

/// Rays and their exact answers.
#[derive(Debug)]
pub struct Truths {
    /// The rays.
    pub rays: Rays,
    /// What they truly hit.
    pub reference: Reference,
}

/// Most memory that is kept, bytes.
const MOST_BYTES: usize = 256 << 20;

type Key = [u8; 32];

#[derive(Default)]
struct Kept {
    entries: VecDeque<(Key, Arc<Truths>, usize)>,
    bytes: usize,
}

static KEPT: Mutex<Kept> = Mutex::new(Kept { entries: VecDeque::new(), bytes: 0 });

/// Seeded rays at one elevation with shadow rays to seeded lights, and the exact answers, which are found
/// once for equal maps and settings. The `bool` says whether they were there already.
///
/// # Errors
/// As [`rays::planar`].
pub fn truths(
    field: &HeightField,
    elevation_deg: f64,
    count: usize,
    seed: u64,
) -> Result<(Arc<Truths>, bool), CompareError> {
    let key = key(field, elevation_deg, count, seed);
    let lock = || KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(found) = lock().take(&key) {
        return Ok((found, true));
    }
    let rays = rays::planar(field, elevation_deg, count, seed)?;
    let reference = Reference::new(field, &rays, &rays::lights(field.extent(), seed));
    let made = Arc::new(Truths { rays, reference });
    lock().keep(key, Arc::clone(&made));
    Ok((made, false))
}

impl Kept {
    /// The entry, which then counts as the latest.
    fn take(&mut self, key: &Key) -> Option<Arc<Truths>> {
        let at = self.entries.iter().position(|entry| entry.0 == *key)?;
        let entry = self.entries.remove(at)?;
        let found = Arc::clone(&entry.1);
        self.entries.push_back(entry);
        Some(found)
    }

    fn keep(&mut self, key: Key, truths: Arc<Truths>) {
        let bytes = truths.bytes();
        if bytes > MOST_BYTES || self.entries.iter().any(|entry| entry.0 == key) {
            return;
        }
        self.bytes += bytes;
        self.entries.push_back((key, truths, bytes));
        while self.bytes > MOST_BYTES {
            let Some((_, _, freed)) = self.entries.pop_front() else { break };
            self.bytes -= freed;
        }
    }
}

impl Truths {
    fn bytes(&self) -> usize {
        let of_ray = 24 + size_of::<crate::reference::Truth>() + 1;
        self.rays.len() * of_ray + self.reference.shadows.len() * size_of::<crate::reference::ShadowRay>()
    }
}

fn key(field: &HeightField, elevation_deg: f64, count: usize, seed: u64) -> Key {
    let mut hasher = blake3::Hasher::new();
    let extent = field.extent();
    for number in [field.width() as u64, field.height() as u64, field.wrap() as u64, count as u64, seed] {
        hasher.update(&number.to_le_bytes());
    }
    for number in [extent.scale, extent.base, extent.tile_size[0], extent.tile_size[1]] {
        hasher.update(&number.to_le_bytes());
    }
    hasher.update(&elevation_deg.to_le_bytes());
    for chunk in field.texels().chunks(1 << 16) {
        let bytes: Vec<u8> = chunk.iter().flat_map(|height| height.to_le_bytes()).collect();
        hasher.update(&bytes);
    }
    *hasher.finalize().as_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;
    use heightfield::Wrap;

    #[test]
    fn equal_questions_are_answered_once_and_others_anew() {
        let field = |height: f32| HeightField::new(&[0.25, height, 0.5, 0.75], 2, 2, Wrap::Repeat).unwrap();
        let seed = 0x00ca_c4ed;
        let (first, known) = truths(&field(1.0), 30.0, 50, seed).unwrap();
        assert!(!known);
        let (again, known) = truths(&field(1.0), 30.0, 50, seed).unwrap();
        assert!(known && Arc::ptr_eq(&first, &again));
        for (map, angle, count, seed) in [
            (field(0.9), 30.0, 50, seed),
            (field(1.0), 31.0, 50, seed),
            (field(1.0), 30.0, 51, seed),
            (field(1.0), 30.0, 50, seed + 1),
        ] {
            assert!(!truths(&map, angle, count, seed).unwrap().1);
        }
    }

    #[test]
    fn the_oldest_go_first() {
        let mut kept = Kept::default();
        let entry = |n: usize| {
            let rays = Rays { origins: vec![0.0; 3 * n], directions: vec![0.0; 3 * n] };
            Arc::new(Truths { rays, reference: Reference::default() })
        };
        let large = MOST_BYTES / 300;
        for name in 0..4_u8 {
            kept.keep([name; 32], entry(large));
        }
        assert!(kept.take(&[0; 32]).is_none() && kept.take(&[3; 32]).is_some());
        assert!(kept.bytes <= MOST_BYTES);
    }
}
