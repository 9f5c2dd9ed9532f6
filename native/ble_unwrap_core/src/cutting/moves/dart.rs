//! Darts before splits: a patch that bulges is cut from where it does to its boundary.
//!
//! One linear system tells what a map of the patch would be stretched by, and where ([`stretch::bulge()`]). So darts are
//! placed one after the other before anything is flattened, until the patch promises to stay under the limit: at the
//! tips of fingers, the corners of boxes, the ends of a closed body.

use std::borrow::Cow;
use std::sync::Arc;

use nalgebra::Point2;

use crate::cache::{Kind, Run};
use crate::charts::{self, Patch};
use crate::distortion::RestTriangle;
use crate::mesh::VertexId;
use crate::progress::Cancelled;
use crate::settings::Settings;
use crate::stretch::{self, Bulge, StretchError};

use super::super::cost::CutPrice;

/// A patch is promising if its conformal map has at most so many times the stretch above 1 that the limit allows; the map of
/// least stretch has far less, as it need not keep angles. A dart too many is closed again, one too few makes a split of it: over
/// nine models without a stretch price 6 instead of 3.6 costs 5 % more in charts and seam, over 13 closed meshes under limits
/// of 1.01 to 1.02 0.5 % less, and with the default price over 16 models 3 % more; 3 costs as much.
const PROMISING: f64 = 3.6;
/// A patch that needs more darts is split. Over the same models 4, 6 and 9 give the same charts.
const MOST_DARTS: usize = 6;
/// A patch with more doubled edges is left as it is, and split.
const MOST_DOUBLED: usize = 8;

/// A patch, how it bulges, and how much it may.
#[derive(Clone)]
pub(crate) struct Bulging<'a> {
    patch: Cow<'a, Patch>,
    bulge: Arc<Bulge>,
    most: f64,
    cut: CutPrice,
    run: &'a Run<'a>,
}

impl<'a> Bulging<'a> {
    /// `None` where that cannot be told.
    pub(crate) fn of(patch: Cow<'a, Patch>, settings: &Settings, run: &'a Run<'a>) -> Result<Option<Self>, Cancelled> {
        Self::new(patch, 1.0 + PROMISING * (settings.stretch_limit - 1.0), CutPrice::new(settings), run)
    }

    fn new(patch: Cow<'a, Patch>, most: f64, cut: CutPrice, run: &'a Run<'a>) -> Result<Option<Self>, Cancelled> {
        let mesh = &patch.mesh;
        let known = run.recall(
            Kind::Bulge,
            |f| f.mesh(mesh),
            |_| size_of::<Bulge>(),
            || stretch::bulge(mesh, &RestTriangle::of_mesh(mesh)),
        );
        match known {
            Ok(bulge) => Ok(Some(Self { patch, bulge, most, cut, run })),
            Err(StretchError::Cancelled(c)) => Err(c),
            Err(_) => Ok(None),
        }
    }

    /// Whether the patch may come under the limit as it is.
    pub(crate) fn is_promising(&self) -> bool {
        self.bulge.root.is_none() && self.bulge.enclosed.is_none() && self.bulge.l2 <= self.most
    }

    /// The patch with as many darts as make it promising; `None` where that takes none, too many, or nothing bulges. Also where
    /// guides run inside it: they say where it is to be cut, and a split goes there.
    pub(crate) fn with_enough_darts(self) -> Result<Option<Patch>, Cancelled> {
        if is_guided(&self.patch) || self.is_promising() {
            return Ok(None);
        }
        let mut bulging = self;
        for _ in 0..MOST_DARTS {
            let Some(open) = bulging.with_dart() else { return Ok(None) };
            let Some(next) = Self::new(Cow::Owned(open), bulging.most, bulging.cut, bulging.run)? else {
                return Ok(None);
            };
            bulging = next;
            if bulging.is_promising() {
                return Ok(Some(bulging.patch.into_owned()));
            }
        }
        Ok(None)
    }

