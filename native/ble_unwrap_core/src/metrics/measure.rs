//! The figures of a layout.
//!
//! Sander, Snyder, Gortler, Hoppe: Texture mapping progressive meshes, SIGGRAPH 2001, section 3, for
//! the stretch; definitions otherwise as in the project's independent evaluator.

use std::collections::BTreeMap;

use nalgebra::Point3;
use rayon::prelude::*;

use crate::memory;
use crate::packing::Tile;
use crate::progress::{Cancelled, Progress};

use super::gap::{GAP_SEARCH_TEXELS, OwnedSegment, least_gap};
use super::overlap::{Belonging, overlaps};
use super::uv_mesh::UvMesh;
use super::uv_topology::{NONE, UvTopology};

/// A triangle is degenerate when its height over its longest edge is at most this share of the
/// bounding box diagonal (on the surface) or of the larger extent (in UV): float32 coordinates
/// resolve no less.
pub(crate) const DEGENERATE: f64 = 1e-7;
/// Share of the layout's box that two triangles must have in common to count as an overlap.
const OVERLAP_SHARE: f64 = 1e-9;
/// Charts with less than this share of the surface do not compete for the worst stretch, unless even the largest is so small.
const SPECK: f64 = 1e-4;
/// Where even the largest chart is a [`SPECK`], charts with at least this share of its area compete for the worst stretch.
const SPECK_AMONG_SMALL: f64 = 1e-2;
/// What a triangle takes at the peak, in bytes: 700 were measured where each is a chart of its own, 340 in one chart.
const OF_TRIANGLE: u64 = 1024;
/// How far outside the unit square coordinates may lie before the layout counts as out of range.
const RANGE_SLACK: f64 = 1e-5;

/// The measures of one chart.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct ChartMeasures {
    /// The triangle of the chart that has the lowest number.
    pub first_triangle: usize,
    /// The label that was given for that triangle.
    pub label: i32,
    /// Number of triangles.
    pub faces: usize,
    /// Area of the chart on the surface, divided by the area of all measured triangles.
    pub area_share: f64,
    /// L2 stretch at the chart's best scale; NaN where nothing could be measured.
    pub l2: f64,
}

