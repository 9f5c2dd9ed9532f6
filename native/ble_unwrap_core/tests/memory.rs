//! A refused allocation ends every computation under way with an error. In a process of its own: the refusal is told to all.

use ble_unwrap_core::memory::{OutOfMemory, note_refusal};
use ble_unwrap_core::{Cancelled, MeshInput, Progress, Settings, UnwrapError, unwrap};
use ble_unwrap_fixtures::ico_sphere;

#[test]
fn a_refusal_is_an_error_that_says_so_and_no_other_result() {
    let mesh = ico_sphere(3);
    let flat = mesh.flat();
    let input = MeshInput {
        positions: &mesh.positions,
        corner_vertices: &flat.corner_vertices,
        face_offsets: &flat.face_offsets,
        ..MeshInput::default()
    };
    let settings = Settings::default();
    let before = unwrap(&input, &settings, &Progress::new()).expect("memory enough");

    let under_way = Progress::new();
    note_refusal(3 << 30);
    assert_eq!(under_way.check(), Err(Cancelled::OutOfMemory(OutOfMemory::Refused { bytes: 3 << 30 })));
    let refused = unwrap(&input, &settings, &under_way);
    match refused {
        Err(error @ UnwrapError::OutOfMemory(OutOfMemory::Refused { bytes })) => {
            assert_eq!(bytes, 3 << 30);
            assert!(error.to_string().contains("3.0 GiB (3221225472 bytes)"), "{error}");
        }
        other => panic!("{other:?}"),
    }
    // Asked to stop as well: that is what it says.
    under_way.cancel();
    assert_eq!(under_way.check(), Err(Cancelled::OnRequest));

    // One that begins later does not know of it, and has the same result as before.
    let waiting = Progress::new();
    note_refusal(1);
    waiting.begin();
    let after = unwrap(&input, &settings, &waiting).expect("memory enough");
    assert_eq!((after.uv, after.chart), (before.uv, before.chart));
}
