//! What is wrong with a hit, if anything, by a walk in `f64`.

use heightfield::Status;

use crate::rays::{Kind, Ray};
use crate::surface::Surface;

/// Largest error of the depth, as a share of the relief's: `|dt| |dz|`.
pub const DEPTH: f64 = 1e-6;
/// Tiles that a ray may cross at least before the search gives up on it.
pub const PROMISED_TILES: f64 = 1e5;
/// Contacts shallower than this may be seen or not: `f64` itself cannot tell.
pub const GRAZE: f64 = 1e-9;

/// The verdict on one ray.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    Right,
    /// The first hit was passed over.
    Missed,
    /// The ray went into the solid and came out, or out at the bottom, without any hit.
    Leaked,
    /// A hit where there is no surface.
    False,
    /// The right hit, but not where it says.
    Inaccurate,
    /// The search gave up.
    Unconverged,
    /// Too long for the judge.
    Unjudged,
}

pub const VERDICTS: [Verdict; 7] = [
    Verdict::Right,
    Verdict::Missed,
    Verdict::Leaked,
    Verdict::False,
    Verdict::Inaccurate,
    Verdict::Unconverged,
    Verdict::Unjudged,
];

/// What a search says about a ray.
#[derive(Debug, Clone, Copy)]
pub struct Answer {
    pub status: u8,
    pub t: f32,
}

/// The error of the depth where both have a hit, and the verdict.
pub fn judge(surface: &Surface, kind: Kind, (origin, direction): Ray, answer: Answer) -> (Verdict, f64) {
    let cells = surface.width.max(surface.height) as f64;
    let far = origin[0].abs().max(origin[1].abs()) + 1.0;
    // What rounding the far end of the coordinates does to the height, at one height a cell.
    let slack = GRAZE + 4.0 * f64::EPSILON * far * cells;
    let shadow = kind == Kind::Shadow;
    let lift = if shadow { -surface.gap_at(origin, direction, 0.0) } else { 0.0 };
    let t = f64::from(answer.t);
    // Half a unit in the last place of the answer, as a parameter.
    let rounding = t.abs() * f64::from(f32::EPSILON) * 0.5 + f64::from(f32::MIN_POSITIVE);
    let seen = surface.look(origin, direction, lift, slack, t + 2.0 * rounding);
    if answer.status == Status::Unconverged as u8 {
        // Only a ray that runs on for more tiles than the search promises may be given up.
        let room = if direction[2] > 0.0 { 1.0 - origin[2] } else { origin[2] };
        let tiles = direction[0].hypot(direction[1]) * room / direction[2].abs();
        let endless = tiles > PROMISED_TILES && !seen.complete && seen.touch.is_infinite();
        return (if endless { Verdict::Unjudged } else { Verdict::Unconverged }, 0.0);
    }
    if answer.status != Status::Hit as u8 {
        let verdict = match (seen.deep.is_finite(), seen.complete) {
            (true, _) => Verdict::Leaked,
            (false, true) => Verdict::Right,
            (false, false) => Verdict::Unjudged,
        };
        return (verdict, 0.0);
    }
    let dz = direction[2].abs();
    let speed = dz + direction[0].abs() * surface.width as f64 + direction[1].abs() * surface.height as f64;
    if !seen.complete && seen.deep.is_infinite() {
        return (Verdict::Unjudged, 0.0);
    }
    // The gap at the hit: no more than the rounding of t can make of it, at one height a cell.
    let gap = surface.gap_at(origin, direction, t) + lift;
    let near = gap.abs() <= DEPTH + slack + rounding * speed;
    let buried = gap < 0.0 && t == 0.0;
    if shadow {
        return (judge_shadow(surface, (origin, direction), t - rounding, gap, near, seen.deep, speed), 0.0);
    }
    if t - rounding > seen.deep {
        let late = (t - seen.deep) * dz;
        let verdict = if late <= DEPTH + rounding * dz && near { Verdict::Right } else { Verdict::Missed };
        return (verdict, late);
    }
    if buried {
        return (Verdict::Right, 0.0);
    }
    let error = ((t - seen.touch).abs() - rounding).max(0.0) * dz;
    let verdict = if !near {
        Verdict::False
    } else if error <= DEPTH || gap <= slack + rounding * speed {
        // The touch itself, or another place the ray comes as close to before it goes in.
        Verdict::Right
    } else {
        Verdict::Inaccurate
    };
    let graze = verdict == Verdict::Right && error > DEPTH;
    (verdict, if graze { 0.0 } else { error })
}

fn judge_shadow(
    surface: &Surface,
    (origin, direction): Ray,
    t: f64,
    gap: f64,
    near: bool,
    deep: f64,
    speed: f64,
) -> Verdict {
    if t > deep && gap.abs() > DEPTH {
        return Verdict::Missed;
    }
    if !near {
        return Verdict::False;
    }
    // A hit at the very start is one only for a ray that goes into the surface, if only into the last
    // bit of the cell that it starts in.
    if t <= 0.0 && deep * speed > 1e-6 && surface.rise(origin, direction) > 1e-6 * speed {
        return Verdict::False;
    }
    Verdict::Right
}
