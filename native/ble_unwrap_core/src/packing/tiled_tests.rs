//! Whole packings into several tiles and at a density that is given, against the same oracle of distances.

use std::collections::BTreeSet;

use proptest::prelude::*;

use super::tests::*;
use super::*;

/// A bit of everything of about the same size, so that no chart alone bounds the density.
fn even(count: usize, seed: u64) -> Vec<Chart> {
    let mut charts = mixture(count, seed);
    for (k, (points, _)) in charts.iter_mut().enumerate() {
        let first = points[0];
        let extent = points.iter().map(|p| (p - first).norm()).fold(0.0, f64::max);
        let size = [1.0, 1.3, 1.6][k % 3] / extent;
        points.iter_mut().for_each(|p| *p = first + (*p - first) * size);
    }
    charts
}

fn tiled(size: u32, margin_texels: f64, tiles: usize) -> PackSettings {
    PackSettings { tiles, ..square(size, margin_texels) }
}

fn at_density(settings: &PackSettings, density: f64) -> PackSettings {
    PackSettings { texel_density: Some(density), ..settings.clone() }
}

/// Triangles of a chart, in texels from the corner of its tile.
type Placed = Vec<[Point2<f64>; 3]>;

/// The charts of each tile with their placement there, as it comes out after rounding where that tile lies.
fn by_tile(charts: &[Chart], packed: &Packed) -> Vec<(Tile, Vec<Placed>)> {
    let size = packed.size.map(f64::from);
    let tiles: BTreeSet<Tile> = packed.tiles.iter().copied().collect();
    tiles
        .into_iter()
        .map(|tile| {
            let corner = tile.corner();
            let of_tile = (0..charts.len()).filter(|&k| packed.tiles[k] == tile);
            let triangles = of_tile.map(|k| {
                let (points, triangles) = &charts[k];
                let at = |v: u32| {
                    let uv = packed.uvs(k, &[points[v as usize]])[0];
                    let local = |axis: usize| (f64::from(uv[axis] as f32) - corner[axis]) * size[axis];
                    Point2::new(local(0), local(1))
                };
                triangles.iter().map(|t| t.map(at)).collect()
            });
            (tile, triangles.collect())
        })
        .collect()
}

/// Asserts that charts keep the margin within each tile and half of it to its border, and have one density.
fn check_tiles(charts: &[Chart], settings: &PackSettings, packed: &Packed) {
    let (margin, size) = (settings.margin_texels, [settings.width, settings.height].map(f64::from));
    assert!(packed.tiles.iter().all(|tile| tile.number() < settings.tiles));
    let tiles = by_tile(charts, packed);
    assert_eq!(tiles.len(), packed.tiles_used);
    for (tile, placed) in &tiles {
        for (i, chart) in placed.iter().enumerate() {
            for p in chart.iter().flatten() {
                let inside = (0..2).all(|k| p[k] >= 0.5 * margin && p[k] <= size[k] - 0.5 * margin);
                assert!(inside, "{p:?} of chart {i} in {tile:?}");
            }
            for other in &placed[..i] {
                for s in chart {
                    for t in other {
                        let apart = distance(s, t);
                        assert!(apart >= margin && apart > 0.0, "{apart} texels apart in {tile:?}");
                    }
                }
            }
        }
    }
    let scales = packed.poses.iter().map(|pose| pose.scale / packed.texels_per_unit);
    let enlarged = scales.filter(|scale| (scale - 1.0).abs() > 1e-9).count();
    assert!(enlarged <= packed.specks, "{enlarged} charts have another density, {} are specks", packed.specks);
    assert!(packed.efficiency > 0.0 && packed.efficiency <= 1.0, "{}", packed.efficiency);
}

