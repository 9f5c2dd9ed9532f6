//! What is a copy of what, so that charts of like parts can be laid on each other.
//!
//! Charts change on their way from here to the texture: some are cut across, some are made anew after rounding. So what
//! is kept are not pairs of charts but pairs of places on the surface, side by side. Charts whose polygons are copies
//! of the same ones, and are cut along the copies of the same sides, have the same description.

use crate::charts::Chart;
use crate::mesh::{FaceId, Groups, HalfedgeId, Mirror};

use super::alike::Alike;

/// For the sides of the polygons of a surface those that they are copies of.
#[derive(Clone, Debug, Default)]
pub(crate) struct Originals {
    /// The original of each half-edge that is a side, itself where it is no copy. Empty where nothing is to be stacked.
    original: Vec<HalfedgeId>,
    /// Whether each face is the mirror image of its original.
    is_mirrored: Vec<bool>,
    /// Whether each face belongs to a component that is a copy or has copies, or that was charted by halves.
    has_like: Vec<bool>,
    /// For sides in the second half of a component that was charted by halves, their images in the first half; none
    /// elsewhere. Empty where halves are not to be stacked.
    in_first_half: Vec<HalfedgeId>,
}

/// A side of a polygon in a chart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct DescribedSide {
    /// The side of the surface that this one is a copy of, in the end.
    original: HalfedgeId,
    /// Whether the chart ends there.
    is_border: bool,
}

/// What a chart is a copy of.
#[derive(Clone, Debug)]
pub(crate) struct Described {
    /// Its sides, ascending, and the half-edge of the chart's mesh that each one is. Two charts with the same sides
    /// have the same polygons, cut in the same way.
    pub(crate) sides: Vec<(DescribedSide, HalfedgeId)>,
    /// Whether it is the mirror image of what these sides belong to.
    pub(crate) is_mirrored: bool,
}

impl Described {
    /// The sides alone.
    pub(crate) fn shape(&self) -> impl Iterator<Item = DescribedSide> + '_ {
        self.sides.iter().map(|side| side.0)
    }
}

impl Originals {
    /// Of components, for each of which `likes` has the one before it that it is like, if any.
    pub(super) fn of(face_count: usize, components: &Groups<FaceId>, likes: &[Option<Alike>]) -> Self {
        let mut out = Self {
            original: (0..3 * face_count).map(HalfedgeId::new).collect(),
            is_mirrored: vec![false; face_count],
            has_like: vec![false; face_count],
            in_first_half: Vec::new(),
        };
        // Originals come first, so that what they are copies of is known.
        for (component, like) in likes.iter().enumerate() {
            let Some(like) = like else { continue };
            let [there, here] = [like.original, component].map(|c| components.group(c));
            there.iter().for_each(|f| out.has_like[f.index()] = true);
            for (local, face) in here.iter().enumerate() {
                out.has_like[face.index()] = true;
                for (h, side) in FaceId::new(local).halfedges().into_iter().zip(face.halfedges()) {
                    let source = like.likeness.source(h);
                    // Diagonals have none.
                    if source.is_none() {
                        continue;
                    }
                    let source = there[source.face().index()].halfedge(source.slot());
                    out.original[side.index()] = out.original[source.index()];
                    out.is_mirrored[face.index()] = out.is_mirrored[source.face().index()] != like.likeness.is_mirrored;
                }
            }
        }
        out
    }

    /// Makes the second half of a component, which is `faces` of the surface, the mirror image of the first.
    pub(super) fn add_halves(&mut self, mirror: &Mirror, faces: &[FaceId]) {
        if self.in_first_half.is_empty() {
            self.in_first_half = vec![HalfedgeId::NONE; self.original.len()];
        }
        let first = mirror.first_half();
        for (local, face) in faces.iter().enumerate() {
            self.has_like[face.index()] = true;
            let local = FaceId::new(local);
            if first.binary_search(&local).is_ok() {
                continue;
            }
            for (h, side) in local.halfedges().into_iter().zip(face.halfedges()) {
                let image = mirror.likeness.image(h);
                if !image.is_none() {
                    self.in_first_half[side.index()] = faces[image.face().index()].halfedge(image.slot());
                }
            }
        }
    }

