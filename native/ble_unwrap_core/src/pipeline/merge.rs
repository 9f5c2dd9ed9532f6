//! Charts joined to larger ones where the union still flattens under the limit.
//!
//! Splitting top-down is greedy: two neighbours from different branches may well be one chart. Iso-charts
//! merges by an estimate; here the real flattening is the judge: first of the two charts as they are, sewn together, and
//! where they do not fit of their union embedded anew.

use rayon::prelude::*;

use crate::charts::{Chart, Patch};
use crate::mesh::{FaceId, HalfedgeId, TriMesh};
use crate::progress::Cancelled;
use crate::settings::Settings;

use super::charting::{self, Charting, Refused};
use super::memo::Run;
use super::sew::{self, Joined};
use crate::flattening::{Rung, Rungs};

/// Failed unions a chart may take part in before it is left alone.
const MOST_FAILURES: usize = 4;
/// Failed embeddings of unions that could not be sewn, likewise. In the geometric mean over the meshes of `make quality` none
/// gives 2.72 charts, one or two 2.56, four 2.55, in 0.43, 0.46 and 0.49 CPU seconds.
const MOST_EMBEDDED: usize = 2;
/// On a fine mesh only unions of so many times fewer faces than may be sewn are embedded, which costs as many times more.
const EMBEDDED_SHARE: usize = 5;

/// Which neighbours are tried.
#[derive(Clone, Copy, Debug)]
pub(super) enum Which {
    /// All.
    All,
    /// All, but unions embedded anew only where they have so few faces together, as below.
    AllSewn {
        /// Most faces of a union that would be sewn if that were limited.
        most_faces: usize,
    },
    /// Only those of which one came out of a split, and which have so few faces together.
    AfterSplits {
        /// Most faces of a union.
        most_faces: usize,
    },
}

/// Where the trial of a union begins.
#[derive(Clone, Copy, Debug)]
enum Start {
    /// With the two charts, laid side by side.
    Sewn,
    /// With an embedding of the union, cut open anew: where they did not fit, after all that do have been joined.
    Embedded,
}

/// A chart and its history.
struct Candidate {
    chart: Chart,
    area: f64,
    failures: usize,
    /// Came out of a split, or of joining a chart that did.
    split: bool,
    /// Charts (by index) whose union with this one has been refused.
    refused: Vec<usize>,
    /// Those among them that did not fit as they lay, and that have not been tried from another start yet.
    misfits: Vec<usize>,
    embedded: usize,
}

impl Candidate {
    fn new(chart: Chart, split: bool) -> Self {
        Self {
            area: chart.patch.area(),
            chart,
            failures: 0,
            split,
            refused: Vec::new(),
            misfits: Vec::new(),
            embedded: 0,
        }
    }
}

