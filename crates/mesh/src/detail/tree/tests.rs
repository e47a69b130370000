//! The tree against every triangle tested one by one, in f64.

use glam::{DVec3, Vec3};

use super::ray::{Hit, Ray, Sides};
use super::{LEAF, Scratch, Tree};

type Soup = Vec<[[f32; 3]; 3]>;

struct Random(u64);

impl Random {
    fn unit(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1 << 24) as f32
    }

    fn signed(&mut self) -> Vec3 {
        Vec3::new(self.unit(), self.unit(), self.unit()) * 2.0 - 1.0
    }
}

fn tree(soup: &Soup) -> Tree {
    Tree::new(soup.len(), |i| soup[i as usize].map(Vec3::from), || true).unwrap()
}

fn soup(count: usize, size: f32, random: &mut Random) -> Soup {
    (0..count)
        .map(|_| {
            let middle = random.signed();
            [(); 3].map(|()| (middle + random.signed() * size).to_array())
        })
        .collect()
}

/// A square of bumps seen from above, counter-clockwise.
fn grid(n: usize) -> Soup {
    let p = |i: usize, j: usize| {
        let (x, y) = (i as f32 / n as f32, j as f32 / n as f32);
        [x, y, 0.1 * (9.0 * x).sin() * (7.0 * y).cos()]
    };
    let cells = (0..n).flat_map(|j| (0..n).map(move |i| (i, j)));
    cells
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [p(i, j), p(i + 1, j), p(i + 1, j + 1), p(i, j + 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect()
}

/// The first hit by the textbook test (Moeller and Trumbore 1997), and how far inside it is.
fn brute(soup: &Soup, ray: &Ray, sides: Sides) -> Option<(f64, f64)> {
    let (o, d) = (DVec3::from(ray.origin.map(f64::from)), DVec3::from(ray.direction.map(f64::from)));
    let mut best: Option<(f64, f64)> = None;
    for corners in soup {
        let [a, b, c] = corners.map(|p| DVec3::from(p.map(f64::from)));
        let (e1, e2) = (b - a, c - a);
        let det = e1.dot(d.cross(e2));
        if det == 0.0 || (sides == Sides::Front && det < 0.0) {
            continue;
        }
        let u = (o - a).dot(d.cross(e2)) / det;
        let v = d.dot((o - a).cross(e1)) / det;
        let t = e2.dot((o - a).cross(e1)) / det;
        let inside = u.min(v).min(1.0 - u - v);
        let within = t >= f64::from(ray.start) && t <= f64::from(ray.end);
        if inside >= 0.0 && within && best.is_none_or(|(found, _)| t < found) {
            best = Some((t, inside));
        }
    }
    best
}

fn ask(tree: &Tree, rays: &[Ray], sides: Sides) -> Vec<Option<Hit>> {
    let mut hits = vec![None; rays.len()];
    tree.nearest_hits(&mut rays.to_vec(), &mut hits, sides, &mut Scratch::default());
    hits
}

/// Compares a bundle with brute force; returns how many rays hit. Hits within a hair of an edge may
/// go either way.
fn compare(soup: &Soup, tree: &Tree, rays: &[Ray], sides: Sides) -> usize {
    let found = ask(tree, rays, sides);
    let mut hits = 0;
    for (ray, hit) in rays.iter().zip(&found) {
        let expected = brute(soup, ray, sides);
        match (hit, expected) {
            (Some(hit), Some((t, _))) => {
                hits += 1;
                assert!((f64::from(hit.t) - t).abs() < 2e-5, "{hit:?} against {t} for {ray:?}");
                let [a, b, c] = soup[hit.triangle as usize].map(Vec3::from);
                let [u, v, w] = hit.weights;
                let place = a * u + b * v + c * w;
                let along = Vec3::from(ray.origin) + Vec3::from(ray.direction) * hit.t;
                assert!(place.distance(along) < 2e-5, "{place} against {along}");
                assert!((u + v + w - 1.0).abs() < 1e-5);
            }
            (None, None) => {}
            (Some(hit), None) => assert!(hit.weights.iter().any(|w| w.abs() < 1e-4), "{hit:?} for {ray:?}"),
            (None, Some((_, inside))) => assert!(inside < 1e-4, "a hit {inside} inside is lost: {ray:?}"),
        }
        assert_eq!(
            tree.blocked(*ray, &mut Vec::new()),
            ask(tree, &[*ray], Sides::Both)[0].is_some(),
            "{ray:?}"
        );
    }
    hits
}

#[test]
fn bundles_find_what_brute_force_finds() {
    let mut random = Random(1);
    let mut hits = 0;
    for (count, size) in [(1, 0.5), (7, 0.5), (9, 0.3), (300, 0.1), (2000, 0.05), (400, 1.0), (20_000, 0.03)]
    {
        let soup = soup(count, size, &mut random);
        let tree = tree(&soup);
        for bundle in 0..12 {
            let origin = random.signed() * 1.5;
            let direction = random.signed() - origin;
            let spread = [0.0, 0.02, 1.0][bundle % 3];
            let rays: Vec<Ray> = (0..1 + bundle * 5)
                .map(|_| {
                    let direction = (direction + random.signed() * spread).normalize();
                    Ray::new(origin + random.signed() * spread, direction, 0.0, 2.0)
                })
                .collect();
            for sides in [Sides::Front, Sides::Both] {
                hits += compare(&soup, &tree, &rays, sides);
            }
        }
    }
    assert!(hits > 500, "{hits} hits");
}

#[test]
fn a_lost_triangle_is_noticed() {
    // Negative control: the comparison fails for a tree of other triangles.
    let soup = grid(8);
    let tree = tree(&soup[16..].to_vec());
    let rays = vec![Ray::new(Vec3::new(0.3, 0.03, 1.0), Vec3::NEG_Z, 0.0, 2.0)];
    let found = std::panic::catch_unwind(|| compare(&soup, &tree, &rays, Sides::Both));
    assert!(found.is_err());
}

#[test]
fn no_ray_slips_between_neighbours() {
    // Rays through vertices and along edges of the projection, straight and slanted.
    let soup = grid(16);
    let tree = tree(&soup);
    for direction in [Vec3::NEG_Z, Vec3::new(0.25, -0.125, -1.0), Vec3::new(-0.0, 0.5, -1.0)] {
        let mut rays = Vec::new();
        for j in 1..64 {
            for i in 1..64 {
                let p = Vec3::new(i as f32 / 64.0, j as f32 / 64.0, 0.0);
                if (p - direction * 0.25).min_element() > -0.2 {
                    rays.push(Ray::new(p - direction * 0.25, direction, 0.0, 1.0));
                }
            }
        }
        for rays in rays.chunks(64) {
            let lost = ask(&tree, rays, Sides::Front)
                .iter()
                .zip(rays)
                .filter(|(hit, ray)| {
                    let p = Vec3::from(ray.origin) + direction * 0.25;
                    let far = direction.truncate() * 0.15;
                    let inside = |x: f32, d: f32| x + d < 1.0 && x + d > 0.0 && x - d > 0.0 && x - d < 1.0;
                    hit.is_none() && inside(p.x, far.x) && inside(p.y, far.y)
                })
                .count();
            assert_eq!(lost, 0, "along {direction}");
        }
    }
}

#[test]
fn sides_are_told_apart() {
    let soup = grid(4);
    let tree = tree(&soup);
    let down = Ray::new(Vec3::new(0.4, 0.3, 1.0), Vec3::NEG_Z, 0.0, 2.0);
    let up = Ray::new(Vec3::new(0.4, 0.3, -1.0), Vec3::Z, 0.0, 2.0);
    assert!(ask(&tree, &[down], Sides::Front)[0].is_some());
    assert!(ask(&tree, &[up], Sides::Front)[0].is_none());
    assert!(ask(&tree, &[up], Sides::Both)[0].is_some());
}

#[test]
fn a_ray_ends_where_it_is_told() {
    let soup = vec![[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]];
    let tree = tree(&soup);
    let ray = |start, end| Ray::new(Vec3::new(0.2, 0.2, 1.0), Vec3::NEG_Z, start, end);
    assert!(ask(&tree, &[ray(0.0, 1.0)], Sides::Front)[0].is_some());
    assert!(ask(&tree, &[ray(0.0, 0.999)], Sides::Front)[0].is_none());
    assert!(ask(&tree, &[ray(1.001, 2.0)], Sides::Front)[0].is_none());
}

/// How many nodes lie on the longest path.
fn depth(tree: &Tree) -> usize {
    let mut open = vec![(0u32, 1)];
    let mut deepest = 0;
    while let Some((at, depth)) = open.pop() {
        deepest = deepest.max(depth);
        let children = tree.nodes[at as usize].child;
        open.extend(children.iter().filter(|&&c| c & LEAF == 0).map(|&c| (c, depth + 1)));
    }
    deepest
}

#[test]
fn hostile_triangles_make_a_shallow_tree() {
    let one = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let same = vec![one; 50_000];
    // Each a tenth the size and distance of the one before, down to nothing.
    let shrinking: Soup = (0..20_000)
        .map(|i| {
            let s = 0.99_f32.powi(i);
            one.map(|p| p.map(|x| (x + 1.0) * s * 1e14))
        })
        .collect();
    let points = vec![[[3.0; 3]; 3]; 10_000];
    for soup in [same, shrinking, points] {
        let tree = tree(&soup);
        // 48 cuts wherever the areas say, then halves.
        assert!(depth(&tree) < 48 + 17, "{}", depth(&tree));
        let ray = Ray::new(Vec3::new(0.2, 0.2, 1.0), Vec3::NEG_Z, 0.0, 2.0);
        ask(&tree, &[ray; 64], Sides::Both);
    }
}

#[test]
fn an_empty_tree_meets_nothing() {
    let tree = tree(&Vec::new());
    let ray = Ray::new(Vec3::ZERO, Vec3::X, 0.0, 1.0);
    assert_eq!(ask(&tree, &[ray], Sides::Both), [None]);
    assert!(!tree.blocked(ray, &mut Vec::new()));
    assert!(tree.nearest_point(Vec3::ONE, &mut Vec::new()).is_none());
}

#[test]
fn building_stops_when_told() {
    let soup = grid(4);
    for after in 0..3 {
        let mut asked = 0;
        let built = Tree::new(
            soup.len(),
            |i| soup[i as usize].map(Vec3::from),
            || {
                asked += 1;
                asked <= after
            },
        );
        assert!(built.is_none());
    }
}

#[test]
fn the_nearest_point_is_no_further_than_any_other() {
    let mut random = Random(9);
    let soup = soup(300, 0.2, &mut random);
    let tree = tree(&soup);
    for _ in 0..200 {
        let p = random.signed() * 2.0;
        let near = tree.nearest_point(p, &mut Vec::new()).unwrap();
        let [a, b, c] = soup[near.triangle as usize].map(Vec3::from);
        let [u, v, w] = near.weights;
        assert!(near.place.distance(a * u + b * v + c * w) < 1e-5);
        assert!(u >= 0.0 && v >= 0.0 && w >= -1e-6);
        // Points spread over every triangle come as close as their spacing allows, never closer.
        let mut least = f32::INFINITY;
        for corners in &soup {
            let [a, b, c] = corners.map(Vec3::from);
            for i in 0..=20 {
                for j in 0..=20 - i {
                    let (u, v) = (i as f32 / 20.0, j as f32 / 20.0);
                    least = least.min(p.distance(a + (b - a) * u + (c - a) * v));
                }
            }
        }
        let found = p.distance(near.place);
        assert!(found <= least + 1e-6 && found > least - 0.03, "{found} against {least}");
    }
}
