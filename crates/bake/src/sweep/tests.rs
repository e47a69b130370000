//! What lines see far away, on every instruction set, against a look at all of their samples in `f64`.

use heightfield::lanes::{Level, dispatch_at};
use heightfield::{HeightField, Wrap};

use super::lines::{Far, Scratch, SweepLines};
use super::{FAR_FROM, Grids, LANES, Sweep};

const SIZE: [usize; 2] = [150, 40];

fn field(wrap: Wrap, height: impl Fn(f32, f32) -> f32) -> HeightField {
    let texels: Vec<f32> =
        (0..SIZE[0] * SIZE[1]).map(|at| height((at % SIZE[0]) as f32, (at / SIZE[0]) as f32)).collect();
    HeightField::new(&texels, SIZE[0], SIZE[1], wrap).unwrap()
}

/// Rough, smooth, a plane on which all ties, a long gentle arc, and thin posts that hide each other.
fn fields(wrap: Wrap) -> Vec<HeightField> {
    let noise = |i: f32, j: f32| ((i * 12.9898 + j * 78.233).sin() * 43758.547).rem_euclid(1.0);
    vec![
        field(wrap, noise),
        field(wrap, |i, j| 0.5 + 0.25 * (i * 0.13).sin() + 0.25 * (j * 0.4 + i * 0.05).cos()),
        field(wrap, |i, j| (i + 2.0 * j) / 256.0),
        field(wrap, |i, _| 0.9 - (i / 75.0 - 1.0).powi(2) * 0.01),
        field(wrap, |i, j| if noise(i, j) > 0.97 { noise(j, i) } else { 0.0 }),
    ]
}

/// Heights and steps of a line wherever it meets a row or a column of texels. Where it meets one right beside the
/// other it need not be looked at twice.
fn line(field: &HeightField, sweep: &Sweep<'_>, at: i64, end: usize) -> Vec<(f64, f64)> {
    let plan = &sweep.plan;
    let [w, h] = SIZE.map(|n| n as f64);
    let mut steps: Vec<f64> = (0..=end).map(|step| step as f64).collect();
    if plan.slant != 0.0 {
        let rows = (1..=end).map(|row| row as f64 / plan.slant.abs());
        steps.extend(rows.filter(|&step| step < end as f64 && (step - step.round()).abs() > 1.0 / 512.0));
        steps.sort_by(f64::total_cmp);
    }
    let height = |step: f64| {
        let main = if plan.forward { step } else { plan.steps as f64 - 1.0 - step };
        let cross = at as f64 + plan.slant * step;
        let [x, y] = if plan.along_x { [main, cross] } else { [cross, main] };
        field.height_at((x + 0.5) / w, (y + 0.5) / h)
    };
    steps.into_iter().map(|step| (step, height(step))).collect()
}

/// The largest difference of what all lines see at all texels from the truth, height per step.
fn worst(field: &HeightField, direction: [f64; 2], level: Level) -> f64 {
    let grids = Grids::new(field);
    let sweep = grids.towards(field, direction);
    let (plan, grid) = (&sweep.plan, sweep.grid);
    let mut worst = 0.0_f64;
    for first in (plan.first_line..plan.first_line + plan.line_count as i64).step_by(LANES) {
        let mut out = vec![Far::default(); plan.steps];
        let scratch = &mut Scratch::default();
        dispatch_at(level, SweepLines { plan, grid, line: first, scratch, out: &mut out });
        let lines = first..(first + LANES as i64).min(plan.first_line + plan.line_count as i64);
        for (lane, at) in lines.enumerate() {
            let Some((from, last)) = plan.receivers(at) else { continue };
            let end = plan.end(at, last);
            let samples = line(field, &sweep, at, end);
            for (step, seen) in out.iter().enumerate().take(last + 1).skip(from) {
                let own = samples.iter().find(|sample| sample.0 == step as f64).unwrap().1;
                let far = samples.iter().filter(|sample| sample.0 >= (step + FAR_FROM) as f64);
                let rise = far.map(|s| (s.1 - own) / (s.0 - step as f64)).fold(0.0, f64::max);
                worst = worst.max((rise - f64::from(seen.rises[lane].max(0.0))).abs());
            }
        }
    }
    worst
}

#[test]
fn lines_see_the_steepest_of_all_their_samples() {
    let directions = [[1.0, 0.0], [0.0, -1.0], [0.8, 0.6], [-0.28, 0.96], [-0.8, -0.6], [0.199_3, 0.98]];
    for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
        for (map, field) in fields(wrap).iter().enumerate() {
            for direction in directions {
                for &level in Level::available() {
                    let worst = worst(field, direction, level);
                    assert!(worst <= 5e-6, "{wrap:?}, map {map}, {direction:?}, {level:?}: {worst}");
                }
            }
        }
    }
}