/// The measures of a layout.
///
/// Distortions are means over the *measured* triangles, weighted by area on the surface; they are NaN if there are no such
/// triangles. A triangle is measured if its UVs are finite and it is degenerate neither on the surface nor in UV. A flipped
/// triangle counts with the absolute value of its area.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Measures {
    /// Number of charts: sets of triangles that are connected over edges in UV.
    pub charts: usize,
    /// Number of islands: sets of charts that are connected over vertices in UV. Gaps, and `overlaps_between`, are between
    /// islands.
    pub islands: usize,
    /// Number of triangles.
    pub faces: usize,
    /// Number of triangles that do not have a finite UV at each corner.
    pub unmapped_faces: usize,
    /// Number of those `unmapped_faces` whose label says that they have UVs, although a UV is NaN or infinite.
    pub nonfinite_faces: usize,
    /// Number of triangles that are degenerate on the surface, or have a vertex that is not finite.
    pub degenerate_faces: usize,
    /// Number of triangles that are degenerate in UV but not on the surface. Their stretch is infinite, and is left out.
    pub uv_degenerate_faces: usize,
    /// L2 stretch at the best scale of the whole layout; at least 1.
    pub l2: f64,
    /// L2 stretch with every chart at its own best scale.
    pub l2_chart_scale: f64,
    /// L2 stretch of the worst chart at its best scale. Charts with less than 1e-4 of the surface are left out; if even the
    /// largest chart has less than a hundredth of the surface, those with less than a hundredth of its area are left out
    /// instead.
    pub l2_worst_chart: f64,
    /// Label of the triangle with the lowest number in the worst chart.
    pub worst_chart: Option<i32>,
    /// L-infinity stretch: the largest singular value of the map from UV to the surface, over all triangles, at the
    /// layout's scale.
    pub l_infinity: f64,
    /// Mean of ½(σ₁/σ₂ + σ₂/σ₁), where σ₁ and σ₂ are the singular values of a triangle's map; 1 means conformal.
    pub angle_distortion: f64,
    /// Mean of ½(ρ + 1/ρ), where ρ is the ratio of a triangle's areas on the surface and in UV at the layout's scale; 1
    /// means that areas are kept.
    pub area_distortion: f64,
    /// Number of triangles whose orientation in UV differs from that of most of their chart (by area on the surface), once
    /// the triangles of the chart have been oriented consistently on the surface.
    pub flips: usize,
    /// Number of pairs of triangles that share more than 1e-9 of the area of the layout's bounding box. Pairs of
    /// different charts of one stack are not counted, and of triangles of one stack that are the same one stands for
    /// all.
    pub overlaps: u64,
    /// Number of those pairs whose triangles are in different islands.
    pub overlaps_between: u64,
    /// False if there were too many overlaps to count (millions). The two numbers above are then lower bounds.
    pub overlaps_complete: bool,
    /// Length of the seams, divided by the square root of the surface area. The boundary of the mesh itself does not count.
    pub seam_length: f64,
    /// Length of the seams in the unit of the mesh.
    pub seam_length_absolute: f64,
    /// Number of tiles in which triangles lie; 0 if one lies in none of those that there are.
    pub tiles: usize,
    /// Share of the tiles in which triangles lie, or of the unit square if there is only one tile, that is covered; for
    /// a layout outside of all tiles, share of its bounding square. A stack covers what its largest chart does. Area
    /// that a pair of triangles covers twice is subtracted once for each pair, so the value means nothing if
    /// `overlaps_complete` is false.
    pub packing_efficiency: f64,
    /// Least distance in texels between two islands that are not of one stack; 0 if boundaries cross. A distance above
    /// eight texels and above twice the margin is given as the larger of these two values.
    pub gap_texels: f64,
    /// False if there was too much to search. The gap is then an upper bound.
    pub gap_complete: bool,
    /// Least and greatest coordinate along u, then along v; NaN if there are no UVs.
    pub uv_box: [[f64; 2]; 2],
    /// The measures of each chart. Charts are in the order of their `first_triangle`.
    pub per_chart: Vec<ChartMeasures>,
}

/// What was found of each triangle of a layout.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct TriangleMeasures {
    /// Chart, numbered by lowest triangle; [`NONE`] without UV.
    pub(crate) chart: Vec<u32>,
    /// Whether it is one of [`Measures::flips`].
    pub(crate) flipped: Vec<bool>,
    /// Whether it is in a pair of [`Measures::overlaps`].
    pub(crate) overlapping: Vec<bool>,
    /// Whether it is one of [`Measures::uv_degenerate_faces`].
    pub(crate) collapsed: Vec<bool>,
}

/// Measures a layout: [`measure_each`] without what it finds of each triangle.
///
/// # Errors
/// [`Cancelled`].
pub(crate) fn measure(mesh: &UvMesh, progress: &Progress) -> Result<Measures, Cancelled> {
    Ok(measure_each(mesh, progress)?.0)
}

