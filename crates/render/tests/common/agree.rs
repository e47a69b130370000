//! How well a rendered relief agrees with the truth.
#![allow(dead_code)]

use glam::{DVec3, Vec2, Vec3};
use render::{Camera, Frame};

use super::truth::{Hit, Truth};

/// Differences between a picture and the truth.
#[derive(Debug, Clone)]
pub struct Agreement {
    /// Pixels covered in both.
    pub both: usize,
    /// Pixels covered in one of them only, although all their neighbours in the truth are alike: more than a
    /// pixel off, or a hole.
    pub outline_off: Vec<usize>,
    /// Distance between the places, in pixels where they are, ninety-ninth percentile, away from edges in depth.
    pub place_p99: f64,
    /// Pixels covered in both whose depth lies beyond all those of the truth within a pixel around.
    pub astray: Vec<usize>,
    /// Share of pixels more than a pixel off, of all that are covered in both, edges in depth included.
    pub far: f64,
    /// Distance between the texture coordinates in texels, ninety-ninth percentile, away from edges in depth.
    pub texels_p99: f64,
    /// Largest relative difference in depth between neighbours that are alike, ninety-ninth percentile.
    pub depth_p99: f64,
}

fn percentile(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values
        .get(((values.len() as f64 * share) as usize).min(values.len().saturating_sub(1)))
        .copied()
        .unwrap_or(0.0)
}

/// Compares. The frame needs the outputs mask, position, depth and uv.
pub fn agreement(frame: &Frame, truth: &[Option<Hit>], camera: &Camera, texels: [usize; 2]) -> Agreement {
    let (w, h) = (frame.width as usize, frame.height as usize);
    let mask = frame.aovs.mask.as_ref().unwrap();
    let positions = frame.aovs.position.as_ref().unwrap();
    let depths = frame.aovs.depth.as_ref().unwrap();
    let uvs = frame.aovs.uv.as_ref().unwrap();
    let pixel = 2.0 * (0.5 * camera.fov_y).tan() / h as f64;
    let around = |at: usize| {
        let (x, y) = ((at % w) as i64, (at / w) as i64);
        (-1..=1).flat_map(move |dy| (-1..=1).map(move |dx| (x + dx, y + dy))).filter_map(move |(x, y)| {
            ((0..w as i64).contains(&x) && (0..h as i64).contains(&y)).then_some(y as usize * w + x as usize)
        })
    };
    let depth_of = |hit: &Hit| (hit.position - camera.eye).dot(camera.forward());
    let mut found = Agreement {
        both: 0,
        outline_off: Vec::new(),
        place_p99: 0.0,
        astray: Vec::new(),
        far: 0.0,
        texels_p99: 0.0,
        depth_p99: 0.0,
    };
    let (mut places, mut texel_errors, mut depth_errors, mut far) = (Vec::new(), Vec::new(), Vec::new(), 0);
    for at in 0..w * h {
        let (seen, hit) = (mask[at] == 1, &truth[at]);
        if seen != hit.is_some() && around(at).all(|near| truth[near].is_some() == hit.is_some()) {
            found.outline_off.push(at);
        }
        let (true, Some(hit)) = (seen, hit) else { continue };
        found.both += 1;
        let depth = depth_of(hit);
        let place = Vec3::from_slice(&positions[3 * at..]).as_dvec3();
        let off = (place - hit.position).length() / (depth * pixel);
        far += usize::from(off > 1.0);
        let near = || around(at).filter_map(|near| truth[near].as_ref()).map(depth_of);
        let (nearest, farthest) = (near().fold(f64::INFINITY, f64::min), near().fold(0.0, f64::max));
        let seen_depth = f64::from(depths[at]);
        if seen_depth < nearest - depth * pixel || seen_depth > farthest + depth * pixel {
            found.astray.push(at);
        }
        let smooth = around(at).all(|near| {
            truth[near].is_some_and(|near| (depth_of(&near) - depth).abs() < 6.0 * depth * pixel)
        });
        if smooth {
            let uv = Vec2::from_slice(&uvs[2 * at..]).as_dvec2() - hit.uv;
            places.push(off);
            // On a seam the same place has two.
            let turns = uv - uv.round();
            texel_errors.push((turns.x * texels[0] as f64).hypot(turns.y * texels[1] as f64));
            depth_errors.push((f64::from(depths[at]) - depth).abs() / depth);
        }
    }
    found.far = far as f64 / found.both.max(1) as f64;
    found.place_p99 = percentile(places, 0.99);
    found.texels_p99 = percentile(texel_errors, 0.99);
    found.depth_p99 = percentile(depth_errors, 0.99);
    found
}

