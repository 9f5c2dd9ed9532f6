//! WIP
use rayon::prelude::*;

use super::mask::Reach;
use super::outline::Outline;
use super::place::{Goal, Layout, place};
use super::pose::base_turns;
use super::shape::Shape;
use super::{PackError, PackItem, PackSettings, Packed, Pose, Rotation};
use crate::Progress;

#[derive(Clone, Copy, Debug)]
pub(super) enum Order { Area, Extent, Box }

pub(super) struct Attempt { density: f64, shapes: Vec<Shape>, layout: Layout, used: f64 }

pub(super) struct Plan { pub(super) cell: f64, pub(super) goals: Vec<(Goal, Order)>, pub(super) rounds: usize, pub(super) tol: f64 }

pub(super) fn pack(items: &[PackItem<'_>], settings: &PackSettings, progress: &Progress) -> Result<Packed, PackError> {
    let plan = Plan { cell: 1.0, goals: vec![(Goal::Centre, Order::Area)], rounds: 8, tol: 0.003 };
    pack_plan(items, settings, &plan, progress)
}

pub(super) fn pack_plan(items: &[PackItem<'_>], settings: &PackSettings, plan: &Plan, progress: &Progress) -> Result<Packed, PackError> {
    let debug = std::env::var("PACKDBG").is_ok();
    let outlines: Vec<Outline> = items.par_iter().enumerate().map(|(i, item)| Outline::new(item, i)).collect::<Result<_, _>>()?;
    let n = outlines.len();
    let mut by_area: Vec<usize> = (0..n).collect();
    let area = |i: usize| outlines[i].area * outlines[i].unit().powi(2);
    by_area.sort_by(|&a, &b| area(b).total_cmp(&area(a)).then(a.cmp(&b)));
    let mut large = vec![false; n];
    by_area.iter().take(24).for_each(|&i| large[i] = true);
    let turns: Vec<_> = (0..n).into_par_iter().map(|i| base_turns(&outlines[i], settings.rotation, large[i], n == 1)).collect();
    let cell = plan.cell;
    let border = 0.5 * settings.margin_texels;
    let cols = ((f64::from(settings.width) - 2.0 * border) / cell).floor() as usize;
    let rows = ((f64::from(settings.height) - 2.0 * border) / cell).floor() as usize;
    let reach = Reach::new(settings.margin_texels / cell);
    let slope = rows as f64 / cols as f64;
    let cap = rows + rows / 2;
    let total: f64 = (0..n).map(area).sum();
    let full = f64::from(settings.width) * f64::from(settings.height);
    let mut density = (0.7 * full / total).sqrt();
    let mut low: Option<Attempt> = None;
    let mut high = f64::INFINITY;
    for round in 0..plan.rounds {
        let t0 = std::time::Instant::now();
        let shapes: Vec<Shape> = (0..n).into_par_iter().map(|i| Shape::new(&outlines[i], &turns[i], settings.rotation != Rotation::None, density, cell)).collect();
        let t1 = t0.elapsed();
        let results: Vec<Layout> = plan.goals.par_iter().map(|&(goal, order)| {
            let mut ids: Vec<usize> = (0..n).collect();
            let key = |i: usize| { let f = &shapes[i].footprints[0].mask; match order {
                Order::Area => shapes[i].cells, Order::Extent => f.width().max(f.height()), Order::Box => f.width()*f.height() } };
            ids.sort_by(|&a, &b| key(b).cmp(&key(a)).then(shapes[b].cells.cmp(&shapes[a].cells)).then(a.cmp(&b)));
            place(&shapes, &ids, cols, cap, slope, &reach, goal, progress)
        }).collect::<Result<_, _>>()?;
        let cells: usize = shapes.iter().map(|s| s.cells).sum();
        let used = |l: &Layout| if l.missing > 0 { cap as f64 / rows as f64 * cells as f64 / (cells - l.missing).max(1) as f64 } else { l.rows as f64 / rows as f64 };
        let all: Vec<f64> = results.iter().map(used).collect();
        let k = (0..all.len()).min_by(|&a, &b| all[a].total_cmp(&all[b])).unwrap_or(0);
        let u = all[k];
        if debug {
            eprintln!("round {round} density {density:.5} eff {:.4} -> {all:.3?} build {t1:?} place {:?}", total * density * density / full, t0.elapsed() - t1);
        }
        let layout = results.into_iter().nth(k).ok_or(PackError::Full)?;
        if u <= 1.0 {
            if low.as_ref().is_none_or(|l| l.density < density) { low = Some(Attempt { density, shapes, layout, used: u }); }
        } else { high = high.min(density); }
        let guess = density / u.sqrt();
        match &low {
            Some(l) if high.is_finite() => {
                if high / l.density < 1.0 + plan.tol { break; }
                let (a, b) = (l.density * (high / l.density).powf(0.2), l.density * (high / l.density).powf(0.7));
                density = guess.clamp(a, b);
            }
            Some(_) => density = guess * 1.003,
            None => density = guess * 0.997,
        }
    }
    let best = low.ok_or(PackError::Full)?;
    let poses: Vec<Pose> = (0..n).map(|i| { let at = best.layout.placed[i].ok_or(PackError::Full)?; Ok(best.shapes[i].footprints[at.footprint].pose(at.x, at.y, cell, border)) }).collect::<Result<_, PackError>>()?;
    let _ = best.used;
    Ok(Packed { poses, efficiency: total * best.density * best.density / full, texels_per_unit: best.density, specks: best.shapes.iter().filter(|s| s.is_speck).count(), size: [settings.width, settings.height] })
}

#[cfg(test)]
mod scratch {
    use super::*;
    use nalgebra::Point2;
    fn load(path: &str) -> Vec<(Vec<Point2<f64>>, Vec<[u32; 3]>)> {
        let text = std::fs::read_to_string(path).unwrap();
        let mut it = text.split_ascii_whitespace();
        let n: usize = it.next().unwrap().parse().unwrap();
        (0..n).map(|_| {
            let nv: usize = it.next().unwrap().parse().unwrap();
            let nt: usize = it.next().unwrap().parse().unwrap();
            let p = (0..nv).map(|_| Point2::new(it.next().unwrap().parse().unwrap(), it.next().unwrap().parse().unwrap())).collect();
            let t = (0..nt).map(|_| [0; 3].map(|_: u32| it.next().unwrap().parse().unwrap())).collect();
            (p, t)
        }).collect()
    }
    #[test]
    fn scratch_run() {
        let path = std::env::var("PACKIN").unwrap();
        let charts = load(&path);
        let items: Vec<PackItem> = charts.iter().map(|(p, t)| PackItem { points: p, triangles: t }).collect();
        let mut s = PackSettings::default();
        let get = |k: &str, d: f64| std::env::var(k).ok().map_or(d, |v| v.parse().unwrap());
        s.width = get("SIZE", 1024.0) as u32; s.height = s.width; s.margin_texels = get("MARGIN", 2.0);
        let goals = std::env::var("GOALS").unwrap_or("TA".into()).split(',').map(|g| {
            let b = g.as_bytes();
            (match b[0] { b'T' => Goal::Top, b'G' => Goal::Centre, b'M' => Goal::Mixed, _ => Goal::Corner }, match b[1] { b'A' => Order::Area, b'E' => Order::Extent, _ => Order::Box })
        }).collect();
        let plan = Plan { cell: get("CELL", 1.0), goals, rounds: get("ROUNDS", 8.0) as usize, tol: 0.003 };
        let t = std::time::Instant::now();
        let r = pack_plan(&items, &s, &plan, &Progress::new()).unwrap();
        eprintln!("{path} charts {} eff {:.4} specks {} time {:.3}", items.len(), r.efficiency, r.specks, t.elapsed().as_secs_f64());
        if let Ok(out) = std::env::var("PACKOUT") {
            let mut o = String::new();
            for (k, (p, t)) in charts.iter().enumerate() { for tri in t { o += &format!("{k}"); for &v in tri { let q = r.poses[k].texel(p[v as usize]); o += &format!(" {} {}", q.x / f64::from(s.width), q.y / f64::from(s.height)); } o += "\n"; } }
            std::fs::write(out, o).unwrap();
        }
    }
}
