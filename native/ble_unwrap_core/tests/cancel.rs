//! Cancelling from another thread, and progress as another thread sees it.

use std::thread;
use std::time::{Duration, Instant};

use ble_unwrap_core::{MeshInput, Progress, Settings, Stage, UnwrapError, unwrap};
use ble_unwrap_fixtures::{FlatPolygons, PolyMesh, book, grid, many_components, sculpt_like};

/// How long a cancelled computation may go on in this test: generous, for machines that are busy with
/// other tests; alone it is some ten milliseconds.
const PATIENCE: Duration = Duration::from_millis(1500);

fn input<'a>(mesh: &'a PolyMesh, flat: &'a FlatPolygons) -> MeshInput<'a> {
    MeshInput {
        positions: &mesh.positions,
        corner_vertices: &flat.corner_vertices,
        face_offsets: &flat.face_offsets,
        corner_triangles: None,
        ..MeshInput::default()
    }
}

/// Cancels at several moments, early to late; each time the computation must end soon, and unless it
/// was done before, with the error. Returns how many ended with it.
fn cancelled_runs(mesh: &PolyMesh, moments: impl Iterator<Item = Duration>) -> usize {
    let flat = mesh.flat();
    let mut stopped = 0;
    for moment in moments {
        let progress = Progress::new();
        thread::scope(|scope| {
            let run = scope.spawn(|| {
                let result = unwrap(&input(mesh, &flat), &Settings::default(), &progress);
                (Instant::now(), result)
            });
            thread::sleep(moment);
            progress.cancel();
            let asked = Instant::now();
            let (ended, result) = run.join().expect("no panic");
            let late = ended.saturating_duration_since(asked);
            assert!(late < PATIENCE, "{late:?} after cancelling at {moment:?} in {:?}", progress.stage());
            match result {
                Err(UnwrapError::Cancelled(_)) => stopped += 1,
                Err(other) => panic!("{other}"),
                Ok(_) => assert_eq!(progress.stage(), Stage::Done),
            }
        });
    }
    stopped
}

#[test]
fn a_large_mesh_stops_at_any_moment() {
    let mesh = sculpt_like(60_000);
    // Seconds of work, so that the first moments hit every stage before packing.
    let moments = [0, 5, 20, 60, 150, 300, 600, 900].map(Duration::from_millis);
    assert!(cancelled_runs(&mesh, moments.into_iter()) >= 6);
}

/// Cancels as soon as another thread sees a stage; the computation must end soon, with the error.
fn stops_in(stage: Stage, mesh: &PolyMesh) {
    let flat = mesh.flat();
    let progress = Progress::new();
    thread::scope(|scope| {
        let run = scope.spawn(|| {
            let result = unwrap(&input(mesh, &flat), &Settings::default(), &progress);
            (Instant::now(), result)
        });
        while progress.stage() < stage && !run.is_finished() {
            thread::sleep(Duration::from_micros(50));
        }
        assert_eq!(progress.stage(), stage, "it was over before anybody looked: take a larger mesh");
        progress.cancel();
        let asked = Instant::now();
        let (ended, result) = run.join().expect("no panic");
        assert!(matches!(result, Err(UnwrapError::Cancelled(_))), "{stage:?} went on to the end");
        let late = ended.saturating_duration_since(asked);
        assert!(late < PATIENCE, "{late:?} after cancelling in {stage:?}");
    });
}

#[test]
fn each_stage_stops_when_it_is_interrupted() {
    stops_in(Stage::Condition, &sculpt_like(60_000));
    stops_in(Stage::Charts, &sculpt_like(20_000));
    let parts = many_components(20_000);
    stops_in(Stage::Charts, &parts);
    stops_in(Stage::Pack, &parts);
    stops_in(Stage::Verify, &parts);
}

#[test]
fn one_large_plane_stops() {
    let mesh = grid(300, 300, |u, v| [u, v, 0.0]);
    let moments = [5, 40, 100, 160].map(Duration::from_millis);
    assert!(cancelled_runs(&mesh, moments.into_iter()) >= 1);
}

#[test]
fn cancelled_before_the_start_and_after_the_end() {
    let mesh = book(5);
    let flat = mesh.flat();
    let progress = Progress::new();
    progress.cancel();
    let result = unwrap(&input(&mesh, &flat), &Settings::default(), &progress);
    assert!(matches!(result, Err(UnwrapError::Cancelled(_))));
    let progress = Progress::new();
    assert!(unwrap(&input(&mesh, &flat), &Settings::default(), &progress).is_ok());
    progress.cancel();
    assert_eq!((progress.stage(), progress.fraction()), (Stage::Done, 1.0));
}

#[test]
fn progress_only_rises_and_ends_at_one() {
    // Each of them is charted by itself.
    let apart = |faces: usize, x: f64| sculpt_like(faces).moved(|[u, v, w]| [u + x, v, w]);
    let mesh = apart(6000, 0.0).joined(&apart(4000, 9.0)).joined(&apart(3000, 18.0)).joined(&apart(2000, 27.0));
    let flat = mesh.flat();
    let progress = Progress::new();
    let mut seen = vec![(progress.stage(), progress.fraction())];
    thread::scope(|scope| {
        let run = scope.spawn(|| unwrap(&input(&mesh, &flat), &Settings::default(), &progress).map(|_| ()));
        while !run.is_finished() {
            // The fraction first: the stage is entered before its share counts.
            let fraction = progress.fraction();
            seen.push((progress.stage(), fraction));
            thread::sleep(Duration::from_millis(1));
        }
        assert!(run.join().expect("no panic").is_ok());
    });
    assert!(seen.windows(2).all(|w| w[0].1 <= w[1].1), "the fraction fell");
    assert!(seen.iter().all(|s| (0.0..=1.0).contains(&s.1)));
    let halfway = seen.iter().filter(|s| s.1 > 0.05 && s.1 < 0.8).map(|s| s.1.to_bits());
    let steps = halfway.collect::<std::collections::BTreeSet<_>>().len();
    assert!(steps >= 3, "only {steps} steps of progress while charts were made");
    assert_eq!((progress.stage(), progress.fraction()), (Stage::Done, 1.0));
}
