//! Numbers that look random and depend on nothing but their arguments.

/// The `counter`-th number of stream `seed`, uniform in [0, 1): SplitMix64.
#[must_use]
pub fn random(seed: u64, counter: u64) -> f64 {
    let mut z =
        seed.wrapping_mul(0xD134_2543_DE82_EF95).wrapping_add((counter + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15));
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^= z >> 31;
    (z >> 11) as f64 / (1u64 << 53) as f64
}

/// Smooth noise in the plane, in [−1, 1]: random values on the integer grid, blended with a
/// continuous second derivative. Repeats after 2²⁰.
#[must_use]
pub fn smooth_noise(seed: u64, x: f64, y: f64) -> f64 {
    let (i, j) = (x.floor(), y.floor());
    let (s, t) = (x - i, y - j);
    let fade = |t: f64| t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let value = |di: i64, dj: i64| {
        let wrap = |k: f64, d: i64| ((k as i64 + d) & 0xF_FFFF) as u64;
        2.0 * random(seed, wrap(i, di) << 20 | wrap(j, dj)) - 1.0
    };
    let blend = |a: f64, b: f64, t: f64| a + (b - a) * t;
    let (s, t) = (fade(s), fade(t));
    blend(blend(value(0, 0), value(1, 0), s), blend(value(0, 1), value(1, 1), s), t)
}