/// Joins neighbouring charts, longest shared border over √(smaller area) first (guides count little), as long as the union
/// is under the limit. Each chart takes part in at most [`MOST_FAILURES`] failed tests, and
/// [`MOST_EMBEDDED`] from an embedding, so the number of tests is linear in the number of charts. Two halves of a split in two are not tried: their union has
/// already been refused.
pub(super) fn merge(
    mesh: &TriMesh,
    polygon: &[u32],
    charting: Charting,
    which: Which,
    settings: &Settings,
    progress: &Run<'_>,
) -> Result<(Vec<Chart>, Rungs), Cancelled> {
    let mut rungs = Rungs::default();
    let refused = charting.refused;
    let family = charting.family;
    let mut pool: Vec<Option<Candidate>> = charting
        .charts
        .into_iter()
        .zip(&family)
        .map(|(chart, family)| Some(Candidate::new(chart, family.is_some())))
        .collect();
    let mut halves: Vec<(u32, usize)> = family.iter().enumerate().filter_map(|(i, f)| Some(((*f)?, i))).collect();
    halves.sort_unstable();
    for pair in halves.chunk_by(|a, b| a.0 == b.0) {
        if let [(_, a), (_, b)] = *pair {
            for (one, other) in [(a, b), (b, a)] {
                if let Some(c) = &mut pool[one] {
                    c.refused.push(other);
                }
            }
        }
    }
    let mut owner = vec![usize::MAX; mesh.face_count()];
    for (i, c) in pool.iter().enumerate() {
        for f in c.iter().flat_map(|c| &c.chart.patch.faces) {
            owner[f.index()] = i;
        }
    }
    loop {
        progress.check()?;
        let mut start = Start::Sewn;
        let mut pairs = independent_pairs(&pool, &borders(mesh, &owner, &pool, which, start));
        if pairs.is_empty() {
            start = Start::Embedded;
            pairs = independent_pairs(&pool, &borders(mesh, &owner, &pool, which, start));
        }
        if pairs.is_empty() {
            break;
        }
        let tests: Vec<Result<(Joined, Rungs), Cancelled>> = pairs
            .par_iter()
            .with_max_len(1)
            .map(|&(a, b)| {
                let mut rungs = Rungs::default();
                let (Some(one), Some(other)) = (&pool[a], &pool[b]) else { return Ok((Joined::Refused, rungs)) };
                let sides = [&one.chart, &other.chart];
                let joined = match start {
                    Start::Sewn => sew::joined(mesh, polygon, sides, settings, &mut rungs, progress)?,
                    Start::Embedded => embedded(mesh, polygon, sides, &refused, settings, &mut rungs, progress)?,
                };
                Ok((joined, rungs))
            })
            .collect();
        for (&(a, b), test) in pairs.iter().zip(tests) {
            let (joined, steps) = test?;
            if let Joined::Chart(chart) = joined {
                rungs.add(&steps);
                rungs.take(Rung::Merge);
                for f in &chart.patch.faces {
                    owner[f.index()] = pool.len();
                }
                let split = [a, b].iter().any(|&i| pool[i].as_ref().is_some_and(|c| c.split));
                pool[a] = None;
                pool[b] = None;
                pool.push(Some(Candidate::new(*chart, split)));
            } else {
                for (one, other) in [(a, b), (b, a)] {
                    let Some(c) = &mut pool[one] else { continue };
                    match start {
                        Start::Sewn => {
                            c.failures += 1;
                            c.refused.push(other);
                            c.misfits.extend(matches!(joined, Joined::Misfit).then_some(other));
                        }
                        Start::Embedded => {
                            c.embedded += 1;
                            c.misfits.retain(|&m| m != other);
                        }
                    }
                }
            }
        }
    }
    let mut charts: Vec<Chart> = pool.into_iter().flatten().map(|c| c.chart).collect();
    charts.sort_by_key(|c| c.patch.faces.iter().min().copied());
    Ok((charts, rungs))
}

/// The union of two charts flattened anew, whatever they look like now, if that makes no seam longer.
fn embedded(
    mesh: &TriMesh,
    polygon: &[u32],
    sides: [&Chart; 2],
    refused: &Refused,
    settings: &Settings,
    rungs: &mut Rungs,
    progress: &Run<'_>,
) -> Result<Joined, Cancelled> {
    let mut faces: Vec<FaceId> = sides.iter().flat_map(|c| c.patch.faces.iter().copied()).collect();
    faces.sort_unstable();
    // What was split into more than two may have come together again.
    if refused.contains(&faces) {
        return Ok(Joined::Refused);
    }
    let patch = Patch::of_surface(mesh, polygon, faces);
    let chart = charting::as_one(&patch, settings, rungs, progress)?;
    // Darts may have made more seam than the border was.
    let seams = |c: &Chart| c.patch.mesh.boundary_length();
    let shorter = chart.filter(|chart| seams(chart) <= sides.iter().map(|side| seams(side)).sum());
    Ok(shorter.map_or(Joined::Refused, |chart| Joined::Chart(Box::new(chart))))
}

