//! From the cells of a piece to its points: moving least squares.
//!
//! Levin: The approximation power of moving least-squares, Mathematics of Computation 67, 1998. Each point gets its own
//! affine map, fitted to the positions of the cells around it in the tangent plane with weights that fade with
//! distance; where the map of the cells is affine the result is exact, and it is as smooth as the weights.

use nalgebra::{Matrix2, Point2, Point3, Vector2, Vector3};
use rayon::prelude::*;

use crate::geodesics::WeightedGraph;
use crate::progress::{Cancelled, Progress};

use super::cells::Cells;
use super::sample::tangents;

/// Reach of the weights over the root of a cell's area: some ten cells.
const REACH: f64 = 1.9;
/// Ridge of the fit, towards a rotation, over the second moments: across a line of cells, or with a single one, the
/// map is a rotation.
const RIDGE: f64 = 1e-6;

/// The cells of a piece with a chart and a place each.
pub(super) struct FlatCells<'a> {
    pub(super) cells: &'a Cells,
    /// Chart of each cell.
    pub(super) chart: Vec<u32>,
    /// Place of each cell in its chart.
    pub(super) uv: Vec<Point2<f64>>,
    /// Normals, one side within a chart.
    pub(super) normal: Vec<Vector3<f64>>,
}

impl FlatCells<'_> {
    /// Place and normal of each point of the piece, in the chart of its cell. O(n) times some twenty cells.
    pub(super) fn prolong(
        &self,
        position: &[Point3<f64>],
        progress: &Progress,
    ) -> Result<Vec<(Point2<f64>, Vector3<f64>)>, Cancelled> {
        let rings = self.rings();
        position
            .par_iter()
            .zip(&self.cells.of_point)
            .with_min_len(256)
            .map(|(p, &cell)| {
                progress.check()?;
                Ok(self.place(p, cell as usize, &rings[cell as usize]))
            })
            .collect()
    }

    /// For each cell itself and the cells of its chart up to two edges away.
    fn rings(&self) -> Vec<Vec<u32>> {
        let graph: &WeightedGraph = &self.cells.sample.graph;
        let same = |a: usize, b: usize| self.chart[a] == self.chart[b];
        (0..self.chart.len())
            .into_par_iter()
            .map(|c| {
                let mut ring = vec![c as u32];
                for (a, _) in graph.neighbours(c).filter(|&(a, _)| same(a, c)) {
                    ring.push(a as u32);
                    ring.extend(graph.neighbours(a).map(|(b, _)| b as u32).filter(|&b| same(b as usize, c)));
                }
                ring.sort_unstable();
                ring.dedup();
                ring
            })
            .collect()
    }

    fn place(&self, p: &Point3<f64>, cell: usize, ring: &[u32]) -> (Point2<f64>, Vector3<f64>) {
        let sample = &self.cells.sample;
        let reach = REACH * sample.area[cell].sqrt();
        let weight = |c: u32| {
            let t = (p - sample.position[c as usize]).norm_squared() / (reach * reach);
            // The cell's own mean may be out of reach where cells are long; its weight must not vanish.
            let faded = (1.0 - t).max(0.0).powi(2);
            if c as usize == cell { faded.max(1e-3) } else { faded }
        };
        let mut normal = Vector3::zeros();
        let (mut sum, mut mean, mut image) = (0.0, Vector3::zeros(), Vector2::zeros());
        for &c in ring {
            let w = weight(c);
            normal += self.normal[c as usize] * w;
            mean += sample.position[c as usize].coords * w;
            image += self.uv[c as usize].coords * w;
            sum += w;
        }
        let (mean, image) = (mean / sum, image / sum);
        let normal = normal.try_normalize(1e-9).unwrap_or(self.normal[cell]);
        let [a, b] = tangents(&normal);
        let flat = |d: Vector3<f64>| Vector2::new(a.dot(&d), b.dot(&d));
        let (mut moment, mut mixed) = (Matrix2::zeros(), Matrix2::zeros());
        for &c in ring {
            let w = weight(c);
            if w > 0.0 {
                let x = flat(sample.position[c as usize].coords - mean);
                moment += x * x.transpose() * w;
                mixed += (self.uv[c as usize].coords - image) * x.transpose() * w;
            }
        }
        let turn = Vector2::new(mixed.m11 + mixed.m22, mixed.m21 - mixed.m12);
        let turn = turn.try_normalize(f64::MIN_POSITIVE).unwrap_or_else(Vector2::x);
        let rotation = Matrix2::new(turn.x, -turn.y, turn.y, turn.x);
        let ridge = RIDGE * moment.trace().max(RIDGE * reach * reach);
        moment += Matrix2::identity() * ridge;
        let map = moment.try_inverse().map_or(rotation, |inverse| (mixed + rotation * ridge) * inverse);
        (Point2::from(image + map * flat(p.coords - mean)), normal)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::local_map::{Offset, Offsets, measure, tests::sheet};
    use crate::cloud::orientation::orient;
    use crate::cloud::sample::Sample;

    fn cells_of(sample: &Sample, wanted: usize) -> Cells {
        Cells::new(&sample.position, &sample.area, &sample.graph, wanted, &Progress::new()).expect("not cancelled")
    }

    #[test]
    fn affine_maps_are_prolonged_exactly() {
        let (sample, plane) = sheet(60, |x, y| Point3::new(x, y, 0.0));
        let cells = cells_of(&sample, 200);
        let map = Matrix2::new(1.2, 0.3, -0.1, 0.9);
        let uv = cells.sample.position.iter().map(|p| Point2::from(map * p.xy().coords)).collect();
        let normal = vec![Vector3::z(); cells.sample.len()];
        let flat = FlatCells { cells: &cells, chart: vec![0; cells.sample.len()], uv, normal };
        let placed = flat.prolong(&sample.position, &Progress::new()).expect("not cancelled");
        for ((uv, normal), p) in placed.iter().zip(&plane) {
            assert!((uv - map * p).norm() < 1e-5, "{uv} {p}");
            assert!((normal - Vector3::z()).norm() < 1e-9);
        }
    }

    #[test]
    fn a_bent_sheet_keeps_its_lengths() {
        let (sample, _) = sheet(80, |x, y| Point3::new(x.sin(), x.cos(), y));
        let cells = cells_of(&sample, 600);
        let uv = cells.sample.position.iter().map(|p| Point2::new(p.x.atan2(p.y), p.z)).collect();
        let mut normal = cells.sample.normal.clone();
        orient(&cells.sample.graph, &mut normal);
        let flat = FlatCells { cells: &cells, chart: vec![0; cells.sample.len()], uv, normal };
        let placed = flat.prolong(&sample.position, &Progress::new()).expect("not cancelled");
        let (uv, normal): (Vec<_>, Vec<_>) = placed.into_iter().unzip();
        let stretch = measure(&Offsets::with_normals(&sample, &normal, Offset::Projected), &sample.area, &uv);
        assert!(stretch.l2 < 1.002 && stretch.folded.is_empty(), "{stretch:?}");
    }

    #[test]
    fn a_single_cell_is_projected() {
        let (sample, plane) = sheet(6, |x, y| Point3::new(x, y, 0.0));
        let cells = cells_of(&sample, 1);
        assert!(cells.sample.len() <= 2);
        let count = cells.sample.len();
        let uv = cells.sample.position.iter().map(|p| p.xy()).collect();
        let flat =
            FlatCells { cells: &cells, chart: (0..count as u32).collect(), uv, normal: vec![Vector3::z(); count] };
        let placed = flat.prolong(&sample.position, &Progress::new()).expect("not cancelled");
        for i in 1..36 {
            if cells.of_point[i] == cells.of_point[0] {
                let (there, here) = ((placed[i].0 - placed[0].0).norm(), (plane[i] - plane[0]).norm());
                assert!((there - here).abs() < 1e-9);
            }
        }
    }
}
