//! What an artist wants of a layout: like parts alike, mirrored seams, hidden seams, straight borders along the axes.

use std::collections::{BTreeMap, BTreeSet};

use ble_unwrap_core::settings::{Front, Settings, Stack, Style, Symmetry};
use ble_unwrap_core::{Atlas, MeshInput, Progress, unwrap};
use ble_unwrap_fixtures::{PolyMesh, capped_cylinder, torus, uv_sphere, voxels, wrapped_grid};

fn unwrapped(mesh: &PolyMesh, settings: &Settings) -> Atlas {
    let flat = mesh.flat();
    let input = MeshInput {
        positions: &mesh.positions,
        corner_vertices: &flat.corner_vertices,
        face_offsets: &flat.face_offsets,
        ..MeshInput::default()
    };
    let atlas = unwrap(&input, settings, &Progress::new()).expect("unwraps");
    assert_eq!((atlas.report.flips, atlas.report.overlaps), (0, 0));
    assert!(atlas.report.charts_over_limit.is_empty() && atlas.certificate.is_valid());
    atlas
}

fn count(atlas: &Atlas, rung: &str) -> usize {
    atlas.report.rungs.iter().filter(|taken| taken.0 == rung).map(|taken| taken.1).sum()
}

/// The edges at which UVs on both sides differ, by vertices.
fn seams(mesh: &PolyMesh, atlas: &Atlas) -> BTreeSet<[u32; 2]> {
    let mut found: BTreeMap<[u32; 2], Vec<[[f32; 2]; 2]>> = BTreeMap::new();
    let mut corner = 0;
    for face in &mesh.faces {
        let n = face.len();
        for k in 0..n {
            let (a, b) = (face[k], face[(k + 1) % n]);
            let (p, q) = (atlas.uv[corner + k], atlas.uv[corner + (k + 1) % n]);
            found.entry([a.min(b), a.max(b)]).or_default().push(if a < b { [p, q] } else { [q, p] });
        }
        corner += n;
    }
    found.into_iter().filter(|(_, sides)| sides.len() == 2 && sides[0] != sides[1]).map(|(edge, _)| edge).collect()
}

/// A blob with two horns on the right and on the left, the left ones mirror images of the right ones, and nothing else the same.
fn horned() -> PolyMesh {
    uv_sphere(32, 20).moved(|[x, y, z]| {
        let horn = |at: [f64; 3]| {
            let away = (x.abs() - at[0]).powi(2) + (y - at[1]).powi(2) + (z - at[2]).powi(2);
            0.8 * (-away / 0.05).exp()
        };
        let r = 1.0 + 0.15 * y + 0.1 * (2.0 * z).sin() + horn([0.6, 0.64, 0.48]) + horn([0.8, -0.36, -0.48]);
        [r * x, r * y * 1.2, r * z]
    })
}

#[test]
fn mirrored_surfaces_have_mirrored_seams() {
    let mesh = horned();
    let share = |symmetry: Symmetry| {
        let atlas = unwrapped(&mesh, &Settings { symmetry, ..Settings::default() });
        assert_eq!(count(&atlas, "mirrored"), usize::from(symmetry == Symmetry::Auto));
        mirrored_share(&mesh, &atlas)
    };
    assert_eq!(share(Symmetry::Auto), 1.0);
    assert!(share(Symmetry::Off) < 0.9, "else the shape is too easy for this test");
}

/// How many of the seams have a mirror image in x = 0 that is one, too.
fn mirrored_share(mesh: &PolyMesh, atlas: &Atlas) -> f64 {
    let place = |p: [f64; 3]| p.map(|x| (x * 1e6).round() as i64);
    let at: BTreeMap<[i64; 3], u32> = mesh.positions.iter().zip(0..).map(|(p, v)| (place(*p), v)).collect();
    let mirrored = |v: u32| {
        let [x, y, z] = mesh.positions[v as usize];
        at[&place([-x, y, z])]
    };
    let seams = seams(mesh, atlas);
    let image = |&[a, b]: &[u32; 2]| [mirrored(a).min(mirrored(b)), mirrored(a).max(mirrored(b))];
    seams.iter().filter(|edge| seams.contains(&image(edge))).count() as f64 / seams.len() as f64
}