/// Shared border length of each pair of charts that may still be tested, sorted by pair.
fn borders(
    mesh: &TriMesh,
    owner: &[usize],
    pool: &[Option<Candidate>],
    which: Which,
    start: Start,
) -> Vec<(usize, usize, f64)> {
    let faces = |i: usize| pool[i].as_ref().map_or(0, |c| c.chart.patch.faces.len());
    let split = |i: usize| pool[i].as_ref().is_some_and(|c| c.split);
    let wanted = |a: usize, b: usize| match which {
        Which::All => true,
        Which::AllSewn { most_faces } => match start {
            Start::Sewn => true,
            Start::Embedded => faces(a) + faces(b) <= most_faces / EMBEDDED_SHARE,
        },
        Which::AfterSplits { most_faces } => {
            let most = match start {
                Start::Sewn => most_faces,
                Start::Embedded => most_faces / EMBEDDED_SHARE,
            };
            (split(a) || split(b)) && faces(a) + faces(b) <= most
        }
    };
    let open = |i: usize| {
        pool[i].as_ref().is_some_and(|c| match start {
            Start::Sewn => c.failures < MOST_FAILURES,
            Start::Embedded => c.embedded < MOST_EMBEDDED,
        })
    };
    let untried = |a: usize, b: usize| {
        pool[a].as_ref().is_some_and(|c| match start {
            Start::Sewn => !c.refused.contains(&b),
            Start::Embedded => c.misfits.contains(&b),
        })
    };
    let shared = |h: HalfedgeId| {
        let t = mesh.twin(h);
        if t.is_none() || t < h {
            return None;
        }
        let (a, b) = (owner[h.face().index()], owner[t.face().index()]);
        let (a, b) = (a.min(b), a.max(b));
        (a != b && b != usize::MAX && wanted(a, b) && open(a) && open(b) && untried(a, b))
            .then(|| (a, b, mesh.edge_length(h) * mesh.border_cost(h)))
    };
    let mut sides: Vec<(usize, usize, f64)> = mesh.halfedges().filter_map(shared).collect();
    sides.sort_by_key(|s| (s.0, s.1));
    sides
        .chunk_by(|x, y| (x.0, x.1) == (y.0, y.1))
        .map(|group| (group[0].0, group[0].1, group.iter().map(|s| s.2).sum()))
        .collect()
}