    /// What a chart of the surface is a copy of; `None` where nothing is like it. O(n log n).
    pub(crate) fn described(&self, chart: &Chart) -> Option<Described> {
        let patch = &chart.patch;
        let first = patch.faces.first()?.index();
        if !*self.has_like.get(first)? {
            return None;
        }
        let mut sides = Vec::new();
        for (local, face) in patch.mesh.faces().zip(&patch.faces) {
            if self.is_mirrored[face.index()] != self.is_mirrored[first] {
                return None;
            }
            for (h, side) in local.halfedges().into_iter().zip(face.halfedges()) {
                if !patch.is_diagonal(h) {
                    let original = self.original[side.index()];
                    sides.push((DescribedSide { original, is_border: patch.mesh.is_boundary(h) }, h));
                }
            }
        }
        let mut is_mirrored = self.is_mirrored[first];
        let image = |side: &DescribedSide| self.in_first_half.get(side.original.index()).copied();
        let images: Option<Vec<HalfedgeId>> =
            sides.iter().map(|(side, _)| image(side).filter(|h| !h.is_none())).collect();
        // A chart of the second half counts as a copy of its image in the first; one that reaches across the plane has no image there.
        if let Some(images) = images {
            sides.iter_mut().zip(images).for_each(|((side, _), image)| side.original = image);
            is_mirrored = !is_mirrored;
        }
        sides.sort_unstable();
        Some(Described { sides, is_mirrored })
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point2, Point3};

    use super::*;
    use crate::charts::Patch;
    use crate::mesh::{self, Likeness, Shape, TriMesh, VertexId, test_surfaces};
    use crate::progress::Progress;

    /// Three sheets without symmetry beside each other, the last one mirrored, as one surface: 12 quads each.
    fn sheets() -> (TriMesh, Vec<u32>) {
        let flat = test_surfaces::grid(4, 3, [4.0, 3.0], 0.0);
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        for sheet in 0..3 {
            let first = positions.len() as u32;
            let side = if sheet == 2 { -1.0 } else { 1.0 };
            let height = |p: &Point3<f64>| 0.1 * p.x * p.x + 0.05 * p.y.powi(3) + 0.1 * (p.x * p.y).sin();
            let place = |p: &Point3<f64>| Point3::new(side * p.x + 20.0 * f64::from(sheet), p.y, height(p));
            positions.extend(flat.positions().iter().map(place));
            let named = |t: &[VertexId; 3]| {
                let [a, b, c] = t.map(|v| first + v.index() as u32);
                if sheet == 2 { [a, c, b] } else { [a, b, c] }
            };
            triangles.extend(flat.triangles().iter().map(named));
        }
        let mesh = test_surfaces::mesh(&positions, &triangles);
        let polygon = (0..mesh.face_count() as u32).map(|f| f / 2).collect();
        (mesh, polygon)
    }

    fn whole(mesh: &TriMesh, polygon: &[u32], faces: &[FaceId]) -> Patch {
        let patch = Patch::of_surface(mesh, polygon, faces.to_vec());
        Patch::whole(patch.mesh, patch.polygon)
    }

    fn likeness(here: &Patch, there: &Patch, is_mirrored: bool) -> Likeness {
        let [a, b] = [here, there].map(|p| Shape::new(&p.mesh, &p.polygon).expect("it has sides"));
        let found = a.likeness(&b, is_mirrored, |_, _| true, &Progress::new()).expect("not cancelled");
        found.expect("they are alike")
    }

    fn chart(mesh: &TriMesh, polygon: &[u32], faces: impl Iterator<Item = usize>) -> Chart {
        let patch = Patch::of_surface(mesh, polygon, faces.map(FaceId::new).collect());
        Chart { uv: vec![Point2::origin(); patch.mesh.vertex_count()], patch, l2: 1.0 }
    }