/// Measures a layout, as a whole and triangle by triangle.
///
/// UVs are taken in the proportions of the texture, so a layout for a 2:1 texture that shows no
/// distortion on the surface has none here either. A UV unit is `width`×`height` texels even where the
/// layout leaves the unit square.
///
/// Guaranteed: no number in `mesh` makes it panic, and the result does not depend on the number of
/// threads. Not guaranteed: exactness. Overlaps below the threshold go unseen; [`verify`](crate::verify::verify())
/// is exact. O(n log n); about two seconds for a million triangles on two cores.
///
/// # Errors
/// [`Cancelled`].
pub(crate) fn measure_each(mesh: &UvMesh, progress: &Progress) -> Result<(Measures, TriangleMeasures), Cancelled> {
    let m = mesh.triangle_count();
    memory::require((m as u64).saturating_mul(OF_TRIANGLE)).map_err(Cancelled::OutOfMemory)?;
    let (positions, unit) = unit_positions(mesh);
    progress.check()?;
    let topology = UvTopology::new(mesh, &positions);
    progress.check()?;

    let aspect = mesh.texture().aspect();
    let mut uv_box = [[f64::NAN; 2]; 2];
    let mut uv: Vec<[[f64; 2]; 3]> = (0..m)
        .into_par_iter()
        .map(|f| match mesh.corner_uv(f) {
            Some(uv) if topology.chart[f] != NONE => uv.map(|p| [0, 1].map(|k| f64::from(p[k]) * aspect[k])),
            _ => [[f64::NAN; 2]; 3],
        })
        .collect();
    for p in uv.iter().flatten() {
        // `min` and `max` prefer numbers to NaN.
        uv_box =
            [[0, 1].map(|k| uv_box[0][k].min(p[k] / aspect[k])), [0, 1].map(|k| uv_box[1][k].max(p[k] / aspect[k]))];
    }
    let extent = [0, 1].map(|k| (uv_box[1][k] - uv_box[0][k]) * aspect[k]);
    let longest_extent = extent[0].max(extent[1]);
    let faces: Vec<FaceMeasures> = (0..m)
        .into_par_iter()
        .map(|f| FaceMeasures::new(mesh.triangles()[f].map(|v| positions[v as usize]), uv[f], longest_extent))
        .collect();
    progress.check()?;

    let surface: f64 = faces.iter().map(|f| f.area).sum();
    let flipped = flips(&faces, &topology);
    let collapsed: Vec<bool> = faces.iter().map(|f| !f.degenerate && f.uv_degenerate).collect();
    let mut out = Measures {
        charts: topology.chart_count,
        islands: topology.island_count,
        faces: m,
        unmapped_faces: topology.chart.iter().filter(|&&c| c == NONE).count(),
        nonfinite_faces: topology.nonfinite,
        degenerate_faces: faces.iter().filter(|f| f.degenerate).count(),
        uv_degenerate_faces: collapsed.iter().filter(|collapsed| **collapsed).count(),
        l2: f64::NAN,
        l2_chart_scale: f64::NAN,
        l2_worst_chart: f64::NAN,
        worst_chart: None,
        l_infinity: f64::NAN,
        angle_distortion: f64::NAN,
        area_distortion: f64::NAN,
        flips: flipped.iter().filter(|flipped| **flipped).count(),
        overlaps: 0,
        overlaps_between: 0,
        overlaps_complete: true,
        seam_length: topology.seam_length / surface.sqrt(),
        seam_length_absolute: topology.seam_length * unit,
        tiles: 0,
        packing_efficiency: 0.0,
        gap_texels: 0.0,
        gap_complete: true,
        uv_box,
        per_chart: Vec::new(),
    };
    stretch(&mut out, mesh, &faces, &topology);

    let texels = mesh.texture().texels();
    let stack = |f: usize| mesh.stack(mesh.label(f)).map(i32::unsigned_abs);
    // A stack is one owner, beyond all islands: no more than 2³⁰ of these, and 2³¹ stacks.
    let owner = |f: usize| stack(f).map_or(topology.island[f], |stack| topology.island_count as u32 + stack);
    let segment = |&h: &u32| {
        let (f, k) = (h as usize / 3, h as usize % 3);
        let ends = [uv[f][k], uv[f][(k + 1) % 3]].map(|p| [0, 1].map(|k| p[k] / aspect[k] * texels[k]));
        OwnedSegment { ends, owner: owner(f) }
    };
    let segments: Vec<OwnedSegment> = topology.boundary.iter().map(segment).collect();
    let limit = GAP_SEARCH_TEXELS.max(2.0 * mesh.texture().margin);
    (out.gap_texels, out.gap_complete) = least_gap(&segments, limit, progress)?;

    let uv_area = covered_once(mesh, &faces, &topology);
    let tiles = tiles_used(&uv, aspect, mesh.texture().tiles);
    // The search for overlaps takes most memory: nothing else should be held then.
    drop((positions, faces, segments));
    let layout_box = extent[0].max(1e-30) * extent[1].max(1e-30);
    for f in repeated(mesh, &uv, &topology) {
        uv[f] = [[f64::NAN; 2]; 3];
    }
    let of: Vec<Belonging> =
        (0..m).map(|f| Belonging { group: topology.island[f], stack: stack(f).unwrap_or(NONE) }).collect();
    let (common, overlapping) = overlaps(&uv, &of, OVERLAP_SHARE * layout_box, progress)?;
    out.overlaps = common.pairs;
    out.overlaps_between = common.between;
    out.overlaps_complete = common.complete;

    let covered = (uv_area - common.area).max(0.0);
    out.tiles = tiles.unwrap_or(0);
    let whole = match tiles {
        Some(used) => aspect[0] * aspect[1] * used.max(1) as f64,
        None => longest_extent.max(1e-30).powi(2),
    };
    out.packing_efficiency = if common.complete { covered / whole } else { (covered / whole).min(1.0) };
    Ok((out, TriangleMeasures { chart: topology.chart, flipped, overlapping, collapsed }))
}

