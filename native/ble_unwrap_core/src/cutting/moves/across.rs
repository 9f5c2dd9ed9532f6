//! Charts too long for the texture, cut across.
//!
//! A ring or a coil unrolls to a ribbon, a frame to a spider: one chart, hardly stretched, and a texture large enough to hold
//! it is all but empty. A few cuts across, each as short as the chart is narrow there, let the texture be filled. The parts are as long as each other where
//! that is to be had: the longest of them says how large all may be drawn, and like parts lie well beside each other.

use std::f64::consts::PI;

use nalgebra::{Point2, Vector2};

use crate::cache::Run;
use crate::charts::{Chart, Patch};
use crate::flattening::{Rung, Rungs};
use crate::mesh::{FaceId, HalfedgeId, TriMesh, VertexId};
use crate::progress::Cancelled;
use crate::segmentation;
use crate::settings::Settings;

use super::super::cost;
use super::super::edit::Edit;
use super::super::state::{ChartId, Cutting};
use super::super::trial::{Verdict, trial};
use super::{Proposal, Start};

/// The cut runs in so much of the length of a part on either side of where it makes parts of equal length; within the first, if it is hardly longer there.
const AROUND: [f64; 2] = [0.06, 0.2];
/// Where no polygon ends there, it runs beside the middle.
const BESIDE: [[f64; 2]; 4] = [[0.3, 0.5], [0.5, 0.7], [0.2, 0.4], [0.6, 0.8]];
/// A cut in just the right place may be longer by this share than one in the wider surroundings.
const LONGER: f64 = 0.05;
/// A part as it was planned fills the texture to this share of the plan at least, since a cut runs where polygons end. One that does less has another form, and
/// is looked at anew.
const AS_PLANNED: f64 = 0.6;
/// A cut is no longer than so many times the mean width of the chart, its area over its length: a straight one across a strip is
/// as long as that, and one along the sides of a triangulation up to about 1.4 times. What is longer runs along the chart, as
/// the diagonals of triangles do that are as long as the chart itself.
const MOST_CUT: f64 = 1.5;
/// Turns tried, of a half one.
const DIRECTIONS: usize = 24;
/// Cuts in two, one after the other, that a part comes out of at most.
const MOST_CUTS: usize = 6;
/// A chart is cut into no more parts at once.
const MOST_PARTS: usize = 1 << MOST_CUTS;

/// The charts of a surface, with those cut across that are too long for the texture of `settings`. All parts stay under the limit,
/// and lie where they lay in their chart but for what that takes. Sorted by lowest face. O(n log n).
pub(crate) fn cut_across(
    mesh: &TriMesh,
    polygon: &[u32],
    charts: Vec<Chart>,
    settings: &Settings,
    rungs: &mut Rungs,
    run: &Run<'_>,
) -> Result<Vec<Chart>, Cancelled> {
    let area: f64 = charts.iter().map(|c| c.patch.area()).sum();
    let texture = [settings.packing.width, settings.packing.height].map(f64::from);
    let tiles = settings.packing.tiles.max(1) as f64;
    let most_filled = |chart: &Chart| area / (tiles * texture[0] * texture[1] * hold(&chart.uv, texture).powi(2));
    let mut cutting = Cutting::new(mesh, polygon, charts);
    let is_too_long = |chart: &Chart| cost::fill_asks_for_a_cut(most_filled(chart), self_border(chart));
    let too_long = |id: &ChartId| cutting.chart(*id).is_some_and(is_too_long);
    let filled_by = |hold: f64| area / (tiles * texture[0] * texture[1] * hold * hold);
    let mut open: Vec<Open> = cutting.ids().filter(too_long).map(|id| Open { id, cuts: 0, parts: None }).collect();
    while let Some(Open { id, cuts, parts }) = open.pop() {
        run.progress.check()?;
        let Some(chart) = cutting.chart(id).filter(|_| cuts < MOST_CUTS) else { continue };
        let filled = most_filled(chart);
        let parts = match parts {
            // As planned, but for where polygons end.
            Some(1) if !cost::fill_asks_for_another_cut(filled / AS_PLANNED) => continue,
            Some(parts) if parts > 1 => parts,
            _ if !cost::fill_asks_for_another_cut(filled) => continue,
            _ => parts_wanted(&chart.uv, texture, filled_by),
        };
        let before = hold(&chart.uv, texture);
        // A body that fills a texture fairly is not worth a cut that leaves its parts unequal.
        let is_empty = cost::fill_asks_for_a_cut(filled, 0.0);
        let share = (parts / 2) as f64 / parts as f64;
        let beside = if is_empty { &BESIDE[..] } else { &[] };
        let places = std::iter::once(None).chain(beside.iter().copied().map(Some));
        for place in places {
            let Some(chart) = cutting.chart(id) else { break };
            let proposal = match place {
                None => at_share(&cutting, chart, share, 1.0 / parts as f64, settings, run)?,
                Some(place) => proposal(&cutting, chart, place, settings, run)?.map(|cut| cut.0),
            };
            let Some(proposal) = proposal else { continue };
            if let Verdict::Charts(made) = trial(&cutting, &proposal, settings, rungs, run)?
                && cost::fills_better(before, made.iter().map(|part| hold(&part.uv, texture)))
            {
                rungs.take(Rung::Split);
                let planned = place.is_none() && made.len() == 2;
                // Of two parts the shorter one is that of fewer.
                let is_shorter = |at: usize| made[at].patch.area() < made[1 - at].patch.area();
                let of_part = |at: usize| if is_shorter(at) { parts / 2 } else { parts - parts / 2 };
                let counts: Vec<Option<usize>> = (0..made.len()).map(|at| planned.then(|| of_part(at))).collect();
                let made = cutting.replace(&[id], made).into_iter().zip(counts);
                open.extend(made.map(|(id, parts)| Open { id, cuts: cuts + 1, parts }));
            }
        }
    }
    Ok(cutting.into_charts())
}