#[test]
fn more_tiles_are_denser_and_keep_every_promise() {
    let charts = even(40, 11);
    let mut before = 0.0;
    for tiles in [1, 2, 4, 13] {
        let settings = tiled(256, 3.0, tiles);
        let packed = packed(&charts, &settings);
        check_tiles(&charts, &settings, &packed);
        assert!(packed.texels_per_unit > before, "{} in {tiles} tiles after {before}", packed.texels_per_unit);
        assert_eq!(packed.shortfall, None);
        before = packed.texels_per_unit;
    }
    let [one, four] = [1, 4].map(|tiles| packed(&charts, &tiled(256, 3.0, tiles)));
    // Four tiles have room for twice the density, and margins weigh less then.
    assert!(four.texels_per_unit > 1.9 * one.texels_per_unit, "{} of {}", four.texels_per_unit, one.texels_per_unit);
    assert_eq!(four.tiles_used, 4);
}

#[test]
fn charts_that_need_no_tile_of_their_own_get_none() {
    // One large chart bounds the density: all others have room beside it, or in one more tile.
    let mut charts = vec![regular(40, 10.0)];
    charts.extend((0..9).map(|_| regular(3, 0.5)));
    let settings = tiled(256, 2.0, 9);
    let packed = packed(&charts, &settings);
    check_tiles(&charts, &settings, &packed);
    assert!(packed.tiles_used <= 2, "{} tiles", packed.tiles_used);
    assert!(packed.texels_per_unit > 0.99 * 253.0 / 20.0, "{}", packed.texels_per_unit);
}

#[test]
fn a_density_is_exact_in_as_few_tiles_as_needed() {
    let charts = even(30, 4);
    let one = packed(&charts, &square(256, 2.0)).texels_per_unit;
    for (share, most) in [(0.5, 1), (0.97, 1), (1.3, 3), (1.9, 6), (2.9, 24)] {
        let settings = at_density(&tiled(256, 2.0, 40), share * one);
        let packed = packed(&charts, &settings);
        check_tiles(&charts, &settings, &packed);
        assert!(
            (packed.texels_per_unit / (share * one) - 1.0).abs() < 1e-9,
            "{} for {}",
            packed.texels_per_unit,
            share * one
        );
        assert!(packed.tiles_used <= most, "{} tiles at {share}", packed.tiles_used);
        assert!(packed.tiles_used as f64 >= 0.6 * share * share, "{} tiles cannot hold it", packed.tiles_used);
        assert_eq!(packed.shortfall, None);
        // With a tile less it does not fit.
        if packed.tiles_used > 1 {
            let fewer = PackSettings { tiles: packed.tiles_used - 1, ..settings };
            let fewer = pack(&items(&charts), &fewer, &Progress::new()).expect("a warning, no error");
            assert!(fewer.shortfall.is_some() && fewer.texels_per_unit < share * one);
        }
    }
}

#[test]
fn a_density_that_does_not_fit_is_told_with_a_remedy() {
    let charts = even(30, 4);
    let settings = tiled(256, 2.0, 2);
    let most = packed(&charts, &settings).texels_per_unit;
    let wanted = at_density(&settings, 2.0 * most);
    let dense = packed(&charts, &wanted);
    check_tiles(&charts, &wanted, &dense);
    assert!(dense.texels_per_unit > 0.95 * most, "{} of {most}", dense.texels_per_unit);
    let shortfall = dense.shortfall.expect("does not fit");
    assert_eq!((shortfall.wanted, shortfall.reached, shortfall.tiles), (2.0 * most, dense.texels_per_unit, 2));
    let needed = shortfall.needed.expect("more tiles do");
    assert!((6..=10).contains(&needed), "{needed}");
    let enough = PackSettings { tiles: charts.len(), ..wanted };
    assert_eq!(packed(&charts, &enough).shortfall, None);
    // A chart that is larger than a tile fits into no number of them.
    let large = vec![regular(4, 10.0), regular(5, 0.1)];
    let shortfall = packed(&large, &at_density(&tiled(256, 2.0, 100), 100.0)).shortfall.expect("too large");
    assert_eq!(shortfall.needed, None);
    assert!(shortfall.reached > 250.0 / 20.0 * 1.0 && shortfall.reached < 20.0, "{shortfall}");
}

