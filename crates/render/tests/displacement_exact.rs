//! Displacement against rays through the displaced surface in double precision.
//!
//! `cargo test -p render --release --test displacement_exact -- --nocapture` prints the table of
//! docs/displacement.md.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use common::agree::{agreement, from, lost, row, show};
use common::shapes::{SIZE, heights, picture, shapes};
use common::truth::Truth;

#[test]
fn displacement_is_the_displaced_surface() {
    let Some(device) = common::device() else { return };
    println!(
        "| mesh | base | pixels | outline off | astray | place p99, pixels | off by a pixel | uv p99, texels | depth p99 |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    for (name, mesh, texels, eye) in shapes() {
        for base in [0.0, 1.0] {
            let field = heights(texels, 0.08, base);
            let camera = from(eye);
            let judge = Truth::new(&mesh, &field);
            let truth = judge.picture(&camera, SIZE);
            let frame = picture(&device, &mesh, &field, camera, "displacement", false);
            show(&frame, &format!("displacement_{name}_{base}"));
            let found = agreement(&frame, &truth, &camera, texels);
            row(name, base, &found);
            assert!(found.both > 1500, "{name} {base}: {found:?}");
            assert!(found.outline_off.is_empty(), "{name} {base}: {found:?}");
            assert_eq!(lost(&found.astray, &frame, &judge, &camera), 0, "{name} {base}: {found:?}");
            assert!(found.place_p99 < 0.5 && found.texels_p99 < 0.3, "{name} {base}: {found:?}");
            if base > 0.0 {
                continue;
            }
            // Negative control: a relief a tenth deeper.
            let deeper = heights(texels, 0.088, base);
            let wrong = agreement(
                &picture(&device, &mesh, &deeper, camera, "displacement", false),
                &truth,
                &camera,
                texels,
            );
            assert!(wrong.place_p99 > 2.0 * found.place_p99, "{name} {base}: {wrong:?}");
        }
    }
}