/// Buttons on both sides of a body look the same from many sides, and are all alike.
#[test]
fn left_and_right_parts_are_mirror_images() {
    let mut all = horned();
    for k in 0..4 {
        let (s, c) = (0.3 + 0.9 * f64::from(k)).sin_cos();
        let right = capped_cylinder(0.4, 12, 3)
            .moved(|[x, y, z]| [0.2 * x + 3.0, 0.2 * (c * y - s * z) + s, 0.2 * (s * y + c * z) + c]);
        let mut left = right.clone().moved(|[x, y, z]| [-x, y, z]);
        left.faces.iter_mut().for_each(|face| face.reverse());
        all = all.joined(&right).joined(&left);
    }
    let atlas = unwrapped(&all, &Settings::default());
    assert_eq!(count(&atlas, "copied"), 7);
    assert_eq!(mirrored_share(&all, &atlas), 1.0);
}

#[test]
fn a_ring_is_two_straight_strips_cut_where_it_is_hidden() {
    let mesh = torus(0.35, 48, 24);
    let atlas = unwrapped(&mesh, &Settings::default());
    assert_eq!(atlas.report.charts, 2);
    let away = |v: u32| mesh.positions[v as usize][0].hypot(mesh.positions[v as usize][1]);
    let seams = seams(&mesh, &atlas);
    let inner = seams.iter().filter(|[a, b]| away(*a) < 0.66 && away(*b) < 0.66).count();
    assert!(inner >= 48 && seams.len() <= 48 + 2 * 24, "{inner} of {} edges on the inner equator", seams.len());
}

#[test]
fn parts_that_are_alike_get_the_same_map_as_quads_or_triangles() {
    let turn = |mesh: PolyMesh, k: u32, mirror: f64| {
        let (s, c) = (0.9 * f64::from(k)).sin_cos();
        mesh.moved(|[x, y, z]| {
            let x = mirror * x;
            // In single precision, as in a file.
            [c * x - s * y + 5.0 * f64::from(k), s * x + c * y, z].map(|x| f64::from(x as f32))
        })
    };
    for triangles in [false, true] {
        let one = || if triangles { horned().triangulated() } else { horned() };
        // Turned mirror images have their faces the other way round.
        let mut back = turn(one(), 3, -1.0);
        back.faces.iter_mut().for_each(|face| face.reverse());
        let all = turn(one(), 0, 1.0).joined(&turn(one(), 1, 1.0)).joined(&turn(one(), 2, 1.0)).joined(&back);
        let atlas = unwrapped(&all, &Settings::default());
        assert_eq!(count(&atlas, "copied"), 3);
        let corners: usize = one().faces.iter().map(Vec::len).sum();
        let area = |part: usize| {
            let (mut corner, mut areas) = (part * corners, Vec::new());
            for face in &one().faces {
                let uv = &atlas.uv[corner..corner + face.len()];
                let sum = (0..face.len()).map(|k| {
                    let (p, q) = (uv[k].map(f64::from), uv[(k + 1) % face.len()].map(f64::from));
                    p[0] * q[1] - p[1] * q[0]
                });
                areas.push(sum.sum::<f64>());
                corner += face.len();
            }
            areas.sort_by(f64::total_cmp);
            areas
        };
        let first = area(0);
        for part in 1..4 {
            let apart: f64 = area(part).iter().zip(&first).map(|(a, b)| (a - b).abs()).sum();
            assert!(apart < 0.01 * first.iter().sum::<f64>(), "part {part}: {apart}");
        }
        assert_eq!((atlas.report.stacked, atlas.report.stacks), (0, 0));
        let stacked = unwrapped(&all, &Settings { stack: Stack::Mirrored, ..Settings::default() });
        let report = &stacked.report;
        assert_eq!((report.charts, report.stacked), (atlas.report.charts, atlas.report.charts));
        assert!(report.stacks <= report.charts / 4 && stacked.certificate.stacked == report.charts, "{report:?}");
        assert!(report.texels_per_unit > 1.5 * atlas.report.texels_per_unit);
    }
}

#[test]
fn parts_that_differ_are_charted_by_themselves() {
    let other = horned().moved(|[x, y, z]| [x, y, if z > 0.9 { z + 0.05 } else { z } + 9.0]);
    let atlas = unwrapped(&horned().joined(&other), &Settings::default());
    assert_eq!(count(&atlas, "copied"), 0);
}

