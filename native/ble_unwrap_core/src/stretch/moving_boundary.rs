//! Which edges of a moving boundary a moving vertex may touch.
//!
//! A long step carries whole stretches of a boundary along: where a vertex and an edge are and where they go tells little, and
//! how they move against each other tells all. So the edges are put in a tree of boxes around places and velocities, in the order in
//! which the boundary runs, and a vertex is compared with a box as seen from itself.

use nalgebra::{Point2, Vector2};

/// Edges in a leaf of the tree.
const LEAF: usize = 4;
/// Boxes that may be looked at, for each vertex of the boundary. A boundary that moves together stays far below; one that is
/// thrown about would otherwise take the square of its length.
const MOST_VISITS: usize = 1024;
/// Share of a length that rounding may take of the places compared, far above what it does.
const ROUNDING: f64 = 1e-14;

/// The least and greatest of places and velocities.
#[derive(Clone, Copy)]
struct Moving {
    place: [Point2<f64>; 2],
    velocity: [Vector2<f64>; 2],
}

impl Moving {
    /// Around nothing.
    const NONE: Self = Self {
        place: [Point2::new(f64::INFINITY, f64::INFINITY), Point2::new(f64::NEG_INFINITY, f64::NEG_INFINITY)],
        velocity: [Vector2::new(f64::INFINITY, f64::INFINITY), Vector2::new(f64::NEG_INFINITY, f64::NEG_INFINITY)],
    };

    fn with(&self, other: &Self) -> Self {
        Self {
            place: [self.place[0].inf(&other.place[0]), self.place[1].sup(&other.place[1])],
            velocity: [self.velocity[0].inf(&other.velocity[0]), self.velocity[1].sup(&other.velocity[1])],
        }
    }

    fn is_finite(&self) -> bool {
        self.place
            .iter()
            .flat_map(|p| p.iter())
            .chain(self.velocity.iter().flat_map(|v| v.iter()))
            .all(|x| x.is_finite())
    }

    /// Whether the box comes to lie around a moving point before a time; with room around it, in lengths of the box.
    #[inline]
    fn meets(&self, (p, v): (Point2<f64>, Vector2<f64>), until: f64, room: f64, rounding: f64) -> bool {
        let mut length = 0.0;
        for k in 0..2 {
            length += self.place[1][k] - self.place[0][k] + until * (self.velocity[1][k] - self.velocity[0][k]);
        }
        let room = room * length + rounding;
        (0..2).all(|k| {
            let (low, high) = (self.place[0][k] - p[k], self.place[1][k] - p[k]);
            let lowest = low + until * (self.velocity[0][k] - v[k]).min(0.0);
            let highest = high + until * (self.velocity[1][k] - v[k]).max(0.0);
            lowest <= room && highest >= -room
        })
    }
}

/// The edges of a boundary and how they move, in a tree: node 1 is the root, the children of node i are 2i and 2i + 1.
pub(super) struct MovingBoundary<'a> {
    order: &'a [u32],
    nodes: Vec<Moving>,
    /// The number of leaves, a power of two.
    leaves: usize,
    rounding: f64,
}

impl<'a> MovingBoundary<'a> {
    /// `order` names the edges in the order in which the boundary runs; `ends(i)` are the places and velocities of an edge's two
    /// ends. `until` is the longest time that will be asked for. `None` where a number is not finite. O(n).
    pub(super) fn new(
        order: &'a [u32],
        ends: impl Fn(usize) -> [(Point2<f64>, Vector2<f64>); 2],
        until: f64,
    ) -> Option<Self> {
        let leaves = order.len().div_ceil(LEAF).next_power_of_two();
        let mut nodes = vec![Moving::NONE; 2 * leaves];
        for (leaf, edges) in order.chunks(LEAF).enumerate() {
            for (p, v) in edges.iter().flat_map(|&e| ends(e as usize)) {
                let node = &mut nodes[leaves + leaf];
                *node = node.with(&Moving { place: [p, p], velocity: [v, v] });
            }
        }
        for node in (1..leaves).rev() {
            nodes[node] = nodes[2 * node].with(&nodes[2 * node + 1]);
        }
        let all = nodes[1];
        let largest = |p: &[f64]| p.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let extent = all.place.iter().map(|p| largest(p.coords.as_slice())).fold(0.0, f64::max)
            + until * all.velocity.iter().map(|v| largest(v.as_slice())).fold(0.0, f64::max);
        (order.is_empty() || all.is_finite() && extent.is_finite()).then_some(Self {
            order,
            nodes,
            leaves,
            rounding: ROUNDING * extent,
        })
    }

    /// A bound on how many boxes may be looked at for all vertices together.
    pub(super) fn most_visits(&self) -> usize {
        MOST_VISITS * self.order.len()
    }

