//! A mesh prepared for being unwrapped several times.

use crate::atlas::Atlas;
use crate::cache::{Cache, Run};
use crate::clock::Clock;
use crate::error::UnwrapError;
use crate::mesh::{ConditionOptions, MeshInput};
use crate::progress::{Progress, Stage};
use crate::settings::Settings;

use super::prepared::Prepared;

/// A mesh, and what was found out about it, for unwrapping it several times with different settings.
///
/// Guaranteed: [`Analysis::unwrap`] returns what [`unwrap`](crate::unwrap()) returns for the same mesh and settings, bit
/// for bit except for the measured times, whatever was unwrapped before and by how many threads at once.
///
/// Not guaranteed: that a second call is faster. It will be if hardly anything but the stretch limit differs.
#[derive(Debug)]
pub struct Analysis {
    positions: Vec<[f64; 3]>,
    corner_vertices: Vec<i32>,
    face_offsets: Vec<i32>,
    conditioning: ConditionOptions,
    prepared: Prepared,
    cache: Cache,
}

impl Analysis {
    /// Copies the mesh and conditions it, which means making it an oriented manifold surface. Of the settings, only `weld`
    /// and `weld_distance` matter here; [`Analysis::unwrap`] must be given the same. O(n log n).
    ///
    /// # Errors
    /// [`UnwrapError::Mesh`] if the arrays do not make a mesh; [`UnwrapError::Setting`] if a setting is out of its range;
    /// [`UnwrapError::OutOfMemory`]; [`UnwrapError::Cancelled`].
    pub fn new(input: &MeshInput<'_>, settings: &Settings, progress: &Progress) -> Result<Self, UnwrapError> {
        progress.check()?;
        settings.validate()?;
        progress.enter(Stage::Condition);
        let conditioning = settings.conditioning();
        let prepared = Prepared::new(input, &conditioning, progress)?;
        Ok(Self {
            cache: Cache::new(prepared.surface.mesh.face_count()),
            prepared,
            positions: input.positions.to_vec(),
            corner_vertices: input.corner_vertices.to_vec(),
            face_offsets: input.face_offsets.to_vec(),
            conditioning,
        })
    }

    /// Whether vertices at the same position are welded, that is, count as one.
    #[must_use]
    pub fn weld(&self) -> bool {
        self.conditioning.weld
    }

    /// The distance up to which vertices are welded; `None` stands for the one that [`Settings::weld_distance`] derives
    /// from single precision.
    #[must_use]
    pub fn weld_distance(&self) -> Option<f64> {
        self.conditioning.weld_distance
    }

    /// The angle between two faces, in degrees, from which on edges are cut; `None` where none is for its angle.
    #[must_use]
    pub fn cut_angle(&self) -> Option<f64> {
        self.conditioning.cut_angle
    }

    /// Number of faces of the mesh.
    #[must_use]
    pub fn face_count(&self) -> usize {
        self.face_offsets.len().saturating_sub(1)
    }