    /// The patch with one dart, and where its vertices are if they stay where they were.
    pub(crate) fn opened(&self, uv: &[Point2<f64>]) -> Option<(Patch, Vec<Point2<f64>>)> {
        let open = self.with_dart()?;
        let start = carried(uv, &self.patch, &open);
        Some((open, start))
    }

    /// The patch cut from its tip to the boundary, or on a closed surface to its root.
    fn with_dart(&self) -> Option<Patch> {
        let (tip, root) = self.ends()?;
        cut_to(&self.patch, tip, root, self.cut)
    }

    /// The inner vertex that a dart is to be cut from, and on a closed surface the one it is cut to. `None` where nothing bulges.
    pub(crate) fn ends(&self) -> Option<(VertexId, Option<VertexId>)> {
        Some((self.bulge.enclosed.or(self.bulge.tip)?, self.bulge.root))
    }
}

/// A patch, and where its vertices lie in the plane, opened where two edges join the same vertices, as no straight lines can.
pub(crate) fn without_doubled_edges(
    patch: Patch,
    uv: Vec<Point2<f64>>,
    settings: &Settings,
) -> (Patch, Vec<Point2<f64>>) {
    let (mut patch, mut uv) = (patch, uv);
    for _ in 0..MOST_DOUBLED {
        let Some(open) =
            stretch::enclosed_vertex(&patch.mesh).and_then(|tip| cut_to(&patch, tip, None, CutPrice::new(settings)))
        else {
            break;
        };
        uv = carried(&uv, &patch, &open);
        patch = open;
    }
    (patch, uv)
}

/// Positions in the plane of the vertices of a patch that has been cut, where they were before.
fn carried(uv: &[Point2<f64>], before: &Patch, after: &Patch) -> Vec<Point2<f64>> {
    let mut carried = vec![Point2::origin(); after.mesh.vertex_count()];
    let corners = after.mesh.triangles().iter().flatten().zip(before.mesh.triangles().iter().flatten());
    for (new, old) in corners {
        carried[new.index()] = uv[old.index()];
    }
    carried
}

pub(super) fn is_guided(patch: &Patch) -> bool {
    let mesh = &patch.mesh;
    mesh.has_guides() && mesh.edges().any(|h| mesh.is_guide(h) && !mesh.is_boundary(h))
}

