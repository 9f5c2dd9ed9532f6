//! One packing attempt: every shape in turn to its best free position.

use std::collections::HashMap;

use super::goal::Goal;
use super::mask::Reach;
use super::obstacles::Obstacles;
use super::occupancy::Occupancy;
use super::order::Strategy;
use super::shape::{Footprint, Shape};
use crate::progress::{Cancelled, Progress};

/// Where a shape went.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Placed {
    pub(super) footprint: usize,
    pub(super) x: usize,
    pub(super) y: usize,
}

/// The outcome of an attempt.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    /// By shape; `None` where the grid was full.
    pub(super) placed: Vec<Option<Placed>>,
    /// Rows in use.
    pub(super) rows: usize,
    /// Cells of shapes not placed.
    pub(super) missing: usize,
}

/// Footprints that share the row where their search begins.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
enum Kind {
    /// The same cells: where one found no place, nor does another.
    Same(u64),
    /// Width, height and share of cells to about an eighth: nearly so.
    Alike(usize, usize, usize),
}

impl Kind {
    fn of(f: &Footprint, alike: bool) -> Self {
        if !alike {
            return Self::Same(f.key);
        }
        // Steps of an eighth of the next lower power of two.
        let coarse = |n: usize| n >> n.ilog2().saturating_sub(3) << n.ilog2().saturating_sub(3);
        let (w, h) = (f.mask.width(), f.mask.height());
        Self::Alike(coarse(w), coarse(h), 8 * f.cells / (w * h))
    }
}

/// How many of the largest squares are asked by row summaries.
const SUMMARISED: usize = 4;

/// Best free position of a footprint cheaper than `limit`, and the first row that may have a free one.
fn best_position(
    grid: &Occupancy,
    f: &Footprint,
    goal: Goal,
    first_row: usize,
    limit: f64,
) -> (Option<(f64, usize, usize)>, usize) {
    let (w, h) = (f.mask.width(), f.mask.height());
    if w > grid.width() || h > grid.height() {
        return (None, 0);
    }
    let last_word = (grid.width() - w) >> 6;
    let within = !0 >> (63 - last_word);
    let mut best = None;
    let mut limit = limit;
    let mut first = None;
    let mut y = first_row;
    while y + h <= grid.height() && goal.cost(f, 0, y) < limit {
        let mut words = f.squares.iter().take(SUMMARISED).fold(within, |words, &q| words & grid.open_words(q, y));
        while words != 0 {
            let word = words.trailing_zeros() as usize;
            words &= words - 1;
            if goal.cost(f, 64 * word, y) >= limit {
                first = first.or(Some(y));
                break;
            }
            let mut blocked = 0;
            for &q in &f.squares {
                blocked |= grid.blocked(q, word, y);
                if blocked == !0 {
                    break;
                }
            }
            if blocked != !0 {
                first = first.or(Some(y));
                let x = 64 * word + (!blocked).trailing_zeros() as usize;
                let cost = goal.cost(f, x, y);
                if cost < limit {
                    limit = cost;
                    best = Some((cost, x, y));
                }
                break;
            }
        }
        y += 1;
    }
    (best, first.unwrap_or(y))
}

/// Where shapes are placed.
#[derive(Clone, Copy)]
pub(super) struct Site<'a> {
    /// Width and height in cells.
    pub(super) size: [usize; 2],
    /// Which cells around a shape others keep away from.
    pub(super) reach: &'a Reach,
    /// What is there already.
    pub(super) obstacles: Option<&'a Obstacles>,
    /// Whether search rows are shared by similar footprints.
    pub(super) alike: bool,
}

/// Places shapes on a site as a strategy says.
///
/// Stops at the first that finds no place. Cost: about a lookup per word of free space and footprint.
///
/// # Errors
/// [`Cancelled`].
pub(super) fn place(
    shapes: &[Shape],
    strategy: &Strategy,
    site: Site<'_>,
    progress: &Progress,
) -> Result<Layout, Cancelled> {
    let Site { size: [width, height], reach, obstacles, alike } = site;
    let order = strategy.order();
    // Highest level still asked about, from each place in the order on.
    let mut top_from = vec![0u32; order.len() + 1];
    for (k, &i) in order.iter().enumerate().rev() {
        let top = shapes[i].footprints.iter().flat_map(|f| f.squares.first()).map(|q| q.level).max();
        top_from[k] = top_from[k + 1].max(top.unwrap_or(0));
    }
    let mut grid = Occupancy::new(width, height, top_from[0]);
    if let Some(Obstacles { mask, frame, .. }) = obstacles {
        grid.occupy(mask, -(*frame as isize), -(*frame as isize), top_from[0]);
    }
    let mut layout = Layout { placed: vec![None; shapes.len()], rows: 0, missing: 0 };
    // Space only gets less: a footprint seen before has no place below the row where it last had one.
    let mut first_rows: HashMap<Kind, usize> = HashMap::new();
    for (k, &i) in order.iter().enumerate() {
        progress.check()?;
        let mut best: Option<(f64, Placed)> = None;
        let none_left = (0..shapes[i].footprints.len()).all(|n| strategy.leaves_out(i, n));
        for (n, f) in shapes[i].footprints.iter().enumerate() {
            if !none_left && strategy.leaves_out(i, n) {
                continue;
            }
            let first_row = first_rows.entry(Kind::of(f, alike)).or_insert(0);
            let limit = best.map_or(f64::INFINITY, |b| b.0);
            let (found, first) = best_position(&grid, f, strategy.goal, *first_row, limit);
            *first_row = first;
            if let Some((cost, x, y)) = found {
                best = Some((cost, Placed { footprint: n, x, y }));
            }
        }
        let Some((_, at)) = best else {
            if shapes[i].footprints.is_empty() {
                continue;
            }
            layout.missing = order[k..].iter().map(|&i| shapes[i].cells).sum();
            break;
        };
        let f = &shapes[i].footprints[at.footprint];
        let r = reach.cells() as isize;
        grid.occupy(&f.mask.dilated(reach), at.x as isize - r, at.y as isize - r, top_from[k + 1]);
        layout.rows = layout.rows.max(at.y + f.mask.height());
        layout.placed[i] = Some(at);
    }
    Ok(layout)
}