/// What a picture shows, as if it were the truth. It needs the outputs mask, position, uv and height.
pub fn as_truth(frame: &Frame, camera: &Camera) -> Vec<Option<Hit>> {
    let (mask, heights) = (frame.aovs.mask.as_ref().unwrap(), frame.aovs.height.as_ref().unwrap());
    let (positions, uvs) = (frame.aovs.position.as_ref().unwrap(), frame.aovs.uv.as_ref().unwrap());
    let hit = |at: usize| {
        let position = Vec3::from_slice(&positions[3 * at..]).as_dvec3();
        let uv = Vec2::from_slice(&uvs[2 * at..]).as_dvec2();
        Hit { t: (position - camera.eye).length(), position, uv, height: f64::from(heights[at]) }
    };
    (0..mask.len()).map(|at| (mask[at] == 1).then(|| hit(at))).collect()
}

/// A line of a table.
pub fn row(name: &str, base: f32, found: &Agreement) {
    let Agreement { both, outline_off, place_p99, astray, far, texels_p99, depth_p99 } = found;
    let (outline_off, astray) = (outline_off.len(), astray.len());
    println!(
        "| {name} | {base} | {both} | {outline_off} | {astray} | {place_p99:.3} | {:.2} % | {texels_p99:.3} | {depth_p99:.1e} |",
        100.0 * far
    );
}

/// A PNG-less way to look at a picture: binary PPM, to the folder of BUMPWGPU_PICTURES if that is set.
pub fn show(frame: &Frame, name: &str) {
    let Ok(folder) = std::env::var("BUMPWGPU_PICTURES") else { return };
    let mut bytes = format!("P6 {} {} 255\n", frame.width, frame.height).into_bytes();
    bytes.extend(frame.color.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]));
    std::fs::write(std::path::Path::new(&folder).join(format!("{name}.ppm")), bytes).unwrap();
}

/// A camera that looks at the origin.
pub fn from(eye: [f64; 3]) -> Camera {
    Camera::look_at(DVec3::from(eye), DVec3::ZERO)
}

/// A pixel of a picture, and rays through it.
struct Pixel {
    /// Whether the picture shows anything there, and where that is.
    shown: Option<DVec3>,
    /// How wide the pixel is there.
    width: f64,
    middle: DVec3,
    right: DVec3,
    down: DVec3,
}

impl Pixel {
    /// The frame needs the outputs mask and position.
    fn new(at: usize, frame: &Frame, camera: &Camera) -> Self {
        let (mask, positions) = (frame.aovs.mask.as_ref().unwrap(), frame.aovs.position.as_ref().unwrap());
        let [corner, right, down] = camera.pixel_directions([frame.width, frame.height], 0);
        let place = Vec3::from_slice(&positions[3 * at..]).as_dvec3();
        let (x, y) = (at % frame.width as usize, at / frame.width as usize);
        Self {
            shown: (mask[at] == 1).then_some(place),
            width: right.length() * (place - camera.eye).dot(camera.forward()),
            middle: corner + right * (x as f64 + 0.5) + down * (y as f64 + 0.5),
            right,
            down,
        }
    }

    /// The direction of the ray so far from the middle, in pixels.
    fn ray(&self, dx: f64, dy: f64) -> DVec3 {
        self.middle + self.right * dx + self.down * dy
    }
}

/// Of some pixels those that show what is nowhere within a pixel, or nothing: some things are seen from one point of a
/// pixel only, being thinner.
pub fn lost(pixels: &[usize], frame: &Frame, judge: &Truth<'_>, camera: &Camera) -> usize {
    const RAYS: i32 = 24;
    let is_lost = |at: usize| {
        let pixel = Pixel::new(at, frame, camera);
        let Some(place) = pixel.shown else { return true };
        !(-RAYS..=RAYS).flat_map(|i| (-RAYS..=RAYS).map(move |j| (i, j))).any(|(i, j)| {
            let [dx, dy] = [i, j].map(|k| f64::from(k) / f64::from(RAYS));
            let hit = judge.seen(camera, pixel.ray(dx, dy));
            hit.is_some_and(|hit| hit.position.distance(place) < 1.5 * pixel.width)
        })
    };
    pixels.iter().filter(|&&at| is_lost(at)).count()
}

/// How many of some pixels do not show what a ray within a fiftieth of a pixel meets, or nothing where such a ray meets
/// nothing: outlines and crests may pass between two rays that are hardly apart. The truth looks finely here.
pub fn disproved(pixels: &[usize], frame: &Frame, judge: &Truth<'_>, camera: &Camera) -> usize {
    const WITHIN: f64 = 0.02;
    let is_so = |at: usize| {
        let pixel = Pixel::new(at, frame, camera);
        let spots =
            (0..=4).flat_map(|ring| (0..24).map(move |turn| (f64::from(ring) / 4.0, f64::from(turn))));
        spots.into_iter().any(|(ring, turn)| {
            let (sine, cosine) = (turn * std::f64::consts::TAU / 24.0).sin_cos();
            let ray = pixel.ray(WITHIN * ring * cosine, WITHIN * ring * sine);
            match (judge.seen_finely(camera, ray), pixel.shown) {
                (Some(hit), Some(place)) => hit.position.distance(place) < pixel.width,
                (hit, shown) => hit.is_none() && shown.is_none(),
            }
        })
    };
    pixels.iter().filter(|&&at| !is_so(at)).count()
}