    /// Calls `found` for the edges that a moving point may touch before a time, which `found` takes and gives back, lower where it
    /// has got to know better. `room` is how far beyond the ends of an edge still counts, in lengths of it. `visits` counts the boxes looked
    /// at.
    pub(super) fn near(
        &self,
        point: (Point2<f64>, Vector2<f64>),
        until: f64,
        room: f64,
        visits: &mut usize,
        mut found: impl FnMut(usize, f64) -> f64,
    ) -> f64 {
        let mut until = until;
        // One node of each level waits at most.
        let mut open = [0; usize::BITS as usize + 1];
        open[0] = 1;
        let mut waiting = 1;
        while waiting > 0 {
            waiting -= 1;
            let node = open[waiting];
            *visits += 1;
            if !self.nodes[node].meets(point, until, room, self.rounding) {
                continue;
            }
            if node < self.leaves {
                open[waiting..waiting + 2].copy_from_slice(&[2 * node + 1, 2 * node]);
                waiting += 2;
            } else {
                let first = (node - self.leaves) * LEAF;
                for &edge in &self.order[first.min(self.order.len())..(first + LEAF).min(self.order.len())] {
                    until = found(edge as usize, until);
                }
            }
        }
        until
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    type Motion = (Point2<f64>, Vector2<f64>);

    /// Whether a moving point comes to an edge before a time, by looking often.
    fn comes_near([a, b]: [Motion; 2], p: Motion, until: f64) -> bool {
        let at = |m: Motion, t: f64| m.0 + m.1 * t;
        (0..=200).map(|k| until * f64::from(k) / 200.0).any(|t| {
            let (a, b, p) = (at(a, t), at(b, t), at(p, t));
            let along = b - a;
            let s = ((p - a).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
            (p - (a + along * s)).norm() < 1e-9
        })
    }

    /// The edges of a closed polygon, each from its vertex to the next.
    fn edges(vertices: &[Motion]) -> impl Fn(usize) -> [Motion; 2] + '_ {
        |i| [vertices[i], vertices[(i + 1) % vertices.len()]]
    }

    proptest! {
        #[test]
        fn no_edge_that_is_met_is_missed(
            numbers in prop::collection::vec(prop::array::uniform4(-1.0..1.0_f64), 3..40),
            edge in 0..40_usize,
            t in 0.0..1.0_f64,
            s in 0.0..1.0_f64,
            own in prop::array::uniform2(-1.0..1.0_f64),
        ) {
            let vertices: Vec<Motion> =
                numbers.iter().map(|&[x, y, u, v]| (Point2::new(x, y), Vector2::new(u, v))).collect();
            let order: Vec<u32> = (0..vertices.len() as u32).collect();
            let ends = edges(&vertices);
            let edge = edge % vertices.len();
            // A point that is on an edge at the time t.
            let [a, b] = ends(edge).map(|(p, v)| p + v * t);
            let velocity = Vector2::from(own);
            let point = (a + (b - a) * s - velocity * t, velocity);
            let boundary = MovingBoundary::new(&order, &ends, 1.0).expect("finite");
            let (mut found, mut visits) = (Vec::new(), 0);
            boundary.near(point, 1.0, 1e-6, &mut visits, |e, until| { found.push(e); until });
            prop_assert!(found.contains(&edge));
            let missed = (0..vertices.len()).filter(|e| !found.contains(e)).any(|e| comes_near(ends(e), point, 1.0));
            prop_assert!(!missed);
        }
    }

    #[test]
    fn a_boundary_that_grows_as_a_whole_costs_in_proportion_to_it() {
        let visits = |n: usize| {
            let at = |k: usize| {
                let (y, x) = (std::f64::consts::TAU * k as f64 / n as f64).sin_cos();
                (Point2::new(x, y), Vector2::new(x, y))
            };
            let vertices: Vec<Motion> = (0..n).map(at).collect();
            let order: Vec<u32> = (0..n as u32).collect();
            let boundary = MovingBoundary::new(&order, edges(&vertices), 0.5).expect("finite");
            let mut visits = 0;
            for &p in &vertices {
                boundary.near(p, 0.5, 1e-6, &mut visits, |_, until| until);
            }
            assert!(visits < boundary.most_visits());
            visits
        };
        let (few, many) = (visits(4_000), visits(16_000));
        assert!(many < 5 * few, "{few} boxes become {many} for four times as many edges");
    }

    #[test]
    fn what_is_not_finite_is_refused_and_nothing_is_found_in_nothing() {
        let ends = |_| [(Point2::origin(), Vector2::new(f64::NAN, 0.0)); 2];
        assert!(MovingBoundary::new(&[0, 1, 2], ends, 1.0).is_none());
        let none = MovingBoundary::new(&[], ends, 1.0).expect("empty");
        let mut visits = 0;
        none.near((Point2::origin(), Vector2::zeros()), 1.0, 1e-6, &mut visits, |_, _| unreachable!("no edge"));
    }
}
