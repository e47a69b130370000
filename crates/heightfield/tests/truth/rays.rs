//! Kinds of rays, each with its own way of going wrong.

use crate::common::Random;
use crate::surface::Surface;

/// A ray, and what a search is told about it.
pub type Ray = ([f64; 3], [f64; 3]);

/// What the rays of a batch have in common.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// From the lid down to the floor, steep to far.
    View,
    /// From well above the lid.
    Above,
    /// From between surface and lid, down or up.
    Between,
    /// From below the surface, which is a hit at once.
    Buried,
    /// Exactly along rows, columns and diagonals of cells, through their corners.
    Borders,
    /// Along one axis, or straight down.
    Axis,
    /// Exactly level.
    Level,
    /// A thousandth to a millionth off level.
    Grazing,
    /// As `View`, whole tiles away: up to a million of them.
    Far,
    /// From the surface towards a light.
    Shadow,
}

pub const KINDS: [Kind; 10] = [
    Kind::View,
    Kind::Above,
    Kind::Between,
    Kind::Buried,
    Kind::Borders,
    Kind::Axis,
    Kind::Level,
    Kind::Grazing,
    Kind::Far,
    Kind::Shadow,
];

impl Kind {
    /// `count` rays, added to `rays`: one of this kind, and its neighbours at steps of up to a texel, in the
    /// same direction or fanning out. `single` rounds them to `f32`.
    pub fn bundle(
        self,
        surface: &Surface,
        random: &mut Random,
        single: bool,
        count: usize,
        rays: &mut Vec<Ray>,
    ) {
        let (origin, direction) = self.draw(surface, random);
        let step =
            [random.range(-1.0, 1.0) / surface.width as f64, random.range(-0.3, 0.3) / surface.height as f64];
        let fan = if random.next() < 0.5 { 0.0 } else { random.range(-0.02, 0.02) };
        let round = |x: f64| if single { f64::from(x as f32) } else { x };
        for k in 0..count {
            let k = k as f64;
            let mut origin = [round(origin[0] + k * step[0]), round(origin[1] + k * step[1]), origin[2]];
            let direction = [direction[0] * (1.0 + k * fan), direction[1] * (1.0 - k * fan), direction[2]];
            if self == Kind::Shadow {
                origin[2] = surface.point(origin[0], origin[1]);
            }
            rays.push((origin.map(round), direction.map(round)));
        }
    }

    fn draw(self, surface: &Surface, random: &mut Random) -> Ray {
        let (w, h) = (surface.width as f64, surface.height as f64);
        let (u, v) = (random.range(-2.0, 3.0), random.range(-2.0, 3.0));
        let azimuth = random.range(0.0, std::f64::consts::TAU);
        let lateral = 1e-3 * 2e4_f64.powf(random.next());
        let way = [lateral * azimuth.cos(), lateral * azimuth.sin()];
        let down = -(4.0_f64.powf(random.range(-1.0, 1.0)));
        let pick = |random: &mut Random, n: usize| (random.next() * n as f64) as usize;
        match self {
            Kind::View => ([u, v, 1.0], [way[0], way[1], -1.0]),
            Kind::Above => ([u, v, random.range(1.0, 4.0)], [way[0] * -down, way[1] * -down, down]),
            Kind::Between => {
                let ground = surface.point(u, v);
                let z = ground + (1.0 - ground) * random.next();
                ([u, v, z], [way[0], way[1], if random.next() < 0.5 { -1.0 } else { 0.5 }])
            }
            Kind::Buried => (
                [u, v, surface.point(u, v) - random.range(0.0, 1.5)],
                [way[0], way[1], random.range(-1.0, 1.0)],
            ),
            Kind::Borders => {
                let column = (random.range(-1.0, 2.0) * w).floor() + 0.5;
                let row = (random.range(-1.0, 2.0) * h).floor() + 0.5;
                let ways = [[1, 0], [0, 1], [-1, 0], [0, -1], [1, 1], [-1, 1], [1, -1], [2, 1], [-1, 3]];
                let [a, b] = ways[pick(random, ways.len())];
                let cells = [0.25, 1.0, 3.0, 16.0, 64.0][pick(random, 5)];
                ([column / w, row / h, 1.0], [f64::from(a) * cells / w, f64::from(b) * cells / h, -1.0])
            }
            Kind::Axis => {
                let way = [[lateral, 0.0], [-lateral, 0.0], [0.0, lateral], [0.0, -lateral], [0.0, -0.0]];
                let [a, b] = way[pick(random, 5)];
                ([u, v, 1.0], [a, b, -1.0])
            }
            Kind::Level => {
                // Below the last few peaks, so that there is an end to it.
                let ground = surface.point(u, v);
                let z = ground + (surface.highest - ground) * random.range(-0.01, 0.9);
                ([u, v, z], [azimuth.cos(), azimuth.sin(), 0.0])
            }
            Kind::Grazing => {
                let ground = surface.point(u, v);
                let slope = 10_f64.powf(random.range(-6.0, -3.0));
                let dz = if random.next() < 0.7 { -slope } else { slope };
                let z = ground + (surface.highest - ground) * random.range(0.0, 0.9);
                ([u, v, z], [azimuth.cos(), azimuth.sin(), dz])
            }
            Kind::Far => {
                let tiles = 10_f64.powf(random.range(0.0, 6.0));
                let signs = [[1.0, 1.0], [-1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]][pick(random, 4)];
                let away = [0, 1].map(|k| (signs[k] * tiles * random.next()).round());
                ([u + away[0], v + away[1], 1.0], [way[0], way[1], -1.0])
            }
            Kind::Shadow => {
                let rise = 0.02 * 500_f64.powf(random.next());
                ([u, v, 0.0], [azimuth.cos(), azimuth.sin(), rise])
            }
        }
    }
}
