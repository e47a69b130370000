//! The lower envelope of parabolas along rows: one axis of the Euclidean distance transform.
//!
//! Felzenszwalb and Huttenlocher 2012, section 2.

/// One axis: its length, and how far apart its texels are.
pub(super) struct Transform {
    length: usize,
    square: f64,
    cyclic: bool,
}

impl Transform {
    /// `spacing`: mesh units between two texels; `cyclic`: whether the row begins again after its end.
    pub fn new(length: usize, spacing: f32, cyclic: bool) -> Self {
        Self { length, square: f64::from(spacing).powi(2), cyclic }
    }
}

/// A parabola of the envelope.
#[derive(Clone, Copy)]
struct Parabola {
    at: i64,
    value: f64,
    /// Where it begins to be the lowest.
    from: f64,
}

/// Replaces the values of each row by the least of `value[q] + (p - q)^2 spacing^2` over all `q`.
pub(super) fn transform_rows(axis: &Transform, values: &mut [f32]) {
    let mut envelope = Vec::new();
    for row in values.chunks_exact_mut(axis.length) {
        transform(axis, row, &mut envelope);
    }
}

fn transform(axis: &Transform, row: &mut [f32], envelope: &mut Vec<Parabola>) {
    let n = row.len() as i64;
    // In a cyclic row the nearest copy of a texel is at most half a length away.
    let margin = if axis.cyclic { n / 2 } else { 0 };
    envelope.clear();
    for at in -margin..n + margin {
        let value = f64::from(row[if axis.cyclic { at.rem_euclid(n) } else { at } as usize]);
        let mut from = f64::NEG_INFINITY;
        while let Some(&last) = envelope.last() {
            // Where the new parabola falls below the last one.
            let apart = (at - last.at) as f64;
            from = 0.5 * ((value - last.value) / (axis.square * apart) + (at + last.at) as f64);
            if from > last.from {
                break;
            }
            from = f64::NEG_INFINITY;
            envelope.pop();
        }
        envelope.push(Parabola { at, value, from });
    }
    let mut lowest = 0;
    for (p, value) in row.iter_mut().enumerate() {
        while envelope.get(lowest + 1).is_some_and(|next| next.from <= p as f64) {
            lowest += 1;
        }
        if let Some(parabola) = envelope.get(lowest) {
            let away = (p as i64 - parabola.at) as f64;
            *value = (parabola.value + away * away * axis.square) as f32;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_envelope_is_the_least_of_all() {
        let values: Vec<f32> = (0..3 * 23).map(|i| ((i * 7919) % 101) as f32 * 0.7).collect();
        for cyclic in [false, true] {
            for spacing in [0.01, 1.0, 9.0] {
                let axis = Transform::new(23, spacing, cyclic);
                let mut rows = values.clone();
                transform_rows(&axis, &mut rows);
                for (row, transformed) in values.chunks(23).zip(rows.chunks(23)) {
                    for (p, &got) in transformed.iter().enumerate() {
                        let away = |q: usize| {
                            let d = p.abs_diff(q);
                            let d = if cyclic { d.min(23 - d) } else { d };
                            (d as f32 * spacing).powi(2)
                        };
                        let least = (0..23).map(|q| row[q] + away(q)).fold(f32::INFINITY, f32::min);
                        assert!((got - least).abs() <= 1e-5 * least, "{got} for {least}");
                    }
                }
            }
        }
    }
}
