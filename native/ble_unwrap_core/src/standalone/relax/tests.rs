use std::collections::HashMap;

use proptest::prelude::*;

use super::*;
use crate::standalone::measure_layout;

/// A mesh of polygons with a UV map.
#[derive(Clone)]
struct Mapped {
    positions: Vec<[f64; 3]>,
    corners: Vec<i32>,
    offsets: Vec<i32>,
    uv: Vec<[f32; 2]>,
}

impl Mapped {
    /// A grid of quads over the unit square.
    fn grid(n: usize, place: impl Fn(f64, f64) -> [f64; 3], uv: impl Fn(f64, f64) -> [f64; 2]) -> Self {
        let side = n + 1;
        let at = |k: usize| [(k % side) as f64 / n as f64, (k / side) as f64 / n as f64];
        let positions = (0..side * side).map(at).map(|[x, y]| place(x, y)).collect();
        let quad = |k: usize| {
            let first = (k / n) * side + k % n;
            [first, first + 1, first + side + 1, first + side]
        };
        let vertices: Vec<usize> = (0..n * n).flat_map(quad).collect();
        let uv = vertices.iter().map(|&k| at(k)).map(|[x, y]| uv(x, y).map(|x| x as f32)).collect();
        let corners = vertices.into_iter().map(|k| k as i32).collect();
        Self { positions, corners, offsets: (0..=n * n).map(|f| 4 * f as i32).collect(), uv }
    }

    /// Both meshes, which share no vertex.
    fn and(mut self, other: Self) -> Self {
        let (vertices, corners) = (self.positions.len() as i32, self.corners.len() as i32);
        self.positions.extend(other.positions);
        self.corners.extend(other.corners.iter().map(|v| v + vertices));
        self.offsets.extend(other.offsets[1..].iter().map(|c| c + corners));
        self.uv.extend(other.uv);
        self
    }