/// Pairs in which no chart occurs twice, best first.
fn independent_pairs(pool: &[Option<Candidate>], borders: &[(usize, usize, f64)]) -> Vec<(usize, usize)> {
    let area = |i: usize| pool[i].as_ref().map_or(0.0, |c| c.area);
    let mut scored: Vec<(f64, usize, usize)> = borders
        .iter()
        .map(|&(a, b, length)| (length / area(a).min(area(b)).max(f64::MIN_POSITIVE).sqrt(), a, b))
        .collect();
    scored.sort_by(|x, y| y.0.total_cmp(&x.0).then((x.1, x.2).cmp(&(y.1, y.2))));
    let mut taken = vec![false; pool.len()];
    let mut pairs = Vec::new();
    for (_, a, b) in scored {
        if !taken[a] && !taken[b] {
            taken[a] = true;
            taken[b] = true;
            pairs.push((a, b));
        }
    }
    pairs
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::test_surfaces;
    use crate::progress::Progress;
    use crate::settings::NEVER_SEWN;
    use nalgebra::{Point2, Point3};

    /// Waves of the border, so that two that lie on each other cross, and their height.
    const WAVES: (f64, f64) = (5.0, 0.1);

    /// The cap of a ball above 30° in two halves, each drawn as a disc but for a sector: as they lie, the union would go
    /// round its pole twice.
    fn halves_that_do_not_fit() -> (TriMesh, Vec<u32>, Vec<Chart>) {
        let ball = test_surfaces::sphere(3);
        let all: Vec<u32> = (0..ball.face_count() as u32).collect();
        let above = |f: &FaceId| ball.triangle_positions(*f).iter().all(|p| p.z > 0.5);
        let cap = Patch::of_surface(&ball, &all, ball.faces().filter(above).collect());
        let polygon: Vec<u32> = (0..cap.mesh.face_count() as u32).collect();
        let half = |side: f64| {
            let mine =
                |f: &FaceId| (cap.mesh.triangle_positions(*f).iter().map(|p| p.x).sum::<f64>() > 0.0) == (side > 0.0);
            let patch = Patch::of_surface(&cap.mesh, &polygon, cap.mesh.faces().filter(mine).collect());
            let draw = |p: &Point3<f64>| {
                let angle = 1.9 * (side * p.y).atan2(side * p.x);
                let radius = p.xy().coords.norm() * (1.0 + side * WAVES.1 * (WAVES.0 * angle).cos());
                Point2::new(radius * angle.cos(), radius * angle.sin())
            };
            let uv = patch.mesh.positions().iter().map(draw).collect();
            Chart { patch, uv, l2: 1.0 }
        };
        let halves = vec![half(1.0), half(-1.0)];
        (TriMesh::clone(&cap.mesh), polygon, halves)
    }

    fn merged(family: [Option<u32>; 2], which: Which, settings: &Settings) -> (Vec<Chart>, Rungs) {
        let (mesh, polygon, charts) = halves_that_do_not_fit();
        let charting =
            Charting { charts, family: family.to_vec(), rungs: Rungs::default(), refused: Refused::default() };
        let progress = Progress::new();
        merge(&mesh, &polygon, charting, which, settings, &Run::new(&progress, None)).expect("not cancelled")
    }

    #[test]
    fn charts_that_do_not_fit_as_they_lie_become_one_from_an_embedding() {
        let (mesh, polygon, charts) = halves_that_do_not_fit();
        let settings = Settings::default();
        let progress = Progress::new();
        let run = Run::new(&progress, None);
        for chart in &charts {
            assert!(chart.patch.mesh.topology().is_disk());
            assert_eq!(crate::stretch::first_flip(&chart.patch.mesh, &chart.uv), None);
        }
        let sides = [&charts[0], &charts[1]];
        let sewn = sew::joined(&mesh, &polygon, sides, &settings, &mut Rungs::default(), &run).expect("not cancelled");
        assert!(matches!(sewn, Joined::Misfit));
        let (charts, rungs) = merged([None, None], Which::All, &settings);
        assert_eq!(charts.len(), 1);
        assert!(charts[0].l2 > 1.0 && charts[0].l2 <= settings.stretch_limit, "{}", charts[0].l2);
        assert_eq!(charts[0].patch.faces.len(), mesh.face_count());
        assert!(crate::stretch::boundary_is_simple(&charts[0].patch.mesh, &charts[0].uv));
        assert!(rungs.taken().contains(&("merge", 1)));
    }

    #[test]
    fn a_union_over_the_limit_stays_two_whatever_its_start() {
        let tight = Settings { stretch_limit: 1.0005, least_sewn: NEVER_SEWN, ..Settings::default() };
        assert_eq!(merged([None, None], Which::All, &tight).0.len(), 2);
    }

    #[test]
    fn a_union_that_was_refused_before_is_not_embedded() {
        let (mesh, polygon, charts) = halves_that_do_not_fit();
        let progress = Progress::new();
        let run = Run::new(&progress, None);
        let all: Vec<FaceId> = mesh.faces().collect();
        let whole = Patch::of_surface(&mesh, &polygon, all);
        let refused = Refused::of(std::iter::once(Refused::key(&whole.faces)));
        let settings = Settings::default();
        let charting = Charting { charts, family: vec![None, None], rungs: Rungs::default(), refused };
        let (charts, _) = merge(&mesh, &polygon, charting, Which::All, &settings, &run).expect("not cancelled");
        assert_eq!(charts.len(), 2);
    }

    #[test]
    fn a_union_embedded_with_darts_may_not_lengthen_the_seam() {
        // The border of a small cap is shorter than any cut that opens the ball.
        let ball = test_surfaces::sphere(3);
        let polygon: Vec<u32> = (0..ball.face_count() as u32).collect();
        let progress = Progress::new();
        let run = Run::new(&progress, None);
        let settings = Settings::default();
        let high = |f: &FaceId| ball.triangle_positions(*f).iter().all(|p| p.z > 0.9);
        let side = |wanted: bool| {
            let patch = Patch::of_surface(&ball, &polygon, ball.faces().filter(|f| high(f) == wanted).collect());
            // Where it lies does not matter.
            Chart { uv: vec![Point2::origin(); patch.mesh.vertex_count()], patch, l2: 1.0 }
        };
        let sides = [side(true), side(false)];
        let seam = |c: &Chart| c.patch.mesh.boundary_length();
        let mut rungs = Rungs::default();
        let whole = Patch::of_surface(&ball, &polygon, ball.faces().collect());
        let one = charting::as_one(&whole, &settings, &mut rungs, &run).expect("not cancelled").expect("with darts");
        assert!(seam(&one) > sides.iter().map(seam).sum());
        let (none, sides) = (Refused::default(), [&sides[0], &sides[1]]);
        let joined = embedded(&ball, &polygon, sides, &none, &settings, &mut rungs, &run).expect("not cancelled");
        assert!(matches!(joined, Joined::Refused));
    }

    #[test]
    fn on_a_fine_mesh_only_small_unions_are_embedded() {
        let settings = Settings::default();
        let faces = halves_that_do_not_fit().0.face_count();
        let count = |family, most_faces| merged(family, Which::AfterSplits { most_faces }, &settings).0.len();
        let of_two_splits = [Some(0), Some(1)];
        assert_eq!(count(of_two_splits, EMBEDDED_SHARE * faces), 1);
        assert_eq!(count(of_two_splits, EMBEDDED_SHARE * (faces - 1)), 2, "it may be sewn, and that fails");
        assert_eq!(count([None, None], EMBEDDED_SHARE * faces), 2, "no split has made them");
        assert_eq!(count([Some(0), Some(0)], EMBEDDED_SHARE * faces), 2, "two halves of a split in two");
    }
}
