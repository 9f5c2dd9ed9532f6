//! How long each stage took, for the report. Nothing is decided by it.

use std::time::Instant;

/// Seconds of each stage so far.
pub(crate) struct Clock {
    last: Instant,
    laps: Vec<(&'static str, f64)>,
}

impl Clock {
    pub(crate) fn new() -> Self {
        Self { last: Instant::now(), laps: Vec::new() }
    }

    pub(crate) fn lap(&mut self, name: &'static str) {
        let now = Instant::now();
        self.laps.push((name, (now - self.last).as_secs_f64()));
        self.last = now;
    }

    pub(crate) fn into_laps(self) -> Vec<(&'static str, f64)> {
        self.laps
    }
}