/// A chart that may be cut.
struct Open {
    id: ChartId,
    /// Cuts that it came out of.
    cuts: usize,
    /// Into how many parts of equal length it is to be cut, if that is known.
    parts: Option<usize>,
}

/// Into how many parts of equal length a chart is cut, at least two, so that a texture which holds them can be filled well. `filled_by` says how well one can be that is so many
/// times as large.
fn parts_wanted(uv: &[Point2<f64>], texture: [f64; 2], filled_by: impl Fn(f64) -> f64) -> usize {
    let along = axis(uv);
    let (low, high) = range(uv, along);
    let middle = 0.5 * (low + high);
    let fills = |parts: &usize| {
        let reach = 0.5 * (high - low) / *parts as f64;
        let part: Vec<Point2<f64>> =
            uv.iter().filter(|p| (p.coords.dot(&along) - middle).abs() <= reach).copied().collect();
        part.is_empty() || !cost::fill_asks_for_another_cut(filled_by(hold(&part, texture)))
    };
    (2..=MOST_PARTS).find(fills).unwrap_or(MOST_PARTS)
}

/// A cut across a chart at some share of its length, near enough for a part of which there are so many, `part` being its share.
fn at_share(
    cutting: &Cutting<'_>,
    chart: &Chart,
    share: f64,
    part: f64,
    settings: &Settings,
    run: &Run<'_>,
) -> Result<Option<Proposal>, Cancelled> {
    let [near, wide] = AROUND.map(|around| [share - around * part, share + around * part]);
    let Some((anywhere, shortest)) = proposal(cutting, chart, wide, settings, run)? else { return Ok(None) };
    let right_there = proposal(cutting, chart, near, settings, run)?;
    let is_short = |cut: &(Proposal, f64)| cut.1 <= (1.0 + LONGER) * shortest;
    Ok(Some(right_there.filter(is_short).map_or(anywhere, |cut| cut.0)))
}

/// Share of a chart's boundary where it has been cut open: two sides of the same edge of the surface.
fn self_border(chart: &Chart) -> f64 {
    let (mesh, names) = (&chart.patch.mesh, &chart.patch.vertices);
    let ends = |h: HalfedgeId| {
        let (v, w) = (names[mesh.from(h).index()], names[mesh.to(h).index()]);
        (v.min(w), v.max(w))
    };
    let mut border: Vec<_> = mesh.halfedges().filter(|&h| mesh.is_boundary(h)).map(|h| (ends(h), h)).collect();
    border.sort_unstable();
    let length = |edge: &[((VertexId, VertexId), HalfedgeId)]| edge.iter().map(|e| mesh.edge_length(e.1)).sum::<f64>();
    let cut: f64 = border.chunk_by(|a, b| a.0 == b.0).filter(|edge| edge.len() > 1).map(length).sum();
    cut / length(&border).max(f64::MIN_POSITIVE)
}

