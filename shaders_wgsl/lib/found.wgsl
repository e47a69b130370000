// What a search returns. Twin of `Found` in crates/heightfield/src/ray.rs.

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