/// How much of the seams faces a direction, in the mean over their length: from -1 to 1.
fn facing(mesh: &PolyMesh, atlas: &Atlas, front: [f64; 3]) -> f64 {
    let (mut sum, mut total) = (0.0, 0.0);
    for edge in seams(mesh, atlas) {
        let [p, q] = edge.map(|v| mesh.positions[v as usize]);
        let length = (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt();
        let middle = [0, 1, 2].map(|k| 0.5 * (p[k] + q[k]));
        let norm = middle.iter().map(|x| x * x).sum::<f64>().sqrt();
        sum += length * (0..3).map(|k| middle[k] * front[k]).sum::<f64>() / norm;
        total += length;
    }
    sum / total
}

#[test]
fn seams_keep_away_from_the_front() {
    let ball = uv_sphere(40, 24).moved(|[x, y, z]| [x, 1.1 * y, 1.2 * z + 0.1 * x * y]);
    for (front, direction) in
        [(Front::X, [1.0, 0.0, 0.0]), (Front::NegativeX, [-1.0, 0.0, 0.0]), (Front::Y, [0.0, 1.0, 0.0])]
    {
        let settings = Settings { front, symmetry: Symmetry::Off, ..Settings::default() };
        let got = facing(&ball, &unwrapped(&ball, &settings), direction);
        assert!(got < -0.3, "{front:?}: {got}");
        let alike = Settings { hide_seams: 0.0, ..settings };
        let without = facing(&ball, &unwrapped(&ball, &alike), direction);
        assert!(got < without, "{front:?}: {got} and {without}");
    }
}

/// The share of the seams' length in UV that is along an axis, to a degree.
fn aligned_share(mesh: &PolyMesh, atlas: &Atlas) -> f64 {
    let (mut along, mut total, mut corner) = (0.0, 0.0, 0);
    let seams = seams(mesh, atlas);
    for face in &mesh.faces {
        let n = face.len();
        for k in 0..n {
            let (a, b) = (face[k], face[(k + 1) % n]);
            if seams.contains(&[a.min(b), a.max(b)]) {
                let (p, q) = (atlas.uv[corner + k], atlas.uv[corner + (k + 1) % n]);
                let side = [f64::from(q[0] - p[0]).abs(), f64::from(q[1] - p[1]).abs()];
                total += side[0].hypot(side[1]);
                if side[0].min(side[1]) < 0.0175 * side[0].max(side[1]) {
                    along += side[0].hypot(side[1]);
                }
            }
        }
        corner += n;
    }
    along / total
}

#[test]
fn straight_borders_lie_along_the_axes() {
    let turned = |mesh: PolyMesh| {
        let (s, c) = 0.4_f64.sin_cos();
        mesh.moved(|[x, y, z]| [c * x - s * z, y, s * x + c * z])
    };
    // The wall's four sides; the caps are round.
    let tube = turned(capped_cylinder(6.0, 32, 12));
    let atlas = unwrapped(&tube, &Settings::default());
    assert!(aligned_share(&tube, &atlas) > 0.6 && atlas.report.l2 < 1.001, "{}", aligned_share(&tube, &atlas));
    // No seam of one face is spared for a net that is not at right angles.
    let cube = turned(voxels([6, 6, 6], |_| true));
    let atlas = unwrapped(&cube, &Settings::default());
    assert!(aligned_share(&cube, &atlas) > 0.999 && atlas.report.l2 < 1.0001, "{}", aligned_share(&cube, &atlas));
}

/// A body of revolution: a profile of (radius, height) around z, closed by a cap of one polygon at each end.
fn lathe(sides: usize, profile: &[[f64; 2]]) -> PolyMesh {
    let rows = profile.len() - 1;
    let mut mesh = wrapped_grid(sides, rows, [true, false], |u, v| {
        let [r, z] = profile[(v * rows as f64).round() as usize];
        let (s, c) = (std::f64::consts::TAU * u).sin_cos();
        [r * c, r * s, z]
    });
    let ring = |row: usize| (0..sides).map(move |k| (row * sides + k) as u32);
    mesh.faces.push(ring(0).rev().collect());
    mesh.faces.push(ring(rows).collect());
    mesh
}

/// A gear: teeth between two flat rings, and a round hole.
fn gear(teeth: usize) -> PolyMesh {
    let steps = [(0.0, 1.0), (0.15, 1.25), (0.35, 1.25), (0.5, 1.0)];
    let n = 4 * teeth;
    let corner = |k: usize, inner: bool| {
        let (along, radius) = steps[k % 4];
        let (angle, radius) =
            if inner { (k as f64 / n as f64, 0.4) } else { (((k / 4) as f64 + along) / teeth as f64, radius) };
        let (s, c) = (std::f64::consts::TAU * angle).sin_cos();
        [radius * c, radius * s]
    };
    let mut mesh = PolyMesh::default();
    for (inner, z) in [(false, 0.0), (false, 0.4), (true, 0.0), (true, 0.4)] {
        mesh.positions.extend((0..n).map(|k| corner(k, inner)).map(|[x, y]| [x, y, z]));
    }
    for k in 0..n {
        let [a, b] = [k, (k + 1) % n].map(|k| k as u32);
        let m = n as u32;
        mesh.faces.push(vec![a, b, m + b, m + a]);
        mesh.faces.push(vec![2 * m + b, 2 * m + a, 3 * m + a, 3 * m + b]);
        mesh.faces.push(vec![b, a, 2 * m + a, 2 * m + b]);
        mesh.faces.push(vec![m + a, m + b, 3 * m + b, 3 * m + a]);
    }
    mesh
}

/// Turned and moved, in quads and in triangles.
fn in_all_ways(mesh: &PolyMesh) -> Vec<PolyMesh> {
    let turned = mesh.clone().moved(|[x, y, z]| {
        let (s, c) = 0.7_f64.sin_cos();
        [c * x - s * z + 3.0, y - 1.0, s * x + c * z]
    });
    [mesh.clone(), turned].into_iter().flat_map(|mesh| [mesh.clone().triangulated(), mesh]).collect()
}

#[test]
fn a_barrel_is_a_rectangle_and_two_round_caps() {
    for (sides, bulge) in [(12, 0.25), (24, 0.25), (24, 0.1)] {
        let profile: Vec<[f64; 2]> =
            (-4..=4).map(|k| 0.25 * f64::from(k)).map(|t| [1.0 - bulge * t * t, 1.25 * t]).collect();
        for mesh in in_all_ways(&lathe(sides, &profile)) {
            let atlas = unwrapped(&mesh, &Settings::default());
            assert!([1, 3].contains(&atlas.report.charts), "the caps are apart, or hang on by an edge");
            assert!(atlas.report.l2 < 1.006, "{}", atlas.report.l2);
            // The outline of each cap is border twice: straight on the wall, round on the cap.
            assert!(aligned_share(&mesh, &atlas) > 0.6, "{}", aligned_share(&mesh, &atlas));
            let left = unwrapped(&mesh, &Settings { straighten: 0.0, ..Settings::default() });
            assert!(left.report.l2 < atlas.report.l2 && aligned_share(&mesh, &left) < 0.5);
        }
    }
}

/// So many vertices that the wall is charted on a coarse mesh by itself, while its caps keep their edges.
#[test]
fn what_is_left_between_the_planes_of_a_large_thing_is_charted_by_itself() {
    let profile: Vec<[f64; 2]> =
        (-12..=12).map(|k| f64::from(k) / 12.0).map(|t| [1.0 - 0.25 * t * t, 1.25 * t]).collect();
    let mesh = lathe(200, &profile);
    let atlas = unwrapped(&mesh, &Settings::default());
    assert_eq!(atlas.report.charts, 3);
    assert!(count(&atlas, "prolonged") + count(&atlas, "mirrored") > 0, "by way of the coarse mesh");
    let rim = seams(&mesh, &atlas).iter().filter(|edge| edge.iter().all(|v| *v < 200 || *v >= 24 * 200)).count();
    assert_eq!(rim, 400, "all around both caps");
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    let again = alone.install(|| unwrapped(&mesh, &Settings::default()));
    assert_eq!((atlas.uv, atlas.chart), (again.uv, again.chart));
}

#[test]
fn a_machined_part_is_cut_at_its_hard_edges_and_nowhere_else() {
    for mesh in in_all_ways(&gear(12)) {
        let atlas = unwrapped(&mesh, &Settings::default());
        assert!(atlas.report.l2 < 1.0001, "{}", atlas.report.l2);
        assert!(atlas.report.charts <= 7, "two rings, the hole, and strips of teeth: {}", atlas.report.charts);
        // All of both rings' edges, and some across the strips.
        assert!(seams(&mesh, &atlas).len() < 4 * 48 + 12);
        let organic = unwrapped(&mesh, &Settings { style: Style::Organic, ..Settings::default() });
        assert!(organic.report.l2 > 1.01, "as a grown thing it is bent: {}", organic.report.l2);
    }
}

#[test]
fn a_bevelled_prism_keeps_its_flats_where_it_is_known_to_be_manufactured() {
    // An octagon, high: its walls are 45 degrees apart, which is round unless one says that it is not. Its bevels are not made strips.
    let mesh = lathe(8, &[[0.8, 0.0], [1.0, 0.2], [1.0, 2.0], [0.8, 2.2]]);
    let hard = unwrapped(&mesh, &Settings { style: Style::Hard, straighten: 0.0, ..Settings::default() });
    let auto = unwrapped(&mesh, &Settings { straighten: 0.0, ..Settings::default() });
    assert!(hard.report.l2 < 1.001 && hard.report.l2 < auto.report.l2, "{} {}", hard.report.l2, auto.report.l2);
}

/// A box with sides of `wide` between bevels of `strips` faces each.
fn bevelled_box(wide: [f64; 3], bevel: f64, strips: usize) -> PolyMesh {
    let cells = 2 * strips + 1;
    voxels([cells; 3], |_| true).moved(|p| {
        let (mut core, mut out) = ([0.0; 3], [0.0; 3]);
        for axis in 0..3 {
            let from_middle = p[axis] - 0.5 * cells as f64;
            core[axis] = from_middle.signum() * 0.5 * wide[axis];
            let share = (from_middle.abs() - 0.5) / strips as f64;
            out[axis] = from_middle.signum() * (0.25 * std::f64::consts::PI * share).tan();
        }
        let length = out.iter().map(|x| x * x).sum::<f64>().sqrt();
        [0, 1, 2].map(|axis| core[axis] + bevel * out[axis] / length)
    })
}

#[test]
fn a_bevelled_box_is_made_of_rectangles_with_its_bevels_beside_them() {
    for (wide, bevel, strips) in
        [([2.0; 3], 0.15, 1), ([6.0, 1.5, 0.6], 0.08, 1), ([1.4; 3], 0.3, 3), ([3.0, 2.0, 1.0], 0.1, 2)]
    {
        for mesh in in_all_ways(&bevelled_box(wide, bevel, strips)) {
            let atlas = unwrapped(&mesh, &Settings::default());
            assert!(atlas.report.l2 < 1.003 && atlas.report.charts <= 3, "{wide:?}: {}", atlas.report.l2);
            assert!(aligned_share(&mesh, &atlas) > 0.8, "{wide:?}: {}", aligned_share(&mesh, &atlas));
        }
    }
}

#[test]
fn a_bottle_is_a_rectangle_with_a_shoulder_and_round_ends() {
    for (high, neck) in [(3.0, 0.35), (6.0, 0.25), (2.0, 0.5)] {
        let shoulder = (1..=6).map(|k| std::f64::consts::PI * f64::from(k) / 6.0);
        let shoulder = shoulder.map(|t| [1.0 - (1.0 - neck) * 0.5 * (1.0 - t.cos()), high + t / std::f64::consts::PI]);
        let wall = (0..=4).map(|k| [1.0, 0.25 * f64::from(k) * high]);
        let profile: Vec<[f64; 2]> = wall.chain(shoulder).chain([[neck, high + 1.5]]).collect();
        for mesh in in_all_ways(&lathe(32, &profile)) {
            let atlas = unwrapped(&mesh, &Settings::default());
            let seams = seams(&mesh, &atlas);
            let ring = |row: u32| seams.iter().filter(|edge| edge.iter().all(|v| v / 32 == row)).count();
            // All around the shoulder, and around the base but where this hangs on by some edges.
            assert!(ring(4) == 32 && ring(0) >= 28 && (1..4).all(|row| ring(row) == 0), "{high}");
            let down = seams.iter().filter(|edge| edge.iter().all(|v| v / 32 <= 4) && edge[0] / 32 != edge[1] / 32);
            assert_eq!(down.count(), 4, "the wall is cut once, along a line");
            assert!(atlas.report.charts <= 5 && atlas.report.l2 < 1.008, "{high}: {}", atlas.report.l2);
        }
    }
}

#[test]
fn a_frame_is_made_of_planes_at_right_angles() {
    for inner in [0.7, 0.8, 0.9] {
        let square = |half: f64, z: f64| {
            [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[x, y]| [half * x, half * y, z])
        };
        let positions = [square(1.0, 0.0), square(inner, 0.0), square(1.0, 0.3), square(inner, 0.3)].concat();
        let around = |k: u32| [k, (k + 1) % 4];
        let faces = (0..4).map(around).flat_map(|[a, b]| {
            [[a, 4 + a, 4 + b, b], [8 + a, 8 + b, 12 + b, 12 + a], [a, b, 8 + b, 8 + a], [4 + a, 12 + a, 12 + b, 4 + b]]
        });
        let frame = PolyMesh { positions, faces: faces.map(Vec::from).collect() };
        for mesh in in_all_ways(&frame) {
            let atlas = unwrapped(&mesh, &Settings::default());
            // The mitres of its corners are aslant, where seams run along them.
            let aligned = aligned_share(&mesh, &atlas);
            assert!(atlas.report.l2 < 1.0001 && aligned > 0.9 && atlas.report.charts <= 6, "{inner}: {aligned}");
        }
    }
}

#[test]
fn a_pyramid_is_a_net_or_a_fan_and_a_base() {
    for high in [1.5, 2.5, 4.0] {
        let base = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]];
        let positions = [&base[..], &[[0.0, 0.0, high]]].concat();
        let sides = (0..4).map(|k| vec![k, (k + 1) % 4, 4]);
        let pyramid = PolyMesh { positions, faces: std::iter::once(vec![3, 2, 1, 0]).chain(sides).collect() };
        for mesh in in_all_ways(&pyramid) {
            let atlas = unwrapped(&mesh, &Settings::default());
            assert!(atlas.report.l2 < 1.0001 && atlas.report.charts <= 2, "{high}: {}", atlas.report.charts);
        }
    }
}

