//! Whole packings around obstacles, within another border and at a given scale, against the same oracle of distances.

use super::tests::*;
use super::*;

/// What obstacles are packed around: a bar across the texture, and a triangle that begins beyond it.
fn obstacles() -> Vec<[Point2<f64>; 3]> {
    let corners = [
        [[0.0, 90.0], [200.0, 90.0], [200.0, 100.0]],
        [[0.0, 90.0], [200.0, 100.0], [0.0, 100.0]],
        [[300.0, 300.0], [180.0, 256.5], [256.5, 180.0]],
    ];
    corners.map(|t| t.map(|[x, y]| Point2::new(x, y))).to_vec()
}

/// Asserts that all charts keep the margin to obstacles.
fn check_obstacles(charts: &[Chart], obstacles: &[[Point2<f64>; 3]], margin: f64, packed: &Packed) {
    for (k, chart) in charts.iter().enumerate() {
        for t in final_triangles(packed, k, chart) {
            for o in obstacles {
                let apart = distance(&t, o);
                assert!(apart >= margin && apart > 0.0, "chart {k} is {apart} texels from an obstacle");
            }
        }
    }
}

#[test]
fn obstacles_keep_their_margin() {
    let obstacles = obstacles();
    for (n, margin) in [0.0, 2.0, 5.5].into_iter().enumerate() {
        for (count, quality) in [(1, Quality::Normal), (14, Quality::Fast), (700, Quality::Fast)] {
            let charts = mixture(count, n as u64);
            let sizes = [(256, 256), (290, 256), (256, 270)];
            for &(width, height) in &sizes[if count == 700 { n..n + 1 } else { 0..3 }] {
                let settings =
                    PackSettings { quality, margin_texels: margin, width, height, ..PackSettings::default() };
                let constraints = Constraints { obstacles: &obstacles, ..Constraints::default() };
                match pack_within(&items(&charts), &constraints, &settings, &Progress::new()) {
                    Ok(packed) => {
                        check(&charts, &settings, &packed);
                        check_obstacles(&charts, &obstacles, margin, &packed);
                        assert!(packed.efficiency > 0.1 && packed.efficiency <= 1.0);
                    }
                    Err(error) => assert!(
                        count == 700 && margin > 5.0 && matches!(error, PackError::NoRoomBetweenObstacles { .. }),
                        "{error}"
                    ),
                }
            }
        }
    }
}

#[test]
fn obstacles_that_take_all_are_an_error() {
    let corners = [[-1.0, -1.0], [600.0, -1.0], [-1.0, 600.0]].map(|[x, y]| Point2::new(x, y));
    let constraints = Constraints { obstacles: &[corners], ..Constraints::default() };
    for count in [1, 20, many::ROWS_ONLY] {
        let charts: Vec<Chart> = (0..count).map(|_| regular(3, 1.0)).collect();
        let error = pack_within(&items(&charts), &constraints, &square(256, 2.0), &Progress::new());
        assert!(matches!(error, Err(PackError::NoRoomBetweenObstacles { charts, .. }) if charts == count), "{error:?}");
    }
    let nothing = pack_within(&[], &constraints, &square(256, 2.0), &Progress::new()).expect("nothing to place");
    assert!((nothing.efficiency - 1.0).abs() < 1e-9);
}

#[test]
fn another_border_is_kept() {
    let charts = mixture(12, 3);
    for border in [0.0, 1.0, 20.0] {
        for count in [1, 12] {
            let constraints = Constraints { border_texels: Some(border), ..Constraints::default() };
            let packed =
                pack_within(&items(&charts[..count]), &constraints, &square(256, 6.0), &Progress::new()).expect("fits");
            let points = (0..count).flat_map(|k| final_triangles(&packed, k, &charts[k])).flatten();
            let least = points.flat_map(|p| [p.x, p.y, 256.0 - p.x, 256.0 - p.y]).fold(f64::MAX, f64::min);
            assert!((border..border + 1.0).contains(&least), "{least} for {border}");
        }
    }
    let wrong = |border: f64| {
        let constraints = Constraints { border_texels: Some(border), ..Constraints::default() };
        pack_within(&items(&charts), &constraints, &square(64, 1.0), &Progress::new()).expect_err("no border")
    };
    assert_eq!(wrong(-1.0), PackError::Border { border: -1.0 });
    assert_eq!(wrong(31.6), PackError::BorderTooLarge { border: 31.6, width: 64, height: 64 });
}

#[test]
fn a_given_scale_is_exact_or_an_error() {
    for count in [1, 10, 700] {
        let charts = mixture(count, 5);
        let free = packed(&charts, &square(512, 2.0)).texels_per_unit;
        let at = |scale: f64| {
            let constraints = Constraints { scale: Some(scale), ..Constraints::default() };
            pack_within(&items(&charts), &constraints, &square(512, 2.0), &Progress::new())
        };
        for &share in if count == 700 { &[0.5][..] } else { &[0.01, 0.5, 0.9] } {
            let packed = at(share * free).expect("fits");
            check(&charts, &square(512, 2.0), &packed);
            assert_eq!(packed.specks, 0, "none is enlarged");
            for pose in &packed.poses {
                assert!((pose.scale / (share * free) - 1.0).abs() < 1e-9, "{} for {}", pose.scale, share * free);
            }
        }
        let Err(PackError::TooLarge { shrunk }) = at(2.0 * free) else { panic!("twice too large") };
        assert!(shrunk > 0.45 && shrunk < 0.55, "{shrunk}");
        // By that much smaller they do fit.
        assert!(count == 700 || at(2.0 * free * shrunk * 0.99).is_ok());
    }
}
