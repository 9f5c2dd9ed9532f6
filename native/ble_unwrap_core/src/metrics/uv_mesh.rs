//! A triangulated surface with a UV per corner, borrowed.

use nalgebra::Point3;
use thiserror::Error;

/// The texture a layout is meant for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Texture {
    /// Texels across.
    pub width: u32,
    /// Texels upwards.
    pub height: u32,
    /// Wanted distance between charts, in texels.
    pub margin: f64,
}

impl Texture {
    /// A square texture.
    #[must_use]
    pub fn square(size: u32, margin: f64) -> Self {
        Self { width: size, height: size, margin }
    }

    /// Factors that turn UV into texels; a side of no texels counts as one.
    #[must_use]
    pub fn texels(&self) -> [f64; 2] {
        [f64::from(self.width.max(1)), f64::from(self.height.max(1))]
    }

    /// Factors that give UV the proportions of the texture, the longer side being 1.
    #[must_use]
    pub fn aspect(&self) -> [f64; 2] {
        let [w, h] = self.texels();
        [w / w.max(h), h / w.max(h)]
    }
}

/// Why arrays do not make a UV mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum UvMeshError {
    /// Two arrays that have one entry a triangle differ in length.
    #[error("{triangles} triangles, but {other} {what}")]
    Length {
        /// Number of triangles.
        triangles: usize,
        /// Length of the other array.
        other: usize,
        /// What the other array holds.
        what: &'static str,
    },
    /// A triangle names a vertex that is not there.
    #[error("triangle {triangle} names vertex {vertex} of {count}")]
    Vertex {
        /// The triangle.
        triangle: usize,
        /// The vertex it names.
        vertex: u32,
        /// Number of vertices.
        count: usize,
    },
    /// A triangle names a corner that is not there.
    #[error("triangle {triangle} names corner {corner} of {count}")]
    Corner {
        /// The triangle.
        triangle: usize,
        /// The corner it names.
        corner: u32,
        /// Number of corners.
        count: usize,
    },
    /// More than 2³⁰ triangles: half-edges would not fit in 32 bits.
    #[error("{triangles} triangles are more than 2^30")]
    TooMany {
        /// Number of triangles.
        triangles: usize,
    },
}

/// A triangle soup over the vertices of a mesh, with a float32 UV per corner.
///
/// Triangles of one polygon may share corners. Lengths and indices are checked, numbers are not:
/// positions and UVs may be NaN.
#[derive(Clone, Copy, Debug)]
pub struct UvMesh<'a> {
    positions: &'a [Point3<f64>],
    triangles: &'a [[u32; 3]],
    uv: &'a [[f32; 2]],
    corner_triangles: &'a [[u32; 3]],
    chart: &'a [i32],
    texture: Texture,
}

impl<'a> UvMesh<'a> {
    /// Checks lengths and indices. O(n).
    ///
    /// `triangles` (m×3) index `positions`; `corner_triangles` (m×3) index `uv`; `chart` holds a label
    /// for each triangle, negative where the triangle has no UV, or is empty if all have one.
    ///
    /// # Errors
    /// The first length or index that is wrong.
    pub fn new(
        positions: &'a [Point3<f64>],
        triangles: &'a [[u32; 3]],
        uv: &'a [[f32; 2]],
        corner_triangles: &'a [[u32; 3]],
        chart: &'a [i32],
        texture: Texture,
    ) -> Result<Self, UvMeshError> {
        let m = triangles.len();
        if m > 1 << 30 {
            return Err(UvMeshError::TooMany { triangles: m });
        }
        if corner_triangles.len() != m {
            return Err(UvMeshError::Length { triangles: m, other: corner_triangles.len(), what: "corner triangles" });
        }
        if !chart.is_empty() && chart.len() != m {
            return Err(UvMeshError::Length { triangles: m, other: chart.len(), what: "chart labels" });
        }
        for (triangle, (vertices, corners)) in triangles.iter().zip(corner_triangles).enumerate() {
            if let Some(&vertex) = vertices.iter().find(|&&v| v as usize >= positions.len()) {
                return Err(UvMeshError::Vertex { triangle, vertex, count: positions.len() });
            }
            let mapped = chart.is_empty() || chart[triangle] >= 0;
            if let Some(&corner) = corners.iter().find(|&&c| c as usize >= uv.len())
                && mapped
            {
                return Err(UvMeshError::Corner { triangle, corner, count: uv.len() });
            }
        }
        Ok(Self { positions, triangles, uv, corner_triangles, chart, texture })
    }

    /// Vertex positions.
    #[must_use]
    pub fn positions(&self) -> &'a [Point3<f64>] {
        self.positions
    }

    /// Vertices of each triangle.
    #[must_use]
    pub fn triangles(&self) -> &'a [[u32; 3]] {
        self.triangles
    }

    /// The texture the layout is meant for.
    #[must_use]
    pub fn texture(&self) -> Texture {
        self.texture
    }

    /// Number of triangles.
    #[must_use]
    pub fn triangle_count(&self) -> usize {
        self.triangles.len()
    }

    /// The given label of a triangle: negative where it has no UV, 0 if no labels were given.
    #[must_use]
    pub fn label(&self, triangle: usize) -> i32 {
        self.chart.get(triangle).copied().unwrap_or(0)
    }

    /// The UVs of a triangle's corners, with −0 made 0; none if its label is negative.
    #[must_use]
    pub fn corner_uv(&self, triangle: usize) -> Option<[[f32; 2]; 3]> {
        (self.label(triangle) >= 0)
            .then(|| self.corner_triangles[triangle].map(|c| self.uv[c as usize].map(|x| x + 0.0)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrong_arrays_are_named() {
        let p = [Point3::origin(); 3];
        let uv = [[0.0; 2]; 3];
        let t = Texture::square(64, 2.0);
        let make = |tri: &[[u32; 3]], corner: &[[u32; 3]], chart: &[i32]| {
            UvMesh::new(&p, tri, &uv, corner, chart, t).map(|m| m.triangle_count())
        };
        let good = [[0, 1, 2]];
        assert_eq!(make(&good, &good, &[]), Ok(1));
        assert_eq!(make(&good, &[[9, 9, 9]], &[-1]), Ok(1), "an unmapped triangle needs no corners");
        assert_eq!(make(&[[0, 1, 3]], &good, &[]), Err(UvMeshError::Vertex { triangle: 0, vertex: 3, count: 3 }));
        assert_eq!(make(&good, &[[0, 7, 3]], &[0]), Err(UvMeshError::Corner { triangle: 0, corner: 7, count: 3 }));
        assert!(matches!(make(&good, &[], &[]), Err(UvMeshError::Length { .. })));
        assert!(matches!(make(&good, &good, &[0, 0]), Err(UvMeshError::Length { .. })));
    }
}
