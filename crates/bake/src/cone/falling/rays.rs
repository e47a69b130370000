//! Branch and bound for the published relaxed cones of neighbouring texels side by side.
//!
//! A node is a block of texels at which rays may go in, and steep enough are the samples of its rays up to some number.
//! The block holds nothing new if there are none; nor if the surface falls nowhere on the way there as fast as the rays do,
//! which therefore cannot come out; nor if it is above all these samples wherever they may lie. Else its parts are looked at.

use heightfield::lanes::Lanes;

use super::super::grid::Stack;
use super::Row;
use super::blocks::Block;
use super::texels::{RAY_SAMPLES, Texels};

/// What a distance may be too long by through rounding, UV units.
const GAP_MARGIN: f32 = 1e-6;
/// Single-precision tests ask for this part of the slope known: what they round away stays below the other part.
const CAUTION: f32 = 1.0 - 1e-6;
/// What heights may be off by through rounding.
const HEIGHT_MARGIN: f64 = 1e-6;
/// What positions may be off by through rounding, in texels.
const PLACE_MARGIN: f64 = 1e-3;
/// Most lanes.
const MOST: usize = 16;
/// Blocks of this level are looked at texel by texel.
const LEAF: usize = 1;
/// How often rays through one texel are looked at in vain before each is followed.
const TRIES: u32 = 8;
/// Samples of a row farther apart than this many texels are looked at one by one.
const WIDEST: f64 = 16.0;

/// Texels in a row and what is known of them.
pub(super) struct Rays<'a, L: Lanes> {
    texels: Texels<'a>,
    row: Row<'a>,
    /// The texels' distances from the first, UV units.
    u: L::F,
    low: L::F,
    lows: [f32; MOST],
}

/// Of the height of the texel they go in at, sample `k` of rays is this share.
#[inline(always)]
fn share(k: u32) -> f64 {
    1.0 - f64::from(k) / f64::from(RAY_SAMPLES)
}

/// How far out sample `k` of a ray lies, in units of the distance of the texel of height `top` that it goes in at.
#[inline(always)]
fn out(top: f64, k: u32) -> f64 {
    (1.0 - top * share(k)) / (1.0 - top)
}

impl<'a, L: Lanes> Rays<'a, L> {
    /// `row`: texels that are done with have slopes no less than they want to know.
    #[inline(always)]
    pub fn new(texels: Texels<'a>, row: Row<'a>) -> Self {
        let first = texels.field.first_texel();
        let (mut u, mut lows) = ([0.0; MOST], [0.0; MOST]);
        for lane in 0..L::WIDTH {
            u[lane] = lane as f32 * texels.step[0] as f32;
            lows[lane] = texels.field.texel(row.site[0] + lane as i64 + first, row.site[1] + first);
        }
        Self { texels, row, u: L::load(&u), low: L::load(&lows), lows }
    }

    /// Looks at all rays.
    #[inline(always)]
    pub fn search(mut self, stack: &mut Stack) {
        self.seed();
        let blocks = self.texels.blocks;
        stack.clear();
        blocks.roots(stack);
        let mut slope = self.asked();
        while let Some((level, node, origin)) = stack.pop() {
            let block = blocks.block(level, node, origin);
            if !L::any(self.may_rise_to(&block, slope).0) {
                continue;
            }
            if level > LEAF {
                blocks.children(level, node, origin, stack);
            } else if self.through(&block, slope) {
                slope = self.asked();
            }
        }
    }

