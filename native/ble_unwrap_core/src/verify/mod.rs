//! Exact checks of the final float32 layout.
//!
//! # What is checked, and why it proves a layout injective
//!
//! All signs come from exact predicates (Shewchuk: Adaptive precision floating-point arithmetic and
//! fast robust geometric predicates, 1997), so there is no tolerance anywhere. For each chart:
//!
//! 1. every triangle is strictly positive;
//! 2. the *boundary chain* (the directed edges of its triangles, less those that two triangles run
//!    through in opposite directions) consists of simple loops that do not touch themselves or
//!    each other;
//! 3. exactly one of these loops is positively oriented.
//!
//! Because of 1 the number of triangles over a point of the plane is the degree of the layout there,
//! which is the winding number of the boundary chain around the point. Because of 2 every loop
//! contributes 0 and +1 (a positive one) or −1; because of 3 the sum is at most 1. So no two
//! triangles share area. Nothing is asked of the inside: a vertex around which the surface winds twice
//! has all its triangles positive, but then some boundary must wind twice, and 2 or 3 fails. Nor is
//! anything asked of the surface: vertices count as one where their UVs are one.
//!
//! For the layout, further:
//!
//! 4. boundary loops of different charts do not touch;
//! 5. no loop lies in the filled area of another chart (in its holes it may).
//!
//! Where the texture has several tiles, every chart must lie within one of these. Nothing else changes: tiles are squares of one plane, and distances
//! between charts of different tiles count like any others.
//!
//! Two charts that share area without their boundaries meeting would have a loop of one inside the
//! filled area of the other. So 1 to 5 make the whole layout injective.
//!
//! # Stacks
//!
//! Charts may lie on each other on purpose. Of each stack one chart goes through all of the above: the one with the
//! lowest label whose triangle with the lowest number is positive. Each other one must
//!
//! 6. have only strictly positive triangles, or only strictly negative ones, if it is mirrored: its boundary chain is
//!    then taken the other way round;
//! 7. have the same boundary chain as that one, edge by edge and to the bit.
//!
//! Then its winding numbers are those of that chart: it is as injective, and covers exactly the same place.

mod boundary;
mod crossings;
mod nesting;
mod stacking;

use std::fmt;

use crate::metrics::{GAP_SEARCH_TEXELS, NONE, OwnedSegment, UvMesh, least_gap};
use crate::packing::Tile;
use crate::predicates;
use crate::progress::{Cancelled, Progress};

use stacking::{Stacking, Triangles};

/// How many elements of a layout break a rule, and the first of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Defect<T> {
    /// Number of elements that break the rule.
    pub count: usize,
    /// The element that breaks the rule and has the lowest number. If the checks are not [complete](Certificate::complete),
    /// it may be another.
    pub first: Option<T>,
}

impl<T> Default for Defect<T> {
    fn default() -> Self {
        Self { count: 0, first: None }
    }
}

impl<T: Copy + Ord> Defect<T> {
    fn add(&mut self, offender: T) {
        self.merge(Self { count: 1, first: Some(offender) });
    }

    fn merge(&mut self, other: Self) {
        self.count += other.count;
        self.first = match (self.first, other.first) {
            (Some(a), Some(b)) => Some(a.min(b)),
            (a, b) => a.or(b),
        };
    }
}

