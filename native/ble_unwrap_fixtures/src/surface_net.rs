//! Quads on the zero level of a distance function.

use crate::poly_mesh::PolyMesh;

/// Cells along one side of a block that is evaluated as a whole or skipped.
const BLOCK: i64 = 8;

/// Surface net (Gibson 1998) of the zero level of `distance` in the box [−extent, extent]³, with
/// cells of size `cell`: one vertex a cell that the surface crosses, at the mean of its crossings
/// with the cell's edges, and one quad a grid edge it crosses. Negative is inside; quads are wound
/// outwards.
///
/// `distance` may change by at most `slope` times the way gone: blocks it cannot cross are skipped,
/// so the cost is that of the surface and not of the box. Details finer than two cells may come out
/// non-manifold.
pub(crate) fn surface_net(extent: f64, cell: f64, slope: f64, distance: impl Fn([f64; 3]) -> f64) -> PolyMesh {
    let cells = (2.0 * extent / cell).ceil() as i64;
    let blocks = (cells + BLOCK - 1) / BLOCK;
    let at = |g: [i64; 3]| g.map(|i| i as f64 * cell - extent);
    // Cells crossed: grid position, signs of their eight corners, place of their vertex.
    let mut crossed: Vec<([i64; 3], u8, [f64; 3])> = Vec::new();
    let block_origins = (0..blocks).flat_map(|x| (0..blocks).flat_map(move |y| (0..blocks).map(move |z| [x, y, z])));
    for origin in block_origins.map(|b| b.map(|i| i * BLOCK)) {
        let half = 0.5 * BLOCK as f64 * cell;
        if distance(at(origin).map(|x| x + half)).abs() > slope * half * 3.0_f64.sqrt() {
            continue;
        }
        cross_block(origin, cell, &at, &distance, &mut crossed);
    }
    crossed.sort_unstable_by_key(|c| c.0);
    let vertex = |g: [i64; 3]| crossed.binary_search_by_key(&g, |c| c.0).ok().map(|i| i as u32);
    let mut faces = Vec::new();
    for &(g, signs, _) in &crossed {
        for axis in 0..3 {
            // The edge from the cell's lowest corner along the axis, and the four cells around it.
            let (here, there) = (signs & 1 != 0, signs >> (1 << axis) & 1 != 0);
            if here == there {
                continue;
            }
            let around = [(0, 0), (-1, 0), (-1, -1), (0, -1)].map(|(du, dv)| {
                let mut g = g;
                g[(axis + 1) % 3] += du;
                g[(axis + 2) % 3] += dv;
                vertex(g)
            });
            if let [Some(a), Some(b), Some(c), Some(d)] = around {
                faces.push(if here { vec![a, b, c, d] } else { vec![d, c, b, a] });
            }
        }
    }
    PolyMesh { positions: crossed.iter().map(|c| c.2).collect(), faces }
}

/// Appends the crossed cells of one block.
fn cross_block(
    origin: [i64; 3],
    cell: f64,
    at: &impl Fn([i64; 3]) -> [f64; 3],
    distance: &impl Fn([f64; 3]) -> f64,
    crossed: &mut Vec<([i64; 3], u8, [f64; 3])>,
) {
    const N: i64 = BLOCK + 1;
    let offset = |c: usize| [c & 1, c >> 1 & 1, c >> 2 & 1].map(|d| d as i64);
    let add = |a: [i64; 3], b: [i64; 3]| [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
    let value: Vec<f64> = (0..N * N * N).map(|i| distance(at(add(origin, [i / (N * N), i / N % N, i % N])))).collect();
    for i in 0..BLOCK * BLOCK * BLOCK {
        let local = [i / (BLOCK * BLOCK), i / BLOCK % BLOCK, i % BLOCK];
        let corner: [f64; 8] = std::array::from_fn(|c| {
            let [x, y, z] = add(local, offset(c));
            value[((x * N + y) * N + z) as usize]
        });
        let signs = (0..8).filter(|&c| corner[c] < 0.0).fold(0u8, |s, c| s | 1 << c);
        if signs == 0 || signs == u8::MAX {
            continue;
        }
        let (mut sum, mut count) = ([0.0; 3], 0.0);
        for c in 0..8 {
            for axis in (0..3).filter(|axis| c >> axis & 1 == 0) {
                let d = c | 1 << axis;
                if (corner[c] < 0.0) != (corner[d] < 0.0) {
                    let mut p = offset(c).map(|x| x as f64);
                    p[axis] += corner[c] / (corner[c] - corner[d]);
                    (0..3).for_each(|k| sum[k] += p[k]);
                    count += 1.0;
                }
            }
        }
        let g = add(origin, local);
        let low = at(g);
        crossed.push((g, signs, [0, 1, 2].map(|k| low[k] + cell * sum[k] / count)));
    }
}
