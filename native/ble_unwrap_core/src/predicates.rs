//! The exact predicate on which everything rests that is promised of a map.

use robust::{Coord, orient2d};

/// Twice the signed area of the triangle abc in the plane. Its sign is exact: positive where a → b → c turns left, zero where all
/// three lie on a line; NaN where a coordinate is.
#[inline]
#[must_use]
pub(crate) fn orientation<P: Into<[f64; 2]>>(a: P, b: P, c: P) -> f64 {
    let coord = |p: P| {
        let [x, y] = p.into();
        Coord { x, y }
    };
    orient2d(coord(a), coord(b), coord(c))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_tells_a_turn_that_rounding_does_not() {
        // On a line but for the last digit, where the plain formula gives nothing.
        let (a, b) = ([12.0, 12.0], [24.0, 24.0]);
        let next = f64::from_bits(0.5f64.to_bits() + 1);
        assert!(orientation([0.5, 0.5], a, b) == 0.0);
        assert!(orientation([0.5, next], a, b) > 0.0 && orientation([next, 0.5], a, b) < 0.0);
        assert!(orientation([f64::NAN, 0.0], a, b).is_nan());
    }
}
