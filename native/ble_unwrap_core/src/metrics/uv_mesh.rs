//! A triangulated surface with a UV per corner, borrowed.

use nalgebra::Point3;

use crate::packing::PackSettings;

/// The texture a layout is meant for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Texture {
    /// Texels across.
    pub width: u32,
    /// Texels upwards.
    pub height: u32,
    /// Wanted distance between charts, in texels.
    pub margin: f64,
    /// Number of tiles that charts may lie in, each of that width and height.
    pub tiles: usize,
}

impl Texture {
    /// A square texture.
    #[cfg(test)]
    pub(crate) fn square(size: u32, margin: f64) -> Self {
        Self { width: size, height: size, margin, tiles: 1 }
    }

    /// The texture that charts are packed into.
    #[must_use]
    pub(crate) fn of(packing: &PackSettings) -> Self {
        let PackSettings { width, height, tiles, .. } = *packing;
        Self { width, height, margin: packing.margin(), tiles: tiles.clamp(1, PackSettings::MOST_TILES) }
    }

    /// Factors that turn UV into texels; a side of no texels counts as one.
    #[must_use]
    pub(crate) fn texels(&self) -> [f64; 2] {
        [f64::from(self.width.max(1)), f64::from(self.height.max(1))]
    }

    /// Factors that give UV the proportions of the texture, the longer side being 1.
    #[must_use]
    pub(crate) fn aspect(&self) -> [f64; 2] {
        let [w, h] = self.texels();
        [w / w.max(h), h / w.max(h)]
    }
}

/// More than 2³⁰ triangles: half-edges would not fit in 32 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct TooManyTriangles {
    /// Number of triangles.
    pub(crate) triangles: usize,
}

/// A triangle soup over the vertices of a mesh, with a float32 UV per corner.
///
/// Triangles of one polygon may share corners. Lengths and indices are checked, numbers are not:
/// positions and UVs may be NaN.
#[derive(Clone, Copy, Debug)]
pub(crate) struct UvMesh<'a> {
    positions: &'a [Point3<f64>],
    triangles: &'a [[u32; 3]],
    uv: &'a [[f32; 2]],
    corner_triangles: &'a [[u32; 3]],
    chart: &'a [i32],
    /// The stack of each label, if any are stacked.
    stack: &'a [i32],
    texture: Texture,
}

impl<'a> UvMesh<'a> {
    /// Checks lengths and indices. O(n).
    ///
    /// `triangles` (m×3) index `positions`; `corner_triangles` (m×3) index `uv`; `chart` holds a label
    /// for each triangle, negative where the triangle has no UV, or is empty if all have one.
    ///
    /// # Errors
    /// [`TooManyTriangles`].
    ///
    /// # Panics
    /// If a length or an index is wrong.
    pub(crate) fn new(
        positions: &'a [Point3<f64>],
        triangles: &'a [[u32; 3]],
        uv: &'a [[f32; 2]],
        corner_triangles: &'a [[u32; 3]],
        chart: &'a [i32],
        texture: Texture,
    ) -> Result<Self, TooManyTriangles> {
        let m = triangles.len();
        if m > 1 << 30 {
            return Err(TooManyTriangles { triangles: m });
        }
        assert_eq!(corner_triangles.len(), m, "three corners a triangle");
        assert!(chart.is_empty() || chart.len() == m, "a label for each triangle, or none");
        for (triangle, (vertices, corners)) in triangles.iter().zip(corner_triangles).enumerate() {
            assert!(vertices.iter().all(|&v| (v as usize) < positions.len()), "triangle {triangle} names no vertex");
            let mapped = chart.is_empty() || chart[triangle] >= 0;
            assert!(!mapped || corners.iter().all(|&c| (c as usize) < uv.len()), "triangle {triangle} names no corner");
        }
        Ok(Self { positions, triangles, uv, corner_triangles, chart, stack: &[], texture })
    }

    /// The same, with charts that lie on each other on purpose: `stack` holds, for each label from 0 on, a number that
    /// the labels of one stack share; charts with a negative number, and with a label beyond the list, lie alone.
    #[must_use]
    pub(crate) fn with_stacks(self, stack: &'a [i32]) -> Self {
        Self { stack, ..self }
    }

    /// The stack of the charts with this label, if they lie on others.
    #[must_use]
    pub(crate) fn stack(&self, label: i32) -> Option<i32> {
        let stack = *self.stack.get(usize::try_from(label).ok()?)?;
        (stack >= 0).then_some(stack)
    }

    /// Vertex positions.
    #[must_use]
    pub(crate) fn positions(&self) -> &'a [Point3<f64>] {
        self.positions
    }

    /// Vertices of each triangle.
    #[must_use]
    pub(crate) fn triangles(&self) -> &'a [[u32; 3]] {
        self.triangles
    }

    /// The texture the layout is meant for.
    #[must_use]
    pub(crate) fn texture(&self) -> Texture {
        self.texture
    }

    /// Number of triangles.
    #[must_use]
    pub(crate) fn triangle_count(&self) -> usize {
        self.triangles.len()
    }

    /// The given label of a triangle: negative where it has no UV, 0 if no labels were given.
    #[must_use]
    pub(crate) fn label(&self, triangle: usize) -> i32 {
        self.chart.get(triangle).copied().unwrap_or(0)
    }

    /// The UVs of a triangle's corners, with −0 made 0; none if its label is negative.
    #[must_use]
    pub(crate) fn corner_uv(&self, triangle: usize) -> Option<[[f32; 2]; 3]> {
        (self.label(triangle) >= 0)
            .then(|| self.corner_triangles[triangle].map(|c| self.uv[c as usize].map(|x| x + 0.0)))
    }
}

#[cfg(test)]
mod tests {
    use std::panic::catch_unwind;

    use super::*;

    #[test]
    fn wrong_arrays_are_refused() {
        let p = [Point3::origin(); 3];
        let uv = [[0.0; 2]; 3];
        let t = Texture::square(64, 2.0);
        let make = |tri: &[[u32; 3]], corner: &[[u32; 3]], chart: &[i32]| {
            catch_unwind(|| UvMesh::new(&p, tri, &uv, corner, chart, t).map(|m| m.triangle_count())).ok()
        };
        let good = [[0, 1, 2]];
        assert_eq!(make(&good, &good, &[]), Some(Ok(1)));
        assert_eq!(make(&good, &[[9, 9, 9]], &[-1]), Some(Ok(1)), "an unmapped triangle needs no corners");
        assert_eq!(make(&[[0, 1, 3]], &good, &[]), None, "no such vertex");
        assert_eq!(make(&good, &[[0, 7, 3]], &[0]), None, "no such corner");
        assert_eq!(make(&good, &[], &[]), None, "no corners");
        assert_eq!(make(&good, &good, &[0, 0]), None, "two labels");
    }
}