/// By how much a texture of this width and height must be enlarged to hold points, turned as suits them best.
pub(super) fn hold(uv: &[Point2<f64>], [width, height]: [f64; 2]) -> f64 {
    directions()
        .map(|along| {
            let across = Vector2::new(-along.y, along.x);
            (extent(uv, along) / width).max(extent(uv, across) / height)
        })
        .fold(f64::INFINITY, f64::min)
}

/// The direction across which points extend least: along a strip, where the one in which they extend furthest is a diagonal.
fn axis(uv: &[Point2<f64>]) -> Vector2<f64> {
    let narrower = |best: (f64, Vector2<f64>), along: Vector2<f64>| {
        let width = extent(uv, Vector2::new(-along.y, along.x));
        if width < best.0 { (width, along) } else { best }
    };
    directions().fold((f64::INFINITY, Vector2::x()), narrower).1
}

pub(super) fn directions() -> impl Iterator<Item = Vector2<f64>> {
    (0..DIRECTIONS).map(|k| PI * k as f64 / DIRECTIONS as f64).map(|angle| Vector2::new(angle.cos(), angle.sin()))
}

pub(super) fn extent(uv: &[Point2<f64>], along: Vector2<f64>) -> f64 {
    let (low, high) = range(uv, along);
    high - low
}

fn range(uv: &[Point2<f64>], along: Vector2<f64>) -> (f64, f64) {
    uv.iter()
        .map(|p| p.coords.dot(&along))
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), t| (low.min(t), high.max(t)))
}

/// A cut across a chart at some place of its length, and how long it is; `None` where there is none, or where it would be longer than the chart is
/// wide, as it is where no polygon ends there.
fn proposal(
    cutting: &Cutting<'_>,
    chart: &Chart,
    place: [f64; 2],
    settings: &Settings,
    run: &Run<'_>,
) -> Result<Option<(Proposal, f64)>, Cancelled> {
    let (patch, uv) = (&chart.patch, &chart.uv);
    let along = axis(uv);
    let ends = ends(patch, uv, along, place);
    let crease_weight = settings.segmentation.crease_weight;
    let parts = segmentation::between(&patch.mesh, &patch.polygon, [&ends[0], &ends[1]], crease_weight, run.progress)?;
    let Some(parts) = parts else { return Ok(None) };
    let border = border(&patch.mesh, &parts.label);
    let mean_width = patch.area() / extent(uv, along);
    let length: f64 = border.iter().map(|&h| patch.mesh.edge_length(h)).sum();
    if length > MOST_CUT * mean_width {
        return Ok(None);
    }
    let open: Vec<HalfedgeId> = border.iter().map(|h| patch.faces[h.face().index()].halfedge(h.slot())).collect();
    Ok(Some((Proposal { edit: Edit::new(cutting.mesh(), &[], &open), start: Start::Lying }, length)))
}

/// The faces at either end of a chart, between which it may be cut: those of polygons that lie beyond a place of its length, or reach into it from
/// there. Polygons that reach over the whole place are at neither end.
fn ends(patch: &Patch, uv: &[Point2<f64>], along: Vector2<f64>, [begin, end]: [f64; 2]) -> [Vec<FaceId>; 2] {
    let (low, high) = range(uv, along);
    let mut names = patch.polygon.clone();
    names.sort_unstable();
    names.dedup();
    let place = |f: FaceId| names.partition_point(|&name| name < patch.polygon[f.index()]);
    let mut span = vec![[f64::INFINITY, f64::NEG_INFINITY]; names.len()];
    for f in patch.mesh.faces() {
        let [first, last] = &mut span[place(f)];
        for v in patch.mesh.triangle(f) {
            let at = (uv[v.index()].coords.dot(&along) - low) / (high - low);
            (*first, *last) = (first.min(at), last.max(at));
        }
    }
    let faces_of =
        |is_wanted: &dyn Fn([f64; 2]) -> bool| patch.mesh.faces().filter(|&f| is_wanted(span[place(f)])).collect();
    [faces_of(&|[first, last]| first < begin && last <= end), faces_of(&|[first, last]| first >= begin && last > end)]
}