    fn input(&self) -> MeshInput<'_> {
        MeshInput {
            positions: &self.positions,
            corner_vertices: &self.corners,
            face_offsets: &self.offsets,
            ..MeshInput::default()
        }
    }

    fn try_relax(&self, rules: &RelaxRules<'_>) -> Result<Relaxed, RelaxError> {
        relax(&self.input(), &self.uv, rules, &Settings::default(), &Progress::new())
    }

    /// Relaxed, with everything checked that is promised of any input.
    fn relax(&self, rules: &RelaxRules<'_>) -> Relaxed {
        let relaxed = self.try_relax(rules).expect("valid arrays");
        let place = |c: usize, uv: &[[f32; 2]]| (self.corners[c], uv[c].map(|x| (x + 0.0).to_bits()));
        let mut joined = HashMap::new();
        let mut parted = HashMap::new();
        for c in (0..self.corners.len()).filter(|&c| self.uv[c].iter().all(|x| x.is_finite())) {
            let (before, after) = (place(c, &self.uv), place(c, &relaxed.uv));
            assert_eq!(*joined.entry(before).or_insert(after), after, "corner {c} is parted from another");
            assert_eq!(*parted.entry(after).or_insert(before), before, "corner {c} is joined to another");
        }
        let bits = |uv: [f32; 2]| uv.map(f32::to_bits);
        for (c, _) in rules.pinned.unwrap_or_default().iter().enumerate().filter(|p| *p.1) {
            assert_eq!(bits(relaxed.uv[c]), bits(self.uv[c]), "corner {c} is pinned");
        }
        let face_of = |c: usize| self.offsets.partition_point(|&begin| begin as usize <= c) - 1;
        let moved: Vec<usize> = relaxed.islands.iter().filter(|(_, i)| i.moved).map(|(n, _)| *n).collect();
        for c in 0..self.corners.len() {
            let island = relaxed.island[face_of(c)];
            if !usize::try_from(island).is_ok_and(|island| moved.contains(&island)) && self.uv[c][0].is_finite() {
                // It may be joined to a corner that moved only if its face has no island of its own.
                assert!(island < 0 || bits(relaxed.uv[c]) == bits(self.uv[c]), "corner {c} has moved");
            }
        }
        for (number, island) in &relaxed.islands {
            assert!(!(island.moved && island.left.is_some()));
            if island.moved {
                let of_it = |f: usize| relaxed.island[f] == *number as i32;
                let chart: Vec<i32> = (0..self.offsets.len() - 1).map(|f| if of_it(f) { 0 } else { -1 }).collect();
                let m = self.measured(&relaxed.uv, Some(&chart));
                assert_eq!((m.flips, m.overlaps), (0, 0), "{island:?}");
            }
        }
        relaxed
    }

    fn measured(&self, uv: &[[f32; 2]], chart: Option<&[i32]>) -> metrics::Measures {
        let layout = measure_layout(&self.input(), uv, chart, &[], &Settings::default(), &Progress::new());
        layout.expect("a valid layout").measures
    }

    fn only(&self, rules: &RelaxRules<'_>) -> RelaxedIsland {
        let relaxed = self.relax(rules);
        assert_eq!(relaxed.islands.len(), 1, "{:?}", relaxed.islands);
        relaxed.islands[0].1
    }

    /// Which corners are at vertices of which this holds.
    fn pins(&self, is_pinned: impl Fn([f64; 3]) -> bool) -> Vec<bool> {
        self.corners.iter().map(|&v| is_pinned(self.positions[v as usize])).collect()
    }

    /// Area and centroid of the map: quads by their first diagonals, each triangle as positive.
    fn area_and_centroid(&self, uv: &[[f32; 2]]) -> (f64, [f64; 2]) {
        let (mut total, mut sum) = (0.0, [0.0; 2]);
        for quad in uv.as_chunks::<4>().0 {
            for [a, b, c] in [[0, 1, 2], [0, 2, 3]].map(|t| t.map(|k| quad[k].map(f64::from))) {
                let area = 0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])).abs();
                total += area;
                sum = [0, 1].map(|k| sum[k] + area * (a[k] + b[k] + c[k]) / 3.0);
            }
        }
        (total, sum.map(|x| x / total))
    }
}

fn hill_at(x: f64, y: f64) -> [f64; 3] {
    [x, y, 0.4 * (-9.0 * ((x - 0.5).powi(2) + (y - 0.5).powi(2))).exp()]
}

fn shrunk(x: f64, y: f64) -> [f64; 2] {
    [0.1 + 0.3 * x, 0.5 + 0.3 * y]
}

/// A hill that somebody has projected from above.
fn hill() -> Mapped {
    Mapped::grid(12, hill_at, shrunk)
}

fn pinned(pins: &[bool]) -> RelaxRules<'_> {
    RelaxRules { pinned: Some(pins), ..RelaxRules::default() }
}

#[test]
fn an_island_has_less_stretch_and_lies_where_it_lay() {
    let map = hill();
    let relaxed = map.relax(&RelaxRules::default());
    let (_, island) = relaxed.islands[0];
    assert!(island.moved && island.l2_after < 1.0 + 0.8 * (island.l2_before - 1.0), "{island:?}");
    assert!((island.area - 1.0).abs() < 1e-9 && island.pinned == 0 && (island.face, island.faces) == (0, 144));
    assert_eq!((relaxed.l2_before, relaxed.l2_after), (island.l2_before, island.l2_after));
    for (uv, l2) in [(&map.uv, island.l2_before), (&relaxed.uv, island.l2_after)] {
        assert!((map.measured(uv, None).l2 - l2).abs() < 1e-6, "{l2}");
    }
    let (before, after) = (map.area_and_centroid(&map.uv), map.area_and_centroid(&relaxed.uv));
    assert!((before.0 / after.0 - 1.0).abs() < 1e-5, "{before:?} {after:?}");
    assert!((0..2).all(|k| (before.1[k] - after.1[k]).abs() < 1e-6), "{before:?} {after:?}");
    // The best turn back to the start is none.
    let (mut cos, mut sin) = (0.0, 0.0);
    for (p, q) in map.uv.iter().zip(&relaxed.uv) {
        let [p, q] = [(p, before.1), (q, after.1)].map(|(p, c)| [0, 1].map(|k| f64::from(p[k]) - c[k]));
        cos += p[0] * q[0] + p[1] * q[1];
        sin += p[0] * q[1] - p[1] * q[0];
    }
    assert!((sin / cos).abs() < 1e-2, "{}", sin / cos);
}

