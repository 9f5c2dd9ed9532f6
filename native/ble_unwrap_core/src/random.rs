//! Random numbers that depend on a seed and an index only, never on the order they are drawn in.

/// Between two words of the sequence of SplitMix64: 2⁶⁴ divided by the golden ratio.
pub(crate) const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// Word `index` of the sequence of SplitMix64 that begins at `seed`, 64 bits.
///
/// Steele, Lea, Flood: Fast splittable pseudorandom number generators, OOPSLA 2014, figure 15.
pub(crate) fn word(seed: u64, index: u64) -> u64 {
    mix(seed.wrapping_add(index.wrapping_add(1).wrapping_mul(GOLDEN)))
}

/// The bijection of 64 bits that makes words of equidistant numbers: the finaliser of SplitMix64.
pub(crate) fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Uniform in (0, 1].
fn uniform(seed: u64, index: u64) -> f64 {
    ((word(seed, index) >> 11) + 1) as f64 * 2.0_f64.powi(-53)
}

/// Number `index` of a standard normal sequence (Box and Muller 1958); each takes two words.
pub(crate) fn normal(seed: u64, index: u64) -> f64 {
    // The seed itself is hashed, so that neighbouring seeds do not give shifted sequences.
    let seed = word(seed, u64::MAX);
    let radius = (-2.0 * uniform(seed, 2 * index).ln()).sqrt();
    radius * (std::f64::consts::TAU * uniform(seed, 2 * index + 1)).cos()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn word_is_the_published_sequence() {
        // First outputs of SplitMix64 seeded with 1234567, a widely used check.
        assert_eq!([word(1_234_567, 0), word(1_234_567, 1)], [6_457_827_717_110_365_317, 3_203_168_211_198_807_973]);
    }

    #[test]
    fn normal_has_mean_nought_variance_one_and_light_tails() {
        let n = 100_000_u64;
        let moments = (0..n).map(|i| normal(7, i)).fold([0.0; 3], |[a, b, c], v| [a + v, b + v * v, c + v.powi(4)]);
        let [mean, variance, fourth] = moments.map(|m| m / n as f64);
        assert!(mean.abs() < 0.01 && (variance - 1.0).abs() < 0.02 && (fourth - 3.0).abs() < 0.1, "{moments:?}");
        assert_ne!(normal(7, 0), normal(8, 0));
    }
}
