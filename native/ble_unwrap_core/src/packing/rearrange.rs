//! Another arrangement to start from: charts that change places, are turned, or are put elsewhere.

use std::f64::consts::{FRAC_PI_2, TAU};

use super::compact::{Arrangement, Frame};
use super::sketch::Spot;
use crate::random::word;

/// Number `number` of as many variations of an arrangement as one likes: one chart turned, one put anywhere and turned, or two that change
/// places, turned or not. Charts for which `turns` says so get any angle, others a multiple of a quarter turn, and none is turned where
/// `quarters` is false. Charts may overlap in it.
pub(super) fn varied(at: &Arrangement, number: u64, turns: &[bool], quarters: bool, frame: &Frame) -> Arrangement {
    let mut new = at.clone();
    let n = new.spots.len();
    let pick = |draw: u64, of: usize| (word(number, draw) % of as u64) as usize;
    let share = |draw: u64| (word(number, draw) >> 11) as f64 / (1u64 << 53) as f64;
    let one = pick(0, n);
    let other = (one + 1 + pick(1, n.max(2) - 1)) % n;
    let turned = |spot: &mut Spot, chart: usize, draw: u64| {
        let angle = match (turns[chart], quarters) {
            (true, _) => TAU * share(draw),
            (false, true) => FRAC_PI_2 * pick(draw, 4) as f64,
            (false, false) => return,
        };
        let ((s, c), [a, b]) = (angle.sin_cos(), spot.turn);
        spot.turn = [a * c - b * s, b * c + a * s];
    };
    match pick(2, 4) {
        kind @ (0 | 1) if n > 1 => {
            let places = [one, other].map(|i| new.spots[i].centre);
            (new.spots[one].centre, new.spots[other].centre) = (places[1], places[0]);
            if kind == 1 {
                turned(&mut new.spots[one], one, 3);
                turned(&mut new.spots[other], other, 4);
            }
        }
        2 => turned(&mut new.spots[one], one, 3),
        _ => {
            turned(&mut new.spots[one], one, 3);
            new.spots[one].centre = [frame.sides[0] * share(5), frame.sides[1] * share(6)];
        }
    }
    new
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arrangement() -> Arrangement {
        let spot = |k: usize| Spot { turn: [1.0, 0.0], centre: [10.0 * k as f64, 5.0] };
        Arrangement { density: 2.0, spots: (0..4).map(spot).collect() }
    }

    #[test]
    fn a_variation_moves_two_charts_at_most_and_is_a_function_of_its_number() {
        let at = arrangement();
        let frame = Frame { sides: [100.0, 50.0], border: 1.0, gap: 2.0, ceiling: f64::INFINITY };
        let mut is_any_turned = [false; 2];
        for number in 0..200 {
            for (k, turns) in [[true; 4], [false; 4]].iter().enumerate() {
                let new = varied(&at, number, turns, true, &frame);
                assert_eq!(new.spots, varied(&at, number, turns, true, &frame).spots);
                let moved: Vec<_> = at.spots.iter().zip(&new.spots).filter(|(a, b)| a != b).map(|(_, b)| *b).collect();
                assert!(moved.len() <= 2, "{} charts moved", moved.len());
                assert_eq!(new.density, 2.0);
                for Spot { turn: [c, s], centre } in moved {
                    assert!((c * c + s * s - 1.0).abs() < 1e-12);
                    assert!((0.0..=100.0).contains(&centre[0]) && (0.0..=50.0).contains(&centre[1]));
                    let is_quarter = c.abs().min(s.abs()) < 1e-12;
                    assert!(turns[0] || is_quarter);
                    is_any_turned[k] |= !is_quarter;
                }
            }
            let fixed = varied(&at, number, &[false; 4], false, &frame);
            assert!(fixed.spots.iter().all(|spot| spot.turn == [1.0, 0.0]));
        }
        assert_eq!(is_any_turned, [true, false]);
    }

    #[test]
    fn a_single_chart_is_turned_or_moved() {
        let mut at = arrangement();
        at.spots.truncate(1);
        let frame = Frame { sides: [100.0; 2], border: 1.0, gap: 2.0, ceiling: f64::INFINITY };
        for number in 0..50 {
            assert_ne!(varied(&at, number, &[true], true, &frame).spots, at.spots);
        }
    }
}