#[test]
fn what_has_the_least_stretch_stays_to_the_bit() {
    let flat = Mapped::grid(6, |x, y| [x, 0.5 * y, 0.0], |x, y| [0.2 + 0.1 * x, 0.3 + 0.05 * y]);
    let relaxed = flat.relax(&RelaxRules::default());
    assert_eq!(relaxed.uv, flat.uv);
    let (_, island) = relaxed.islands[0];
    assert!(!island.moved && island.left.is_none() && island.l2_after == island.l2_before, "{island:?}");
    // And again, what was relaxed hardly moves.
    let once = hill().relax(&RelaxRules::default());
    let again = Mapped { uv: once.uv.clone(), ..hill() }.relax(&RelaxRules::default());
    let farthest = once.uv.iter().flatten().zip(again.uv.iter().flatten()).map(|(a, b)| (a - b).abs());
    assert!(farthest.fold(0.0, f32::max) < 1e-3);
}

#[test]
fn a_turned_or_mirrored_island_is_relaxed_as_it_lies() {
    let straight = hill().relax(&RelaxRules::default());
    let turned = Mapped::grid(12, hill_at, |x, y| [0.6 - 0.3 * y, 0.1 + 0.3 * x]).relax(&RelaxRules::default());
    let mirrored = Mapped::grid(12, hill_at, |x, y| [-0.1 - 0.3 * x, 0.5 + 0.3 * y]).relax(&RelaxRules::default());
    for (k, uv) in straight.uv.iter().enumerate() {
        let [x, y] = [f64::from(uv[0]) - 0.1, f64::from(uv[1]) - 0.5];
        let near = |found: [f32; 2], goal: [f64; 2]| (0..2).all(|k| (f64::from(found[k]) - goal[k]).abs() < 2e-4);
        assert!(near(turned.uv[k], [0.6 - y, 0.1 + x]), "{:?}", turned.uv[k]);
        assert!(near(mirrored.uv[k], [-0.1 - x, 0.5 + y]), "{:?}", mirrored.uv[k]);
    }
}

#[test]
fn pins_stay_and_hold_the_island() {
    let map = hill();
    let free = map.relax(&RelaxRules::default());
    // One pin: the same shape, elsewhere.
    let one = map.pins(|p| p[0] == 0.0 && p[1] == 0.0);
    let held = map.relax(&pinned(&one));
    let shift = [0, 1].map(|k| held.uv[0][k] - free.uv[0][k]);
    for (a, b) in free.uv.iter().zip(&held.uv) {
        assert!((0..2).all(|k| (a[k] + shift[k] - b[k]).abs() < 1e-5), "{a:?} {b:?}");
    }
    assert_eq!(held.islands[0].1.pinned, 1);
    // Many pins: more stretch than without, less than before.
    let border = map.pins(|p| p[0] == 0.0 || p[0] == 1.0);
    let held = map.only(&pinned(&border));
    assert_eq!(held.pinned, 26);
    assert!(held.l2_after < held.l2_before && held.l2_after > free.l2_after, "{held:?}");
    let all = vec![true; map.uv.len()];
    assert_eq!(map.only(&pinned(&all)).left, Some(LeftAsItWas::AllPinned));
    // A pin on one corner holds all that are joined to it, and each keeps the zero that it has.
    let mut signed = Mapped::grid(4, hill_at, |x, y| [x - 0.5, y - 0.5]);
    let middle: Vec<usize> = (0..signed.uv.len()).filter(|&c| signed.uv[c] == [0.0, 0.0]).collect();
    signed.uv[middle[1]] = [-0.0, 0.0];
    let mut pin = vec![false; signed.uv.len()];
    (pin[middle[0]], pin[0]) = (true, true);
    let held = signed.relax(&pinned(&pin));
    assert!(held.islands[0].1.moved && held.islands[0].1.pinned == 2);
    assert_eq!(held.uv[middle[1]][0].to_bits(), (-0.0f32).to_bits());
}

