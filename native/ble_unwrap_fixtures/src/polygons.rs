//! Single polygons.

use std::f64::consts::TAU;

use crate::poly_mesh::PolyMesh;

fn single(positions: Vec<[f64; 3]>) -> PolyMesh {
    let faces = vec![(0..positions.len() as u32).collect()];
    PolyMesh { positions, faces }
}

/// One regular polygon, its corners lifted to a wave of height `wave`.
#[must_use]
pub fn regular_polygon(corners: usize, wave: f64) -> PolyMesh {
    let at = |i: usize| TAU * i as f64 / corners as f64;
    single((0..corners).map(at).map(|t| [t.cos(), t.sin(), wave * (5.0 * t).sin()]).collect())
}

/// One polygon that crosses itself: a star drawn in one stroke over an odd number of points.
#[must_use]
pub fn star_polygon(points: usize) -> PolyMesh {
    let at = |i: usize| TAU * (i * (points / 2)) as f64 / points as f64;
    single((0..points).map(at).map(|t| [t.cos(), t.sin(), 0.0]).collect())
}

/// One concave polygon: a comb.
#[must_use]
pub fn comb(teeth: usize) -> PolyMesh {
    let mut outline = vec![[teeth as f64, -1.0, 0.0], [teeth as f64, 0.0, 0.0]];
    for x in (0..teeth).rev().map(|i| i as f64) {
        outline.extend([[x + 0.6, 0.0, 0.0], [x + 0.6, 5.0, 0.0], [x, 5.0, 0.0], [x, 0.0, 0.0]]);
    }
    outline.push([0.0, -1.0, 0.0]);
    single(outline)
}

/// A square with a square hole as one polygon, which runs along a bridge to the hole and back and so
/// has two vertices twice.
#[must_use]
pub fn keyhole() -> PolyMesh {
    let flat = [(0, 0), (3, 0), (3, 3), (0, 3), (1, 1), (1, 2), (2, 2), (2, 1)];
    PolyMesh {
        positions: flat.map(|(x, y)| [f64::from(x), f64::from(y), 0.0]).to_vec(),
        faces: vec![vec![0, 1, 2, 3, 0, 4, 5, 6, 7, 4]],
    }
}
