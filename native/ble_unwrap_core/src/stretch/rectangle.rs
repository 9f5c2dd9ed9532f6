//! A chart whose quads form a grid laid out as a rectangle: a road, a belt, a pipe or a ring that was cut open. A texture then runs along it in straight
//! rows, as it does along a plank.

use std::collections::VecDeque;

use nalgebra::Point2;

use crate::mesh::{HalfedgeId, Quad, TriMesh, measure};

/// The sides of a quad, one after the other, each on its inner side.
type Cell = [HalfedgeId; 4];

/// A map of a chart onto a rectangle.
pub(crate) struct Rectangle {
    /// Where the vertices lie; the area is that of the surface.
    pub(crate) uv: Vec<Point2<f64>>,
    /// How many times as long as wide it is.
    pub(crate) slenderness: f64,
}

/// A chart that is a grid of quads, or of triangles that pair up to quads along the longest side of both, as a rectangle with straight rows and columns. Of
/// all these it is the one of least L2 stretch, but for what the quads lean: the width of each column and the height of each row are best, in closed form.
/// `polygon` names the polygon of each face. `None` where there is no such grid. O(n).
///
/// # Panics
/// If there is not one polygon a face.
pub(crate) fn rectangle(mesh: &TriMesh, polygon: &[u32]) -> Option<Rectangle> {
    let cells = cells(mesh, polygon)?;
    let place = Grid::of(mesh, &cells)?;
    // Stretched from a by b to w by h, a cell of area A adds A·(a²/w² + b²/h²) to the squared stretch of a map of its area.
    let [mut across, mut along] = place.size.map(|count| vec![0.0; count]);
    for (cell, at) in cells.iter().zip(&place.cells) {
        let area = area(mesh, cell);
        let square = |k: usize| {
            let side = |k: usize| mesh.edge_length(cell[k % 4]).powi(2);
            0.5 * (side(k) + side(k + 2))
        };
        across[at.column] += area * square(at.turns);
        along[at.row] += area * square(at.turns + 1);
    }
    // So widths are best in proportion to the cube roots of these sums, and both directions add as much.
    let lines = |sums: &[f64]| {
        let mut gone = vec![0.0];
        sums.iter().for_each(|sum| gone.push(gone[gone.len() - 1] + sum.cbrt()));
        gone
    };
    let (x, y) = (lines(&across), lines(&along));
    let [wide, high] = [x[place.size[0]], y[place.size[1]]];
    let ratio = (high / wide).sqrt();
    let scale = (measure::total_area(mesh) / (wide * high * ratio)).sqrt();
    let laid: Vec<Point2<f64>> =
        place.vertices.iter().map(|&[i, j]| Point2::new(x[i] * scale, y[j] * scale * ratio)).collect();
    let is_sound = |p: &Point2<f64>| p.x.is_finite() && p.y.is_finite();
    if !laid.iter().all(is_sound) || super::first_flip(mesh, &laid).is_some() {
        return None;
    }
    let [wide, high] = [wide, high * ratio];
    Some(Rectangle { uv: laid, slenderness: wide.max(high) / wide.min(high) })
}

fn area(mesh: &TriMesh, cell: &Cell) -> f64 {
    [cell[0], cell[2]].map(|h| measure::triangle_area(mesh.triangle_positions(h.face()))).iter().sum()
}

/// All faces in pairs; `None` where some are left.
fn cells(mesh: &TriMesh, polygon: &[u32]) -> Option<Vec<Cell>> {
    let mut is_taken = vec![false; mesh.face_count()];
    let mut cells = Vec::with_capacity(mesh.face_count() / 2);
    let mut take = |diagonal: HalfedgeId| {
        let other = mesh.twin(diagonal);
        let is_free = !is_taken[diagonal.face().index()] && !is_taken[other.face().index()];
        if is_free {
            [diagonal, other].iter().for_each(|h| is_taken[h.face().index()] = true);
            cells.push([other.next(), other.prev(), diagonal.next(), diagonal.prev()]);
        }
    };
    Quad::all(mesh, polygon).for_each(|quad| take(quad.diagonal));
    let longest = |h: HalfedgeId| {
        let sides = [h, h.next(), h.prev()];
        sides.into_iter().max_by(|g, h| mesh.edge_length(*g).total_cmp(&mesh.edge_length(*h)))
    };
    for h in mesh.edges().filter(|&h| !mesh.is_boundary(h)) {
        let t = mesh.twin(h);
        // Triangles of larger polygons are no triangles of the surface.
        let is_between = polygon[h.face().index()] != polygon[t.face().index()];
        if h.face() != t.face() && is_between && longest(h) == Some(h) && longest(t) == Some(t) {
            take(h);
        }
    }
    (2 * cells.len() == mesh.face_count()).then_some(cells)
}