/// The outcome of the exact checks of a layout. Triangles are those of the triangulated faces; the label of a triangle is
/// the number of its chart.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Certificate {
    /// Number of charts: of different labels that are not negative.
    pub charts: usize,
    /// Triangles with a negative label. They take part in no other check, and break no rule by themselves.
    pub unmapped: Defect<u32>,
    /// Triangles with a corner that is outside the unit square or not finite; where the texture has several tiles, outside the tile in which the triangle
    /// of its chart with the lowest number lies, since a chart must not cross the border of a tile.
    pub out_of_range: Defect<u32>,
    /// Triangles that are not strictly positive: they are turned over or have no area. Of a chart that lies on another
    /// in a stack, all are to be positive, or all negative, as its triangle with the lowest number is.
    pub flipped: Defect<u32>,
    /// Pairs of boundary edges of one chart that cross or touch, except where one follows the other. Each is named by the
    /// triangles of the two edges, the lower number first. A vertex that a boundary visits twice counts, too.
    pub crossings_inside: Defect<(u32, u32)>,
    /// Pairs of boundary edges of different charts that have a point in common, named in the same way.
    pub crossings_between: Defect<(u32, u32)>,
    /// Boundary loops inside the filled area of another chart. Each is named by a triangle at the loop and the triangle of
    /// that chart with the lowest number. They are not looked for where contacts were too many to count.
    pub nested: Defect<(u32, u32)>,
    /// Labels of the charts that do not have exactly one positively oriented boundary loop, because they are in pieces or
    /// turned inside out.
    pub bad_loops: Defect<i32>,
    /// Number of charts that share their place with others on purpose.
    pub stacked: usize,
    /// Labels of the charts that do not cover exactly the same place as the chart of their stack that they are compared
    /// with.
    pub apart: Defect<i32>,
    /// Labels of all charts that break a rule, in ascending order.
    pub faulty_charts: Vec<i32>,
    /// Least distance in texels between the boundaries of different charts that are not of one stack. Unlike the
    /// checks, it is subject to rounding. A distance above eight texels and above twice the margin is given as the
    /// larger of these two values.
    pub gap_texels: f64,
    /// The margin: the value that `gap_texels` has to reach.
    pub margin_texels: f64,
    /// Whether all searches came to their end. A search gives up when there are too many contacts. The counts are then
    /// lower bounds, and the first element need not be the one with the lowest number; or nothing is proven.
    pub complete: bool,
}

/// Says in one clause what is wrong, or "nothing".
impl fmt::Display for Certificate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let counts = [
            (
                self.out_of_range.count,
                ["triangle outside the texture or its tile", "triangles outside the texture or their tiles"],
            ),
            (self.flipped.count, ["flipped triangle", "flipped triangles"]),
            (self.crossings_inside.count, ["crossing of a chart with itself", "crossings of charts with themselves"]),
            (self.crossings_between.count, ["crossing between charts", "crossings between charts"]),
            (self.nested.count, ["chart within another", "charts within others"]),
            (self.bad_loops.count, ["chart without one outer boundary", "charts without one outer boundary each"]),
            (self.apart.count, ["chart not exactly on its stack", "charts not exactly on their stacks"]),
        ];
        let mut found: Vec<String> = counts
            .into_iter()
            .filter(|c| c.0 > 0)
            .map(|(n, words)| format!("{n} {}", words[usize::from(n > 1)]))
            .collect();
        if self.gap_texels.is_nan() || self.gap_texels < self.margin_texels {
            found.push(format!("charts {} texels apart instead of {}", self.gap_texels, self.margin_texels));
        }
        if !self.complete {
            found.push("more contacts than can be looked at".into());
        }
        if found.is_empty() { f.write_str("nothing") } else { f.write_str(&found.join(", ")) }
    }
}

impl Certificate {
    /// Whether the layout is proven to be injective but for its stacks, to lie in the unit square or its tiles and to
    /// keep the margin.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        self.is_injective() && self.keeps_margin()
    }

    /// Whether charts that are not of one stack are at least the margin apart.
    #[must_use]
    pub fn keeps_margin(&self) -> bool {
        // NaN keeps nothing.
        self.complete && self.gap_texels >= self.margin_texels
    }

    /// Whether the layout is proven to be injective, but for charts that lie exactly on another one of their stack, and
    /// to lie in the unit square or, chart by chart, in its tiles.
    #[must_use]
    pub fn is_injective(&self) -> bool {
        self.complete
            && self.out_of_range.count == 0
            && self.flipped.count == 0
            && self.crossings_inside.count == 0
            && self.crossings_between.count == 0
            && self.nested.count == 0
            && self.bad_loops.count == 0
            && self.apart.count == 0
    }
}

