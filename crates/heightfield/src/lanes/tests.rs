//! Every operation at every level against plain Rust on one number.

use super::*;

/// What each operation gives for some numbers, in one list.
struct Everything<'a> {
    a: &'a [f32],
    b: &'a [f32],
}

impl Kernel for Everything<'_> {
    type Output = Vec<f64>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Vec<f64> {
        let mut out: Vec<Vec<f64>> = Vec::new();
        let width = L::WIDTH;
        for (ca, cb) in self.a.chunks_exact(width).zip(self.b.chunks_exact(width)) {
            let mut results = Vec::new();
            let float = |x: L::F, results: &mut Vec<Vec<f64>>| {
                let mut to = [0.0; 16];
                L::store(x, &mut to);
                results.push(to[..width].iter().copied().map(f64::from).collect());
            };
            let int = |x: L::I, results: &mut Vec<Vec<f64>>| {
                let mut to = [0; 16];
                L::store_int(x, &mut to);
                results.push(to[..width].iter().copied().map(f64::from).collect());
            };
            let wide = |x: L::D, results: &mut Vec<Vec<f64>>| {
                let mut to = [0.0; 16];
                L::store_wide(x, &mut to);
                results.push(to[..width].to_vec());
            };
            let mask = |x: L::M, results: &mut Vec<Vec<f64>>| {
                results.push((0..width).map(|i| f64::from(L::bits(x) >> i & 1)).collect());
            };
            let (a, b) = (L::load(ca), L::load(cb));
            let (less, not_more) = (L::lt(a, b), L::le(a, b));
            for x in [a + b, a - b, a * b, a / b, L::min(a, b), L::max(a, b), L::abs(a), L::floor(a)] {
                float(x, &mut results);
            }
            float(L::sqrt(L::abs(a)), &mut results);
            let order: Vec<f32> = (0..width).map(|i| i as f32).collect();
            let (mut spread, mut next) = ([0.0; 16], 0.0);
            L::store(L::expand(less, &order, b), &mut spread);
            for i in 0..width {
                assert_eq!(spread[i], if ca[i] < cb[i] { next } else { cb[i] });
                next += f32::from(ca[i] < cb[i]);
            }
            assert_eq!(L::bits(L::from_bits(L::bits(less))), L::bits(less));
            mask(L::odd(L::to_int(L::floor(a))), &mut results);
            assert_eq!(L::largest(a), ca.iter().copied().fold(f32::MIN, f32::max));
            float(L::select(less, a, b), &mut results);
            let mut swapped = [0.0; 16];
            L::store(L::neighbours(a), &mut swapped);
            for i in 0..width {
                assert_eq!(swapped[i], ca[(i ^ 1).min(width - 1)]);
            }
            float(L::to_float(L::to_int(L::floor(a))), &mut results);
            for m in [less, not_more, !less, less & !not_more, less | not_more, L::first(width / 2)] {
                mask(m, &mut results);
            }
            let (i, j) = (L::to_int(L::floor(a)), L::to_int(L::floor(b)));
            let five = L::splat_int(5);
            let low = j & L::splat_int(7);
            for x in [i + j, i - j, i * j, i & j, L::min_unsigned(i, j), L::min_int(i, j)] {
                int(x, &mut results);
            }
            int(L::select_int(less, i, five), &mut results);
            let table = [3, 1, 4, 1, 5, 9, 2, 6, 5, 3, 5, 8, 9, 7, 9, 3];
            int(L::lookup(&table, i), &mut results);
            float(L::times_power(a, L::splat_int(-3)), &mut results);
            mask(L::lt_int(i, j), &mut results);
            mask(L::eq_int(i, low), &mut results);
            let at = i & L::splat_int(63);
            // SAFETY: 0..64, and the table has more numbers than that.
            let (one, pair) = unsafe { (L::gather(self.a, at, less), L::gather_pairs(self.b, at)) };
            // SAFETY: as above.
            let all = unsafe { L::gather_all(self.a, at) };
            for x in [one, all, pair.0, pair.1] {
                float(x, &mut results);
            }
            // SAFETY: 0..64, and the table has more numbers than that.
            let square = unsafe { L::gather_squares(self.b, at, 70) };
            for x in square {
                float(x, &mut results);
            }
            let (da, db) = (L::widen(a), L::widen(b));
            for x in [da + db, da - db, da * db, da / db, L::min_wide(da, db), L::max_wide(da, db)] {
                wide(x, &mut results);
            }
            wide(L::floor_wide(da), &mut results);
            wide(L::sqrt_wide(L::select_wide(less, db - da, da - db)), &mut results);
            wide(L::splat_wide(0.1) + L::load_wide(&[0.25; 16]), &mut results);
            mask(L::lt_wide(da, db), &mut results);
            mask(L::le_wide(db, da), &mut results);
            float(L::narrow(da / db), &mut results);
            let mut packed = [f32::NAN; 16];
            let mut packed_ints = [0; 16];
            let count = L::compress(less, a, &mut packed);
            assert_eq!(count, L::compress_int(less, i, &mut packed_ints));
            let chosen: Vec<usize> = (0..width).filter(|&k| ca[k] < cb[k]).collect();
            assert_eq!(count, chosen.len());
            for (k, &lane) in chosen.iter().enumerate() {
                assert_eq!(packed[k], ca[lane]);
                assert_eq!(packed_ints[k], ca[lane].floor() as i32);
            }
            for (k, third) in L::load_triples(&self.a[..3 * width]).into_iter().enumerate() {
                L::store(third, &mut packed);
                assert!((0..width).all(|lane| packed[lane] == self.a[3 * lane + k]));
            }
            let mut packed_wide = [f64::NAN; 16];
            assert_eq!(count, L::compress_wide(less, da, &mut packed_wide));
            for (k, &lane) in chosen.iter().enumerate() {
                assert_eq!(packed_wide[k], f64::from(ca[lane]));
            }
            wide(L::select_signed_wide(da - db, da, db), &mut results);
            if out.is_empty() {
                out = results;
            } else {
                out.iter_mut().zip(results).for_each(|(all, more)| all.extend(more));
            }
        }
        // Half of a vector is another mask at each width.
        out.remove(17);
        out.into_iter().flatten().collect()
    }
}