/// The area of all triangles in UV, in which a stack counts once, as its largest chart.
fn covered_once(mesh: &UvMesh, faces: &[FaceMeasures], topology: &UvTopology) -> f64 {
    let (mut alone, mut stacked) = (0.0, BTreeMap::<(i32, i32), f64>::new());
    for f in (0..faces.len()).filter(|&f| topology.chart[f] != NONE) {
        let label = mesh.label(f);
        let sum = match mesh.stack(label) {
            Some(stack) => stacked.entry((stack, label)).or_default(),
            None => &mut alone,
        };
        *sum += faces[f].uv_double_area.abs();
    }
    let mut largest = BTreeMap::<i32, f64>::new();
    for ((stack, _), area) in stacked {
        let most = largest.entry(stack).or_default();
        *most = most.max(area);
    }
    (alone + largest.values().sum::<f64>()) * 0.5
}

/// Triangles that are the same in UV as one of another island of their stack with a lower number: hundreds of copies of
/// a triangle would be tens of thousands of pairs.
fn repeated(mesh: &UvMesh, uv: &[[[f64; 2]; 3]], topology: &UvTopology) -> Vec<usize> {
    let stacked = |f: usize| {
        let stack = mesh.stack(mesh.label(f)).filter(|_| topology.chart[f] != NONE)?;
        let mut corners = uv[f].map(|p| p.map(f64::to_bits));
        corners.sort_unstable();
        Some((stack, corners, topology.island[f], f))
    };
    let mut all: Vec<_> = (0..uv.len()).filter_map(stacked).collect();
    all.sort_unstable();
    let same = all.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1));
    same.flat_map(|same| same.iter().filter(|other| other.2 != same[0].2).map(|other| other.3)).collect()
}

/// Number of tiles in which triangles lie, `None` if one lies in none of the first `count`. A triangle is in the tile that its centre is in, and
/// must not reach beyond; triangles without a UV are NaN. UVs have the proportions of the texture.
fn tiles_used(uv: &[[[f64; 2]; 3]], aspect: [f64; 2], count: usize) -> Option<usize> {
    let mut is_used = vec![false; count.max(1)];
    for corners in uv.iter().filter(|corners| !corners[0][0].is_nan()) {
        let corners = corners.map(|p| [0, 1].map(|k| p[k] / aspect[k]));
        let tile = Tile::near([0, 1].map(|k| corners.iter().map(|p| p[k]).sum::<f64>() / 3.0), count);
        if !corners.iter().all(|&p| tile.holds(p, RANGE_SLACK)) {
            return None;
        }
        is_used[tile.number()] = true;
    }
    Some(is_used.iter().filter(|used| **used).count())
}