#[test]
fn flips_and_overlap_are_cleared_first_unless_pins_forbid_it() {
    let folded = Mapped::grid(10, hill_at, |x, y| [0.1 + 0.3 * (x - 0.45).abs(), 0.5 + 0.3 * y]);
    let wound = |x: f64, y: f64| {
        let angle = 9.0 * x;
        [0.5 + (0.2 + 0.03 * y) * angle.cos(), 0.5 - (0.2 + 0.03 * y) * angle.sin()]
    };
    let ring = Mapped::grid(24, |x, y| [4.0 * x, y, 0.0], wound);
    for map in [&folded, &ring] {
        let before = map.measured(&map.uv, None);
        assert!(before.flips > 0 || before.overlaps > 0, "there is nothing to clear");
        let island = map.only(&RelaxRules::default());
        assert!(island.moved && island.l2_after < 1.3, "{island:?}");
    }
    let triangle = folded.pins(|p| p[0] < 0.25 || p[0] > 0.75);
    assert_eq!(folded.only(&pinned(&triangle)).left, Some(LeftAsItWas::PinsTurnFacesOver));
    let ends = ring.pins(|p| p[0] < 0.4 || p[0] > 3.0);
    assert_eq!(ring.only(&pinned(&ends)).left, Some(LeftAsItWas::PinsOverlap));
}

#[test]
fn seams_stay_open_and_each_island_is_relaxed_by_itself() {
    // Both halves of a hill, cut in the middle, and a second hill that is not selected.
    let mut map = hill().and(Mapped::grid(6, hill_at, |x, y| [0.6 + 0.2 * x, 0.1 + 0.2 * y]));
    for c in 0..144 * 4 {
        if (c / 4) % 12 >= 6 {
            map.uv[c][0] += 0.05;
        }
    }
    let selected: Vec<bool> = (0..180).map(|f| f == 3 || f == 9).collect();
    let relaxed = map.relax(&RelaxRules { selected: Some(&selected), ..RelaxRules::default() });
    assert_eq!(
        relaxed.islands.iter().map(|(n, i)| (*n, i.face, i.faces)).collect::<Vec<_>>(),
        [(0, 0, 72), (1, 6, 72)]
    );
    assert!(relaxed.islands.iter().all(|(_, i)| i.moved));
    assert_eq!(relaxed.uv[144 * 4..], map.uv[144 * 4..]);
    assert_eq!((relaxed.island[0], relaxed.island[6], relaxed.island[150]), (0, 1, 2));
    let all = map.relax(&RelaxRules::default());
    assert_eq!(all.islands.len(), 3);
    assert_eq!(all.uv[..144 * 4], relaxed.uv[..144 * 4], "an island does not matter to the others");
}

