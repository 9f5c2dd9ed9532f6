//! Components that are like others, which get copies of their charts: hundreds of bolts take the time of one, and are unwrapped alike.

use std::cmp::Reverse;
use std::collections::HashMap;

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::cache::Run;
use crate::charts::{Chart, Patch};
use crate::flattening::{Rung, Rungs};
use crate::mesh::{self, FaceId, Groups, Likeness, Plane, Shape, VertexId};
use crate::progress::{Cancelled, Progress};
use crate::settings::{LimitOver, Moves, Settings, Stack, Symmetry};

use super::copied::copied;
use super::state::Cutting;

/// Charting components of fewer faces takes no longer than comparing them. They are compared only where like ones are
/// to be stacked, as leaves are.
const LEAST_FACES: usize = 8;
/// A component is compared with so many others at most that look the same by their numbers.
const MOST_COMPARED: usize = 8;
/// With so many where like ones are to be stacked: each that is missed takes a place of its own.
const MOST_COMPARED_FOR_STACKS: usize = 64;
/// So many of the largest components are looked at for a mirror plane of the object.
const MOST_PLANES: usize = 5;

/// What is mirrored in the plane of the object may be out of place by this share of its own extent.
const MISPLACED: f64 = 0.1;

/// A component that is like another one.
pub(super) struct Alike {
    /// The other: one that is charted itself, or a copy, of which this one is the mirror image.
    pub(super) original: usize,
    /// Of the original to this one.
    pub(super) likeness: Likeness,
}

/// A component as a patch of itself, and where its vertices are beside those of others.
pub(super) struct Placed {
    pub(super) patch: Patch,
    pub(super) positions: Vec<Point3<f64>>,
}

/// For each component the one before it that it is like, if any. Where the object has a mirror plane, that of one of its largest
/// components, the mirror image in it comes first, so that left and right are mirrored, too. O(n log n).
///
/// # Errors
/// [`Cancelled`] if `progress` says so.
pub(super) fn alike(
    components: &Groups<FaceId>,
    placed: &(impl Fn(usize) -> Placed + Sync),
    settings: &Settings,
    progress: &Progress,
) -> Result<Vec<Option<Alike>>, Cancelled> {
    let mut likes: Vec<Option<Alike>> = (0..components.len()).map(|_| None).collect();
    // Under a limit over the atlas charts of different components share it, and the paper knows of no copies.
    if settings.moves < Moves::All || settings.limit_over == LimitOver::Atlas {
        return Ok(likes);
    }
    let mut by_size: HashMap<usize, Vec<usize>> = HashMap::new();
    let least = if settings.stack == Stack::Off { LEAST_FACES } else { 1 };
    for component in (0..components.len()).filter(|&c| components.group(c).len() >= least) {
        by_size.entry(components.group(component).len()).or_default().push(component);
    }
    let groups: Vec<Vec<usize>> = by_size.into_values().filter(|group| group.len() > 1).collect();
    if groups.is_empty() {
        return Ok(likes);
    }
    let plane = if settings.symmetry == Symmetry::Auto { plane(components, placed, progress)? } else { None };
    let found: Vec<Result<Vec<(usize, Alike)>, Cancelled>> =
        groups.par_iter().map(|group| alike_among(group, placed, plane.as_ref(), settings.stack, progress)).collect();
    for group in found {
        for (component, like) in group? {
            likes[component] = Some(like);
        }
    }
    Ok(likes)
}

/// The mirror plane of the largest component that has one, of a few.
fn plane(
    components: &Groups<FaceId>,
    placed: &impl Fn(usize) -> Placed,
    progress: &Progress,
) -> Result<Option<Plane>, Cancelled> {
    let mut largest: Vec<usize> = (0..components.len()).collect();
    largest.sort_by_key(|&component| Reverse(components.group(component).len()));
    for &component in largest.iter().take(MOST_PLANES) {
        let Placed { patch, positions } = placed(component);
        let mirror = mesh::mirror(&patch.mesh, &patch.polygon, progress)?;
        if let Some(plane) = mirror.and_then(|mirror| mirror.plane(&patch.mesh, &positions)) {
            return Ok(Some(plane));
        }
    }
    Ok(None)
}

