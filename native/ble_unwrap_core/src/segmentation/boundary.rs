//! Borders between parts as minimum cuts in a band.
//!
//! Iso-charts, section 4.3 (after Katz and Tal 2003): of all curves in a band around the border that
//! growth found, take the one that is short, follows creases, and lies where both sides' embeddings
//! fit equally badly.

use crate::geodesics::LandmarkDistances;
use crate::linalg::{EigenError, Mds, classical_mds};
use crate::mesh::TriMesh;
use crate::progress::{Cancelled, Progress};

use super::bends::{Bends, capacity};
use super::polygon_graph::PolygonGraph;
use super::{CutCost, CutGraph};

/// How borders are moved.
#[derive(Clone, Copy)]
pub(super) struct Cut {
    /// See [`SegmentationSettings::band`](super::SegmentationSettings::band).
    pub(super) band: f64,
    /// The α of the capacity.
    pub(super) crease_share: f64,
    /// See [`SegmentationSettings::crease_weight`](super::SegmentationSettings::crease_weight).
    pub(super) crease_weight: f64,
    pub(super) cost: CutCost,
}

/// Moves the borders between parts, within the band and over polygons that reach across the middle. The capacity is made of the crease 1/(1 + d/mean)ʷ and the misfit
/// (gᵢ + gⱼ)/(2·mean), with w the crease weight, d = 1 − cos(dihedral) and g the difference between the errors of a polygon's distances in
/// the two parts' own embeddings.
pub(super) fn improve(
    mesh: &TriMesh,
    graph: &PolygonGraph,
    distances: &LandmarkDistances,
    representatives: &[usize],
    settings: Cut,
    label: &mut [u32],
    progress: &Progress,
) -> Result<(), Cancelled> {
    let bends = Bends::new(mesh, graph, settings.crease_weight);
    let parts: Vec<Part<'_>> = (0..representatives.len())
        .map(|r| Part::new(mesh, graph, distances, representatives, r, settings.crease_share < 1.0))
        .collect::<Result<_, _>>()?;
    for a in 0..parts.len() {
        for b in a + 1..parts.len() {
            progress.check()?;
            let pair = Pair { mesh, graph, distances, bends: &bends, number: [a, b], parts: [&parts[a], &parts[b]] };
            pair.improve(settings, label, progress)?;
        }
    }
    Ok(())
}

/// One part as its representative sees it.
struct Part<'a> {
    /// Distance of each vertex to the representative.
    row: &'a [f32],
    /// Mean distance of each polygon to it.
    reach: Vec<f64>,
    /// Landmarks nearer to this representative than to any other.
    landmarks: Vec<usize>,
    /// Their classical scaling, if it is wanted and can be had.
    embedding: Option<Mds>,
}

impl<'a> Part<'a> {
    fn new(
        mesh: &TriMesh,
        graph: &PolygonGraph,
        distances: &'a LandmarkDistances,
        representatives: &[usize],
        number: usize,
        embed: bool,
    ) -> Result<Self, Cancelled> {
        let row = distances.row(representatives[number]);
        let reach = (0..graph.len()).map(|p| graph.mean_at(mesh, p, |v| f64::from(row[v]))).collect();
        let nearest = |l: usize| {
            let to = |r: usize| distances.get(representatives[r], distances.landmarks()[l]);
            (0..representatives.len()).min_by(|&a, &b| to(a).total_cmp(&to(b)).then(a.cmp(&b)))
        };
        let landmarks: Vec<usize> = (0..distances.len()).filter(|&l| nearest(l) == Some(number)).collect();
        let embedding = if embed {
            let all = distances.between_landmarks();
            let pairs = landmarks.iter().flat_map(|&i| landmarks.iter().map(move |&j| (i, j)));
            let squared: Vec<f64> = pairs.map(|(i, j)| all[i * distances.len() + j].powi(2)).collect();
            match classical_mds(&squared, landmarks.len(), 2) {
                Ok(scaling) => Some(scaling),
                Err(EigenError::Cancelled(c)) => return Err(c),
                Err(_) => None,
            }
        } else {
            None
        };
        Ok(Self { row, reach, landmarks, embedding })
    }

    /// Mean squared error of the distances of a polygon to the landmarks of this part, in its
    /// embedding; 0 without one.
    fn error(&self, pair: &Pair<'_>, polygon: usize) -> f64 {
        let Some(mds) = &self.embedding else { return 0.0 };
        let distance = |l: &usize| {
            let row = pair.distances.row(*l);
            pair.graph.mean_at(pair.mesh, polygon, |v| f64::from(row[v]))
        };
        let d: Vec<f64> = self.landmarks.iter().map(distance).collect();
        let squared: Vec<f64> = d.iter().map(|d| d * d).collect();
        let mut at = [0.0; 2];
        mds.place(&squared, &mut at);
        let error = |(i, d): (usize, &f64)| {
            let to: f64 = mds.point(i).iter().zip(at).map(|(a, b)| (a - b) * (a - b)).sum();
            (to.sqrt() - d).powi(2)
        };
        d.iter().enumerate().map(error).sum::<f64>() / d.len().max(1) as f64
    }
}

/// Where something lies between two representatives at these distances: −1 at the first, 0 on the bisector, 1 at the second.
fn balance(to_first: f64, to_second: f64) -> f64 {
    let sum = to_first + to_second;
    if sum > 0.0 && sum.is_finite() { (to_first - to_second) / sum } else { 0.0 }
}

/// Two parts and the border between them.
struct Pair<'a> {
    mesh: &'a TriMesh,
    graph: &'a PolygonGraph,
    distances: &'a LandmarkDistances,
    bends: &'a Bends,
    number: [usize; 2],
    parts: [&'a Part<'a>; 2],
}

