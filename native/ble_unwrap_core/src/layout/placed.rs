//! Charts packed into the texture and rounded to single precision.

use std::collections::BTreeSet;

use nalgebra::Point2;

use crate::charts::Chart;
use crate::error::UnwrapError;
use crate::flattening::NEGLIGIBLE;
use crate::mesh::{FaceId, MeshInput, Surface, VertexId};
use crate::packing::{self, PackItem, PackSettings, Packed, Rotation, Shortfall};
use crate::progress::Progress;
use crate::rounding::{self, Rounding, RoundingError};
use crate::settings::Settings;
use crate::stretch;

use super::quads;
use super::stacks::{Lying, Stacks};
use super::upright;

/// Charts packed and rounded.
#[derive(Default)]
pub(super) struct Placed {
    pub(super) uv: Vec<[f32; 2]>,
    pub(super) face_chart: Vec<i32>,
    pub(super) polygon_chart: Vec<i32>,
    /// The stack of each chart, −1 for those that lie alone.
    pub(super) stack: Vec<i32>,
    /// Charts of which the UVs of the chart that they lie on turn faces over, once rounded.
    pub(super) unstackable: Vec<usize>,
    /// Faces (of the surface) that rounding turned over, with their chart.
    pub(super) broken: Vec<(usize, FaceId)>,
    pub(super) specks: usize,
    pub(super) texels_per_unit: f64,
    pub(super) shortfall: Option<Shortfall>,
    /// The margin that was kept, in texels.
    pub(super) margin: f64,
    /// Number of charts laid on whole texels.
    pub(super) snapped: usize,
}

impl Placed {
    pub(super) fn new(
        input: &MeshInput<'_>,
        surface: &Surface,
        charts: &[Chart],
        stacks: &Stacks,
        packing: &PackSettings,
        settings: &Settings,
        progress: &Progress,
    ) -> Result<Self, UnwrapError> {
        let limit = settings.chart_limit();
        let own_place: Vec<usize> = (0..charts.len()).filter(|&number| stacks.lying[number].is_none()).collect();
        let alone: Vec<&Chart> = own_place.iter().map(|&number| &charts[number]).collect();
        let mut packed = pack(&alone, surface.scale, packing, progress)?;
        if packing.rotation != Rotation::None {
            packed.quarter_turns = upright::quarter_turns(input, surface, &alone, &packed, settings.front);
        }
        let size = packed.size.map(f64::from);
        let mut layout = Self {
            uv: vec![[0.0; 2]; input.corner_vertices.len()],
            face_chart: vec![-1; surface.mesh.face_count()],
            polygon_chart: vec![-1; input.face_offsets.len().saturating_sub(1)],
            stack: stacks.numbers(),
            unstackable: Vec::new(),
            broken: Vec::new(),
            specks: packed.specks,
            texels_per_unit: packed.texels_per_unit,
            shortfall: packed.shortfall,
            margin: packed.margin,
            snapped: 0,
        };
        // What others lie on.
        let mut rounded: Vec<Option<Vec<[f32; 2]>>> = vec![None; charts.len()];
        for (item, &number) in own_place.iter().enumerate() {
            progress.check()?;
            let chart = &charts[number];
            let mut exact = packed.uvs(item, &chart.uv);
            let lying = || charts.iter().zip(&stacks.lying).filter_map(|(c, lying)| Some((c, lying.as_ref()?)));
            let exceeds_here = |(chart, lying): (&Chart, &Lying)| {
                let there = || lying.vertex.iter().map(|v| exact[v.index()]).collect::<Vec<_>>();
                lying.on == number && exceeds(chart, &there(), size, limit)
            };
            if packed.is_snapped(item) && (exceeds(chart, &exact, size, limit) || lying().any(exceeds_here)) {
                packed.unsnap(item);
                exact = packed.uvs(item, &chart.uv);
            }
            layout.snapped += usize::from(packed.is_snapped(item));
            let texel = size.map(|s| 1.0 / s);
            let rounding = Rounding { texel, corner: packed.tiles[item].corner(), diagonal: surface.diagonal };
            let halves = quads::convex_halves(chart);
            let uv = match rounding::round_to_f32(&chart.patch.mesh, &halves, &exact, &rounding, progress) {
                Ok(rounded) => rounded.uv,
                Err(RoundingError::Cancelled(cancelled)) => return Err(cancelled.into()),
                Err(RoundingError::Unmendable(unmendable)) => {
                    let faces = unmendable.faces.iter().map(|f| (number, chart.patch.faces[f.index()]));
                    layout.broken.extend(faces);
                    unmendable.uv
                }
            };
            layout.write(surface, number, chart, &uv);
            if layout.stack[number] >= 0 {
                rounded[number] = Some(uv);
            }
        }
        let broken: BTreeSet<usize> = layout.broken.iter().map(|broken| broken.0).collect();
        for (number, (chart, lying)) in charts.iter().zip(&stacks.lying).enumerate() {
            let Some(lying) = lying else { continue };
            progress.check()?;
            let below = rounded[lying.on].as_deref().unwrap_or_default();
            let uv: Vec<[f32; 2]> = lying.vertex.iter().map(|v| below[v.index()]).collect();
            layout.write(surface, number, chart, &uv);
            let turned = rounding::turned_faces(&chart.patch.mesh, &uv, lying.is_mirrored);
            if broken.contains(&lying.on) {
                layout.broken.extend(turned.into_iter().map(|f| (number, chart.patch.faces[f.index()])));
            } else if !turned.is_empty() {
                layout.unstackable.push(number);
            }
        }
        for &[corner, with] in &surface.followers {
            layout.uv[corner as usize] = layout.uv[with as usize];
        }
        for &[polygon, with] in &surface.absorbed {
            layout.polygon_chart[polygon as usize] = layout.polygon_chart[with as usize];
        }
        Ok(layout)
    }

