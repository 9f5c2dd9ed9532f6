//! Ranges of real numbers.

use std::fmt;

/// The real numbers between two ends. Each end may belong to the interval or be left out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// The lower end.
    pub least: f64,
    /// Whether the lower end itself is left out.
    pub least_open: bool,
    /// The upper end; infinite where there is no upper bound.
    pub most: f64,
    /// Whether the upper end itself is left out.
    pub most_open: bool,
}

impl Interval {
    /// The numbers from `least` to `most`, both included.
    #[must_use]
    pub const fn closed(least: f64, most: f64) -> Self {
        Self { least, least_open: false, most, most_open: false }
    }

    /// The numbers above `least` and at most `most`.
    #[must_use]
    pub const fn above(least: f64, most: f64) -> Self {
        Self { least, least_open: true, most, most_open: false }
    }

    /// The numbers above `least` and below `most`.
    #[must_use]
    pub const fn between(least: f64, most: f64) -> Self {
        Self { least, least_open: true, most, most_open: true }
    }

    /// All finite numbers from `least` on.
    #[must_use]
    pub const fn at_least(least: f64) -> Self {
        Self { least, least_open: false, most: f64::INFINITY, most_open: true }
    }

    /// Whether a number lies in the interval. NaN lies in none.
    #[must_use]
    pub fn contains(self, x: f64) -> bool {
        (x > self.least || !self.least_open && x == self.least) && (x < self.most || !self.most_open && x == self.most)
    }
}

impl fmt::Display for Interval {
    /// Writes the interval in words, for instance "above 0 and at most 1".
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", if self.least_open { "above" } else { "at least" }, self.least)?;
        if self.most.is_infinite() {
            return Ok(());
        }
        write!(f, " and {} {}", if self.most_open { "below" } else { "at most" }, self.most)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_belong_to_it_or_not_and_the_text_says_so() {
        let cases = [
            (Interval::closed(0.0, 2.0), [true, true], "at least 0 and at most 2"),
            (Interval::above(0.0, 2.0), [false, true], "above 0 and at most 2"),
            (Interval::between(0.0, 2.0), [false, false], "above 0 and below 2"),
        ];
        for (interval, ends, text) in cases {
            assert_eq!([0.0, 2.0].map(|x| interval.contains(x)), ends, "{text}");
            assert_eq!(interval.to_string(), text);
            let outside = [-f64::MIN_POSITIVE, 2.0_f64.next_up(), f64::NAN, f64::INFINITY, f64::NEG_INFINITY];
            assert!(outside.into_iter().all(|x| !interval.contains(x)), "{text}");
            assert!([f64::MIN_POSITIVE, 1.0, 2.0_f64.next_down()].into_iter().all(|x| interval.contains(x)), "{text}");
        }
        let finite = Interval::at_least(1.0);
        assert_eq!(finite.to_string(), "at least 1");
        assert!(finite.contains(1.0) && finite.contains(f64::MAX) && !finite.contains(f64::INFINITY));
    }
}
