//! What a UV mesh borrows from, for the layout of a mesh of polygons.

use nalgebra::Point3;

use super::uv_mesh::{Texture, TooManyTriangles, UvMesh};
use crate::mesh::{MeshInput, Surface};

/// The triangles of a conditioned mesh, by vertex and by corner of the input.
pub(crate) struct LayoutArrays<'a> {
    positions: Vec<Point3<f64>>,
    triangles: Vec<[u32; 3]>,
    corner_triangles: &'a [[u32; 3]],
}

impl<'a> LayoutArrays<'a> {
    /// With the vertices that stand for others in the surface, so that edges count as seams where it has them.
    pub(crate) fn new(input: &MeshInput<'_>, surface: &'a Surface) -> Self {
        let corner_triangles = surface.corner.as_chunks().0;
        let vertex = |c: u32| surface.representative[input.corner_vertices[c as usize] as usize];
        let triangles = corner_triangles.iter().map(|c| c.map(vertex)).collect();
        Self { positions: input.positions.iter().map(|&p| Point3::from(p)).collect(), triangles, corner_triangles }
    }

    /// With a UV a corner and a label a triangle, or no labels where all triangles have UVs.
    ///
    /// # Errors
    /// [`TooManyTriangles`].
    pub(crate) fn uv_mesh<'b>(
        &'b self,
        uv: &'b [[f32; 2]],
        label: &'b [i32],
        texture: Texture,
    ) -> Result<UvMesh<'b>, TooManyTriangles> {
        UvMesh::new(&self.positions, &self.triangles, uv, self.corner_triangles, label, texture)
    }
}