    /// Writes the UVs of a chart, one for each of its vertices.
    fn write(&mut self, surface: &Surface, number: usize, chart: &Chart, uv: &[[f32; 2]]) {
        let label = i32::try_from(number).unwrap_or(i32::MAX);
        for (local, &face) in chart.patch.mesh.faces().zip(&chart.patch.faces) {
            self.face_chart[face.index()] = label;
            self.polygon_chart[surface.input_polygon(face)] = label;
            for (vertex, h) in chart.patch.mesh.triangle(local).iter().zip(face.halfedges()) {
                self.uv[surface.corner[h.index()] as usize] = uv[vertex.index()];
            }
        }
    }
}

/// Whether a chart that keeps the stretch limit as it was flattened exceeds it as it lies in a texture of the given
/// size.
fn exceeds(chart: &Chart, uv: &[Point2<f64>], size: [f64; 2], limit: f64) -> bool {
    let texels: Vec<Point2<f64>> = uv.iter().map(|p| Point2::new(p.x * size[0], p.y * size[1])).collect();
    let l2 = stretch::l2_of_positions(&chart.patch.mesh, &texels, NEGLIGIBLE);
    // What rounding to single precision adds is far below a millionth.
    chart.l2 <= limit && l2 > limit * (1.0 - 1e-6)
}

/// The triangles of each chart, as packing takes them.
pub(super) fn triangles(charts: &[&Chart]) -> Vec<Vec<[u32; 3]>> {
    let index = |v: VertexId| u32::try_from(v.index()).unwrap_or(u32::MAX);
    charts.iter().map(|c| c.patch.mesh.triangles().iter().map(|t| t.map(index)).collect()).collect()
}

/// What is to be packed, of charts and their [`triangles`].
pub(super) fn items<'a>(charts: &[&'a Chart], triangles: &'a [Vec<[u32; 3]>]) -> Vec<PackItem<'a>> {
    charts.iter().zip(triangles).map(|(c, t)| PackItem { points: &c.uv, triangles: t }).collect()
}

/// Packs charts whose unit is `unit` units of the input, in which densities are given and told.
fn pack(charts: &[&Chart], unit: f64, packing: &PackSettings, progress: &Progress) -> Result<Packed, UnwrapError> {
    let triangles = triangles(charts);
    let items = items(charts, &triangles);
    // A surface has unit area, so that what is out of range here fits into no texture, or is specks in any.
    let in_unit = |density: f64| (density * unit).clamp(f64::MIN_POSITIVE, PackSettings::GREATEST_DENSITY);
    let scaled = PackSettings { texel_density: packing.texel_density.map(in_unit), ..packing.clone() };
    let mut packed = packing::pack(&items, &scaled, progress)?;
    let told =
        |s: Shortfall| Shortfall { wanted: packing.texel_density.unwrap_or(s.wanted), reached: s.reached / unit, ..s };
    packed.texels_per_unit /= unit;
    packed.shortfall = packed.shortfall.map(told);
    Ok(packed)
}