#[test]
fn parts_that_share_one_vertex_are_held_there() {
    // Two hills, which meet at a corner of both.
    let mut map =
        hill().and(Mapped::grid(12, |x, y| hill_at(x, y).map(|z| z + 1.0), |x, y| [0.4 + 0.3 * x, 0.8 + 0.3 * y]));
    let corner = map.corners[144 * 4];
    let last = map.corners[143 * 4 + 2];
    map.corners.iter_mut().filter(|v| **v == corner).for_each(|v| *v = last);
    map.positions[last as usize][2] = 0.5;
    let relaxed = map.relax(&RelaxRules::default());
    let [(0, island)] = relaxed.islands[..] else { panic!("one island: {:?}", relaxed.islands) };
    assert!(island.moved && island.faces == 288, "{island:?}");
    assert_eq!(relaxed.uv[143 * 4 + 2], map.uv[143 * 4 + 2]);
    // One triangle that hangs at all of its vertices, each of which is a corner of another, cannot move; nor can two such.
    let both = Mapped {
        positions: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.3, 1.0, 0.0]],
        corners: vec![0, 1, 2, 0, 1, 2],
        offsets: vec![0, 3, 6],
        uv: [[0.1f32, 0.1], [0.5, 0.1], [0.3, 0.2]].repeat(2),
    };
    let left = both.only(&RelaxRules::default()).left;
    assert!(matches!(left, Some(LeftAsItWas::PartsHold | LeftAsItWas::PartsOverlap)), "{left:?}");
    // An island that touches itself in this way is left: a ring of eight quads, one of which hangs at a vertex.
    let mut ring = Mapped::grid(3, |x, y| [x, y, 0.0], shrunk);
    let hole = 4;
    for first in [4 * hole, 0] {
        ring.corners.drain(first..first + 4);
        ring.uv.drain(first..first + 4);
    }
    ring.offsets.truncate(8);
    assert!(matches!(ring.only(&RelaxRules::default()).left, Some(LeftAsItWas::Pinched { vertex: 5 })));
}

#[test]
fn what_cannot_lie_flat_is_left_and_named() {
    // A closed box in one piece; a torus as well.
    let cube = Mapped {
        positions: (0..8).map(|k| [k & 1, k >> 1 & 1, k >> 2].map(f64::from)).collect(),
        corners: vec![0, 2, 3, 1, 4, 5, 7, 6, 0, 1, 5, 4, 1, 3, 7, 5, 3, 2, 6, 7, 2, 0, 4, 6],
        offsets: (0..=6).map(|f| 4 * f).collect(),
        uv: Vec::new(),
    };
    let by_vertex = |map: &Mapped| map.corners.iter().map(|v| [*v as f32 * 0.1, (*v * *v % 7) as f32 * 0.1]).collect();
    let cube = Mapped { uv: by_vertex(&cube), ..cube };
    assert_eq!(cube.only(&RelaxRules::default()).left, Some(LeftAsItWas::Closed));
    let all_in_one_point = Mapped { uv: vec![[0.5; 2]; 144 * 4], ..hill() };
    assert_eq!(all_in_one_point.only(&RelaxRules::default()).left, Some(LeftAsItWas::NoAreaInMap));
    let thin = Mapped::grid(3, |x, _| [x, 0.0, 0.0], shrunk);
    let left = thin.only(&RelaxRules::default()).left;
    assert!(matches!(left, Some(LeftAsItWas::NoSurface | LeftAsItWas::EdgeOfNoLength { .. })), "{left:?}");
    // So small and so far away that single precision has no place for its vertices.
    let tiny = Mapped::grid(12, hill_at, |x, y| [900.0 + 2e-4 * x, 2e-4 * y]);
    assert_eq!(tiny.only(&RelaxRules::default()).left, Some(LeftAsItWas::TooSmall));
}

#[test]
fn numbers_that_are_not_finite_concern_their_faces_only() {
    let mut map = hill();
    map.uv[7] = [f32::NAN, 0.3];
    map.positions[60][1] = f64::INFINITY;
    let relaxed = map.relax(&RelaxRules::default());
    assert!(relaxed.island[1] == -1 && relaxed.island.iter().filter(|i| **i == -1).count() >= 4);
    assert!(relaxed.uv[7][0].is_nan() && relaxed.uv[7][1] == 0.3);
    assert!(relaxed.islands[0].1.moved, "{:?}", relaxed.islands);
    let all = Mapped { positions: vec![[f64::NAN; 3]; map.positions.len()], ..map.clone() };
    assert!(matches!(all.try_relax(&RelaxRules::default()), Err(RelaxError::Mesh(MeshError::NoFiniteFace { .. }))));
    let empty = Mapped { positions: Vec::new(), corners: Vec::new(), offsets: Vec::new(), uv: Vec::new() };
    let relaxed = empty.try_relax(&RelaxRules::default()).expect("nothing to do");
    assert!(relaxed.islands.is_empty() && relaxed.l2_before.is_nan());
}

