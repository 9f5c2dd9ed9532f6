//! Charts joined beyond the limit for as long as the atlas keeps it on the whole.
//!
//! UVAtlas bounds the stretch of the whole atlas, so that a chart may exceed the limit where others have room to spare.
//! Here the charts under the limit are joined further, least added stretch per length of border saved first.

use rayon::prelude::*;

use crate::charts::Chart;
use crate::mesh::{HalfedgeId, TriMesh};
use crate::progress::Cancelled;
use crate::settings::Settings;

use super::memo::Run;
use super::sew::{self, Joined};
use crate::flattening::{Rung, Rungs};

/// Share of the budget that is left for rounding to single precision.
const RESERVE: f64 = 1e-4;

/// Two neighbours and what their union would be.
struct Union {
    /// Places in the pool.
    pair: [usize; 2],
    chart: Chart,
    /// Area times squared stretch that it has more than its parts.
    added: f64,
    /// That over the length of border that it saves.
    price: f64,
}

/// A chart in the pool, and its share in the sum of area times squared L2 stretch.
struct Member {
    chart: Chart,
    area: f64,
    stretch: f64,
}

impl Member {
    fn new(chart: Chart) -> Self {
        let area = chart.patch.area();
        Self { stretch: area * chart.l2 * chart.l2, area, chart }
    }
}

/// Joins neighbouring charts of a surface while the area-weighted mean of the squared L2 stretch of the charts stays
/// under the square of `settings.stretch_limit`, and each chart under [`Settings::chart_limit`]. Charts come sorted by
/// lowest face, their faces named as in `mesh`.
///
/// Every pair of neighbours is flattened together once, and every union that is taken with each of its neighbours: some
/// ten trials a chart.
pub(super) fn spend(
    mesh: &TriMesh,
    polygon: &[u32],
    charts: Vec<Chart>,
    settings: &Settings,
    progress: &Run<'_>,
) -> Result<(Vec<Chart>, Rungs), Cancelled> {
    let mut pool = Pool::new(mesh, polygon, charts, settings);
    let mut rungs = Rungs::default();
    let mut offers = pool.offers(pool.neighbours(None), progress)?;
    loop {
        progress.check()?;
        let left = pool.left();
        let price = |i: usize| (offers[i].price, offers[i].pair);
        let payable = (0..offers.len()).filter(|&i| offers[i].added <= left);
        let best = payable.min_by(|&i, &j| price(i).0.total_cmp(&price(j).0).then(price(i).1.cmp(&price(j).1)));
        let Some(best) = best else { break };
        let Union { pair, chart, .. } = offers.swap_remove(best);
        rungs.take(Rung::Merge);
        let joined = pool.join(pair, chart);
        offers.retain(|o| o.pair.iter().all(|i| !pair.contains(i)));
        offers.extend(pool.offers(pool.neighbours(Some(joined)), progress)?);
    }
    let mut charts: Vec<Chart> = pool.members.into_iter().flatten().map(|m| m.chart).collect();
    charts.sort_by_key(|c| c.patch.faces.iter().min().copied());
    Ok((charts, rungs))
}

struct Pool<'a> {
    mesh: &'a TriMesh,
    polygon: &'a [u32],
    settings: &'a Settings,
    /// Those that were joined to others are gone.
    members: Vec<Option<Member>>,
    /// Place of each face of the surface.
    owner: Vec<usize>,
    /// What the sum of area times squared stretch may come to.
    budget: f64,
    spent: f64,
}

impl<'a> Pool<'a> {
    fn new(mesh: &'a TriMesh, polygon: &'a [u32], charts: Vec<Chart>, settings: &'a Settings) -> Self {
        let members: Vec<Option<Member>> = charts.into_iter().map(|c| Some(Member::new(c))).collect();
        let mut owner = vec![usize::MAX; mesh.face_count()];
        for (i, member) in members.iter().enumerate() {
            for f in member.iter().flat_map(|m| &m.chart.patch.faces) {
                owner[f.index()] = i;
            }
        }
        let area: f64 = members.iter().flatten().map(|m| m.area).sum();
        let spent = members.iter().flatten().map(|m| m.stretch).sum();
        let budget = (1.0 - RESERVE) * settings.stretch_limit.powi(2) * area;
        Self { mesh, polygon, settings, members, owner, budget, spent }
    }

