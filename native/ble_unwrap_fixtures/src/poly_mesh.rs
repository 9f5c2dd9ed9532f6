//! Positions and polygons, and what is done to them.

use crate::noise::random;

/// A mesh as a list of polygons. Nothing is promised of it: fixtures are often broken on purpose.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PolyMesh {
    /// Coordinates of the vertices.
    pub positions: Vec<[f64; 3]>,
    /// The vertices of each face.
    pub faces: Vec<Vec<u32>>,
}

/// Polygons as flat arrays of 32-bit signed integers, as Blender keeps them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FlatPolygons {
    /// The vertex of each corner.
    pub corner_vertices: Vec<i32>,
    /// First corner of each face, and the number of corners at the end.
    pub face_offsets: Vec<i32>,
}

impl PolyMesh {
    /// The faces as flat arrays.
    #[must_use]
    pub fn flat(&self) -> FlatPolygons {
        let corner_vertices: Vec<i32> = self.faces.iter().flatten().map(|&v| v as i32).collect();
        let mut face_offsets = vec![0];
        let mut end = 0;
        for face in &self.faces {
            end += face.len() as i32;
            face_offsets.push(end);
        }
        FlatPolygons { corner_vertices, face_offsets }
    }

    /// Every face fanned into triangles from its first corner: right for convex faces.
    #[must_use]
    pub fn triangles(&self) -> Vec<[u32; 3]> {
        self.faces.iter().flat_map(|f| (2..f.len()).map(move |k| [f[0], f[k - 1], f[k]])).collect()
    }

    /// The same mesh with every face fanned into triangles.
    #[must_use]
    pub fn triangulated(self) -> Self {
        let faces = self.triangles().into_iter().map(Vec::from).collect();
        Self { faces, ..self }
    }

    /// The same faces with moved vertices.
    #[must_use]
    pub fn moved(mut self, f: impl Fn([f64; 3]) -> [f64; 3]) -> Self {
        self.positions.iter_mut().for_each(|p| *p = f(*p));
        self
    }

    /// Both meshes side by side, nothing shared.
    #[must_use]
    pub fn joined(mut self, other: &Self) -> Self {
        let first = self.positions.len() as u32;
        self.positions.extend(&other.positions);
        self.faces.extend(other.faces.iter().map(|f| f.iter().map(|v| v + first).collect::<Vec<_>>()));
        self
    }

    /// The same mesh with the faces for which `flip` holds wound the other way.
    #[must_use]
    pub fn flipped(mut self, flip: impl Fn(usize) -> bool) -> Self {
        self.faces.iter_mut().enumerate().filter(|(i, _)| flip(*i)).for_each(|(_, f)| f.reverse());
        self
    }

    /// The same mesh in which the faces for which `double` holds have their first corner twice, before it by a vertex of its
    /// own that lies at the same place: a side of no length.
    #[must_use]
    pub fn with_sides_of_no_length(mut self, double: impl Fn(usize) -> bool) -> Self {
        for (_, face) in self.faces.iter_mut().enumerate().filter(|(i, _)| double(*i)) {
            let copy = self.positions.len() as u32;
            self.positions.push(self.positions[face[0] as usize]);
            face.insert(0, copy);
        }
        self
    }

    /// The faces for which `keep` holds, and the vertices they use.
    #[must_use]
    pub fn retained(&self, keep: impl Fn(usize) -> bool) -> Self {
        let mut number = vec![u32::MAX; self.positions.len()];
        let mut out = Self::default();
        for (_, face) in self.faces.iter().enumerate().filter(|(i, _)| keep(*i)) {
            let face = face.iter().map(|&v| {
                let number = &mut number[v as usize];
                if *number == u32::MAX {
                    *number = out.positions.len() as u32;
                    out.positions.push(self.positions[v as usize]);
                }
                *number
            });
            let face = face.collect();
            out.faces.push(face);
        }
        out
    }

    /// The same mesh with vertices and faces in another order and faces begun at another corner.
    #[must_use]
    pub fn renumbered(&self, seed: u64) -> Self {
        let order = shuffled(self.positions.len(), seed);
        let mut number = vec![0; order.len()];
        order.iter().enumerate().for_each(|(new, &old)| number[old] = new as u32);
        let faces = shuffled(self.faces.len(), seed ^ 0xFACE).into_iter().map(|f| {
            let mut face: Vec<u32> = self.faces[f].iter().map(|&v| number[v as usize]).collect();
            let turn = (random(seed, f as u64) * face.len() as f64) as usize;
            face.rotate_left(turn);
            face
        });
        Self { positions: order.iter().map(|&v| self.positions[v]).collect(), faces: faces.collect() }
    }
}

/// The numbers below `count` in an order that depends on `seed`.
fn shuffled(count: usize, seed: u64) -> Vec<usize> {
    let mut order: Vec<usize> = (0..count).collect();
    for i in (1..count).rev() {
        order.swap(i, (random(seed, i as u64) * (i + 1) as f64) as usize);
    }
    order
}
