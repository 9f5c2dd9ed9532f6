//! A mirrored surface: one half is charted, the other gets the mirror images of its charts, and charts that meet their own image in
//! the mirror plane are joined there.
//!
//! So every seam has a mirror image that is a seam, and the work is done once. What is joined in the plane stays symmetric: of
//! its cuts only those in the plane itself are closed.

use nalgebra::Point2;

use crate::cache::Run;
use crate::charts::{Chart, Patch};
use crate::flattening::{self, Polished, Rungs};
use crate::mesh::{self, FaceId, HalfedgeId, Mirror, TriMesh};
use crate::progress::Cancelled;
use crate::settings::{LimitOver, Moves, Settings, Symmetry};

use super::charted::Charted;
use super::component;
use super::cost::Price;
use super::history::{History, MoveKind};
use super::moves::join::{Join, Which};
use super::moves::partial_join::PartialJoin;
use super::moves::zip::Zip;
use super::moves::{Move, Proposal, Site};
use super::search::search;
use super::state::{ChartId, Cutting};

/// The mirror plane of a patch, if it is to be charted by halves.
pub(super) fn mirror(patch: &Patch, settings: &Settings, run: &Run<'_>) -> Result<Option<Mirror>, Cancelled> {
    // A limit over the atlas joins charts across the plane as it likes.
    if settings.symmetry == Symmetry::Off || settings.moves < Moves::All || settings.limit_over == LimitOver::Atlas {
        return Ok(None);
    }
    mesh::mirror(&patch.mesh, &patch.polygon, run.progress)
}

/// The charts of a mirrored patch; `None` where the images of charts are none, since polygons there are divided into other triangles.
pub(super) fn charts(
    whole: &Patch,
    mirror: &Mirror,
    settings: &Settings,
    charted: &Charted<'_>,
    rungs: &mut Rungs,
    run: &Run<'_>,
) -> Result<Option<Vec<Chart>>, Cancelled> {
    let (mesh, polygon) = (&whole.mesh, &whole.polygon);
    let faces = mirror.first_half();
    let half = Patch::of_surface(mesh, polygon, faces.clone());
    let half = Patch::whole(half.mesh, half.polygon);
    // Seams and stretch weigh against each other as on the whole, of which a root of the area is longer.
    let of_half = Settings { stretch_price: settings.stretch_price * 0.5_f64.sqrt(), ..settings.clone() };
    let (mut charts, steps) = component::charts(&half, &faces, &of_half, charted, run)?;
    rungs.add(&steps);
    let first = Cutting::new(mesh, polygon, charts.clone());
    for chart in &charts.clone() {
        let Some(image) = image(&first, chart, whole, mirror, settings) else { return Ok(None) };
        charts.push(image);
    }
    let mut cutting = Cutting::new(mesh, polygon, charts);
    let zip = Zip { limit: settings.stretch_limit };
    let moves = [&Join { which: Which::EVERY } as &dyn Move, &PartialJoin::MostSeen, &zip];
    let moves = moves.map(|inner| InPlane { inner, mirror });
    let moves: Vec<&dyn Move> = moves.iter().map(|made| made as &dyn Move).collect();
    search(&mut cutting, &mut History::default(), &moves, settings, rungs, run)?;
    Ok(Some(cutting.into_charts()))
}

/// The mirror image of a chart.
fn image(cutting: &Cutting<'_>, chart: &Chart, whole: &Patch, mirror: &Mirror, settings: &Settings) -> Option<Chart> {
    let (mesh, polygon) = (&whole.mesh, &whole.polygon);
    let is_diagonal = |h| whole.is_diagonal(h);
    // Polygons are whole and beside each other: the faces of one follow from one of its sides.
    let mut faces: Vec<FaceId> = Vec::with_capacity(chart.patch.faces.len());
    for h in chart.patch.faces.iter().flat_map(|f| f.halfedges()).filter(|&h| !is_diagonal(h)) {
        let face = mirror.image(h).face();
        faces.push(face);
    }
    let mut of_polygons: Vec<u32> = faces.iter().map(|f| polygon[f.index()]).collect();
    of_polygons.sort_unstable();
    of_polygons.dedup();
    let faces = of_polygons.iter().flat_map(|&p| faces_of(polygon, p)).collect();
    let is_cut = |h: HalfedgeId| !is_diagonal(h) && cutting.is_seam(mirror.image(h));
    let patch = Patch::cut_out(mesh, polygon, faces, is_cut);
    let mut uv = vec![Point2::origin(); patch.mesh.vertex_count()];
    for (f, corners) in patch.faces.iter().zip(patch.mesh.triangles()) {
        for (h, v) in f.halfedges().into_iter().zip(corners) {
            let p = cutting.end(mirror.image(side_from(mesh, h, &is_diagonal)?));
            uv[v.index()] = Point2::new(-p.x, p.y);
        }
    }
    match flattening::lying(&patch, uv, settings) {
        Polished::Flat(flat) => Some(flat.into_chart(patch)),
        Polished::Refused | Polished::BadStart => None,
    }
}

/// The faces of a polygon.
fn faces_of(polygon: &[u32], p: u32) -> impl Iterator<Item = FaceId> + use<> {
    let first = polygon.partition_point(|&q| q < p);
    let last = polygon.partition_point(|&q| q <= p);
    (first..last).map(FaceId::new)
}

/// The side of the polygon of a half-edge that begins at the same corner.
fn side_from(mesh: &TriMesh, h: HalfedgeId, is_diagonal: &impl Fn(HalfedgeId) -> bool) -> Option<HalfedgeId> {
    let turn = |&h: &HalfedgeId| is_diagonal(h).then(|| mesh.twin(h).next());
    std::iter::successors(Some(h), turn).take(mesh.face_count()).find(|&h| !is_diagonal(h))
}

/// A move, made only where what comes of it is its own mirror image: between a chart and its image, or along the plane.
struct InPlane<'a> {
    inner: &'a dyn Move,
    mirror: &'a Mirror,
}

impl InPlane<'_> {
    /// The chart that has the image of another's first polygon.
    fn image(&self, cutting: &Cutting<'_>, id: ChartId) -> Option<ChartId> {
        let first = cutting.chart(id)?.patch.faces.first()?;
        let side = first.halfedges().into_iter().find(|&h| !self.mirror.image(h).is_none())?;
        cutting.owner(self.mirror.image(side).face())
    }

    fn is_symmetric(&self, cutting: &Cutting<'_>, proposal: &Proposal) -> bool {
        proposal.edit.glued().iter().all(|&h| self.mirror.is_between(cutting.mesh(), h))
    }
}

impl Move for InPlane<'_> {
    fn kind(&self) -> MoveKind {
        self.inner.kind()
    }

    fn sites(&self, cutting: &Cutting<'_>, history: &History, price: &Price) -> Vec<Site> {
        let mut sites = self.inner.sites(cutting, history, price);
        sites.retain_mut(|site| {
            let is_pair = match site.charts[..] {
                [a, b] => self.image(cutting, a) == Some(b),
                _ => true,
            };
            // Where the ways are known already, one that is not symmetric must not be tried for ever.
            let had_ways = !site.ways.is_empty();
            site.ways.retain(|way| self.is_symmetric(cutting, way));
            is_pair && site.ways.is_empty() != had_ways
        });
        sites
    }

    fn ways(&self, cutting: &Cutting<'_>, site: &Site, run: &Run<'_>) -> Result<Vec<Proposal>, Cancelled> {
        let mut ways = self.inner.ways(cutting, site, run)?;
        ways.retain(|way| self.is_symmetric(cutting, way));
        Ok(ways)
    }
}
