//! In which order and by which goal charts are placed: the part of packing that is searched.

use super::goal::Goal;
use super::shape::Shape;
use crate::random::{GOLDEN, mix};

/// A way to place all charts.
#[derive(Clone, Debug)]
pub(super) struct Strategy {
    /// What a good position is.
    pub(super) goal: Goal,
    /// Charts of higher priority go first; ties by index.
    pub(super) priority: Vec<f64>,
    /// Where not 0: about half of the poses of each chart are left out, picked by this number. The best
    /// pose for the place a chart finds is often not the best for those that follow.
    pub(super) left_out: u64,
}

/// What makes a chart go first.
#[derive(Clone, Copy)]
enum Size {
    Area,
    Extent,
    Box,
}

/// The strategies tried first, best on average first (measured on atlases of 10 to 300 charts: any
/// one is within 3 % of another, the best of all 2 to 4 % above each).
const PORTFOLIO: [(Goal, Size); 8] = [
    (Goal::Middle, Size::Area),
    (Goal::Middle, Size::Extent),
    (Goal::Middle, Size::Box),
    (Goal::Top, Size::Area),
    (Goal::Centre, Size::Extent),
    (Goal::Top, Size::Extent),
    (Goal::Centre, Size::Area),
    (Goal::Top, Size::Box),
];

/// Spread of the changes of log-priority: from swapping near neighbours to moving a chart by an octave.
const SPREADS: [f64; 4] = [0.05, 0.15, 0.4, 0.1];
/// Half of the variations are confined to one chart in so many, and change those much.
const FEW: u64 = 5;
/// One variation in so many may change the goal.
const OTHER_GOAL: u64 = 6;

impl Strategy {
    /// The first `count` strategies of the portfolio.
    pub(super) fn portfolio(shapes: &[Shape], count: usize) -> Vec<Self> {
        let size = |shape: &Shape, size: Size| {
            let (w, h) = shape.footprints.first().map_or((1, 1), |f| (f.mask.width(), f.mask.height()));
            // Ties by area: a priority is a product with a small power of the number of cells.
            let cells = (shape.cells.max(1)) as f64;
            match size {
                Size::Area => cells,
                Size::Extent => (w.max(h) as f64).powi(2) * cells.powf(0.01),
                Size::Box => (w * h) as f64 * cells.powf(0.01),
            }
        };
        let of = |&(goal, by): &(Goal, Size)| Self {
            goal,
            priority: shapes.iter().map(|s| size(s, by)).collect(),
            left_out: 0,
        };
        PORTFOLIO.iter().take(count).map(of).collect()
    }

    /// A neighbour of this strategy, number `number` of as many as one likes.
    pub(super) fn varied(&self, number: u64) -> Self {
        let mut new = self.clone();
        match random(number, u64::MAX - 3) % 4 {
            0 | 1 => new.left_out = random(number, u64::MAX - 4) | 1,
            2 => new.left_out = 0,
            _ => {}
        }
        let spread = SPREADS[(number % SPREADS.len() as u64) as usize];
        let few = random(number, u64::MAX).is_multiple_of(2);
        for (i, p) in new.priority.iter_mut().enumerate() {
            let bits = random(number, i as u64);
            let (a, b) =
                ((bits >> 40) as f64 / (1u64 << 24) as f64, (bits >> 8 & 0xFF_FFFF) as f64 / (1u64 << 24) as f64);
            // The sum of two uniform numbers: a triangular distribution of unit variance.
            let noise = (a + b - 1.0) * 6.0_f64.sqrt();
            if !few {
                *p *= (spread * noise).exp();
            } else if bits.is_multiple_of(FEW) {
                *p *= (4.0 * spread * noise).exp();
            }
        }
        if random(number, u64::MAX - 1).is_multiple_of(OTHER_GOAL) {
            new.goal = PORTFOLIO[(random(number, u64::MAX - 2) % 4) as usize].0;
        }
        new
    }

    /// Whether pose `pose` of chart `chart` is left out.
    pub(super) fn leaves_out(&self, chart: usize, pose: usize) -> bool {
        self.left_out != 0 && random(self.left_out.wrapping_add(chart as u64), pose as u64) & 1 == 0
    }

    /// Indices of the charts, first to last.
    pub(super) fn order(&self) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.priority.len()).collect();
        order.sort_by(|&a, &b| self.priority[b].total_cmp(&self.priority[a]).then(a.cmp(&b)));
        order
    }
}

/// A random word for each pair of counters.
fn random(a: u64, b: u64) -> u64 {
    mix(mix(a.wrapping_mul(GOLDEN).wrapping_add(1)).wrapping_add(b.wrapping_mul(0xD1B5_4A32_D192_ED03)))
}