#[test]
fn a_given_scale_in_tiles_is_exact_or_an_error() {
    let charts = even(30, 4);
    let one = packed(&charts, &square(256, 2.0)).texels_per_unit;
    let at = |tiles: usize| {
        let constraints = Constraints { scale: Some(1.5 * one), ..Constraints::default() };
        pack_within(&items(&charts), &constraints, &tiled(256, 2.0, tiles), &Progress::new())
    };
    assert!(matches!(at(1), Err(PackError::TooLarge { shrunk }) if (0.6..0.7).contains(&shrunk)));
    let packed = at(6).expect("they fit");
    check_tiles(&charts, &tiled(256, 2.0, 6), &packed);
    assert!(packed.specks == 0 && packed.tiles_used <= 4, "{}", packed.tiles_used);
}

#[test]
fn margins_hold_where_single_precision_is_coarse() {
    // In the tenth tile single precision moves a point of the largest texture by a 64th of a texel.
    for (size, tiles) in [(PackSettings::LARGEST_SIZE, 10), (PackSettings::LARGEST_SIZE, 91), (16_384, 10), (8192, 100)]
    {
        let settings = tiled(size, 0.25, tiles);
        // Squares of whole texels, as near to each other as may be.
        let charts: Vec<Chart> = (0..3 * tiles).map(|k| regular(4 + k % 2, 1.0)).collect();
        let packed = packed(&charts, &settings);
        assert_eq!(packed.tiles_used, tiles);
        check_tiles(&charts, &settings, &packed);
    }
}

#[test]
fn obstacles_are_in_the_way_in_their_own_tiles() {
    let triangle = |corners: [[f64; 2]; 3]| corners.map(|[x, y]| Point2::new(x, y));
    // The first tile is full, the second has a bar that reaches into the third, which is otherwise free.
    let obstacles = [
        triangle([[0.0, 0.0], [256.0, 0.0], [256.0, 256.0]]),
        triangle([[0.0, 0.0], [256.0, 256.0], [0.0, 256.0]]),
        triangle([[300.0, 100.0], [600.0, 100.0], [600.0, 120.0]]),
    ];
    let charts = mixture(24, 2);
    let settings = tiled(256, 2.0, 3);
    let constraints = Constraints { obstacles: &obstacles, ..Constraints::default() };
    let packed = pack_within(&items(&charts), &constraints, &settings, &Progress::new()).expect("there is room");
    assert_eq!(packed.tiles_used, 3, "with the one that obstacles fill");
    assert_eq!(packed.tiles.iter().map(|tile| tile.number()).collect::<BTreeSet<_>>(), BTreeSet::from([1, 2]));
    for (tile, placed) in by_tile(&charts, &packed) {
        let corner = tile.corner().map(|x| 256.0 * x);
        for t in placed.iter().flatten() {
            for o in &obstacles {
                let o = o.map(|p| p - Vector2::from(corner));
                assert!(distance(t, &o) >= 2.0, "in {tile:?}");
            }
        }
    }
    // Full tiles are an error, as a full texture is.
    let full = pack_within(&items(&charts), &constraints, &tiled(256, 2.0, 1), &Progress::new());
    assert!(matches!(full, Err(PackError::NoRoomBetweenObstacles { charts: 24, .. })), "{full:?}");
}

#[test]
fn charts_upon_themselves_do_not_count_as_needing_room() {
    // Twenty copies of a square upon each other, as a stack that moves as one has them.
    let (points, triangles) = regular(4, 1.0);
    let stack = |_| (points.clone(), triangles.iter().copied().cycle().take(20 * triangles.len()).collect());
    let charts: Vec<Chart> = (0..4).map(stack).collect();
    let density = 0.4 * 256.0 / 2.0f64.sqrt();
    let packed = packed(&charts, &at_density(&tiled(256, 2.0, 9), density));
    assert_eq!((packed.tiles_used, packed.shortfall), (1, None));
}

