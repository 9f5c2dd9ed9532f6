//! The charts of a whole surface folded, where that fills the texture: what is a copy of something else, or a mirror image, stays so.

use std::sync::Arc;

use crate::cache::Run;
use crate::charts::{Chart, Patch};
use crate::flattening::Rungs;
use crate::mesh::{FaceId, Groups, HalfedgeId, TriMesh};
use crate::progress::Cancelled;
use crate::settings::Settings;

use super::alike::Alike;
use super::cost;
use super::moves::fold::{Cover, Folds, fold};
use super::symmetric;

/// What is known of the components of a surface once they are charted.
pub(super) struct Components<'a> {
    pub(super) faces: &'a Groups<FaceId>,
    /// What each is a copy of.
    pub(super) likes: &'a [Option<Alike>],
    /// Those that were charted by halves.
    pub(super) by_halves: &'a [bool],
}

/// Whether charts are to be folded under some settings.
pub(super) fn is_wanted(settings: &Settings) -> bool {
    let packing = &settings.packing;
    settings.cover_price > 0.0
        && !cost::may_bend(settings.stretch_price)
        && packing.tiles == 1
        && packing.texel_density.is_none()
}

/// The charts of a surface, folded; see [`fold`].
pub(super) fn folded(
    mesh: &Arc<TriMesh>,
    polygon: &[u32],
    components: &Components<'_>,
    patch_of: &dyn Fn(usize) -> Patch,
    charts: Vec<Chart>,
    cover: &Cover<'_>,
    settings: &Settings,
    rungs: &mut Rungs,
    run: &Run<'_>,
) -> Result<Vec<Chart>, Cancelled> {
    let mut component_of = vec![0; mesh.face_count()];
    let mut has_copies: Vec<bool> = components.likes.iter().map(Option::is_some).collect();
    components.likes.iter().flatten().for_each(|like| has_copies[like.original] = true);
    for (component, faces) in components.faces.iter().enumerate() {
        faces.iter().for_each(|f| component_of[f.index()] = component);
    }
    let component = |chart: &Chart| chart.patch.faces.first().map(|f| component_of[f.index()]);
    let may_be_cut = |chart: &Chart| component(chart).is_some_and(|component| !has_copies[component]);
    let images = |charts: &[&Chart]| {
        let mut image: Vec<HalfedgeId> = mesh.halfedges().collect();
        let mut mirrored: Vec<usize> = charts.iter().filter_map(|chart| component(chart)).collect();
        mirrored.sort_unstable();
        mirrored.dedup();
        for component in mirrored.into_iter().filter(|&component| components.by_halves[component]) {
            let Some(own) = symmetric::images(&patch_of(component), run)? else { continue };
            let faces = components.faces.group(component);
            let on_surface = |h: HalfedgeId| if h.is_none() { h } else { faces[h.face().index()].halfedge(h.slot()) };
            for (f, sides) in faces.iter().zip(own) {
                for (h, there) in f.halfedges().into_iter().zip(sides) {
                    image[h.index()] = on_surface(there);
                }
            }
        }
        Ok(image)
    };
    fold(mesh, polygon, charts, &Folds { may_be_cut: &may_be_cut, images: &images, cover }, settings, rungs, run)
}