    fn left(&self) -> f64 {
        self.budget - self.spent
    }

    /// Length of the border between each pair of neighbours, or of one chart and its neighbours, by pair.
    fn neighbours(&self, of: Option<usize>) -> Vec<([usize; 2], f64)> {
        let side = |h: HalfedgeId| {
            let t = self.mesh.twin(h);
            if t.is_none() {
                return None;
            }
            let (a, b) = (self.owner[h.face().index()], self.owner[t.face().index()]);
            let wanted = a != b && a != usize::MAX && b != usize::MAX;
            wanted.then(|| ([a.min(b), a.max(b)], self.mesh.edge_length(h) * self.mesh.border_cost(h)))
        };
        let mut sides: Vec<([usize; 2], f64)> = match of.map(|i| &self.members[i]) {
            None => self.mesh.edges().filter_map(side).collect(),
            Some(member) => {
                let faces = member.iter().flat_map(|m| &m.chart.patch.faces);
                faces.flat_map(|f| f.halfedges()).filter_map(side).collect()
            }
        };
        sides.sort_by_key(|s| s.0);
        let total = |group: &[([usize; 2], f64)]| (group[0].0, group.iter().map(|s| s.1).sum());
        sides.chunk_by(|s, t| s.0 == t.0).map(total).collect()
    }

    /// The unions of pairs of neighbours that flatten within what is left.
    fn offers(&self, pairs: Vec<([usize; 2], f64)>, progress: &Run<'_>) -> Result<Vec<Union>, Cancelled> {
        let offer = |(pair, saved): ([usize; 2], f64)| {
            progress.check()?;
            let [Some(a), Some(b)] = pair.map(|i| self.members[i].as_ref()) else { return Ok(None) };
            let most = ((self.left() + a.stretch + b.stretch) / (a.area + b.area)).sqrt();
            let mut settings = self.settings.clone();
            settings.stretch_limit = most.min(self.settings.chart_limit());
            if settings.stretch_limit.is_nan() || settings.stretch_limit <= 1.0 {
                return Ok(None);
            }
            let sides = [&a.chart, &b.chart];
            let union = sew::joined(self.mesh, self.polygon, sides, &settings, &mut Rungs::default(), progress)?;
            let Joined::Chart(chart) = union else { return Ok(None) };
            let added = (a.area + b.area) * chart.l2 * chart.l2 - a.stretch - b.stretch;
            Ok(Some(Union { pair, chart: *chart, added, price: added / saved.max(f64::MIN_POSITIVE) }))
        };
        let offers: Vec<Result<Option<Union>, Cancelled>> = pairs.into_par_iter().with_max_len(1).map(offer).collect();
        offers.into_iter().filter_map(Result::transpose).collect()
    }

    /// Takes a union in place of its parts; returns its place.
    fn join(&mut self, pair: [usize; 2], chart: Chart) -> usize {
        let place = self.members.len();
        for f in &chart.patch.faces {
            self.owner[f.index()] = place;
        }
        for i in pair {
            self.spent -= self.members[i].take().map_or(0.0, |m| m.stretch);
        }
        let member = Member::new(chart);
        self.spent += member.stretch;
        self.members.push(Some(member));
        place
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

    use super::super::charting;

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
            charting::as_one(&patch, &Settings::default(), &mut Rungs::default(), &run).expect("runs").expect("flat")
        };
        let charts = [(0, 0), (0, 1), (1, 0), (1, 1)].map(flat).to_vec();
        (mesh, polygon, charts)
    }

    fn spent(limit: f64) -> (Vec<Chart>, Vec<Chart>) {
        let (mesh, polygon, charts) = quarters();
        let settings = Settings { stretch_limit: limit, limit_over: LimitOver::Atlas, ..Settings::default() };
        let progress = Progress::new();
        let run = Run::new(&progress, None);
        let (joined, rungs) = spend(&mesh, &polygon, charts.clone(), &settings, &run).expect("not cancelled");
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
