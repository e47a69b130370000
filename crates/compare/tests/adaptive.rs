//! The adaptive sweep: it refines where it matters, drops what is pointless, and keeps what was asked for.

#![allow(clippy::unwrap_used)]
use compare::{Format, Plan, Region, Setting, compare_adaptively, sweep};
use heightfield::{Extent, HeightField, Wrap};

fn hills() -> HeightField {
    let side = 96;
    let texels: Vec<f32> = (0..side * side)
        .map(|i| {
            let (x, y) = ((i % side) as f32 / side as f32, (i / side) as f32 / side as f32);
            let turn = std::f32::consts::TAU;
            0.5 + 0.3 * (3.0 * turn * x).sin() * (2.0 * turn * y).cos() + 0.15 * (9.0 * turn * y).sin()
        })
        .collect();
    let extent = Extent { scale: 0.08, base: 1.0, tile_size: [1.0, 1.0] };
    HeightField::new(&texels, side, side, Wrap::Repeat).unwrap().with_extent(extent).unwrap()
}

#[test]
fn the_sweep_refines_around_the_front_and_says_what_it_dropped() {
    let plan = Plan {
        settings: sweep::defaults().unwrap().into_iter().map(Setting::from).collect(),
        elevations_deg: vec![60.0, 20.0],
        rays: 1500,
        repeats: 2,
        seed: 3,
    };
    let mut last = 0.0;
    let (rows, dropped) = compare_adaptively(&hills(), &plan, None, &mut |done, total, _| {
        let share = done as f64 / total as f64;
        assert!(share >= last && share <= 1.0, "{last} to {share}");
        last = share;
        true
    })
    .unwrap();
    assert_eq!(last, 1.0);
    let all: Vec<_> = rows.iter().filter(|row| row.elevation_deg.is_none()).collect();
    for setting in &plan.settings {
        assert!(all.iter().any(|row| row.setting == *setting), "{setting} was asked for");
    }
    assert!(!dropped.is_empty());
    for gone in &dropped {
        assert!(all.iter().all(|row| row.setting != gone.setting), "{}", gone.setting);
        assert!(!plan.settings.contains(&gone.setting));
    }
    // Values that stand in no table of starting values, so they come from refinement.
    let first = sweep::first_settings().unwrap();
    let refined = all.iter().filter(|row| !first.contains(&row.setting.technique)).count();
    let tried = refined + dropped.iter().filter(|d| !first.contains(&d.setting.technique)).count();
    assert!(tried >= 4, "{tried} settings were refined");
    assert!(all.iter().any(|row| row.setting.heights == Format::R8Unorm), "formats are tried");
    assert!(all.iter().all(|row| !row.regions.is_empty()));
}

#[test]
fn regions_add_up_and_differ() {
    let plan = Plan {
        settings: vec![sweep::with_parameters("steep", &[("steps", 16.0)]).unwrap().into()],
        elevations_deg: vec![25.0],
        rays: 6000,
        repeats: 1,
        seed: 3,
    };
    let rows = compare::compare(&hills(), &plan, None, &mut |_, _, _| true).unwrap();
    let regions = &rows[0].regions;
    assert_eq!(regions.iter().map(|(_, m)| m.rays).sum::<usize>(), rows[0].metrics.rays);
    let of = |wanted: Region| &regions.iter().find(|(region, _)| *region == wanted).unwrap().1;
    let (inside, edge, dark) = (of(Region::Interior), of(Region::Silhouette), of(Region::Shadow));
    assert!(edge.miss_rate > 2.0 * inside.miss_rate, "{edge:?} {inside:?}");
    assert!(edge.uv_error_p99_texels > inside.uv_error_p99_texels);
    assert!(dark.rays > 50 && inside.rays > edge.rays);
    assert!(regions.iter().all(|(_, m)| m.shadow_error_rate.is_some()));
}

#[test]
fn rounded_heights_cost_accuracy_and_no_time_of_their_own() {
    let exact = Setting::from(sweep::with_parameters("exact", &[]).unwrap());
    let settings = vec![
        exact,
        exact.stored(Format::R16Unorm, Format::R32Float),
        exact.stored(Format::R8Unorm, Format::R32Float),
    ];
    let plan = Plan { settings, elevations_deg: vec![30.0], rays: 2000, repeats: 2, seed: 1 };
    let rows = compare::compare(&hills(), &plan, None, &mut |_, _, _| true).unwrap();
    let all: Vec<_> = rows.iter().filter(|row| row.elevation_deg.is_none()).collect();
    let errors: Vec<f64> = all.iter().map(|row| row.metrics.uv_error_p99_texels).collect();
    assert!(errors[0] < 1e-3 && errors[0] < errors[1] && 20.0 * errors[1] < errors[2], "{errors:?}");
    assert!(all[0].memory_bytes > all[1].memory_bytes && all[1].memory_bytes > all[2].memory_bytes);
    assert!(all.iter().all(|row| row.cpu == all[0].cpu));
    let unseen = Plan { seed: 77, ..plan };
    let checked = compare::verify(&hills(), &unseen, &mut |_, _, _| true).unwrap();
    for (seen, unseen) in errors.iter().zip(&checked) {
        assert!((seen / unseen.uv_error_p99_texels - 1.0).abs() < 0.5, "{seen} {unseen:?}");
        assert!(unseen.uv_error_p99_bound_texels.unwrap() >= unseen.uv_error_p99_texels);
    }
}
