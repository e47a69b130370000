// What a search returns. Twin of `Found` in crates/heightfield/src/ray.rs.

// The whole of a segment: what a search is told when nothing is known of the ground.
const WHOLE_STRETCH: vec2f = vec2f(0.0, 1.0);
// What `slack` says of a technique that does not march: more than any range of heights.
const NO_MARCH: f32 = 1e9;

struct Found {
    // Position along the segment: 0 at its start, 1 at its end.
    tau: f32,
    // 0 hit, 1 left, 2 unconverged.
    status: u32,
    // Height reads or nodes visited.
    steps: u32,
}

fn found_hit(tau: f32, steps: u32) -> Found {
    return Found(tau, 0u, steps);
}

fn found_left(steps: u32) -> Found {
    return Found(1.0, 1u, steps);
}

fn found_unconverged(tau: f32, steps: u32) -> Found {
    return Found(tau, 2u, steps);
}
