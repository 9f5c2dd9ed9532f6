//! Distances from a few landmarks to all vertices.

use crate::mesh::VertexId;

/// The k×n block of geodesic distances from k landmarks to the n vertices of a mesh.
///
/// Kept in single precision: half the memory of the largest array of an unwrap, and its relative
/// error of 6e-8 lies far below the discretisation error of any geodesic.
#[derive(Clone, Debug)]
pub(crate) struct LandmarkDistances {
    landmarks: Vec<VertexId>,
    vertex_count: usize,
    rows: Vec<f32>,
}

impl LandmarkDistances {
    /// Wraps distances: row `l` holds those from `landmarks[l]` to every vertex.
    ///
    /// # Panics
    /// If `rows` does not hold `landmarks.len() · vertex_count` values.
    #[must_use]
    pub(crate) fn new(landmarks: Vec<VertexId>, vertex_count: usize, rows: Vec<f32>) -> Self {
        assert_eq!(rows.len(), landmarks.len() * vertex_count, "one row of distances a landmark");
        Self { landmarks, vertex_count, rows }
    }

    /// The landmarks, in order of importance.
    #[must_use]
    pub(crate) fn landmarks(&self) -> &[VertexId] {
        &self.landmarks
    }

    /// Number of landmarks k.
    #[must_use]
    pub(crate) fn len(&self) -> usize {
        self.landmarks.len()
    }

    /// Number of vertices n.
    #[must_use]
    pub(crate) fn vertex_count(&self) -> usize {
        self.vertex_count
    }

    /// Distances from landmark number `l` to every vertex.
    #[must_use]
    pub(crate) fn row(&self, l: usize) -> &[f32] {
        &self.rows[l * self.vertex_count..(l + 1) * self.vertex_count]
    }

    /// The distances of a part, whose vertex `i` is this mesh's `vertices[i]`, from the landmarks that lie in it. Not
    /// guaranteed: that the shortest paths stay in the part; so they are at most what the part alone would have. O(kn).
    #[must_use]
    pub(crate) fn restricted(&self, vertices: &[VertexId]) -> Self {
        let mut place = vec![VertexId::NONE; self.vertex_count];
        for (i, v) in vertices.iter().enumerate().rev() {
            place[v.index()] = VertexId::new(i);
        }
        let kept: Vec<usize> = (0..self.len()).filter(|&l| !place[self.landmarks[l].index()].is_none()).collect();
        let rows = kept.iter().flat_map(|&l| vertices.iter().map(move |v| self.row(l)[v.index()])).collect();
        let landmarks = kept.iter().map(|&l| place[self.landmarks[l].index()]).collect();
        Self::new(landmarks, vertices.len(), rows)
    }

    /// All distances, row after row.
    #[cfg(test)]
    #[must_use]
    pub(crate) fn into_rows(self) -> Vec<f32> {
        self.rows
    }

    /// Distance from landmark number `l` to `v`.
    #[inline]
    #[must_use]
    pub(crate) fn get(&self, l: usize, v: VertexId) -> f64 {
        f64::from(self.rows[l * self.vertex_count + v.index()])
    }

    /// The k×k distances between landmarks, row by row, made symmetric by averaging: marching from
    /// one end and from the other differs by the discretisation error.
    #[must_use]
    pub(crate) fn between_landmarks(&self) -> Vec<f64> {
        let k = self.len();
        let mut d = vec![0.0; k * k];
        for i in 0..k {
            for j in 0..i {
                let mean = 0.5 * (self.get(i, self.landmarks[j]) + self.get(j, self.landmarks[i]));
                d[i * k + j] = mean;
                d[j * k + i] = mean;
            }
        }
        d
    }
}