#[test]
fn every_level_gives_the_same_bits() {
    let number = |i: usize, k: usize| ((i * k) % 4001) as f32 / 7.0 - 250.0;
    let mut a: Vec<f32> = (0..320).map(|i| number(i, 1709)).collect();
    let mut b: Vec<f32> = (0..320).map(|i| number(i, 911)).collect();
    b[7] = a[7];
    a[40] = -0.0;
    a[41] = f32::MIN_POSITIVE / 4.0;
    let expected = Everything { a: &a, b: &b }.run::<Portable<1>>();
    for &level in Level::available() {
        let got = dispatch_at(level, Everything { a: &a, b: &b });
        assert_eq!(expected.len(), got.len());
        for (at, (x, y)) in expected.iter().zip(&got).enumerate() {
            assert_eq!(x.to_bits(), y.to_bits(), "{} operation {} lane {}", level.name(), at / 320, at % 320);
        }
    }
    assert!(Level::available().contains(&Level::Baseline));
}

#[test]
fn one_lane_is_plain_arithmetic() {
    type One = Portable<1>;
    let one = |x: <One as Lanes>::F| {
        let mut to = [0.0];
        One::store(x, &mut to);
        to[0]
    };
    let (a, b) = (One::splat(7.25), One::splat(-2.5));
    assert_eq!(one(a + b), 4.75);
    assert_eq!(one(a / b), -2.9);
    assert_eq!(one(One::floor(b)), -3.0);
    assert_eq!(one(One::times_power(b, One::splat_int(-3))), one(b) / 8.0);
    assert_eq!(one(One::mul_add(a, b, a)), -10.875);
    assert_eq!(one(One::select(One::lt(a, b), a, b)), -2.5);
    assert!(!One::any(One::lt(One::splat(f32::NAN), a)));
}
