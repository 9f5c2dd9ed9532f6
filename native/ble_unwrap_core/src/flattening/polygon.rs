//! Patches that are one polygon, which cannot be split: charts of them whatever it takes.

use std::f64::consts::TAU;

use nalgebra::Point2;

use crate::cache::Run;
use crate::charts::Patch;
use crate::distortion::RestTriangle;
use crate::geodesics::LandmarkDistances;
use crate::progress::Cancelled;
use crate::settings::Settings;

use super::flat::{Flat, l2};
use super::ladder::{self, Flattened};
use super::rungs::{Rung, Rungs};

/// Flattens a patch that is one polygon, which cannot be split: as well as it goes, and at worst on a
/// circle, where every triangulation of a polygon is free of flips.
pub(crate) fn flatten_polygon(
    patch: &Patch,
    distances: &LandmarkDistances,
    settings: &Settings,
    rungs: &mut Rungs,
    run: &Run<'_>,
) -> Result<Flat, Cancelled> {
    if let Flattened::Flat(flat) = ladder::without_limit(patch, distances, settings, rungs, run)? {
        return Ok(flat);
    }
    rungs.take(Rung::TutteCircle);
    Ok(on_a_circle(patch))
}

/// A patch that is one polygon, too thin or too small for single precision: a triangle at least a
/// thousandth as high as long, and if that was not enough or for more corners a regular polygon.
/// Whatever the polygon, no triangle of it is close to degenerate.
pub(crate) fn thicken(patch: &Patch, was_not_enough: bool) -> Flat {
    if patch.mesh.face_count() > 1 || was_not_enough {
        return on_a_circle(patch);
    }
    let rest = RestTriangle::of_mesh(&patch.mesh);
    let mut uv = vec![Point2::origin(); patch.mesh.vertex_count()];
    for (f, r) in patch.mesh.faces().zip(&rest) {
        for (v, p) in patch.mesh.triangle(f).iter().zip(r.corners()) {
            uv[v.index()] = p;
        }
    }
    Flat { l2: l2(patch, &rest, &uv), uv }
}

/// A triangulated polygon with its corners evenly on a circle: strictly convex, so no triangle is
/// flipped or degenerate.
fn on_a_circle(patch: &Patch) -> Flat {
    let loops = patch.mesh.boundary_loops();
    let mut uv = vec![Point2::origin(); patch.mesh.vertex_count()];
    for corners in loops.iter().take(1) {
        for (i, h) in corners.iter().enumerate() {
            let angle = TAU * i as f64 / corners.len() as f64;
            uv[patch.mesh.from(*h).index()] = Point2::new(angle.cos(), angle.sin());
        }
    }
    Flat { l2: l2(patch, &RestTriangle::of_mesh(&patch.mesh), &uv), uv }
}