    /// Unwraps the mesh, as [`unwrap`](crate::unwrap()) does.
    ///
    /// # Errors
    /// Those of [`unwrap`](crate::unwrap()); also [`UnwrapError::Setting`] if `settings.weld` or, where it is on,
    /// `settings.weld_distance`, or `settings.cut_angle` is not what the mesh was analysed with.
    pub fn unwrap(&self, settings: &Settings, progress: &Progress) -> Result<Atlas, UnwrapError> {
        progress.check()?;
        settings.validate()?;
        let made_with = &self.conditioning;
        if settings.weld != made_with.weld {
            let value = settings.weld.to_string();
            let allowed = if made_with.weld { "true, as in the analysis" } else { "false, as in the analysis" };
            return Err(UnwrapError::Setting { name: "weld", value, allowed: allowed.into() });
        }
        if settings.weld && settings.weld_distance != made_with.weld_distance {
            let value = settings.weld_distance.map_or_else(|| "not given".into(), |d| d.to_string());
            let allowed = "what it was in the analysis".into();
            return Err(UnwrapError::Setting { name: "weld_distance", value, allowed });
        }
        if settings.cut_angle != made_with.cut_angle {
            let text = |angle: Option<f64>| angle.map_or_else(|| "not given".into(), |angle| angle.to_string());
            let (value, allowed) =
                (text(settings.cut_angle), format!("{}, as in the analysis", text(made_with.cut_angle)));
            return Err(UnwrapError::Setting { name: "cut_angle", value, allowed });
        }
        let input = MeshInput {
            positions: &self.positions,
            corner_vertices: &self.corner_vertices,
            face_offsets: &self.face_offsets,
            ..MeshInput::default()
        };
        self.cache.begin();
        self.prepared.unwrap(&input, settings, Clock::new(), &Run::new(progress, Some(&self.cache)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Does something with two unit squares, far apart, as four triangles, the corners of each triangle its own vertices.
    fn with_squares<T>(act: impl FnOnce(&MeshInput<'_>) -> T) -> T {
        let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let positions: Vec<[f64; 3]> = [0.0, 5.0].iter().flat_map(|x| corners.map(|c| [c[0] + x, c[1], 0.0])).collect();
        let corner_vertices: Vec<i32> = (0..12).collect();
        let face_offsets: Vec<i32> = (0..=12).step_by(3).collect();
        act(&MeshInput {
            positions: &positions,
            corner_vertices: &corner_vertices,
            face_offsets: &face_offsets,
            ..MeshInput::default()
        })
    }

    fn analysed(settings: &Settings) -> Analysis {
        with_squares(|input| Analysis::new(input, settings, &Progress::new())).expect("a mesh")
    }

    #[test]
    fn it_unwraps_as_a_single_call_does_whatever_went_before() {
        let settings = Settings { weld: true, ..Settings::default() };
        let once = with_squares(|input| crate::unwrap(input, &settings, &Progress::new())).expect("unwraps");
        let analysis = analysed(&settings);
        assert_eq!((analysis.face_count(), analysis.prepared.components.len()), (4, 2));
        for other in [settings.clone(), Settings { stretch_limit: 2.0, ..settings.clone() }, settings.clone()] {
            analysis.unwrap(&other, &Progress::new()).expect("unwraps");
        }
        let again = analysis.unwrap(&settings, &Progress::new()).expect("unwraps");
        assert_eq!((again.uv, again.chart), (once.uv, once.chart));
    }

    #[test]
    fn it_refuses_what_it_was_not_made_for_by_name() {
        let analysis = analysed(&Settings { weld: true, weld_distance: Some(0.1), ..Settings::default() });
        let refused = |settings: Settings| match analysis.unwrap(&settings, &Progress::new()) {
            Err(UnwrapError::Setting { name, .. }) => name,
            other => panic!("{other:?}"),
        };
        assert_eq!(refused(Settings::default()), "weld");
        assert_eq!(refused(Settings { weld: true, ..Settings::default() }), "weld_distance");
        let as_analysed = Settings { weld: true, weld_distance: Some(0.1), ..Settings::default() };
        assert_eq!(refused(Settings { cut_angle: Some(30.0), ..as_analysed }), "cut_angle");
        assert_eq!(refused(Settings { weld: true, weld_distance: Some(-1.0), ..Settings::default() }), "weld_distance");
        let negative = Settings { weld: true, weld_distance: Some(f64::NAN), ..Settings::default() };
        let error = with_squares(|input| Analysis::new(input, &negative, &Progress::new())).map(|_| ());
        assert!(matches!(error, Err(UnwrapError::Setting { name: "weld_distance", .. })));
    }

    #[test]
    fn nothing_is_done_for_who_has_cancelled() {
        let progress = Progress::new();
        progress.cancel();
        let cancelled = analysed(&Settings::default()).unwrap(&Settings::default(), &progress);
        assert!(matches!(cancelled, Err(UnwrapError::Cancelled(_))));
    }
}