/// Checks a layout exactly; the module's text tells what is proven.
///
/// Charts are the labels of `mesh`. A false [`Certificate::complete`] needs tens of millions of near
/// misses or contacts.
///
/// Deterministic for any number of threads. O(n log n); less than a second for a million triangles.
///
/// # Errors
/// [`Cancelled`].
pub(crate) fn verify(mesh: &UvMesh, progress: &Progress) -> Result<Certificate, Cancelled> {
    let m = mesh.triangle_count();
    let mut out = Certificate { complete: true, ..Certificate::default() };
    let mut labels: Vec<i32> = (0..m).map(|f| mesh.label(f)).filter(|&l| l >= 0).collect();
    labels.sort_unstable();
    labels.dedup();
    out.charts = labels.len();
    let mut faulty = vec![false; labels.len()];
    // The tile of each chart.
    let mut home: Vec<Option<Tile>> = vec![None; labels.len()];

    let stacking = Stacking::of(mesh, &labels);
    out.stacked = stacking.stacked();
    // The triangles with a chart and finite UVs, those of charts that lie on others apart.
    let (mut below, mut above) = (Triangles::default(), Triangles::default());
    for f in 0..m {
        let Some(mut uv) = mesh.corner_uv(f) else {
            out.unmapped.add(f as u32);
            continue;
        };
        let c = labels.partition_point(|&l| l < mesh.label(f));
        if home[c].is_none() && uv.iter().flatten().all(|x| x.is_finite()) {
            // The lower left corner of its box: a triangle may touch the upper and the right border of its tile.
            let low = [0, 1].map(|k| uv.iter().map(|p| f64::from(p[k])).fold(f64::INFINITY, f64::min));
            home[c] = Some(Tile::near(low, mesh.texture().tiles));
        }
        let tile = home[c].unwrap_or(Tile::near([0.0; 2], 1));
        if !uv.iter().all(|p| tile.holds(p.map(f64::from), 0.0)) {
            out.out_of_range.add(f as u32);
            faulty[c] = true;
        }
        let finite = uv.iter().flatten().all(|x| x.is_finite());
        if finite && stacking.is_mirrored(c) {
            uv.swap(1, 2);
        }
        if !finite || orientation(uv[0], uv[1], uv[2]) <= 0 {
            out.flipped.add(f as u32);
            faulty[c] = true;
        }
        if finite {
            let to = if stacking.lies_on(c).is_some() { &mut above } else { &mut below };
            to.push(uv, f as u32, c as u32);
        }
    }
    progress.check()?;

    let boundary = below.boundary(labels.len());
    progress.check()?;
    if !above.is_empty() {
        for c in stacking.apart(&boundary, &above.boundary(labels.len())) {
            out.apart.add(labels[c]);
            faulty[c] = true;
        }
    }
    for &(a, b, c) in &boundary.pinches {
        out.crossings_inside.add((a.min(b), a.max(b)));
        faulty[c as usize] = true;
    }
    for (c, &positive) in boundary.positive_loops.iter().enumerate() {
        if positive != 1 && stacking.lies_on(c).is_none() {
            out.bad_loops.add(labels[c]);
            faulty[c] = true;
        }
    }
    let contacts = crossings::contacts(&boundary.edges, progress)?;
    out.crossings_inside.merge(contacts.inside);
    out.crossings_between.merge(contacts.between);
    out.complete &= contacts.complete;
    for c in contacts.charts {
        faulty[c as usize] = true;
    }
    // Too many contacts to count: nobody asks what lies inside what.
    if contacts.complete {
        let nests = nesting::nested(&boundary, progress)?;
        out.nested = nests.nested;
        out.complete &= nests.complete;
        for c in nests.charts {
            faulty[c as usize] = true;
        }
    }
    out.faulty_charts = labels.iter().zip(&faulty).filter(|(_, f)| **f).map(|(&l, _)| l).collect();

    let texels = mesh.texture().texels();
    let segments: Vec<OwnedSegment> = boundary
        .edges
        .iter()
        .map(|e| OwnedSegment { ends: e.ends.map(|p| [0, 1].map(|k| f64::from(p[k]) * texels[k])), owner: e.chart })
        .collect();
    out.margin_texels = mesh.texture().margin;
    let limit = GAP_SEARCH_TEXELS.max(2.0 * out.margin_texels);
    let (gap, complete) = least_gap(&segments, limit, progress)?;
    out.gap_texels = gap;
    out.complete &= complete;
    debug_assert!(boundary.edges.iter().all(|e| e.chart != NONE));
    Ok(out)
}

/// A UV, finite.
type Point = [f32; 2];

/// Sign of the area of triangle abc: 1 counter-clockwise, 0 collinear, −1 clockwise. Exact.
pub(crate) fn orientation(a: Point, b: Point, c: Point) -> i8 {
    let area = predicates::orientation(a.map(f64::from), b.map(f64::from), c.map(f64::from));
    i8::from(area > 0.0) - i8::from(area < 0.0)
}

#[cfg(test)]
mod tests;
