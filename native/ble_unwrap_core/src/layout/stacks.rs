//! Charts that lie on each other in the texture.
//!
//! Which charts are copies of each other is known from how they came about ([`Originals`]), also where they have been
//! cut across or made anew since. One chart of each stack is packed and rounded, and the others take its UVs, vertex by
//! vertex. A chart that would be turned over somewhere by them, because its polygons are divided into other triangles,
//! or too stretched, gets a place of its own.

use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Point2;
use rayon::prelude::*;

use crate::charts::Chart;
use crate::cutting::{Described, Originals};
use crate::distortion::RestTriangle;
use crate::mesh::{FaceId, VertexId};
use crate::progress::{Cancelled, Progress};
use crate::settings::{Settings, Stack};
use crate::stretch;

/// What lies on another chart may be stretched by so much more than where it lay: copies are alike to a thousandth.
const MOST_RISE: f64 = 1e-2;
/// Of charts with the same description, those that do not lie on the first are tried on so many others: the
/// description hardly ever leaves any.
const MOST_BASES: usize = 4;

/// How a chart lies on another.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Lying {
    /// The number of the other chart, which lies on none.
    pub(super) on: usize,
    /// Whether it is its mirror image, so that its triangles are turned over in the texture.
    pub(super) is_mirrored: bool,
    /// The vertex of the other that each vertex lies on.
    pub(super) vertex: Vec<VertexId>,
}

/// Which charts lie on which.
pub(super) struct Stacks {
    /// For each chart how it lies on another; `None` where it is packed itself.
    pub(super) lying: Vec<Option<Lying>>,
}

impl Stacks {
    /// Of the charts of an atlas. Those of `alone`, named by their lowest faces, lie on no other. O(n log n).
    ///
    /// # Errors
    /// [`Cancelled`] if `progress` says so.
    pub(super) fn of(
        charts: &[Chart],
        originals: &Originals,
        alone: &BTreeSet<FaceId>,
        settings: &Settings,
        progress: &Progress,
    ) -> Result<Self, Cancelled> {
        let mut lying = vec![None; charts.len()];
        if settings.stack == Stack::Off {
            return Ok(Self { lying });
        }
        let may_lie = |chart: &Chart| lowest_face(chart).is_some_and(|face| !alone.contains(&face));
        let described = |(number, chart): (usize, &Chart)| {
            let described = if may_lie(chart) { originals.described(chart) } else { None };
            described.map(|described| (number, described))
        };
        let mut known: Vec<(usize, Described)> = charts.par_iter().enumerate().filter_map(described).collect();
        let way = |described: &Described| settings.stack == Stack::Equal && described.is_mirrored;
        known.sort_by(|(m, a), (n, b)| a.shape().cmp(b.shape()).then(way(a).cmp(&way(b))).then(m.cmp(n)));
        let is_same = |(_, a): &(usize, Described), (_, b): &(usize, Described)| {
            way(a) == way(b) && a.sides.len() == b.sides.len() && a.shape().eq(b.shape())
        };
        let groups: Vec<&[(usize, Described)]> = known.chunk_by(is_same).filter(|group| group.len() > 1).collect();
        let found: Vec<Result<Vec<(usize, Lying)>, Cancelled>> =
            groups.into_par_iter().map(|group| stacked(charts, group, settings, progress)).collect();
        for group in found {
            for (number, found) in group? {
                lying[number] = Some(found);
            }
        }
        Ok(Self { lying })
    }

    /// The stack that each chart belongs to, numbered from 0 in the order of their first charts; −1 for charts that lie
    /// alone.
    pub(super) fn numbers(&self) -> Vec<i32> {
        let mut base: Vec<Option<usize>> = self.lying.iter().map(|lying| Some(lying.as_ref()?.on)).collect();
        for lying in self.lying.iter().flatten() {
            base[lying.on] = Some(lying.on);
        }
        let mut known = BTreeMap::new();
        let number = |base: Option<usize>| {
            let next = i32::try_from(known.len()).unwrap_or(i32::MAX);
            base.map_or(-1, |base| *known.entry(base).or_insert(next))
        };
        base.into_iter().map(number).collect()
    }
}

