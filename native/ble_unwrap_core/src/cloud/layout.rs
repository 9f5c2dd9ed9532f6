//! Charts and specks into the unit square.

use nalgebra::Point2;
use rayon::prelude::*;

use crate::packing::{self, PackItem, PackSettings};
use crate::progress::Progress;

use super::error::CloudError;
use super::footprint::Footprint;

/// Specks up to this number are packed like other charts; more are laid out in rows.
const FEW_SPECKS: usize = 64;
/// Share of the texture that charts are expected to cover, to tell which of them are specks.
const EXPECTED_FILL: f64 = 0.7;
/// A speck's place in texels, besides the margin: it is drawn half as large, in the middle.
const SPECK_TEXELS: f64 = 1.0;
/// How much of its place a speck fills, so that rounding to single precision keeps it within.
const SPECK_FILL: f64 = 0.9;

/// A chart in its own plane, with the points' half sides of splats.
pub(super) struct PlaneChart {
    pub(super) uv: Vec<Point2<f64>>,
    pub(super) half: Vec<f64>,
    /// Area of its surface.
    pub(super) area: f64,
}

impl PlaneChart {
    fn extent(&self) -> f64 {
        let start = (Point2::new(f64::INFINITY, f64::INFINITY), Point2::new(f64::NEG_INFINITY, f64::NEG_INFINITY));
        let (low, high) = self.uv.iter().fold(start, |(low, high), p| (low.inf(p), high.sup(p)));
        (high.x - low.x).max(high.y - low.y).max(0.0)
    }
}

/// The charts in the texture.
pub(super) struct Layout {
    /// A place in [0, 1]² for each point of each chart.
    pub(super) uv: Vec<Vec<[f32; 2]>>,
    /// Covered share of the texture, specks included.
    pub(super) efficiency: f64,
    /// Charts of less than a texel.
    pub(super) specks: usize,
}

/// Packs charts at one density, each splat at least the margin from those of other charts. Where there are many
/// charts of less than a texel they get rows of their own along one border: thousands cost no search and no more room
/// than they need.
pub(super) fn lay_out(
    charts: &[PlaneChart],
    settings: &PackSettings,
    progress: &Progress,
) -> Result<Layout, CloudError> {
    // The part of the texture that is packed is smaller, and would have other mip levels.
    let settings = &PackSettings { snap: false, ..settings.with_whole_margin() };
    let [width, height] = [settings.width, settings.height].map(f64::from);
    let total: f64 = charts.iter().map(|c| c.area).sum();
    let extents: Vec<f64> = charts.par_iter().map(PlaneChart::extent).collect();
    let density = (EXPECTED_FILL * width * height / total).sqrt();
    let is_speck = |i: usize| extents[i] <= 0.0 || density.is_finite() && extents[i] * density < SPECK_TEXELS;
    let mut specks: Vec<usize> = (0..charts.len()).filter(|&i| is_speck(i)).collect();
    if specks.len() <= FEW_SPECKS {
        specks.clear();
    }
    let rows = Rows::new(specks.len(), settings)?;
    let own: Vec<usize> = (0..charts.len()).filter(|i| specks.binary_search(i).is_err()).collect();
    let footprints: Vec<Footprint> = own.par_iter().map(|&i| Footprint::new(&charts[i].uv, &charts[i].half)).collect();
    let items: Vec<PackItem<'_>> =
        footprints.iter().map(|f| PackItem { points: &f.points, triangles: &f.triangles }).collect();
    // Clouds have one tile, at the density that fills it.
    let rest =
        PackSettings { height: settings.height - rows.height, tiles: 1, texel_density: None, ..settings.clone() };
    let packed = if items.is_empty() { None } else { Some(packing::pack(&items, &rest, progress)?) };
    let (poses, packed_share, packed_specks) =
        packed.as_ref().map_or((&[][..], 0.0, 0), |p| (&p.poses[..], p.efficiency, p.specks));
    let mut uv: Vec<Vec<[f32; 2]>> = vec![Vec::new(); charts.len()];
    let single =
        |texel: Point2<f64>| [(texel.x / width).clamp(0.0, 1.0) as f32, (texel.y / height).clamp(0.0, 1.0) as f32];
    for (&i, pose) in own.iter().zip(poses) {
        let place = |p: &Point2<f64>| {
            let texel = pose.texel(*p);
            single(Point2::new(texel.x, texel.y + f64::from(rows.height)))
        };
        uv[i] = charts[i].uv.iter().map(place).collect();
    }
    for (place, &i) in specks.iter().enumerate() {
        let (centre, scale) = (rows.centre(place), SPECK_FILL * SPECK_TEXELS / extents[i]);
        let middle = middle(&charts[i].uv);
        let at = |p: &Point2<f64>| {
            single(centre + if extents[i] > 0.0 { (p - middle) * scale } else { nalgebra::Vector2::zeros() })
        };
        uv[i] = charts[i].uv.iter().map(at).collect();
    }
    let share = f64::from(settings.height - rows.height) / height;
    let covered = specks.len() as f64 * SPECK_TEXELS * SPECK_TEXELS / (width * height);
    let efficiency = (packed_share * share + covered).min(1.0);
    Ok(Layout { uv, efficiency, specks: specks.len() + packed_specks })
}