/// A patch cut from an inner vertex to the boundary, or on a closed surface to its root, where that costs least.
pub(super) fn cut_to(patch: &Patch, tip: VertexId, root: Option<VertexId>, cut: CutPrice) -> Option<Patch> {
    let mesh = &patch.mesh;
    let dart = charts::shortest_path_to_boundary(mesh, tip, root, |h| cut.of(mesh, h), |h| patch.is_diagonal(h))?;
    // One edge of a closed surface, cut, opens nothing.
    let least = if root.is_some() { 2 } else { 1 };
    (dart.len() >= least).then(|| patch.cut(&dart))
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::mesh::{TriMesh, measure, test_surfaces};
    use crate::progress::Progress;
    use nalgebra::Point3;

    /// A connected mesh as a patch of itself, every triangle a polygon.
    pub(crate) fn whole(mesh: TriMesh) -> Patch {
        let polygon = (0..mesh.face_count() as u32).collect();
        Patch::whole(Arc::new(mesh), polygon)
    }

    /// A mesh with its vertices moved.
    pub(crate) fn moved(mesh: &TriMesh, to: impl Fn(Point3<f64>) -> Point3<f64>) -> TriMesh {
        let positions: Vec<_> = mesh.positions().iter().map(|&p| to(p)).collect();
        let triangles: Vec<_> = mesh.triangles().iter().map(|t| t.map(|v| v.index() as u32)).collect();
        test_surfaces::mesh(&positions, &triangles)
    }

    fn of<T>(patch: &Patch, stretch_limit: f64, then: impl FnOnce(Bulging<'_>) -> T) -> T {
        let progress = Progress::new();
        let run = Run::new(&progress, None);
        let settings = Settings { stretch_limit, ..Settings::default() };
        then(Bulging::of(Cow::Borrowed(patch), &settings, &run).expect("memory").expect("factored"))
    }

    #[test]
    fn a_cone_gets_one_dart_from_its_tip() {
        let sheet = test_surfaces::grid(12, 12, [2.0, 2.0], 0.0);
        let cone = whole(moved(&sheet, |p| Point3::new(p.x, p.y, -2.0 * (p.x - 1.0).hypot(p.y - 1.0))));
        assert!(!of(&cone, 1.02, |bulging| bulging.is_promising()));
        let open = of(&cone, 1.02, |bulging| bulging.with_enough_darts().expect("memory")).expect("one dart does");
        assert!(open.mesh.topology().is_disk());
        let seam = 0.5 * (open.mesh.boundary_length() - cone.mesh.boundary_length());
        let side = 5.0_f64.sqrt();
        assert!((seam - side).abs() < 0.01, "{seam}: the way from the tip to the nearest side is {side}");
        let tip = Point3::new(1.0, 1.0, 0.0);
        let on_tip = |v: &_| (open.mesh.position(*v) - tip).norm() < 1e-9;
        assert!(open.mesh.vertices().filter(on_tip).all(|v| open.mesh.is_boundary_vertex(v)));
    }

    #[test]
    fn a_closed_body_is_cut_open_and_a_sheet_left_alone() {
        let long = whole(moved(&test_surfaces::sphere(3), |p| Point3::new(0.2 * p.x, 0.2 * p.y, p.z)));
        let open = of(&long, 1.1, |bulging| bulging.with_enough_darts().expect("memory"))
            .expect("a spindle is rolled out by a cut from end to end");
        assert!(open.mesh.topology().is_disk());
        assert!((measure::total_area(&open.mesh) - long.area()).abs() < 1e-12);
        let sheet = whole(test_surfaces::grid(12, 12, [2.0, 2.0], 0.0));
        assert!(of(&sheet, 1.1, |flat| flat.is_promising() && flat.with_enough_darts().expect("memory").is_none()));
        let ball = whole(test_surfaces::sphere(3));
        assert!(
            of(&ball, 1.001, |bulging| bulging.with_enough_darts().expect("memory")).is_none(),
            "no six darts do for that limit"
        );
    }

    #[test]
    fn a_patch_opened_stays_where_it_lay() {
        let sheet = test_surfaces::grid(12, 12, [2.0, 2.0], 0.0);
        let cone = whole(moved(&sheet, |p| Point3::new(p.x, p.y, -2.0 * (p.x - 1.0).hypot(p.y - 1.0))));
        let uv: Vec<Point2<f64>> = cone.mesh.positions().iter().map(|p| p.xy()).collect();
        let (open, start) = of(&cone, 1.1, |r| r.opened(&uv)).expect("a dart");
        assert!(open.mesh.vertex_count() > cone.mesh.vertex_count());
        assert!(start.iter().zip(open.mesh.positions()).all(|(s, p)| *s == p.xy()));
    }

    #[test]
    fn a_flat_patch_with_a_doubled_edge_is_opened_there() {
        let sheet = test_surfaces::sheet_with_a_flap();
        let patch = whole(sheet);
        assert!(!of(&patch, 1.1, |bulging| bulging.is_promising()), "two of its edges join the same vertices");
        let open = of(&patch, 1.1, |bulging| bulging.with_enough_darts().expect("memory")).expect("one dart does");
        assert_eq!(stretch::enclosed_vertex(&open.mesh), None);
        let uv: Vec<Point2<f64>> = patch.mesh.positions().iter().map(|p| p.xy()).collect();
        let (opened, start) = without_doubled_edges(patch.clone(), uv, &Settings::default());
        assert_eq!(opened.mesh.triangles(), open.mesh.triangles());
        assert!(start.iter().zip(opened.mesh.positions()).all(|(s, p)| *s == p.xy()));
    }
}