/// A body of revolution around z of a closed profile.
fn turned_ring(sides: usize, profile: &[[f64; 2]]) -> PolyMesh {
    let n = profile.len();
    wrapped_grid(sides, n, [true, true], |u, v| {
        let [r, z] = profile[(v * n as f64).round() as usize % n];
        let (s, c) = (std::f64::consts::TAU * u).sin_cos();
        [r * c, r * s, z]
    })
}

#[test]
fn the_rims_of_a_hoop_are_strips_and_those_of_a_washer_are_round() {
    for sides in [12, 48] {
        for (inner, high) in [(0.94, 0.3), (0.88, 0.25)] {
            let hoop = turned_ring(sides, &[[inner, 0.0], [1.0, 0.0], [1.0, high], [inner, high]]);
            for mesh in in_all_ways(&hoop) {
                let atlas = unwrapped(&mesh, &Settings::default());
                let aligned = aligned_share(&mesh, &atlas);
                assert!(aligned > 0.9 && atlas.report.l2 < 1.01, "{sides}: {aligned} {}", atlas.report.l2);
                let round = unwrapped(&mesh, &Settings { straighten: 0.0, ..Settings::default() });
                assert!(round.report.l2 < 1.0001 && aligned_share(&mesh, &round) < 0.7);
            }
        }
        for mesh in in_all_ways(&turned_ring(sides, &[[0.5, 0.0], [1.0, 0.0], [1.0, 0.1], [0.5, 0.1]])) {
            assert!(unwrapped(&mesh, &Settings::default()).report.l2 < 1.001);
        }
    }
}