#[test]
fn one_sided_and_branching_surfaces_end() {
    // A Möbius strip in one piece of the map, and three sheets at one edge.
    let n = 24;
    let positions = (0..2 * n)
        .map(|k| {
            let angle = std::f64::consts::TAU * (k % n) as f64 / n as f64;
            let (across, half) = (if k < n { -0.3 } else { 0.3 }, 0.5 * angle);
            let radius = 1.0 + across * half.cos();
            [radius * angle.cos(), radius * angle.sin(), across * half.sin()]
        })
        .collect();
    let quad = |i: usize| {
        let next = if i + 1 < n { [i + 1, i + 1 + n] } else { [n, 0] };
        [i, next[0], next[1], i + n].map(|v| v as i32)
    };
    let corners: Vec<i32> = (0..n).flat_map(quad).collect();
    let uv =
        corners.iter().map(|v| [(*v as usize % n) as f32 * 0.03, if (*v as usize) < n { 0.1 } else { 0.2 }]).collect();
    let band = Mapped { positions, corners, offsets: (0..=n as i32).map(|f| 4 * f).collect(), uv };
    band.relax(&RelaxRules::default());
    let sheets = Mapped {
        positions: vec![[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.5, 0.0], [-1.0, 0.5, 0.2], [0.1, 0.5, 1.0]],
        corners: vec![0, 2, 1, 0, 1, 3, 0, 4, 1],
        offsets: vec![0, 3, 6, 9],
        uv: Vec::new(),
    };
    let flat = |v: &i32| [[0.5, 0.1], [0.5, 0.4], [0.9, 0.2], [0.1, 0.2], [0.6, 0.3]][*v as usize];
    let sheets = Mapped { uv: sheets.corners.iter().map(flat).collect(), ..sheets };
    // Two of the three lie on the same side of their edge.
    assert_eq!(sheets.only(&RelaxRules::default()).left, Some(LeftAsItWas::PartsOverlap));
}

#[test]
fn a_side_of_no_length_follows_where_it_has_none_in_the_map_either() {
    // The first two vertices of a grid at one place, and then with different UVs.
    let mut map = Mapped::grid(6, hill_at, shrunk);
    let second = map.positions[1];
    map.positions[0] = second;
    let apart = map.only(&RelaxRules::default());
    assert!(matches!(apart.left, Some(LeftAsItWas::EdgeOfNoLength { .. })), "{apart:?}");
    let place = map.uv[1];
    map.uv[0] = place;
    let island = map.only(&RelaxRules::default());
    assert!(island.moved, "{island:?}");
}

#[test]
fn the_result_is_the_same_for_any_number_of_threads_and_can_be_cancelled() {
    let map = (0..5).fold(hill(), |map, k| {
        let shift = 0.01 * f64::from(k);
        map.and(Mapped::grid(8 + k as usize, hill_at, |x, y| [shift + 0.3 * x, shift + 0.2 * y]))
    });
    let pins: Vec<bool> = (0..map.uv.len()).map(|c| c % 97 == 0).collect();
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| map.try_relax(&pinned(&pins)).expect("valid"))
    };
    let one = on(1);
    assert!(one.islands.iter().filter(|(_, i)| i.moved).count() >= 5);
    for threads in [2, 8] {
        assert_eq!(on(threads), one);
    }
    let progress = Progress::new();
    progress.cancel();
    let rules = RelaxRules::default();
    let cancelled = relax(&map.input(), &map.uv, &rules, &Settings::default(), &progress);
    assert!(cancelled.is_err_and(|e| e.kind() == ErrorKind::Cancelled));
}

