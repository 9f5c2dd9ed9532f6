//! What was found wrong with a mesh and mended or worked around.

/// How often a defect occurs, and where first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Defect<T> {
    /// Number of occurrences.
    pub count: usize,
    /// The first one, by index; `None` if there is none.
    pub first: Option<T>,
}

impl<T> Default for Defect<T> {
    fn default() -> Self {
        Self { count: 0, first: None }
    }
}

impl<T: Copy> Defect<T> {
    /// Counts an occurrence.
    pub(super) fn found(&mut self, place: T) {
        self.count += 1;
        self.first.get_or_insert(place);
    }
}

/// Everything irregular about an input mesh. None of it keeps the mesh from being unwrapped.
///
/// Vertices, edges (vertex pairs) and faces are those of the input; vertices and faces that merely
/// coincide are no defects.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Defects {
    /// Edges with more than two faces: the flattest pairs stay joined, the rest is cut.
    pub non_manifold_edges: Defect<[u32; 2]>,
    /// Edges cut because the surface has one side only, as a Möbius strip.
    pub contradicting_edges: Defect<[u32; 2]>,
    /// Vertices whose faces hang together at nothing but the vertex.
    pub bow_tie_vertices: Defect<u32>,
    /// Edges of no length, which became points.
    pub edges_of_no_length: Defect<[u32; 2]>,
    /// Triangles without area (of the triangulated faces), by face.
    pub zero_area_triangles: Defect<u32>,
    /// Faces wound against most of their component.
    pub reversed_faces: Defect<u32>,
    /// Faces that name a vertex twice, or two vertices at one point.
    pub repeated_vertices: Defect<u32>,
    /// Faces that have the same vertices as an earlier face.
    pub duplicate_faces: Defect<u32>,
    /// Vertices joined with an earlier vertex at the same position.
    pub welded_vertices: Defect<u32>,
    /// Vertices of faces with a coordinate that is infinite or not a number.
    pub non_finite_vertices: Defect<u32>,
    /// Faces with such a vertex; they get no UVs.
    pub unmapped_faces: Defect<u32>,
    /// Faces whose given triangulation does not cover them, so that another was made.
    pub replaced_triangulations: Defect<u32>,
}

impl Defects {
    /// Gives faces other numbers, those of [`Self::unmapped_faces`] excepted.
    pub(super) fn renumber_faces(&mut self, number: impl Fn(u32) -> u32) {
        for faces in [
            &mut self.zero_area_triangles,
            &mut self.reversed_faces,
            &mut self.repeated_vertices,
            &mut self.duplicate_faces,
            &mut self.replaced_triangulations,
        ] {
            faces.first = faces.first.map(&number);
        }
    }

    /// One sentence a kind of defect, in plain words, with the first element concerned.
    ///
    /// Welding and winding that agree with what was asked for are no reason to worry an artist and
    /// are left to the counts.
    #[must_use]
    pub(crate) fn warnings(&self) -> Vec<String> {
        let edge = |e: [u32; 2]| format!("between vertices {} and {}", e[0], e[1]);
        let vertex = |v: u32| format!("vertex {v}");
        let face = |f: u32| format!("face {f}");
        let mut out = Vec::new();
        say(
            &mut out,
            self.unmapped_faces,
            "face has",
            "faces have",
            "a vertex with non-finite coordinates and got no UVs",
            face,
        );
        say(&mut out, self.non_finite_vertices, "vertex has", "vertices have", "non-finite coordinates", vertex);
        say(
            &mut out,
            self.non_manifold_edges,
            "edge has",
            "edges have",
            "more than two faces and became seams in part",
            edge,
        );
        say(
            &mut out,
            self.contradicting_edges,
            "edge was",
            "edges were",
            "cut because the surface has only one side there",
            edge,
        );
        say(&mut out, self.bow_tie_vertices, "vertex joins", "vertices join", "faces that share no edge", vertex);
        say(&mut out, self.edges_of_no_length, "edge has", "edges have", "no length and became a point", edge);
        say(&mut out, self.zero_area_triangles, "triangle has", "triangles have", "no area", face);
        say(&mut out, self.repeated_vertices, "face uses", "faces use", "the same point more than once", face);
        say(&mut out, self.duplicate_faces, "face repeats", "faces repeat", "the vertices of another face", face);
        say(&mut out, self.reversed_faces, "face is", "faces are", "wound against the rest of the surface", face);
        say(
            &mut out,
            self.replaced_triangulations,
            "face was",
            "faces were",
            "triangulated again: the given triangles do not cover it",
            face,
        );
        out
    }
}

fn say<T: Copy>(
    out: &mut Vec<String>,
    defect: Defect<T>,
    one: &str,
    many: &str,
    rest: &str,
    name: impl Fn(T) -> String,
) {
    if let Some(first) = defect.first {
        let (verb, lead) = if defect.count == 1 { (one, "") } else { (many, "first ") };
        out.push(format!("{} {verb} {rest} ({lead}{}).", defect.count, name(first)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn warnings_name_the_first_element() {
        let mut d = Defects::default();
        assert!(d == Defects::default() && d.warnings().is_empty());
        d.non_manifold_edges.found([3, 9]);
        d.non_manifold_edges.found([4, 5]);
        d.repeated_vertices.found(7);
        assert_eq!(
            d.warnings(),
            [
                "2 edges have more than two faces and became seams in part (first between vertices 3 and 9).",
                "1 face uses the same point more than once (face 7).",
            ]
        );
    }
}
