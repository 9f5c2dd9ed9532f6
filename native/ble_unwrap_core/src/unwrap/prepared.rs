//! A conditioned mesh on its way to an atlas.

use crate::atlas::Atlas;
use crate::cache::Run;
use crate::clock::Clock;
use crate::error::UnwrapError;
use crate::mesh::{self, ConditionOptions, FaceId, Groups, MeshInput, Surface};
use crate::progress::{Progress, Stage};
use crate::settings::Settings;
use crate::{cutting, layout};

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
        let (charts, rungs) = cutting::cut(&self.surface, &self.components, settings, run)?;
        clock.lap("charts");
        layout::lay_out(input, &self.surface, charts, rungs, settings, clock, run)
    }
}
