//! A chart as a rigid body: its outline with as few vertices as a tolerance allows, in pieces that are quickly told to
//! be far apart.

use nalgebra::{Point2, Vector2};

use super::outline::{Edge, Outline};
use super::pose::convex_hull;

/// Sides in a piece: with fewer, more pieces are compared, with more, more sides.
const SIDES: usize = 8;

/// Some sides that follow each other, and a disc around them.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    /// Points by number. Each point is in one piece.
    pub(super) points: Vec<u32>,
    /// Sides as pairs of points. The end of a chain that is not closed is a side without length.
    pub(super) sides: Vec<[u32; 2]>,
    /// By how much the winding number is greater to the left of the sides than to the right.
    pub(super) winding: i32,
    pub(super) centre: Vector2<f64>,
    pub(super) radius: f64,
}

/// A chart as a rigid body.
#[derive(Clone, Debug)]
pub(super) struct Body {
    /// Vertices relative to the middle of the chart, in units of the chart plane.
    pub(super) points: Vec<Vector2<f64>>,
    pub(super) pieces: Vec<Piece>,
    /// A point of each chain of sides.
    pub(super) starts: Vec<u32>,
    /// The vertices of the convex hull.
    pub(super) hull: Vec<u32>,
    /// Largest distance of a vertex from the middle.
    pub(super) radius: f64,
}

impl Body {
    /// The outline with vertices left out that are within `tolerance` units of the chart plane of what is left. O(n log n) but for
    /// outlines of unusual shapes.
    pub(super) fn new(outline: &Outline, tolerance: f64) -> Self {
        let unit = outline.unit();
        let mut points = Vec::new();
        let mut number = vec![u32::MAX; outline.points.len()];
        let mut pieces: Vec<Piece> = Vec::new();
        let mut starts = Vec::new();
        for (chain, winding) in chains(outline) {
            let kept = simplified(&outline.points, &chain, tolerance / unit);
            let mut own: Vec<u32> = Vec::with_capacity(kept.len());
            let mut is_new = Vec::with_capacity(kept.len());
            for v in kept {
                let known = &mut number[v as usize];
                is_new.push(*known == u32::MAX);
                if *known == u32::MAX {
                    *known = points.len() as u32;
                    points.push(outline.points[v as usize].coords * unit);
                }
                own.push(*known);
            }
            starts.push(own[0]);
            let is_open = own.first() != own.last();
            for first in (0..own.len().max(2) - 1).step_by(SIDES) {
                let last = (first + SIDES).min(own.len() - 1);
                let mut sides: Vec<[u32; 2]> = own[first..=last].windows(2).map(|w| [w[0], w[1]]).collect();
                if sides.is_empty() || (is_open && last + 1 == own.len()) {
                    sides.push([own[last]; 2]);
                }
                let new = (first..=last).filter(|&k| is_new[k] && (k < last || last + 1 == own.len()));
                let at = |k: usize| points[own[k] as usize];
                let (low, high) =
                    (first..=last).fold((at(first), at(first)), |(low, high), k| (low.inf(&at(k)), high.sup(&at(k))));
                let centre = 0.5 * (low + high);
                let radius = (first..=last).map(|k| (at(k) - centre).norm()).fold(0.0, f64::max);
                pieces.push(Piece { points: new.map(|k| own[k]).collect(), sides, winding, centre, radius });
            }
        }
        let at: Vec<Point2<f64>> = points.iter().map(|&p| Point2::from(p)).collect();
        let corners = convex_hull(&at);
        let hull = (0..at.len() as u32).filter(|&k| corners.contains(&at[k as usize])).collect();
        let radius = points.iter().map(|p| p.norm()).fold(0.0, f64::max);
        Self { points, pieces, starts, hull, radius }
    }
}

/// The edges of an outline as chains of vertices, closed ones with the first vertex again at the end. Chains end where
/// other than two edges meet. With each its winding: that of its first edge, since where two edges meet, what comes in goes out.
fn chains(outline: &Outline) -> Vec<(Vec<u32>, i32)> {
    let n = outline.points.len();
    let mut around: Vec<Vec<(u32, u32)>> = vec![Vec::new(); n];
    for (number, edge) in outline.edges.iter().enumerate() {
        around[edge.from as usize].push((number as u32, edge.to));
        if edge.to != edge.from {
            around[edge.to as usize].push((number as u32, edge.from));
        }
    }
    let mut is_used = vec![false; outline.edges.len()];
    let mut found = Vec::new();
    let ends = (0..n).filter(|&v| around[v].len() != 2);
    for start in ends.chain((0..n).filter(|&v| around[v].len() == 2)) {
        for &(edge, to) in &around[start] {
            if is_used[edge as usize] {
                continue;
            }
            is_used[edge as usize] = true;
            let mut chain = vec![start as u32, to];
            let Edge { from, winding, .. } = outline.edges[edge as usize];
            let winding = if from as usize == start { winding } else { -winding };
            loop {
                let at = chain[chain.len() - 1] as usize;
                if at == start || around[at].len() != 2 {
                    break;
                }
                let Some(&(edge, to)) = around[at].iter().find(|(edge, _)| !is_used[*edge as usize]) else { break };
                is_used[edge as usize] = true;
                chain.push(to);
            }
            found.push((chain, winding));
        }
    }
    found
}