/// Where the cells and vertices of a grid are.
struct Grid {
    /// Columns and rows.
    size: [usize; 2],
    cells: Vec<InGrid>,
    /// For each vertex the lines that it is on, counted from the left and from below.
    vertices: Vec<[usize; 2]>,
}

#[derive(Clone, Copy)]
struct InGrid {
    column: usize,
    row: usize,
    /// The side of the cell that is below.
    turns: usize,
}

impl Grid {
    /// `None` unless the cells fill a rectangle, each place once.
    fn of(mesh: &TriMesh, cells: &[Cell]) -> Option<Self> {
        const STEPS: [[i64; 2]; 4] = [[1, 0], [0, 1], [-1, 0], [0, -1]];
        let mut cell_of = vec![None; 3 * mesh.face_count()];
        for (c, cell) in cells.iter().enumerate() {
            cell.iter().enumerate().for_each(|(k, h)| cell_of[h.index()] = Some((c, k)));
        }
        // Of each cell the side that is below, of each vertex its place, from a first cell on.
        let mut below: Vec<Option<usize>> = vec![None; cells.len()];
        let mut place: Vec<Option<[i64; 2]>> = vec![None; mesh.vertex_count()];
        *below.first_mut()? = Some(0);
        place[mesh.from(cells[0][0]).index()] = Some([0, 0]);
        let mut open = VecDeque::from([0]);
        let mut reached = 0;
        while let Some(c) = open.pop_front() {
            reached += 1;
            let turns = below[c]?;
            let known = (0..4).find_map(|k| Some((k, place[mesh.from(cells[c][k]).index()]?)))?;
            let mut at = known.1;
            for k in (0..4).map(|k| known.0 + k) {
                let side = cells[c][k % 4];
                let here = &mut place[mesh.from(side).index()];
                if *here.get_or_insert(at) != at {
                    return None;
                }
                let direction = (k + 4 - turns) % 4;
                at = [at[0] + STEPS[direction][0], at[1] + STEPS[direction][1]];
                if mesh.is_boundary(side) {
                    continue;
                }
                let (next, slot) = cell_of[mesh.twin(side).index()]?;
                // From beyond, the side runs the other way.
                let expected = (slot + 4 - (direction + 2) % 4) % 4;
                match below[next] {
                    Some(turns) if turns == expected => {}
                    Some(_) => return None,
                    None => {
                        below[next] = Some(expected);
                        open.push_back(next);
                    }
                }
            }
        }
        let place: Vec<[i64; 2]> = place.into_iter().collect::<Option<_>>()?;
        let least = [0, 1].map(|axis| place.iter().map(|p| p[axis]).min().unwrap_or(0));
        let lines = |p: &[i64; 2]| [0, 1].map(|axis| usize::try_from(p[axis] - least[axis]).unwrap_or(0));
        let vertices: Vec<[usize; 2]> = place.iter().map(lines).collect();
        let size = [0, 1].map(|axis| vertices.iter().map(|p| p[axis]).max().unwrap_or(0));
        let is_full = size[0] * size[1] == cells.len() && (size[0] + 1) * (size[1] + 1) == vertices.len();
        let mut is_used = vec![false; vertices.len()];
        let is_new = |p: &[usize; 2]| !std::mem::replace(&mut is_used[p[1] * (size[0] + 1) + p[0]], true);
        if reached < cells.len() || !is_full || !vertices.iter().all(is_new) {
            return None;
        }
        let in_grid = |(cell, below): (&Cell, Option<usize>)| {
            let turns = below?;
            let [column, row] = vertices[mesh.from(cell[turns]).index()];
            Some(InGrid { column, row, turns })
        };
        let cells = cells.iter().zip(below).map(in_grid).collect::<Option<_>>()?;
        Some(Self { size, cells, vertices })
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;
    use crate::distortion::RestTriangle;
    use crate::stretch::test_meshes::{annulus, grid};
    use crate::stretch::{aligned_length, l2_stretch, plane_area};

    fn quads(mesh: &TriMesh) -> Vec<u32> {
        (0..mesh.face_count() as u32).map(|f| f / 2).collect()
    }

    fn triangles(mesh: &TriMesh) -> Vec<u32> {
        (0..mesh.face_count() as u32).collect()
    }

    fn flat(mesh: &TriMesh) -> Vec<Point2<f64>> {
        mesh.positions().iter().map(|p| p.xy()).collect()
    }

    /// A road that turns by some angle, 1 wide, with its middle at a distance of `radius`.
    fn bend(radius: f64) -> TriMesh {
        grid(24, 2, |x, y| {
            let (s, c) = (0.1 * x).sin_cos();
            Point3::new((radius + 0.5 * y - 0.5) * c, (radius + 0.5 * y - 0.5) * s, 0.0)
        })
    }

    #[test]
    fn a_bend_becomes_straight_in_quads_and_in_triangles() {
        let mesh = bend(4.0);
        for polygon in [quads(&mesh), triangles(&mesh)] {
            let found = rectangle(&mesh, &polygon).expect("a grid");
            let rest = RestTriangle::of_mesh(&mesh);
            // Lengths along the road are off by up to an eighth, and ends of triangles lean by a twentieth.
            let l2 = l2_stretch(&mesh, &rest, &found.uv);
            assert!((1.002..1.01).contains(&l2), "{l2}");
            let high = found.uv.iter().fold(found.uv[0], |high, p| high.sup(p));
            let low = found.uv.iter().fold(found.uv[0], |low, p| low.inf(p));
            let [wide, tall] = [high.x - low.x, high.y - low.y];
            assert!((plane_area(&mesh, &found.uv) - wide * tall).abs() < 1e-9 * wide * tall);
            assert!((measure::total_area(&mesh) - wide * tall).abs() < 1e-9 * wide * tall);
            assert!(found.slenderness > 9.0 && found.slenderness < 10.5, "{}", found.slenderness);
            // All of its border but the ends, of which the best turn lays at most both along an axis.
            assert!(aligned_length(&mesh, &flat(&mesh)) < 0.2 * mesh.boundary_length());
            assert!((aligned_length(&mesh, &found.uv) - mesh.boundary_length()).abs() < 1e-9);
        }
    }

    #[test]
    fn columns_and_rows_keep_their_sizes() {
        // Columns of 1, 2, 3, … and rows of 1, 3, 5, …
        let mesh = grid(6, 4, |x, y| Point3::new(0.5 * x * (x + 1.0), y * y, 0.0));
        let found = rectangle(&mesh, &quads(&mesh)).expect("a grid");
        for h in mesh.halfedges() {
            let side = found.uv[mesh.to(h).index()] - found.uv[mesh.from(h).index()];
            assert!((side.norm() - mesh.edge_length(h)).abs() < 1e-9);
        }
    }

    #[test]
    fn no_other_widths_and_heights_have_less_stretch() {
        // A wall that is wider above, its columns and rows uneven.
        let mesh = grid(5, 4, |x, y| {
            let angle = 0.1 * x * (1.0 + 0.1 * x);
            let radius = 3.0 + 0.2 * y * y;
            Point3::new(radius * angle.cos(), radius * angle.sin(), 0.5 * y)
        });
        let rest = RestTriangle::of_mesh(&mesh);
        let found = rectangle(&mesh, &quads(&mesh)).expect("a grid");
        let best = l2_stretch(&mesh, &rest, &found.uv);
        // The quads lean a little, and what that adds depends on the widths, too.
        for (axis, share) in [(0, 0.95), (0, 1.05), (1, 0.95), (1, 1.05)] {
            let lines: Vec<f64> = found.uv.iter().map(|p| p[axis]).collect();
            let middle = 0.5 * lines.iter().copied().fold(0.0, f64::max);
            let moved: Vec<Point2<f64>> = found
                .uv
                .iter()
                .map(|p| {
                    let mut q = *p;
                    q[axis] = if p[axis] < middle { p[axis] * share } else { p[axis] + middle * (share - 1.0) };
                    q
                })
                .collect();
            assert!(l2_stretch(&mesh, &rest, &moved) > best - 1e-4);
        }
    }

    #[test]
    fn what_is_no_grid_is_none() {
        let ring = annulus(24, 3);
        for polygon in [quads(&ring), triangles(&ring)] {
            assert!(rectangle(&ring, &polygon).is_none());
        }
        // A corner is missing.
        let whole = grid(4, 4, |x, y| Point3::new(x, y, 0.0));
        let faces: Vec<_> = whole.faces().skip(2).collect();
        let (mesh, _) = whole.submesh(&faces, |_| false);
        assert!(rectangle(&mesh, &quads(&mesh)).is_none());
        // A larger polygon is no pair of triangles.
        let polygon: Vec<u32> = quads(&whole).iter().map(|q| q / 2).collect();
        assert!(rectangle(&whole, &polygon).is_none());
    }
}