fn middle(uv: &[Point2<f64>]) -> Point2<f64> {
    let start = (Point2::new(f64::INFINITY, f64::INFINITY), Point2::new(f64::NEG_INFINITY, f64::NEG_INFINITY));
    let (low, high) = uv.iter().fold(start, |(low, high), p| (low.inf(p), high.sup(p)));
    nalgebra::center(&low, &high)
}

/// Rows of equal places along the lower border.
struct Rows {
    columns: usize,
    pitch: f64,
    border: f64,
    /// Texels they take, to the next whole one.
    height: u32,
}

impl Rows {
    fn new(specks: usize, settings: &PackSettings) -> Result<Self, CloudError> {
        let margin = settings.margin_texels;
        let (pitch, border) = (SPECK_TEXELS + margin, 0.5 * margin);
        if specks == 0 {
            return Ok(Self { columns: 1, pitch, border, height: 0 });
        }
        // Half a margin on either side of a place is one between two and half a margin to the border.
        let columns = (f64::from(settings.width) / pitch).floor();
        let height = ((specks as f64 / columns).ceil() * pitch).ceil();
        if columns >= 1.0 && height <= f64::from(settings.height) {
            return Ok(Self { columns: columns as usize, pitch, border, height: height as u32 });
        }
        let PackSettings { width, height, .. } = *settings;
        Err(CloudError::TooManySpecks { specks, margin, width, height })
    }

    fn centre(&self, place: usize) -> Point2<f64> {
        let (column, row) = ((place % self.columns) as f64, (place / self.columns) as f64);
        let at = |k: f64| self.border + 0.5 * SPECK_TEXELS + k * self.pitch;
        Point2::new(at(column), at(row))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn speck(at: f64, points: usize) -> PlaneChart {
        let uv = (0..points).map(|i| Point2::new(at, at + 1e-9 * i as f64)).collect();
        PlaneChart { uv, half: vec![0.0; points], area: 0.0 }
    }

    fn sheet() -> PlaneChart {
        let uv: Vec<_> = (0..900).map(|i| Point2::new(f64::from(i % 30), f64::from(i / 30))).collect();
        PlaneChart { half: vec![1.0; uv.len()], uv, area: 900.0 }
    }

    fn texels(layout: &Layout, side: f64) -> Vec<Vec<Point2<f64>>> {
        let texel = |p: &[f32; 2]| Point2::new(f64::from(p[0]) * side, f64::from(p[1]) * side);
        layout.uv.iter().map(|c| c.iter().map(texel).collect()).collect()
    }

    #[test]
    fn specks_in_rows_keep_the_margin() {
        for (margin, with_sheet) in [(4.0, true), (4.0, false), (0.0, true), (2.5, true)] {
            let mut charts: Vec<_> =
                (0..500).map(|i| speck(f64::from(i), if with_sheet { 1 + i as usize % 3 } else { 1 })).collect();
            charts.extend(with_sheet.then(sheet));
            let settings = PackSettings { margin_texels: margin, width: 256, height: 256, ..PackSettings::default() };
            let layout = lay_out(&charts, &settings, &Progress::new()).expect("they fit");
            assert_eq!(layout.specks, 500);
            let places = texels(&layout, 256.0);
            for (i, a) in places.iter().enumerate() {
                let inside = |x: f64| x >= 0.5 * margin - 1e-3 && x <= 256.0 - 0.5 * margin + 1e-3;
                assert!(a.iter().all(|p| inside(p.x) && inside(p.y)), "{i}");
                for b in &places[..i] {
                    let gap =
                        a.iter().flat_map(|p| b.iter().map(move |q| (p - q).norm())).fold(f64::INFINITY, f64::min);
                    assert!(gap >= margin - 1e-3, "{gap} of {margin}");
                }
            }
        }
    }

    #[test]
    fn too_many_specks_are_refused_with_the_remedy() {
        let charts: Vec<_> = (0..500).map(|i| speck(f64::from(i), 1)).collect();
        let settings = PackSettings { margin_texels: 8.0, width: 64, height: 64, ..PackSettings::default() };
        let text = lay_out(&charts, &settings, &Progress::new()).err().expect("no room").to_string();
        assert!(text.contains("500 stray points") && text.contains("larger texture"), "{text}");
    }

    #[test]
    fn few_specks_are_packed_and_nothing_is_nothing() {
        let settings = PackSettings { width: 256, height: 256, ..PackSettings::default() };
        let layout = lay_out(&[speck(0.0, 1), sheet()], &settings, &Progress::new()).expect("they fit");
        let places = texels(&layout, 256.0);
        let gap = places[1].iter().map(|p| (p - places[0][0]).norm()).fold(f64::INFINITY, f64::min);
        assert!(gap >= 4.0);
        assert!(lay_out(&[], &settings, &Progress::new()).expect("nothing to do").uv.is_empty());
    }
}