/// Vertices of a chain such that all others are within `tolerance` of the sides between them. Douglas, Peucker:
/// Algorithms for the reduction of the number of points required to represent a digitized line or its caricature,
/// Cartographica 10(2), 1973.
fn simplified(points: &[Point2<f64>], chain: &[u32], tolerance: f64) -> Vec<u32> {
    let at = |k: usize| points[chain[k] as usize];
    let last = chain.len() - 1;
    let mut is_kept = vec![false; chain.len()];
    (is_kept[0], is_kept[last]) = (true, true);
    let mut todo = vec![(0, last)];
    while let Some((from, to)) = todo.pop() {
        let (a, side) = (at(from), at(to) - at(from));
        let off = |k: usize| {
            let arm = at(k) - a;
            let share = arm.dot(&side) / side.norm_squared();
            // A closed chain starts without a side.
            (arm - side * if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 }).norm_squared()
        };
        let farthest = (from + 1..to).map(|k| (off(k), k)).reduce(|a, b| if b.0 > a.0 { b } else { a });
        if let Some((off, k)) = farthest
            && off > tolerance * tolerance
        {
            is_kept[k] = true;
            todo.extend([(from, k), (k, to)]);
        }
    }
    chain.iter().zip(&is_kept).filter(|(_, kept)| **kept).map(|(v, _)| *v).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::packing::PackItem;
    use proptest::prelude::*;

    fn outline(points: &[[f64; 2]], triangles: &[[u32; 3]]) -> Outline {
        let points: Vec<Point2<f64>> = points.iter().map(|&p| Point2::from(p)).collect();
        Outline::new(&PackItem { points: &points, triangles }, 0).expect("valid")
    }

    fn sides(body: &Body) -> Vec<[Vector2<f64>; 2]> {
        let ends = |side: &[u32; 2]| side.map(|v| body.points[v as usize]);
        body.pieces.iter().flat_map(|piece| piece.sides.iter().map(ends)).collect()
    }

    /// A fan around the first point.
    fn fan(corners: u32) -> Vec<[u32; 3]> {
        (1..corners - 1).map(|k| [0, k, k + 1]).collect()
    }

    #[test]
    fn straight_sides_have_no_vertices_between_their_ends() {
        let square = [[2.0, 0.0], [4.0, 0.0], [4.0, 4.0], [2.0, 4.0], [0.0, 4.0], [0.0, 0.0]];
        let body = Body::new(&outline(&square, &fan(6)), 1e-9);
        // The first vertex of the chain is kept wherever it lies.
        assert!((4..=5).contains(&body.points.len()), "{} vertices", body.points.len());
        assert_eq!(body.hull.len(), 4);
        assert!((body.radius - 8.0f64.sqrt()).abs() < 1e-12);
        assert_eq!(body.starts.len(), 1);
    }

    #[test]
    fn a_hole_and_a_wire_are_chains_of_their_own() {
        // A square ring, and a triangle without area beside it.
        let mut points: Vec<[f64; 2]> = [3.0, 1.0].iter().flat_map(|&r| [[-r, -r], [r, -r], [r, r], [-r, r]]).collect();
        points.extend([[4.0, 0.0], [5.0, 0.0], [6.0, 0.0]]);
        let mut triangles: Vec<[u32; 3]> =
            (0..4).flat_map(|k| [[k, (k + 1) % 4, 4 + k], [(k + 1) % 4, 4 + (k + 1) % 4, 4 + k]]).collect();
        triangles.push([8, 9, 10]);
        let body = Body::new(&outline(&points, &triangles), 0.0);
        assert_eq!(body.starts.len(), 3);
        let windings: Vec<i32> = body.pieces.iter().map(|piece| piece.winding.abs()).collect();
        assert_eq!(windings.iter().filter(|w| **w == 0).count(), 1, "the wire: {windings:?}");
    }

    proptest! {
        #[test]
        fn what_is_left_out_is_near_what_is_left(
            radii in prop::collection::vec(0.5f64..2.0, 3..60), tolerance in 0.0f64..0.5,
        ) {
            let n = radii.len();
            let corner = |(k, r): (usize, &f64)| {
                let (s, c) = (k as f64 / n as f64 * std::f64::consts::TAU).sin_cos();
                [r * c, r * s]
            };
            let mut points = vec![[0.0, 0.0]];
            points.extend(radii.iter().enumerate().map(corner));
            let triangles: Vec<[u32; 3]> = (0..n as u32).map(|k| [0, k + 1, (k + 1) % n as u32 + 1]).collect();
            let outline = outline(&points, &triangles);
            let body = Body::new(&outline, tolerance);
            let sides = sides(&body);
            for p in &outline.points {
                let p = p.coords * outline.unit();
                let off = |[a, b]: &[Vector2<f64>; 2]| {
                    let share = ((p - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
                    if share.is_nan() { (p - a).norm() } else { (p - (a + (b - a) * share)).norm() }
                };
                prop_assert!(sides.iter().map(off).fold(f64::MAX, f64::min) <= tolerance + 1e-12);
            }
            // Every point is in one piece, every disc around its piece.
            let mut count = vec![0; body.points.len()];
            for piece in &body.pieces {
                piece.points.iter().for_each(|&v| count[v as usize] += 1);
                for v in piece.sides.iter().flatten() {
                    prop_assert!((body.points[*v as usize] - piece.centre).norm() <= piece.radius + 1e-12);
                }
            }
            prop_assert!(count.iter().all(|c| *c == 1));
            if tolerance == 0.0 {
                prop_assert_eq!(body.points.len(), outline.points.len());
            }
        }
    }
}