    /// Tries the texels around each one, and those at and around its partner.
    fn seed(&mut self) {
        for lane in 0..L::WIDTH {
            if self.row.slopes[lane] >= self.row.enough[lane] {
                continue;
            }
            let own = [self.row.site[0] + lane as i64, self.row.site[1]];
            let partner = self.row.partners[lane].take().map(|[x, y]| [i64::from(x), i64::from(y)]);
            for [x, y] in std::iter::once(own).chain(partner) {
                for (dy, dx) in (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (dy, dx))) {
                    self.try_ray(lane, [x + dx, y + dy], 1);
                }
            }
        }
    }

    /// The slopes that tests ask for, infinite for texels that are done with.
    #[inline(always)]
    fn asked(&self) -> L::F {
        let slopes = L::load(self.row.slopes);
        let done = L::le(L::load(self.row.enough), slopes);
        L::select(done, L::splat(f32::INFINITY), slopes * L::splat(CAUTION))
    }

    /// Lanes for which a ray through the block may come out at a rise of more than `slope`, and its first sample that may be
    /// out.
    #[inline(always)]
    fn may_rise_to(&self, block: &Block, slope: L::F) -> (L::M, u32) {
        let [du, dv] = self.texels.step.map(|step| step as f32);
        let from = |axis: usize| (block.first[axis] - self.row.site[axis]) as f32;
        let to = |axis: usize| (block.last[axis] - self.row.site[axis]) as f32;
        let (vx, half) = (L::splat(0.5 * (from(0) + to(0)) * du) - self.u, 0.5 * (to(0) - from(0)) * du);
        let gap_x = L::max(L::abs(vx) - L::splat(half + GAP_MARGIN), L::splat(0.0));
        let gap_y = (from(1).max(-to(1)) * dv - GAP_MARGIN).max(0.0);
        let gap = L::sqrt(gap_x * gap_x + L::splat(gap_y * gap_y)) * slope;
        let tops = block.height.map(f64::from);
        let lanes = self.above(tops[1], gap);
        if tops[1] >= 1.0 || !L::any(lanes) {
            return (lanes, 1);
        }
        let (lanes, last) = self.steep_samples(lanes, gap, block.height);
        self.follow(block, lanes, last)
    }

    /// Whether the surface is above a sample of the rays through one texel, those of all lanes: they lie on a line along the
    /// row, where the surface is straight from column to column.
    #[inline(always)]
    fn is_inside(&self, texel: &Block, k: u32) -> bool {
        let out = out(f64::from(texel.height[0]), k);
        let field = self.texels.field;
        let place = |axis: usize, lane: usize| {
            let apex = (self.row.site[axis] + lane as i64) as f64;
            apex + out * (texel.first[axis] as f64 - apex)
        };
        let (ends, y) = ([place(0, L::WIDTH - 1), place(0, 0)], place(1, 0));
        let [from, to] = [ends[0].min(ends[1]), ends[0].max(ends[1])];
        if to - from > WIDEST {
            return false;
        }
        let first = field.first_texel() as f64 + 0.5;
        let z = f64::from(texel.height[0]) * share(k) + HEIGHT_MARGIN;
        let mut x = from;
        loop {
            if field.height_at((x + first) * self.texels.step[0], (y + first) * self.texels.step[1]) <= z {
                return false;
            }
            if x >= to {
                return true;
            }
            x = (x.floor() + 1.0).min(to);
        }
    }

    /// Those of the lanes for which a ray through the block may come out up to sample `last`, and the first sample that
    /// may be out. The samples are looked at all at once; those of rays through one texel then by halves, and so on.
    #[inline(always)]
    fn follow(&self, block: &Block, lanes: L::M, last: u32) -> (L::M, u32) {
        let tops = block.height.map(f64::from);
        let (mut from, mut to) = (1, last);
        // A block of one cell has the heights of all its corners.
        let alone = block.first == block.last && block.height[0] == block.height[1];
        let mut tries = TRIES;
        while from <= last {
            let between = [out(tops[0], from - 1), out(tops[1], to)];
            let surface = self.texels.blocks.over(self.places(block, between));
            let above = f64::from(surface.height[0]) > tops[1] * share(from) + HEIGHT_MARGIN;
            if above || !L::any(lanes & self.may_fall(block, surface.gradient)) {
                (from, to) = (to + 1, last);
                continue;
            }
            if !alone {
                return (lanes, from);
            }
            tries = tries.saturating_sub(1);
            if from == to && self.is_inside(block, from) {
                (from, to) = (from + 1, last);
            } else if from == to || tries == 0 {
                return (lanes, from);
            } else {
                to = from + (to - from) / 2;
            }
        }
        (L::first(0), last)
    }

    /// Of these lanes those for which the first samples may be steep enough, and the last sample that may be so for any.
    ///
    /// Sample `k` is `c = 1 - k / n` times as high as the texel, `top`, and `(1 - c top) / (1 - top)` times as far away;
    /// so the rise is steep enough where `c` is above a quotient.
    #[inline(always)]
    fn steep_samples(&self, lanes: L::M, gap: L::F, [least, most]: [f32; 2]) -> (L::M, u32) {
        let room = L::splat(1.0 - least);
        let low = self.low - L::splat(HEIGHT_MARGIN as f32);
        let share = (low * room + gap) / (L::splat(most) * room + gap * L::splat(least));
        let samples = (L::splat(1.0) - L::select(lanes, share, L::splat(2.0))) * L::splat(RAY_SAMPLES as f32);
        // One more is looked at where rounding decides.
        let samples = samples + L::splat(1e-3);
        let last = L::largest(samples).clamp(0.0, RAY_SAMPLES as f32) as u32;
        (lanes & L::le(L::splat(1.0), samples), last)
    }

    /// Lanes for which a surface with such gradients may fall as fast as a ray through the block does.
    #[inline(always)]
    fn may_fall(&self, block: &Block, [gradient_u, gradient_v]: [[f32; 2]; 2]) -> L::M {
        let way =
            |axis: usize, site: i64| (site - self.row.site[axis]) as f32 * self.texels.step[axis] as f32;
        let [left, right] = [block.first[0], block.last[0]].map(|site| L::splat(way(0, site)) - self.u);
        let [up, down] = [block.first[1], block.last[1]].map(|site| L::splat(way(1, site)));
        let (least_u, most_u) = products::<L>(gradient_u, [left, right]);
        let (least_v, most_v) = products::<L>(gradient_v, [up, down]);
        let margin = (most_u + most_v + L::splat(1.0)) * L::splat(HEIGHT_MARGIN as f32);
        L::le(least_u + least_v - margin, L::splat(block.height[1] - 1.0))
    }

    /// Where points of the rays through a block may lie that are between these distances out.
    #[inline(always)]
    fn places(&self, block: &Block, [near, far]: [f64; 2]) -> [[f64; 2]; 2] {
        let apexes = [L::WIDTH as i64 - 1, 0];
        [0, 1].map(|axis| {
            let (x0, x1) = (self.row.site[axis] as f64, (self.row.site[axis] + apexes[axis]) as f64);
            let (y0, y1) = (block.first[axis] as f64, block.last[axis] as f64);
            let low = (x1 + near * (y0 - x1)).min(x1 + far * (y0 - x1));
            let high = (x0 + near * (y1 - x0)).max(x0 + far * (y1 - x0));
            [low - PLACE_MARGIN, high + PLACE_MARGIN]
        })
    }

    /// Lanes that a height is higher above than a rise; one that is done with asks for endless rises.
    #[inline(always)]
    fn above(&self, height: f64, rise: L::F) -> L::M {
        let over = L::splat((height + HEIGHT_MARGIN) as f32) - self.low;
        L::lt(L::splat(0.0), over) & L::le(rise, over)
    }

    /// Tries the texels of a block; tells whether a ray through one came out at a steeper rise.
    #[inline(always)]
    fn through(&mut self, block: &Block, mut slope: L::F) -> bool {
        let first = self.texels.field.first_texel();
        let mut any = false;
        for y in block.first[1]..=block.last[1] {
            for x in block.first[0]..=block.last[0] {
                let top = self.texels.field.texel(x + first, y + first);
                let texel = Block { height: [top; 2], first: [x, y], last: [x, y] };
                let (lanes, k) = self.may_rise_to(&texel, slope);
                let mut lanes = L::bits(lanes);
                let mut found = false;
                while lanes != 0 {
                    found |= self.try_ray(lanes.trailing_zeros() as usize, [x, y], k);
                    lanes &= lanes - 1;
                }
                if found {
                    any = true;
                    slope = self.asked();
                }
            }
        }
        any
    }

    /// Tries one texel for one lane; tells whether its ray came out at a steeper rise. Samples before `k` are not out.
    #[inline(always)]
    fn try_ray(&mut self, lane: usize, site: [i64; 2], k: u32) -> bool {
        let own = [self.row.site[0] + lane as i64, self.row.site[1]];
        let offset = [site[0] - own[0], site[1] - own[1]];
        if offset == [0, 0] || !self.texels.is_texel(site) {
            return false;
        }
        let known = f64::from(self.row.slopes[lane]);
        let found = self.texels.follow(own, offset, f64::from(self.lows[lane]), k, known);
        if found > known {
            let rounded = found as f32;
            self.row.slopes[lane] = if f64::from(rounded) < found { rounded.next_up() } else { rounded };
            self.row.partners[lane] = Some(site.map(|at| at as i32));
        }
        found > known
    }
}

/// The least product of one of two numbers and one of two others, and the largest absolute value of these products.
#[inline(always)]
fn products<L: Lanes>([a, b]: [f32; 2], [c, d]: [L::F; 2]) -> (L::F, L::F) {
    let (a, b) = (L::splat(a), L::splat(b));
    let (ac, ad, bc, bd) = (a * c, a * d, b * c, b * d);
    let least = L::min(L::min(ac, ad), L::min(bc, bd));
    (least, L::max(L::max(L::max(ac, ad), L::max(bc, bd)), L::abs(least)))
}
