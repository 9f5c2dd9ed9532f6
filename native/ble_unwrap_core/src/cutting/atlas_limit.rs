//! Charts joined beyond the limit for as long as the atlas keeps it on the whole.
//!
//! UVAtlas bounds the stretch of the whole atlas, so that a chart may exceed the limit where others have room to spare.
//! Here the charts under the limit are joined further, least added stretch per length of border saved first.

use rayon::prelude::*;

use crate::cache::Run;
use crate::charts::Chart;
use crate::flattening::{Rung, Rungs};
use crate::mesh::TriMesh;
use crate::progress::Cancelled;
use crate::settings::Settings;

use super::history::Place;
use super::moves::Site;
use super::moves::join::{Join, Which};
use super::search::tried;
use super::state::{ChartId, Cutting};
use super::trial::Verdict;

/// Share of what the limit allows that is left for rounding to single precision.
const RESERVE: f64 = 1e-4;

/// Two neighbours and what their union would be.
struct Union {
    pair: [ChartId; 2],
    chart: Chart,
    /// Area times squared stretch that it has more than its parts.
    added: f64,
    /// That over the length of border that it saves.
    price: f64,
}

/// Joins neighbouring charts of a surface while the area-weighted mean of the squared L2 stretch of the charts stays
/// under the square of `settings.stretch_limit`, and each chart under [`Settings::chart_limit`]. Charts come sorted by
/// lowest face, their faces named as in `mesh`.
///
/// Every pair of neighbours is flattened together once, and every union that is taken with each of its neighbours: some
/// ten trials a chart.
pub(crate) fn join_within_atlas(
    mesh: &TriMesh,
    polygon: &[u32],
    charts: Vec<Chart>,
    settings: &Settings,
    rungs: &mut Rungs,
    run: &Run<'_>,
) -> Result<Vec<Chart>, Cancelled> {
    let area: f64 = charts.iter().map(|c| c.patch.area()).sum();
    let spent = charts.iter().map(stretch).sum();
    let most = (1.0 - RESERVE) * settings.stretch_limit.powi(2) * area;
    let mut budget = Budget { cutting: Cutting::new(mesh, polygon, charts), settings, most, spent };
    let mut offers = budget.offers(budget.cutting.neighbours(None), run)?;
    loop {
        run.progress.check()?;
        let left = budget.left();
        let price = |i: usize| (offers[i].price, offers[i].pair);
        let payable = (0..offers.len()).filter(|&i| offers[i].added <= left);
        let best = payable.min_by(|&i, &j| price(i).0.total_cmp(&price(j).0).then(price(i).1.cmp(&price(j).1)));
        let Some(best) = best else { break };
        let Union { pair, chart, .. } = offers.swap_remove(best);
        rungs.take(Rung::Merge);
        let joined = budget.join(pair, chart);
        offers.retain(|o| o.pair.iter().all(|id| !pair.contains(id)));
        for id in joined {
            offers.extend(budget.offers(budget.cutting.neighbours(Some(id)), run)?);
        }
    }
    Ok(budget.cutting.into_charts())
}

/// A chart's share in the sum of area times squared L2 stretch.
fn stretch(chart: &Chart) -> f64 {
    chart.patch.area() * chart.l2 * chart.l2
}

struct Budget<'a> {
    cutting: Cutting<'a>,
    settings: &'a Settings,
    /// What the sum of area times squared stretch may come to.
    most: f64,
    spent: f64,
}