/// The name of a chart that stays the same when others are made anew.
pub(super) fn lowest_face(chart: &Chart) -> Option<FaceId> {
    chart.patch.faces.iter().min().copied()
}

/// Which charts of the same description, in ascending order, lie on others of them.
fn stacked(
    charts: &[Chart],
    group: &[(usize, Described)],
    settings: &Settings,
    progress: &Progress,
) -> Result<Vec<(usize, Lying)>, Cancelled> {
    let mut found = Vec::new();
    let mut open: Vec<&(usize, Described)> = group.iter().collect();
    // As few as can be are mirrored: the texture that is painted on the others is seen as it is on most of them.
    let mirrored = open.iter().filter(|(_, described)| described.is_mirrored).count();
    let usual = match (2 * mirrored).cmp(&open.len()) {
        Ordering::Equal => open.first().is_some_and(|(_, described)| described.is_mirrored),
        order => order == Ordering::Greater,
    };
    open.sort_by_key(|(_, described)| described.is_mirrored != usual);
    for _ in 0..MOST_BASES {
        let Some((base, rest)) = open.split_first() else { break };
        progress.check()?;
        let mut others = Vec::new();
        for &own in rest {
            match lying(charts, base, own, settings) {
                Some(lying) => found.push((own.0, lying)),
                None => others.push(own),
            }
        }
        open = others;
    }
    Ok(found)
}

/// How one chart lies on another of the same description, if it may.
fn lying(
    charts: &[Chart],
    (on, base): &(usize, Described),
    (number, own): &(usize, Described),
    settings: &Settings,
) -> Option<Lying> {
    let (below, chart) = (&charts[*on], &charts[*number]);
    let is_mirrored = base.is_mirrored != own.is_mirrored;
    let mesh = &chart.patch.mesh;
    let mut vertex = vec![VertexId::NONE; mesh.vertex_count()];
    for ((_, there), (_, here)) in base.sides.iter().zip(&own.sides) {
        let mut ends = [below.patch.mesh.from(*there), below.patch.mesh.to(*there)];
        if is_mirrored {
            // A side runs the other way in a mirror.
            ends.reverse();
        }
        for (v, end) in [mesh.from(*here), mesh.to(*here)].into_iter().zip(ends) {
            let place = &mut vertex[v.index()];
            if !place.is_none() && *place != end {
                return None;
            }
            *place = end;
        }
    }
    if vertex.iter().any(|v| v.is_none()) {
        return None;
    }
    let seen = |v: &VertexId| {
        let p = below.uv[v.index()];
        if is_mirrored { Point2::new(-p.x, p.y) } else { p }
    };
    let uv: Vec<Point2<f64>> = vertex.iter().map(seen).collect();
    // What is over the limit by itself is no worse here than elsewhere.
    let limit = settings.chart_limit();
    let limit = if chart.l2 > limit { chart.l2 + MOST_RISE } else { limit };
    let fits = stretch::first_flip(mesh, &uv).is_none()
        && stretch::l2_stretch(mesh, &RestTriangle::of_mesh(mesh), &uv) <= limit;
    fits.then_some(Lying { on: *on, is_mirrored, vertex })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn on(on: usize) -> Option<Lying> {
        Some(Lying { on, is_mirrored: false, vertex: Vec::new() })
    }

    #[test]
    fn stacks_are_numbered_by_their_first_charts() {
        let stacks = Stacks { lying: vec![on(4), None, on(1), None, None, on(1), None] };
        assert_eq!(stacks.numbers(), [0, 1, 1, -1, 0, 1, -1]);
        assert_eq!(Stacks { lying: vec![None, None] }.numbers(), [-1, -1]);
    }
}
