//! The bodies of the fuzz targets on seeded bytes: what libFuzzer would begin with.

#![allow(clippy::unwrap_used)]

#[path = "../../../fuzz/bodies.rs"]
mod bodies;

use compare::rays::Random;

fn bytes(random: &mut Random, most: usize) -> Vec<u8> {
    let count = (random.unit() * most as f64) as usize;
    (0..count).map(|_| (random.unit() * 256.0) as u8).collect()
}

#[test]
fn marches_survive_any_bytes() {
    let mut random = Random::new(1, 0xf0);
    (0..1500).for_each(|_| bodies::march(&bytes(&mut random, 400)));
    bodies::march(&[]);
}

#[test]
fn bakes_survive_any_bytes() {
    let mut random = Random::new(2, 0xf1);
    (0..60).for_each(|_| bodies::bake(&bytes(&mut random, 300)));
}

#[test]
fn readers_survive_any_bytes() {
    let mut random = Random::new(3, 0xf2);
    (0..500).for_each(|_| bodies::read(&bytes(&mut random, 500)));
    // Heads that readers go by, with nonsense behind them; and a real file with bytes changed.
    let heads: [&[u8]; 7] = [
        b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR",
        b"II*\0\x08\0\0\0",
        b"MM\0*\0\0\0\x08",
        b"v/1\x01\x02\0\0\0",
        b"\xff\xd8\xff\xe0",
        b"BM",
        b"RIFF\x10\0\0\0WEBPVP8L",
    ];
    for head in heads {
        for _ in 0..200 {
            let mut data = head.to_vec();
            data.extend(bytes(&mut random, 300));
            bodies::read(&data);
        }
    }
    // The smallest PNG: one grey texel.
    let png: &[u8] = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\x01\0\0\0\x01\x08\0\0\0\0\x3a\x7e\x9b\x55\0\0\0\nIDATx\x9cch\0\0\0\x82\0\x81\x77\xcdr\xb6\0\0\0\0IEND\xaeB`\x82";
    assert!(bake::decode_image(png).is_ok());
    for at in 0..png.len() {
        for _ in 0..8 {
            let mut data = png.to_vec();
            data[at] = (random.unit() * 256.0) as u8;
            bodies::read(&data);
        }
        bodies::read(&png[..at]);
    }
}