impl Budget<'_> {
    fn left(&self) -> f64 {
        self.most - self.spent
    }

    /// The unions of pairs of neighbours that flatten within what is left.
    fn offers(&self, pairs: Vec<([ChartId; 2], f64)>, run: &Run<'_>) -> Result<Vec<Union>, Cancelled> {
        let offer = |(pair, saved): ([ChartId; 2], f64)| {
            run.progress.check()?;
            let [Some(a), Some(b)] = pair.map(|id| self.cutting.chart(id)) else { return Ok(None) };
            let (area, before) = (a.patch.area() + b.patch.area(), [stretch(a), stretch(b)]);
            let mut settings = self.settings.clone();
            settings.stretch_limit = ((self.left() + before[0] + before[1]) / area).sqrt().min(settings.chart_limit());
            if settings.stretch_limit.is_nan() || settings.stretch_limit <= 1.0 {
                return Ok(None);
            }
            let site = Site { place: Place::between(pair[0], pair[1]), charts: pair.to_vec(), ways: Vec::new() };
            let (verdict, _) =
                tried(&self.cutting, &Join { which: Which::EVERY, alone: 1 }, &site, None, &settings, run)?;
            let Verdict::Charts(charts) = verdict else { return Ok(None) };
            let Ok([chart]) = <[Chart; 1]>::try_from(charts) else { return Ok(None) };
            let added = area * chart.l2 * chart.l2 - before[0] - before[1];
            Ok(Some(Union { pair, chart, added, price: added / saved.max(f64::MIN_POSITIVE) }))
        };
        let offers: Vec<Result<Option<Union>, Cancelled>> = pairs.into_par_iter().with_max_len(1).map(offer).collect();
        offers.into_iter().filter_map(Result::transpose).collect()
    }

    /// Takes a union in place of its parts; returns its name.
    fn join(&mut self, pair: [ChartId; 2], chart: Chart) -> Vec<ChartId> {
        for part in pair.iter().filter_map(|&id| self.cutting.chart(id)) {
            self.spent -= stretch(part);
        }
        self.spent += stretch(&chart);
        self.cutting.replace(&pair, vec![chart])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::charts::Patch;
    use crate::mesh::{FaceId, test_surfaces};
    use crate::progress::Progress;
    use crate::settings::LimitOver;
    use nalgebra::Point3;

    use super::super::attempt;

    /// Quarters of a cap of a ball, each flattened by itself.
    fn quarters() -> (TriMesh, Vec<u32>, Vec<Chart>) {
        let ball = test_surfaces::sphere(3);
        let all: Vec<u32> = (0..ball.face_count() as u32).collect();
        let above = |f: &FaceId| ball.triangle_positions(*f).iter().all(|p| p.z > 0.4);
        let cap = Patch::of_surface(&ball, &all, ball.faces().filter(above).collect());
        let mesh = TriMesh::clone(&cap.mesh);
        let polygon: Vec<u32> = (0..mesh.face_count() as u32).collect();
        let quarter = |f: FaceId| {
            let p = mesh.triangle_positions(f).iter().fold(Point3::origin(), |sum, p| sum + p.coords);
            (u32::from(p.x > 0.0), u32::from(p.y > 0.0))
        };
        let progress = Progress::new();
        let flat = |place: (u32, u32)| {
            let faces = mesh.faces().filter(|&f| quarter(f) == place).collect();
            let patch = Patch::of_surface(&mesh, &polygon, faces);
            let run = Run::new(&progress, None);
            attempt::as_one(&patch, &Settings::default(), &mut Rungs::default(), &run).expect("runs").expect("flat")
        };
        let charts = [(0, 0), (0, 1), (1, 0), (1, 1)].map(flat).to_vec();
        (mesh, polygon, charts)
    }

    fn spent(limit: f64) -> (Vec<Chart>, Vec<Chart>) {
        let (mesh, polygon, charts) = quarters();
        let settings = Settings { stretch_limit: limit, limit_over: LimitOver::Atlas, ..Settings::default() };
        let progress = Progress::new();
        let run = Run::new(&progress, None);
        let mut rungs = Rungs::default();
        let joined =
            join_within_atlas(&mesh, &polygon, charts.clone(), &settings, &mut rungs, &run).expect("not cancelled");
        let merges: usize = rungs.taken().iter().filter(|r| r.0 == "merge").map(|r| r.1).sum();
        assert_eq!(merges, charts.len() - joined.len());
        let mut faces: Vec<FaceId> = joined.iter().flat_map(|c| c.patch.faces.iter().copied()).collect();
        faces.sort_unstable();
        assert!(faces.into_iter().eq(mesh.faces()), "each face once");
        (charts, joined)
    }

    /// L2 stretch of charts taken together.
    fn l2(charts: &[Chart]) -> f64 {
        let sum = |f: &dyn Fn(&Chart) -> f64| charts.iter().map(f).sum::<f64>();
        (sum(&|c| c.patch.area() * c.l2 * c.l2) / sum(&|c| c.patch.area())).sqrt()
    }

    #[test]
    fn all_is_joined_where_the_limit_is_far_and_nothing_where_it_is_reached() {
        let (before, joined) = spent(1.5);
        assert_eq!((before.len(), joined.len()), (4, 1));
        assert!(l2(&joined) > l2(&before) && l2(&joined) < 1.5);
        let (before, joined) = spent(1.0 + 0.5 * (l2(&before) - 1.0));
        assert_eq!(joined.len(), before.len());
    }

    #[test]
    fn what_there_is_is_spent_and_no_more() {
        let (before, whole) = spent(1.5);
        let limit = 0.5 * (l2(&before) + l2(&whole));
        let (_, joined) = spent(limit);
        assert!((2..4).contains(&joined.len()), "{}", joined.len());
        assert!(l2(&joined) <= limit);
    }
}
