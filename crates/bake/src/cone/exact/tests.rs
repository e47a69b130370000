//! All instruction sets find the same cones.

use heightfield::lanes::Level;
use heightfield::{HeightField, Wrap};

use super::steepest_rises_at;
use crate::Progress;

fn field(wrap: Wrap, rough: f32) -> HeightField {
    let mut state = 5_u32;
    let texels: Vec<f32> = (0..41 * 27)
        .map(|at| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let wave = 0.5 + 0.5 * ((at % 41) as f32 * 0.3).sin() * ((at / 41) as f32 * 0.46).cos();
            wave + rough * ((state >> 8) as f32 / (1 << 24) as f32 - wave)
        })
        .collect();
    HeightField::new(&texels, 41, 27, wrap).unwrap()
}

#[test]
fn all_instruction_sets_find_the_same() {
    for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
        for rough in [0.0, 0.05, 1.0] {
            let field = field(wrap, rough);
            let found = |level: Level| steepest_rises_at(level, &field, &mut Progress::none()).unwrap();
            let expected = found(Level::Baseline);
            for &level in Level::available() {
                for (slope, expected) in found(level).iter().zip(&expected) {
                    // Packets of other widths look in another order, and drop what is no more than this steeper.
                    assert!((slope / expected - 1.0).abs() <= 8e-7, "{level:?}: {slope}, {expected}");
                }
            }
        }
    }
}