    #[test]
    fn charts_of_the_same_polygons_cut_alike_have_the_same_description() {
        let (mesh, polygon) = sheets();
        let (label, count) = mesh.components();
        let components = Groups::by_label(&label, count, FaceId::new);
        assert_eq!(count, 3);
        let patches: Vec<Patch> = (0..3).map(|c| whole(&mesh, &polygon, components.group(c))).collect();
        // The third is a copy of a copy.
        let likes = [
            None,
            Some(Alike { original: 0, likeness: likeness(&patches[0], &patches[1], false) }),
            Some(Alike { original: 1, likeness: likeness(&patches[1], &patches[2], true) }),
        ];
        let originals = Originals::of(mesh.face_count(), &components, &likes);
        let described = |chart: &Chart| originals.described(chart).expect("there are like parts");
        let same = |a: &Described, b: &Described| a.shape().eq(b.shape());
        let sheet = |c: usize, faces: std::ops::Range<usize>| chart(&mesh, &polygon, faces.map(|f| 24 * c + f));
        for faces in [0..24, 0..8, 6..14] {
            let [first, second, third] = [0, 1, 2].map(|c| described(&sheet(c, faces.clone())));
            assert!(same(&first, &second) && same(&first, &third), "{faces:?}");
            assert_eq!([&first, &second, &third].map(|d| d.is_mirrored), [false, false, true]);
        }
        assert!(!same(&described(&sheet(0, 0..8)), &described(&sheet(1, 2..10))), "other polygons");
        // The same polygons, one chart of them cut open along a side.
        let plain = sheet(1, 0..24);
        let inner = plain.patch.mesh.halfedges().find(|&h| {
            !plain.patch.mesh.is_boundary(h)
                && !plain.patch.is_diagonal(h)
                && plain.patch.mesh.is_boundary_vertex(plain.patch.mesh.from(h))
        });
        let patch = plain.patch.cut(&[inner.expect("there are sides that lead inwards")]);
        let open = Chart { uv: vec![Point2::origin(); patch.mesh.vertex_count()], patch, l2: 1.0 };
        assert!(!same(&described(&sheet(0, 0..24)), &described(&open)), "cut elsewhere");
        let nothing = [None, None, None];
        assert!(Originals::of(mesh.face_count(), &components, &nothing).described(&plain).is_none());
        assert!(Originals::default().described(&plain).is_none());
    }

    #[test]
    fn halves_are_copies_of_each_other_and_what_reaches_across_is_none() {
        let flat = test_surfaces::grid(8, 4, [8.0, 4.0], 0.0);
        let height = |p: &Point3<f64>| 0.1 * (p.x - 4.0).powi(2) + 0.3 * p.y + 0.05 * p.y * p.y;
        let positions: Vec<_> = flat.positions().iter().map(|p| Point3::new(p.x, p.y, height(p))).collect();
        let triangles: Vec<_> = flat.triangles().iter().map(|t| t.map(|v| v.index() as u32)).collect();
        let mesh = test_surfaces::mesh(&positions, &triangles);
        let polygon: Vec<u32> = (0..mesh.face_count() as u32).map(|f| f / 2).collect();
        let mirror = mesh::mirror(&mesh, &polygon, &Progress::new()).expect("not cancelled").expect("a plane");
        let all: Vec<FaceId> = mesh.faces().collect();
        let components = Groups::by_label(&vec![0; all.len()], 1, FaceId::new);
        let mut originals = Originals::of(mesh.face_count(), &components, &[None]);
        originals.add_halves(&mirror, &all);
        let middle = |f: &FaceId| mesh.triangle_positions(*f).iter().map(|p| p.x).sum::<f64>() / 3.0;
        let between = |low: f64, high: f64| {
            let faces = all.iter().filter(|f| (low..high).contains(&middle(f))).map(|f| f.index());
            originals.described(&chart(&mesh, &polygon, faces)).expect("it has a plane")
        };
        let (left, right) = (between(1.0, 3.0), between(5.0, 7.0));
        assert!(left.shape().eq(right.shape()) && left.is_mirrored != right.is_mirrored);
        let (across, wide) = (between(3.0, 5.0), between(2.0, 6.0));
        assert!(!across.is_mirrored && !wide.is_mirrored && !across.shape().eq(wide.shape()));
    }
}
