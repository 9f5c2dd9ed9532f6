//! A conditioned mesh on its way to an atlas.

use std::sync::Arc;

use nalgebra::Point3;

use crate::atlas::Atlas;
use crate::cache::{Fingerprint, Kind, Run};
use crate::clock::Clock;
use crate::error::UnwrapError;
use crate::mesh::{self, ConditionOptions, FaceId, Groups, MeshInput, Surface};
use crate::progress::{Cancelled, Progress, Stage};
use crate::settings::Settings;
use crate::{cutting, layout, visibility};

use super::needs;

/// The surface of a mesh, and its connected pieces.
#[derive(Debug)]
pub(super) struct Prepared {
    pub(super) surface: Surface,
    /// The faces of each piece, ascending. The pieces become meshes of their own only while they are charted.
    pub(super) components: Groups<FaceId>,
}

impl Prepared {
    pub(super) fn new(
        input: &MeshInput<'_>,
        conditioning: &ConditionOptions,
        progress: &Progress,
    ) -> Result<Self, UnwrapError> {
        let surface = mesh::canonical(mesh::condition(input, conditioning, progress)?, progress)?;
        let (label, count) = surface.mesh.components();
        Ok(Self { components: Groups::by_label(&label, count, FaceId::new), surface })
    }

    /// The stages after conditioning. Of `input` only positions, corners and offsets are looked at.
    pub(super) fn unwrap(
        &self,
        input: &MeshInput<'_>,
        settings: &Settings,
        mut clock: Clock,
        run: &Run<'_>,
    ) -> Result<Atlas, UnwrapError> {
        needs::require(input, self.components.len(), settings)?;
        run.progress.enter(Stage::Charts);
        let Surface { vertex, scale, .. } = &self.surface;
        // The mesh has each piece in a place of its own.
        let positions: Vec<Point3<f64>> =
            vertex.iter().map(|&v| input.positions[v as usize].map(|x| x / scale).into()).collect();
        let visibility = self.visibility(&positions, settings, run)?;
        let visibility = visibility.as_deref().map(Vec::as_slice);
        let (charts, rungs, originals) = cutting::cut(
            &self.surface,
            &self.components,
            &positions,
            visibility,
            &|charts| layout::cover(charts, settings, run.progress),
            settings,
            run,
        )?;
        clock.lap("charts");
        layout::lay_out(input, &self.surface, charts, &originals, rungs, settings, clock, run)
    }

    /// How far each vertex of the surface can be seen, where seams are to be hidden.
    fn visibility(
        &self,
        positions: &[Point3<f64>],
        settings: &Settings,
        run: &Run<'_>,
    ) -> Result<Option<Arc<Vec<f32>>>, Cancelled> {
        if settings.hide_seams <= 0.0 {
            return Ok(None);
        }
        let mesh = &self.surface.mesh;
        let front = settings.front.direction();
        let key = |f: &mut Fingerprint| {
            f.mesh(mesh);
            f.reals(positions.iter().flat_map(|p| [p.x, p.y, p.z]));
            f.reals(front.iter().flatten().copied());
        };
        let bytes = |values: &Vec<f32>| 4 * values.len();
        let compute = || visibility::of_vertices(mesh, positions, front.map(Into::into), run.progress);
        Ok(Some(run.recall(Kind::Visibility, key, bytes, compute)?))
    }
}