/// What one triangle contributes.
#[derive(Clone, Copy, Debug, PartialEq)]
struct FaceMeasures {
    /// Area on the surface; 0 if it is not finite.
    area: f64,
    degenerate: bool,
    /// Twice the signed area in UV; 0 without UV.
    uv_double_area: f64,
    /// False without UV.
    uv_degenerate: bool,
    mapped: bool,
    /// Singular values of the UV→surface map, larger first, and its squared Frobenius norm.
    singular: [f64; 2],
    squared_norm: f64,
}

impl FaceMeasures {
    /// `p` in units of the bounding box diagonal, `uv` NaN where there is none.
    fn new(p: [Point3<f64>; 3], uv: [[f64; 2]; 3], extent: f64) -> Self {
        let (e1, e2) = (p[1] - p[0], p[2] - p[0]);
        let double_area = e1.cross(&e2).norm();
        let longest = e1.norm().max(e2.norm()).max((p[2] - p[1]).norm());
        // NaN is degenerate.
        let solid = double_area > DEGENERATE * longest;
        let sub = |a: [f64; 2], b: [f64; 2]| [a[0] - b[0], a[1] - b[1]];
        let (d1, d2, d3) = (sub(uv[1], uv[0]), sub(uv[2], uv[0]), sub(uv[2], uv[1]));
        let det = d1[0] * d2[1] - d1[1] * d2[0];
        let mapped = !det.is_nan();
        let uv_longest = d1[0].hypot(d1[1]).max(d2[0].hypot(d2[1])).max(d3[0].hypot(d3[1]));
        let uv_solid = det.abs() > DEGENERATE * extent * uv_longest;
        let su = (e1 * d2[1] - e2 * d1[1]) / det;
        let sv = (e2 * d1[0] - e1 * d2[0]) / det;
        let (a, b, c) = (su.norm_squared(), su.dot(&sv), sv.norm_squared());
        let larger = (0.5 * ((a + c) + (a - c).hypot(2.0 * b))).sqrt();
        // From the area ratio, which is stable where the small singular value is tiny.
        let smaller = double_area / det.abs() / larger;
        Self {
            area: if double_area.is_finite() { 0.5 * double_area } else { 0.0 },
            degenerate: !solid,
            uv_double_area: if mapped { det } else { 0.0 },
            uv_degenerate: mapped && !uv_solid,
            mapped,
            singular: [larger, smaller],
            squared_norm: a + c,
        }
    }

    fn measured(&self) -> bool {
        self.mapped && !self.degenerate && !self.uv_degenerate
    }
}

/// The positions moved and scaled so that the box of the used vertices has diagonal 1, and the factor
/// back. Keeps every square in range for coordinates up to 1e300.
fn unit_positions(mesh: &UvMesh) -> (Vec<Point3<f64>>, f64) {
    let positions = mesh.positions();
    let mut used = vec![false; positions.len()];
    for &v in mesh.triangles().iter().flatten() {
        used[v as usize] = true;
    }
    let mut lo = Point3::from([f64::INFINITY; 3]);
    let mut hi = Point3::from([f64::NEG_INFINITY; 3]);
    for p in positions.iter().zip(&used).filter(|(p, u)| **u && p.iter().all(|x| x.is_finite())).map(|(p, _)| p) {
        lo = lo.inf(p);
        hi = hi.sup(p);
    }
    // Halved first: the difference of two finite numbers may overflow.
    let half = hi.coords * 0.5 - lo.coords * 0.5;
    let middle = hi.coords * 0.5 + lo.coords * 0.5;
    let largest = half.amax();
    if !(largest > 0.0 && largest.is_finite()) {
        return (positions.to_vec(), 1.0);
    }
    let diagonal = 2.0 * (half / largest).norm();
    let moved = positions.par_iter().map(|p| Point3::from((p.coords - middle) / largest / diagonal)).collect();
    (moved, diagonal * largest)
}