#[test]
fn wrong_numbers_are_named_and_nothing_is_nothing() {
    let charts = mixture(3, 1);
    let refused =
        |settings: &PackSettings| pack(&items(&charts), settings, &Progress::new()).expect_err("no such thing");
    for tiles in [0, PackSettings::MOST_TILES + 1] {
        assert_eq!(refused(&tiled(64, 1.0, tiles)), PackError::Tiles { tiles });
    }
    for density in [0.0, -1.0, f64::INFINITY] {
        assert_eq!(refused(&at_density(&square(64, 1.0), density)), PackError::TexelDensity { density });
    }
    let stopped = Progress::new();
    stopped.cancel();
    assert!(matches!(pack(&items(&charts), &tiled(64, 1.0, 4), &stopped), Err(PackError::Cancelled(_))));
    for settings in [tiled(64, 1.0, 4), at_density(&square(64, 1.0), 8.0)] {
        let nothing = packed(&[], &settings);
        assert_eq!((nothing.tiles_used, nothing.efficiency, nothing.shortfall), (0, 0.0, None));
        // Points, and what has no triangles.
        let points: Vec<Chart> = (0..5).map(|k| (vec![Point2::origin()], vec![[0; 3]; usize::from(k < 4)])).collect();
        let packed = packed(&points, &settings);
        assert!(packed.tiles_used >= 1 && packed.shortfall.is_none());
    }
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let charts = even(30, 8);
    let settings = [tiled(256, 2.0, 5), at_density(&tiled(256, 2.0, 9), 20.0), at_density(&tiled(256, 2.0, 2), 90.0)];
    for settings in settings {
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| packed(&charts, &settings))
        };
        assert_eq!(on(1), on(3));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]
    #[test]
    fn promises_hold_for_any_charts_in_any_number_of_tiles(
        count in 1usize..14, seed in 0u64..1000, tiles in 1usize..24, margin in prop_oneof![Just(0.0), 0.0..6.0],
        width in 40u32..160, height in 40u32..160, density in prop_oneof![Just(None), (0.05f64..40.0).prop_map(Some)],
    ) {
        let charts = mixture(count, seed);
        let settings = PackSettings { margin_texels: margin, width, height, tiles, texel_density: density, ..PackSettings::default() };
        let packed = packed(&charts, &settings);
        check_tiles(&charts, &settings, &packed);
        match (density, packed.shortfall) {
            (Some(density), None) => prop_assert!((packed.texels_per_unit / density - 1.0).abs() < 1e-9),
            (Some(density), Some(shortfall)) => prop_assert!(packed.texels_per_unit < density && shortfall.wanted == density),
            (None, shortfall) => prop_assert_eq!(shortfall, None),
        }
    }
}

#[test]
fn a_chart_by_itself_is_enlarged_to_a_texel_where_its_density_asks_for_less() {
    for density in [1e-6, 0.01, 1.0, 20.0] {
        let charts = vec![regular(4, 1.0)];
        for tiles in [1, 3] {
            let packed = packed(&charts, &at_density(&tiled(256, 2.0, tiles), density));
            assert!((packed.texels_per_unit / density - 1.0).abs() < 1e-9, "{} for {density}", packed.texels_per_unit);
            assert_eq!(packed.specks, usize::from(density < 0.1), "at {density}");
            assert!(packed.poses[0].scale >= density.max(0.4), "{} at {density}", packed.poses[0].scale);
            assert_eq!(packed.shortfall, None);
        }
    }
}

#[test]
fn charts_of_neighbouring_tiles_keep_the_margin_without_one_to_the_border() {
    // Squares as large as tiles.
    let charts = vec![regular(4, 1.0), regular(4, 1.0)];
    let settings = PackSettings { rotation: Rotation::Any, ..tiled(256, 8.0, 2) };
    let constraints = Constraints { border_texels: Some(0.0), ..Constraints::default() };
    let packed = pack_within(&items(&charts), &constraints, &settings, &Progress::new()).expect("two squares");
    let reach = |k: usize| charts[k].0.iter().map(|p| 256.0 * packed.uvs(k, &[*p])[0][0]).collect::<Vec<f64>>();
    let [first, second] = if packed.tiles[0] < packed.tiles[1] { [0, 1] } else { [1, 0] };
    let right = reach(first).into_iter().fold(f64::MIN, f64::max);
    let left = reach(second).into_iter().fold(f64::MAX, f64::min);
    assert!(left - right >= 8.0, "{} texels apart", left - right);
}