/// Those that are alike among components of the same number of faces, ascending.
fn alike_among(
    group: &[usize],
    placed: &impl Fn(usize) -> Placed,
    plane: Option<&Plane>,
    stack: Stack,
    progress: &Progress,
) -> Result<Vec<(usize, Alike)>, Cancelled> {
    let most_compared = if stack == Stack::Off { MOST_COMPARED } else { MOST_COMPARED_FOR_STACKS };
    let mut originals: Vec<(usize, Placed)> = Vec::new();
    let mut middles: Vec<(usize, Point3<f64>)> = Vec::new();
    let mut likes = Vec::new();
    for &component in group {
        let own = placed(component);
        // Only what is not mirrored lies on others of which equal ones alone are to.
        let mut found = if stack == Stack::Equal { first_like(&originals, &own, &[false], progress)? } else { None };
        if let Some(plane) = plane {
            let middle = own.middle();
            let image = plane.mirrored(middle);
            let most = MISPLACED * own.extent();
            let partner = middles.iter().find(|other| (other.1 - image).norm() <= most);
            if let Some(&(original, _)) = partner.filter(|_| found.is_none()) {
                let likeness = likeness_in(plane, &placed(original), &own, progress)?;
                found = likeness.map(|likeness| Alike { original, likeness });
            }
            middles.push((component, middle));
        }
        if found.is_none() {
            // What looks the same either way comes to lie on others with the texture as it is there.
            let orientations: &[bool] = match stack {
                Stack::Off => &[true, false],
                Stack::Equal => &[true],
                Stack::Mirrored => &[false, true],
            };
            found = first_like(&originals, &own, orientations, progress)?;
        }
        match found {
            Some(like) => likes.push((component, like)),
            None if originals.len() < most_compared => originals.push((component, own)),
            None => (),
        }
    }
    Ok(likes)
}

/// The likeness of a component to another that is its mirror image in a plane, where both are.
fn likeness_in(
    plane: &Plane,
    here: &Placed,
    there: &Placed,
    progress: &Progress,
) -> Result<Option<Likeness>, Cancelled> {
    let most = MISPLACED * here.extent();
    let is_image = |v: VertexId, w: VertexId| {
        (plane.mirrored(here.positions[v.index()]) - there.positions[w.index()]).norm() <= most
    };
    match (here.shape(), there.shape()) {
        (Some(a), Some(b)) => a.likeness(&b, true, is_image, progress),
        _ => Ok(None),
    }
}

/// The first of some components that another one is like, wherever both are, with the first of the given orientations
/// (whether it is mirrored) that there is.
fn first_like(
    originals: &[(usize, Placed)],
    own: &Placed,
    orientations: &[bool],
    progress: &Progress,
) -> Result<Option<Alike>, Cancelled> {
    for (original, other) in originals {
        let (Some(a), Some(b)) = (other.shape(), own.shape()) else { continue };
        for &is_mirrored in orientations {
            if let Some(likeness) = a.likeness(&b, is_mirrored, |_, _| true, progress)? {
                return Ok(Some(Alike { original: *original, likeness }));
            }
        }
    }
    Ok(None)
}

impl Placed {
    fn shape(&self) -> Option<Shape<'_>> {
        Shape::new(&self.patch.mesh, &self.patch.polygon).map(Shape::telling_seams)
    }

    /// The mean of its vertices.
    fn middle(&self) -> Point3<f64> {
        let sum = self.positions.iter().fold(Vector3::zeros(), |sum, p| sum + p.coords);
        Point3::from(sum / self.positions.len().max(1) as f64)
    }

    /// The distance of its farthest vertex from there.
    fn extent(&self) -> f64 {
        let middle = self.middle();
        self.positions.iter().map(|p| (p - middle).norm()).fold(0.0, f64::max)
    }
}

impl Alike {
    /// Copies of the original's charts. Each component comes as a patch of itself with the names of its faces on the surface, ascending, by
    /// which those of the charts go. `None` where a chart does not lie on this component as well.
    pub(super) fn charts(
        &self,
        original: (&Patch, &[FaceId]),
        charts: &[Chart],
        own: (&Patch, &[FaceId]),
        settings: &Settings,
        run: &Run<'_>,
    ) -> Result<Option<(Vec<Chart>, Rungs)>, Cancelled> {
        let mut charts = charts.to_vec();
        for f in charts.iter_mut().flat_map(|chart| &mut chart.patch.faces) {
            let Ok(local) = original.1.binary_search(f) else { return Ok(None) };
            *f = FaceId::new(local);
        }
        let cutting = Cutting::new(&original.0.mesh, &original.0.polygon, charts);
        let mut rungs = Rungs::default();
        let mut copies = Vec::new();
        for chart in cutting.ids().filter_map(|id| cutting.chart(id)) {
            let copy = copied(&cutting, chart, own.0, &self.likeness, settings, &mut rungs, run)?;
            let Some(copy) = copy else { return Ok(None) };
            copies.push(copy);
        }
        for f in copies.iter_mut().flat_map(|chart| &mut chart.patch.faces) {
            *f = own.1[f.index()];
        }
        copies.sort_by_key(|chart| chart.patch.faces[0]);
        rungs.take(Rung::Copied);
        Ok(Some((copies, rungs)))
    }
}
