//! By how many quarter turns a packed texture is turned so that what is up on the object is up in it.
//!
//! To turn all charts at once costs no texel of a square texture. To turn each by itself would cost some, and what is laid along the axes or
//! upright has been laid so by the packer.

use nalgebra::{Matrix2, Vector2, Vector3};

use crate::charts::Chart;
use crate::mesh::{MeshInput, Surface, VertexId};
use crate::packing::Packed;
use crate::settings::Front;

/// Up points nowhere in a layout where, in the mean over its area, less than this share of a unit of length upwards on the object leads any way: of a
/// floor nothing leads upwards, and of walls that lie in all directions what each does cancels out.
const LEAST_LEANING: f64 = 0.02;

/// Quarter turns, counter-clockwise. `charts` are those that `packed` has places of, in its order. None where no front is given, since then nothing
/// says what is up.
pub(super) fn quarter_turns(
    input: &MeshInput<'_>,
    surface: &Surface,
    charts: &[&Chart],
    packed: &Packed,
    front: Front,
) -> usize {
    let Some(up) = front.up().map(Vector3::from) else { return 0 };
    let (mut sum, mut most) = (Vector2::zeros(), 0.0);
    for (item, chart) in charts.iter().enumerate() {
        let (upwards, area) = upwards(input, surface, chart, up);
        let [from, to] = [Vector2::zeros(), upwards].map(|p| packed.poses[item].texel(p.into()));
        sum += to - from;
        most += area * packed.poses[item].scale;
    }
    // What each number of turns brings to where up is.
    let found = [sum.y, sum.x, -sum.y, -sum.x];
    let is_square = packed.size[0] == packed.size[1];
    let may_be = |turns: &usize| is_square || turns.is_multiple_of(2);
    let best = (0..4).filter(may_be).fold(0, |best, turns| if found[turns] > found[best] { turns } else { best });
    if found[best] > LEAST_LEANING * most { best } else { 0 }
}

/// Where up points in the plane of a chart, in the mean over its area and times that, and the area.
fn upwards(input: &MeshInput<'_>, surface: &Surface, chart: &Chart, up: Vector3<f64>) -> (Vector2<f64>, f64) {
    let (mut sum, mut whole) = (Vector2::zeros(), 0.0);
    for (face, flat) in chart.patch.faces.iter().zip(chart.patch.mesh.triangles()) {
        let place = |v: VertexId| Vector3::from(input.positions[surface.vertex[v.index()] as usize]) / surface.scale;
        let [a, b, c] = surface.mesh.triangle(*face).map(place);
        let (e, f) = (b - a, c - a);
        let area = 0.5 * e.cross(&f).norm();
        // Up as a sum of two sides, in the least squares.
        let gram = Matrix2::new(e.dot(&e), e.dot(&f), e.dot(&f), f.dot(&f));
        let Some(inverse) = gram.try_inverse() else { continue };
        let shares = inverse * Vector2::new(e.dot(&up), f.dot(&up));
        let [a, b, c] = flat.map(|v| chart.uv[v.index()]);
        let upwards = (b - a) * shares.x + (c - a) * shares.y;
        if upwards.iter().all(|x| x.is_finite()) {
            sum += upwards * area;
            whole += area;
        }
    }
    (sum, whole)
}