#[test]
fn wrong_arrays_are_named() {
    let map = hill();
    let text = |rules: &RelaxRules<'_>| map.try_relax(rules).expect_err("wrong").to_string();
    assert!(text(&pinned(&[true])).contains("1 flags for pins, but 576 corners"));
    let selected = RelaxRules { selected: Some(&[true; 3]), ..RelaxRules::default() };
    assert!(text(&selected).contains("3 flags for selected faces, but 144 faces"));
    let short = Mapped { uv: vec![[0.0; 2]], ..map.clone() };
    let error = short.try_relax(&RelaxRules::default()).expect_err("wrong");
    assert!(error.to_string().contains("1 UVs, but 576 corners") && error.kind() == ErrorKind::Argument);
    let wrong = Mapped { corners: vec![9999; 576], ..map };
    assert!(wrong.try_relax(&RelaxRules::default()).is_err_and(|e| e.kind() == ErrorKind::Mesh));
}

#[test]
fn proportions_of_the_texture_count() {
    // In a texture twice as wide as high, a map of half the width is without stretch.
    let flat = Mapped::grid(5, |x, y| [x, y, 0.0], |x, y| [0.1 + 0.2 * x, 0.1 + 0.4 * y]);
    let mut settings = Settings::default();
    (settings.packing.width, settings.packing.height) = (1024, 512);
    let relaxed = relax(&flat.input(), &flat.uv, &RelaxRules::default(), &settings, &Progress::new());
    assert_eq!(relaxed.expect("valid").uv, flat.uv);
    assert!(flat.only(&RelaxRules::default()).moved);
}

#[test]
fn islands_that_start_anew_lose_what_no_relaxing_undoes() {
    // A sheet rolled up to more than a turn, whose map somebody made from above: it lies on itself.
    let roll = |x: f64, y: f64| [(7.0 * x).cos() / 7.0, (7.0 * x).sin() / 7.0, y];
    let map = Mapped::grid(16, roll, |x, y| [0.3 + 0.1 * (7.0 * x).cos(), 0.3 + 0.1 * (7.0 * x).sin() + 0.05 * y]);
    let anew = RelaxRules { start: RelaxStart::Anew, ..RelaxRules::default() };
    let island = map.only(&anew);
    assert!(island.moved && island.l2_after < 1.01, "{island:?}");
    let (before, after) = (map.area_and_centroid(&map.uv), map.area_and_centroid(&map.relax(&anew).uv));
    assert!((before.0 / after.0 - 1.0).abs() < 1e-4, "{before:?} {after:?}");
    assert!((0..2).all(|k| (before.1[k] - after.1[k]).abs() < 1e-5), "{before:?} {after:?}");
    // What lies well already has as little stretch from either start, and pins hold.
    let [kept, other] = [RelaxRules::default(), anew].map(|rules| hill().only(&rules).l2_after);
    assert!((kept - other).abs() < 1e-3, "{kept} {other}");
    let pins = hill().pins(|p| p[0] == 0.0 || p[0] == 1.0);
    let held = hill().only(&RelaxRules { pinned: Some(&pins), ..anew });
    assert!(held.moved && held.l2_after < held.l2_before, "{held:?}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, ..ProptestConfig::default() })]
    #[test]
    fn any_map_ends_well(
        shake in prop::collection::vec(prop::array::uniform2(-0.2..0.2_f32), 36),
        pins in prop::collection::vec(0..36_usize, 0..5),
        steep in 0.0..2.0_f64,
        cut in 0..6_usize,
    ) {
        let mut map = Mapped::grid(5, |x, y| [x, y, steep * x * x * y], |x, y| [x, y]);
        for (c, v) in map.corners.iter().enumerate() {
            let by = shake[*v as usize];
            map.uv[c] = [0, 1].map(|k| map.uv[c][k] + by[k] + if (c / 4) % 5 >= cut { 2.0 } else { 0.0 });
        }
        let is_pinned = map.corners.iter().map(|v| pins.contains(&(*v as usize))).collect::<Vec<_>>();
        map.relax(&pinned(&is_pinned));
    }
}
