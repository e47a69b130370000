//! Every instruction set against one lane.

use super::march::March;
use super::{Heights, WideSearch, leaps};
use crate::chunk::Chunk;
use crate::lanes::{Lanes, Level, Portable, dispatch_at};
use crate::march::march_one;
use crate::search::cell_walk::Leap;
use crate::search::{
    Search, binary, cone, cone_texel, distance, interval, parallax, parallax_limited, pom, relaxed_cone,
    relaxed_cone_texel, relief, steep_exponential, steep_linear,
};
use crate::{ConeKind, ConeMap, DistanceMap, HeightField, Hits, OutputSet, RayArray, Wrap};

fn fields() -> Vec<HeightField> {
    let texels: Vec<f32> = (0..61 * 48).map(|i| ((i * 7919) % 1009) as f32 / 1009.0).collect();
    [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror]
        .into_iter()
        .map(|wrap| HeightField::new(&texels, 61, 48, wrap).unwrap())
        .inspect(attach_maps)
        .collect()
}

/// Maps that promise nothing: what is asked here is whether lanes agree.
fn attach_maps(field: &HeightField) {
    let ratios: Vec<f32> = (0..61 * 48).map(|i| ((i * 4231) % 997) as f32 / 9970.0).collect();
    for kind in ConeKind::ALL {
        field.attach_cone_map(ConeMap::new(field, kind, &ratios).unwrap());
    }
    let distances: Vec<f32> = (0..61 * 48 * 5).map(|i| ((i * 2749) % 991) as f32 / 9910.0).collect();
    field.attach_distance_map(DistanceMap::new(field, 5, &distances).unwrap());
}

/// Holds the rays of a chunk, followed side by side at a level, against the same rays one by one.
fn same_bits(
    search: &impl Search,
    from_surface: bool,
    side_by_side: impl Fn(Level, &HeightField, &mut Chunk<'_>),
) {
    let n = 1501;
    let spread = |i: usize, k: usize| ((i * k) % 997) as f64 / 997.0;
    let origins: Vec<f64> = (0..n)
        .flat_map(|i| [3.0 * spread(i, 31) - 1.0, spread(i, 57), 1.2 - spread(i, 11) * f64::from(i % 3 == 0)])
        .collect();
    let directions: Vec<f64> = (0..n)
        .flat_map(|i| [spread(i, 13) - 0.5, 4.0 * spread(i, 7) - 2.0, [-0.7, 0.4, 0.0, -1.0][i % 4]])
        .collect();
    for field in fields() {
        // Everything but the normal, whose cell is found anew from the position.
        let run = |work: &mut dyn FnMut(&mut Chunk<'_>)| {
            let mut hits = Hits::new(n, OutputSet::ALL);
            let places = hits.as_mut();
            work(&mut Chunk {
                origins: RayArray::F64(&origins),
                directions: RayArray::F64(&directions),
                order: &[],
                from_surface,
                cancel: None,
                t: places.t,
                uv: places.uv,
                z: places.z,
                normal: places.normal,
                steps: places.steps,
                status: places.status,
            });
            let bits = |x: Option<Vec<f32>>| x.unwrap().into_iter().map(f32::to_bits).collect::<Vec<_>>();
            (bits(hits.t), bits(hits.uv), bits(hits.z), bits(hits.normal), hits.steps, hits.status)
        };
        let alone = run(&mut |chunk| (0..n).for_each(|i| march_one(search, &field, chunk, i)));
        for &level in Level::available() {
            let together = run(&mut |chunk| side_by_side(level, &field, chunk));
            assert!(alone == together, "{level:?}");
        }
    }
}

fn layered<S: WideSearch>(search: &S) {
    same_bits(search, false, |level, field, chunk| dispatch_at(level, March { search, field, chunk }));
}

fn leaping<S: Search, T: Leap>(search: &S, leap: &T) {
    for from_surface in [false, true] {
        same_bits(search, from_surface, |level, field, chunk| {
            dispatch_at(level, leaps::March { leap, search, field, chunk });
        });
    }
}

#[test]
fn every_level_gives_the_bits_of_one_lane() {
    layered(&relief::Relief { linear: 32, refine: 8 });
    layered(&interval::Interval { linear: 9, refine: 4 });
    layered(&pom::Pom { steps: 17 });
    layered(&binary::Binary { steps: 16 });
    layered(&steep_linear::SteepLinear { min_steps: 8, max_steps: 64 });
    layered(&steep_exponential::SteepExponential { min_steps: 8, max_steps: 64 });
    layered(&parallax::Parallax {});
    layered(&parallax_limited::ParallaxLimited {});
}

#[test]
fn every_level_jumps_as_one_lane_does() {
    let search = cone::Cone { steps: 300 };
    leaping(&search, &search.walk());
    let search = cone_texel::ConeTexel { steps: 300 };
    leaping(&search, &search.walk());
    let search = relaxed_cone::RelaxedCone { steps: 300, refine: 5 };
    leaping(&search, &search.walk());
    let search = relaxed_cone_texel::RelaxedConeTexel { steps: 300, refine: 5 };
    leaping(&search, &search.walk());
    let search = distance::Distance { steps: 40 };
    leaping(&search, &search.walk());
}

#[test]
#[should_panic(expected = "Baseline")]
fn another_number_of_steps_would_be_noticed() {
    let (search, leap) = (cone::Cone { steps: 3 }, cone::Cone { steps: 300 }.walk());
    leaping(&search, &leap);
}

#[test]
fn lanes_read_the_heights_of_the_field() {
    type One = Portable<1>;
    for field in fields() {
        let heights = Heights::<One>::new(&field);
        for i in 0..5000 {
            let (u, v) = ((i % 71) as f32 * 0.07 - 2.1, (i % 97) as f32 * 0.037 - 1.3);
            let mut got = [0.0];
            One::store(heights.sample(One::splat(u), One::splat(v)), &mut got);
            assert_eq!(got[0].to_bits(), field.sample(u, v).to_bits());
        }
    }
}