/// The edges between parts of a mesh.
fn border(mesh: &TriMesh, label: &[u32]) -> Vec<HalfedgeId> {
    let parts = |h: HalfedgeId| label[h.face().index()] != label[mesh.twin(h).face().index()];
    mesh.edges().filter(|&h| !mesh.is_boundary(h) && parts(h)).collect()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::mesh::test_surfaces;
    use crate::progress::Progress;
    use crate::stretch;
    use nalgebra::Point3;

    fn sheet(length: usize) -> Chart {
        sheet_of(length, 2)
    }

    /// As long as it has cells, and two wide.
    fn sheet_of(length: usize, across: usize) -> Chart {
        strip([length, across], [length as f64, 2.0])
    }

    /// A flat rectangle of so many cells, each two triangles that are polygons of their own.
    fn strip([along, across]: [usize; 2], size: [f64; 2]) -> Chart {
        let mesh = test_surfaces::grid(along, across, size, 0.0);
        let polygon: Vec<u32> = (0..mesh.face_count() as u32).collect();
        let patch = Patch::whole(Arc::new(mesh), polygon);
        let uv = patch.mesh.positions().iter().map(|p| p.xy()).collect();
        Chart { patch, uv, l2: 1.0 }
    }

    /// Charts, each of a mesh of its own, as charts of one mesh, cut across.
    fn cut_up(charts: Vec<Chart>) -> Vec<Chart> {
        let (mut positions, mut triangles, mut starts) = (Vec::new(), Vec::new(), Vec::new());
        for chart in &charts {
            let (mesh, first) = (&chart.patch.mesh, positions.len() as u32);
            starts.push(triangles.len());
            triangles.extend(mesh.triangles().iter().map(|t| t.map(|v| first + v.index() as u32)));
            positions.extend_from_slice(mesh.positions());
        }
        let mesh = test_surfaces::mesh(&positions, &triangles);
        let polygon: Vec<u32> = (0..mesh.face_count() as u32).collect();
        let named = |(mut chart, first): (Chart, usize)| {
            chart.patch.faces = (first..first + chart.patch.faces.len()).map(FaceId::new).collect();
            chart.patch.polygon = chart.patch.faces.iter().map(|f| f.index() as u32).collect();
            chart
        };
        let charts = charts.into_iter().zip(starts).map(named).collect();
        cut_on(&mesh, &polygon, charts)
    }

    fn cut_on(mesh: &TriMesh, polygon: &[u32], charts: Vec<Chart>) -> Vec<Chart> {
        let (progress, mut rungs) = (Progress::new(), Rungs::default());
        let (settings, run) = (Settings::default(), Run::new(&progress, None));
        cut_across(mesh, polygon, charts, &settings, &mut rungs, &run).expect("not cancelled")
    }

    #[test]
    fn parts_are_as_long_as_each_other() {
        for length in [30, 45, 60, 80] {
            let parts = cut_up(vec![sheet(length)]);
            let areas: Vec<f64> = parts.iter().map(|part| part.patch.area()).collect();
            let (least, most) = areas.iter().fold((f64::MAX, 0.0_f64), |(low, high), &a| (low.min(a), high.max(a)));
            // Two wide: a cell of the length is two of the area.
            assert!(parts.len() > 1 && most - least <= 4.0, "{length}: {areas:?}");
        }
    }

    #[test]
    fn a_ribbon_is_cut_into_a_few_straight_across() {
        let parts = cut_up(vec![sheet(80)]);
        assert!((3..=6).contains(&parts.len()), "{}", parts.len());
        let area: f64 = parts.iter().map(|c| c.patch.area()).sum();
        assert!((area - 160.0).abs() < 1e-9);
        for part in &parts {
            assert!(part.l2 < 1.0 + 1e-9 && stretch::boundary_is_simple(&part.patch.mesh, &part.uv));
            let mesh = &part.patch.mesh;
            let around: f64 = boundary_lengths(mesh).iter().sum();
            let straight = part.patch.area() + 4.0;
            assert!((around - straight).abs() < 1e-9, "{around} {straight}: two ends of two edges each");
        }
    }

    #[test]
    fn a_body_cut_open_is_cut_sooner_than_a_sheet_of_its_shape() {
        let sheet = sheet_of(10, 4);
        assert!(self_border(&sheet) == 0.0);
        // A square tube of that length and as wide around, unrolled: its ends are its own border, its sides the two of the cut.
        let corner = |k: usize| [[0.0, 0.0], [0.5, 0.0], [0.5, 0.5], [0.0, 0.5]][k % 4];
        let places = sheet.patch.mesh.positions().iter().map(|p| (p.x as usize, (2.0 * p.y) as usize));
        let ring: Vec<(usize, usize)> = places.collect();
        let name = |v: VertexId| (4 * ring[v.index()].0 + ring[v.index()].1 % 4) as u32;
        let positions: Vec<Point3<f64>> =
            (0..44).map(|i| Point3::new((i / 4) as f64, corner(i)[0], corner(i)[1])).collect();
        let triangles: Vec<[u32; 3]> = sheet.patch.mesh.triangles().iter().map(|t| t.map(name)).collect();
        let tube = test_surfaces::mesh(&positions, &triangles);
        let polygon: Vec<u32> = (0..tube.face_count() as u32).collect();
        let on_cut = |v: VertexId| tube.position(v).y == 0.0 && tube.position(v).z == 0.0;
        let patch =
            Patch::cut_out(&tube, &polygon, tube.faces().collect(), |h| on_cut(tube.from(h)) && on_cut(tube.to(h)));
        let mut uv = vec![Point2::origin(); patch.mesh.vertex_count()];
        for (new, old) in patch.mesh.triangles().iter().flatten().zip(sheet.patch.mesh.triangles().iter().flatten()) {
            uv[new.index()] = sheet.uv[old.index()];
        }
        let open = Chart { patch, uv, l2: 1.0 };
        assert!((self_border(&open) - 20.0 / 24.0).abs() < 1e-9);
        assert_eq!((cut_up(vec![sheet]).len(), cut_on(&tube, &polygon, vec![open]).len()), (1, 2));
    }

    #[test]
    fn what_is_short_or_small_beside_others_stays() {
        assert_eq!(cut_up(vec![sheet(10)]).len(), 1);
        let mesh = test_surfaces::grid(10, 10, [60.0, 60.0], 0.0);
        let polygon: Vec<u32> = (0..mesh.face_count() as u32).collect();
        let patch = Patch::whole(Arc::new(mesh), polygon);
        let uv = patch.mesh.positions().iter().map(|p| p.xy()).collect();
        assert_eq!(cut_up(vec![sheet(80), Chart { patch, uv, l2: 1.0 }]).len(), 2);
    }

    /// Diagonals of triangles as long as the strip are no place for a cut; sides across it are, where there are some.
    #[test]
    fn triangles_as_long_as_the_chart_stay_together() {
        for across in [1, 2, 24] {
            assert_eq!(cut_up(vec![strip([1, across], [30.0, 2.0])]).len(), 1, "{across} across, no side between");
            for along in [2, 3, 5] {
                let parts = cut_up(vec![strip([along, across], [30.0, 2.0])]);
                assert!((2..=along).contains(&parts.len()), "{along} by {across} cells: {} parts", parts.len());
                let around: f64 = parts.iter().flat_map(|c| boundary_lengths(&c.patch.mesh)).sum();
                let straight = 64.0 + 4.0 * (parts.len() - 1) as f64;
                assert!((around - straight).abs() < 1e-9, "{along} by {across} cells: every cut is straight, {around}");
            }
        }
    }

    #[test]
    fn where_no_polygon_ends_in_the_middle_the_cut_is_beside_it() {
        // Cells as long as a third of the strip.
        let parts = cut_up(vec![strip([3, 2], [30.0, 2.0])]);
        assert_eq!(parts.len(), 3);
        let around: f64 = parts.iter().flat_map(|c| boundary_lengths(&c.patch.mesh)).sum();
        assert!((around - 72.0).abs() < 1e-9, "both cuts are straight: {around}");
    }

    #[test]
    fn a_cut_that_only_takes_off_an_end_is_not_made() {
        // A side across near one end alone.
        let mut chart = strip([2, 2], [30.0, 2.0]);
        let moved = |p: &Point3<f64>| Point3::new(if p.x == 15.0 { 2.0 } else { p.x }, p.y, p.z);
        let positions: Vec<Point3<f64>> = chart.patch.mesh.positions().iter().map(moved).collect();
        let triangles: Vec<[u32; 3]> =
            chart.patch.mesh.triangles().iter().map(|t| t.map(|v| v.index() as u32)).collect();
        let mesh = test_surfaces::mesh(&positions, &triangles);
        chart.uv = mesh.positions().iter().map(|p| p.xy()).collect();
        chart.patch = Patch::whole(Arc::new(mesh), chart.patch.polygon);
        assert_eq!(cut_up(vec![chart]).len(), 1);
    }

    fn boundary_lengths(mesh: &TriMesh) -> Vec<f64> {
        mesh.halfedges().filter(|&h| mesh.is_boundary(h)).map(|h| mesh.edge_length(h)).collect()
    }
}