/// Which triangles are oriented against the majority of their chart.
fn flips(faces: &[FaceMeasures], topology: &UvTopology) -> Vec<bool> {
    let sign = |f: usize| {
        if topology.against[f] { -faces[f].uv_double_area.signum() } else { faces[f].uv_double_area.signum() }
    };
    let mut vote = vec![0.0; topology.chart_count];
    for f in (0..faces.len()).filter(|&f| faces[f].measured()) {
        vote[topology.chart[f] as usize] += sign(f) * faces[f].area;
    }
    (0..faces.len())
        .map(|f| faces[f].measured() && (sign(f) > 0.0) != (vote[topology.chart[f] as usize] >= 0.0))
        .collect()
}

/// Fills in the figures that are means over measured triangles.
fn stretch(out: &mut Measures, mesh: &UvMesh, faces: &[FaceMeasures], topology: &UvTopology) {
    #[derive(Clone, Copy)]
    struct Sums {
        first: usize,
        faces: usize,
        energy: f64,
        area: f64,
        uv_area: f64,
    }
    let empty = Sums { first: usize::MAX, faces: 0, energy: 0.0, area: 0.0, uv_area: 0.0 };
    let mut chart = vec![empty; topology.chart_count];
    let mut all = empty;
    let (mut largest, mut angle) = (0.0f64, 0.0);
    for (f, face) in faces.iter().enumerate().filter(|(_, face)| face.mapped) {
        let c = &mut chart[topology.chart[f] as usize];
        c.first = c.first.min(f);
        c.faces += 1;
        if !face.measured() {
            continue;
        }
        let [s1, s2] = face.singular;
        for s in [c, &mut all] {
            s.energy += 0.5 * face.squared_norm * face.area;
            s.area += face.area;
            s.uv_area += 0.5 * face.uv_double_area.abs();
        }
        largest = largest.max(s1);
        angle += 0.5 * (s1 / s2 + s2 / s1) * face.area;
    }
    let l2 = |s: &Sums| (s.energy / s.area * (s.uv_area / s.area)).sqrt();
    out.per_chart = chart
        .iter()
        .map(|s| ChartMeasures {
            first_triangle: s.first,
            label: mesh.label(s.first),
            faces: s.faces,
            area_share: if all.area > 0.0 { s.area / all.area } else { 0.0 },
            l2: l2(s),
        })
        .collect();
    if all.area == 0.0 {
        return;
    }
    let density = all.uv_area / all.area;
    out.l2 = l2(&all);
    out.l2_chart_scale = chart.iter().map(|s| (s.energy * s.uv_area).sqrt()).sum::<f64>() / all.area;
    let largest_chart = out.per_chart.iter().map(|c| c.area_share).fold(0.0, f64::max);
    let speck = SPECK.min(SPECK_AMONG_SMALL * largest_chart);
    for c in out.per_chart.iter().filter(|c| c.area_share > speck) {
        if out.l2_worst_chart.is_nan() || c.l2 > out.l2_worst_chart {
            out.l2_worst_chart = c.l2;
            out.worst_chart = Some(c.label);
        }
    }
    out.l_infinity = largest * density.sqrt();
    out.angle_distortion = angle / all.area;
    let area: f64 = faces
        .iter()
        .filter(|f| f.measured())
        .map(|f| {
            let ratio = 0.5 * f.uv_double_area.abs() / f.area / density;
            0.5 * (ratio + 1.0 / ratio) * f.area
        })
        .sum();
    out.area_distortion = area / all.area;
}

#[cfg(test)]
mod tests;