#[test]
fn a_pipe_bend_is_one_rectangle() {
    let pipe = wrapped_grid(12, 16, [true, false], |u, v| {
        let ((s, c), (t, d)) = ((std::f64::consts::TAU * u).sin_cos(), (0.5 * std::f64::consts::PI * v).sin_cos());
        let r = 4.0 + 0.5 * c;
        [r * d, r * t, 0.5 * s]
    });
    for mesh in in_all_ways(&pipe) {
        let atlas = unwrapped(&mesh, &Settings::default());
        assert!(atlas.report.charts == 1 && atlas.report.l2 < 1.007, "{}", atlas.report.l2);
        assert!(aligned_share(&mesh, &atlas) > 0.999, "{}", aligned_share(&mesh, &atlas));
        let low = |k: usize| atlas.uv.iter().map(|p| p[k]).fold(f32::INFINITY, f32::min);
        let high = |k: usize| atlas.uv.iter().map(|p| p[k]).fold(0.0, f32::max);
        let whole = f64::from((high(0) - low(0)) * (high(1) - low(1)));
        assert!(atlas.report.packing_efficiency > 0.98 * whole, "it fills its box");
    }
}

#[test]
fn the_net_of_a_box_runs_along_its_edges_and_not_across_its_sides() {
    for size in [[1, 2, 3], [1, 1, 6], [2, 2, 2]] {
        let mesh = voxels(size, |_| true).triangulated();
        let atlas = unwrapped(&mesh, &Settings::default());
        assert!(atlas.report.l2 < 1.0001);
        assert!(aligned_share(&mesh, &atlas) > 0.999, "{size:?}: {}", aligned_share(&mesh, &atlas));
    }
}
