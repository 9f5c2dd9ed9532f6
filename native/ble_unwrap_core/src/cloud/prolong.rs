//! From the cells of a piece to its points: quadratic maps of the cells, blended.
//!
//! Near each cell the map is expanded to second order in the cell's tangent plane, by least squares over the cells
//! around; a point takes the mean of the expansions of the cells around it, with weights that fade with distance (a
//! partition of unity: Ohtake, Belyaev, Alexa, Turk, Seidel: Multi-level partition of unity implicits, SIGGRAPH 2003).
//! Affine maps come out exact.

use nalgebra::{Matrix2, Point2, Point3, SMatrix, SVector, Vector2, Vector3};
use rayon::prelude::*;

use crate::geodesics::WeightedGraph;
use crate::progress::{Cancelled, Progress};

use super::cells::Cells;
use super::sample::tangents;

/// Reach of the blending weights over the root of a cell's area: some ten cells.
const REACH: f64 = 1.9;
/// The same for the cells that an expansion is fitted to: some twenty.
const FIT_REACH: f64 = 2.6;
/// Ridge of the fit over the second moments, for the linear part towards a rotation: across a line of cells, or with
/// a single one, the map is a rotation.
const RIDGE: f64 = 1e-7;
/// Ridge for the quadratic part, towards zero, over the fourth moments.
const BEND_RIDGE: f64 = 1e-3;

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

/// Place and normal of a point.
type Placed = (Point2<f64>, Vector3<f64>);

impl FlatCells<'_> {
    /// Place and normal of each point of the piece, in the chart of its cell. O(n) times some twenty cells.
    pub(super) fn prolong(&self, position: &[Point3<f64>], progress: &Progress) -> Result<Vec<Placed>, Cancelled> {
        let rings = self.rings();
        let expansions: Vec<Expansion> =
            (0..rings.len()).into_par_iter().with_min_len(64).map(|c| self.expand(c, &rings[c])).collect();
        progress.check()?;
        position
            .par_iter()
            .zip(&self.cells.of_point)
            .with_min_len(256)
            .map(|(p, &cell)| {
                progress.check()?;
                Ok(self.place(p, cell as usize, &rings[cell as usize], &expansions))
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

    /// The expansion of the map at a cell, fitted to the cells of its ring.
    fn expand(&self, cell: usize, ring: &[u32]) -> Expansion {
        let sample = &self.cells.sample;
        let frame = tangents(&self.normal[cell]);
        let unit = FIT_REACH * sample.area[cell].sqrt();
        // Coordinates in units of the reach: moments of order one.
        let mut moment = SMatrix::<f64, 5, 5>::zeros();
        let mut mixed = SMatrix::<f64, 5, 2>::zeros();
        let (mut dot, mut cross, mut sum) = (0.0, 0.0, 0.0);
        for &c in ring.iter().filter(|&&c| c as usize != cell) {
            let d = sample.position[c as usize] - sample.position[cell];
            let w = (1.0 - d.norm_squared() / (unit * unit)).max(1e-3).powi(2);
            let x = Vector2::new(frame[0].dot(&d), frame[1].dot(&d)) / unit;
            let image = self.uv[c as usize] - self.uv[cell];
            let basis = basis(&x);
            moment += basis * basis.transpose() * w;
            mixed += basis * image.transpose() * w;
            dot += w * x.dot(&image);
            cross += w * x.perp(&image);
            sum += w;
        }
        let turn = Vector2::new(dot, cross).try_normalize(f64::MIN_POSITIVE).unwrap_or_else(Vector2::x);
        let rotation = Matrix2::new(turn.x, -turn.y, turn.y, turn.x) * unit;
        for k in 0..5 {
            let ridge = if k < 2 { RIDGE } else { BEND_RIDGE } * sum.max(RIDGE);
            moment[(k, k)] += ridge;
            if k < 2 {
                for c in 0..2 {
                    mixed[(k, c)] += ridge * rotation[(c, k)];
                }
            }
        }
        let map = moment.cholesky().map_or_else(
            || {
                let mut map = SMatrix::<f64, 5, 2>::zeros();
                map.fixed_view_mut::<2, 2>(0, 0).copy_from(&rotation.transpose());
                map
            },
            |factor| factor.solve(&mixed),
        );
        Expansion { frame, unit, map }
    }

    fn place(&self, p: &Point3<f64>, cell: usize, ring: &[u32], expansions: &[Expansion]) -> Placed {
        let sample = &self.cells.sample;
        let reach = REACH * sample.area[cell].sqrt();
        let (mut normal, mut place, mut sum) = (Vector3::zeros(), Vector2::zeros(), 0.0);
        for &c in ring {
            let d = p - sample.position[c as usize];
            let faded = (1.0 - d.norm_squared() / (reach * reach)).max(0.0).powi(2);
            // The cell's own mean may be out of reach where cells are long; its weight must not vanish.
            let w = if c as usize == cell { faded.max(1e-3) } else { faded };
            if w > 0.0 {
                normal += self.normal[c as usize] * w;
                place += (self.uv[c as usize].coords + expansions[c as usize].at(&d)) * w;
                sum += w;
            }
        }
        (Point2::from(place / sum), normal.try_normalize(1e-9).unwrap_or(self.normal[cell]))
    }
}

/// The map near a cell, relative to the cell's place.
struct Expansion {
    frame: [Vector3<f64>; 2],
    unit: f64,
    map: SMatrix<f64, 5, 2>,
}

impl Expansion {
    fn at(&self, d: &Vector3<f64>) -> Vector2<f64> {
        let x = Vector2::new(self.frame[0].dot(d), self.frame[1].dot(d)) / self.unit;
        self.map.tr_mul(&basis(&x))
    }
}

fn basis(x: &Vector2<f64>) -> SVector<f64, 5> {
    SVector::<f64, 5>::new(x.x, x.y, x.x * x.x, x.x * x.y, x.y * x.y)
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