impl Pair<'_> {
    /// Whether a polygon reaches over the bisector about as far to either side, by its vertices. Of triangles as long as the
    /// patch the means lie near one end or the other, and a border between those would run along all their diagonals.
    fn reaches_across(&self, polygon: usize, band: f64) -> bool {
        let [to_a, to_b] = self.parts.map(|part| part.row);
        let vertices = self.graph.faces.group(polygon).iter().flat_map(|&f| self.mesh.triangle(f));
        let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
        for v in vertices {
            let balance = balance(f64::from(to_a[v.index()]), f64::from(to_b[v.index()]));
            (least, most) = (least.min(balance), most.max(balance));
        }
        least < 0.0 && most > 0.0 && (least + most).abs() < 2.0 * band
    }

    fn improve(&self, settings: Cut, label: &mut [u32], progress: &Progress) -> Result<(), Cancelled> {
        let Cut { band, crease_share, cost, .. } = settings;
        let [a, b] = self.number.map(|n| u32::try_from(n).unwrap_or(0));
        let mean_balance = |p: usize| balance(self.parts[0].reach[p], self.parts[1].reach[p]);
        let in_band = |p: usize| mean_balance(p).abs() < band || self.reaches_across(p, band);
        let movable = |p: usize| (label[p] == a || label[p] == b) && in_band(p);
        let nodes: Vec<usize> = (0..self.graph.len()).filter(|&p| movable(p)).collect();
        let beyond = |p: usize| if label[p] == a { b } else { a };
        let touches = |p: usize| self.graph.links.group(p).iter().any(|l| label[l.to as usize] == beyond(p));
        if !nodes.iter().any(|&p| touches(p)) {
            return Ok(());
        }
        let mut node = vec![usize::MAX; self.graph.len()];
        for (i, &p) in nodes.iter().enumerate() {
            node[p] = i;
        }
        let misfit: Vec<f64> = if crease_share < 1.0 {
            nodes.iter().map(|&p| (self.parts[0].error(self, p) - self.parts[1].error(self, p)).abs()).collect()
        } else {
            vec![0.0; nodes.len()]
        };
        let mean_misfit = (misfit.iter().sum::<f64>() / nodes.len() as f64).max(f64::MIN_POSITIVE);
        let mut cut = CutGraph::new(nodes.len());
        for (i, &p) in nodes.iter().enumerate() {
            for (k, link) in self.graph.links.group(p).iter().enumerate() {
                let q = link.to as usize;
                let other = if node[q] == usize::MAX { misfit[i] } else { misfit[node[q]] };
                let fit = (misfit[i] + other) / (2.0 * mean_misfit);
                let (crease, misfit) = (self.bends.crease(p, k), (1.0 - crease_share) * fit);
                let relative = match cost {
                    CutCost::Sum => crease_share * crease + misfit,
                    CutCost::Product => crease * (crease_share + misfit),
                };
                let capacity = capacity(relative * link.length / self.bends.mean_length);
                if node[q] != usize::MAX {
                    if p < q {
                        cut.add_edge(i, node[q], capacity);
                    }
                } else if label[q] == a {
                    cut.add_terminals(i, capacity, 0);
                } else if label[q] == b {
                    cut.add_terminals(i, 0, capacity);
                }
            }
        }
        for (&p, on_side_of_a) in nodes.iter().zip(cut.min_cut(progress)?) {
            label[p] = if on_side_of_a { a } else { b };
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geodesics::{Metric, geodesic_distances};
    use crate::mesh::{VertexId, test_surfaces};
    use crate::segmentation::SegmentationSettings;

    /// A tube of one row of triangles as long as itself, and a short row at either end: the border goes round between rows.
    #[test]
    fn a_border_does_not_run_along_triangles_that_reach_from_end_to_end() {
        let tube = test_surfaces::cylinder(12, 3, 3.0);
        let heights = [0.0, 1.0, 19.0, 20.0];
        let place = |p: &nalgebra::Point3<f64>| nalgebra::Point3::new(p.x, p.y, heights[p.z.round() as usize]);
        let positions: Vec<_> = tube.positions().iter().map(place).collect();
        let triangles: Vec<[u32; 3]> = tube.triangles().iter().map(|t| t.map(|v| v.index() as u32)).collect();
        let mesh = test_surfaces::mesh(&positions, &triangles);
        let polygon: Vec<u32> = (0..mesh.face_count() as u32).collect();
        let graph = PolygonGraph::new(&mesh, &polygon);
        let at = |z: f64| mesh.vertices().find(|&v| mesh.position(v).z == z).expect("a vertex");
        let ends: [VertexId; 2] = [at(0.0), at(20.0)];
        let distances =
            geodesic_distances(&mesh, &ends, Metric::FastMarching, &Progress::new()).expect("not cancelled");
        let mut label = super::super::grow::nearest(&mesh, &graph, &distances, &[0, 1]);
        let usual = SegmentationSettings::default();
        let cut = Cut { band: usual.band, crease_share: 1.0, crease_weight: 1.0, cost: usual.cost };
        improve(&mesh, &graph, &distances, &[0, 1], cut, &mut label, &Progress::new()).expect("not cancelled");
        let face = |f: crate::mesh::FaceId| label[graph.of_face[f.index()] as usize];
        let border = mesh.edges().filter(|&h| !mesh.is_boundary(h) && face(h.face()) != face(mesh.twin(h).face()));
        let lengths: Vec<f64> = border.map(|h| mesh.edge_length(h)).collect();
        assert!(lengths.len() == 12 && lengths.iter().all(|&l| l < 1.0), "{lengths:?}: the sides of one ring");
    }
}
