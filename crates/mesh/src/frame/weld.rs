//! Finding equal vertices.

use std::hash::BuildHasher;

use hashbrown::{DefaultHashBuilder, HashTable};
use rayon::prelude::*;

/// For each of `count` things, the first one with the same key.
pub(crate) fn first_equal<const W: usize>(count: usize, key: impl Fn(usize) -> [u32; W] + Sync) -> Vec<u32> {
    let hasher = DefaultHashBuilder::default();
    let hashes: Vec<u64> = (0..count).into_par_iter().map(|i| hasher.hash_one(key(i))).collect();
    let mut table: HashTable<u32> = HashTable::with_capacity(count);
    (0..count)
        .map(|i| {
            let own = key(i);
            let entry = table.entry(hashes[i], |&j| key(j as usize) == own, |&j| hashes[j as usize]);
            *entry.or_insert(i as u32).get()
        })
        .collect()
}
