//! The allocator of this module: the system's, with a reserve to come to an end on.
//!
//! Rust ends the process where an allocation fails, and with it Blender and all that is not saved. So a reserve is held, of
//! which no page is ever touched: where the system refuses a piece of memory the reserve is given back, the piece asked for
//! once more, and the core told, which stops all work under way by its next look at the progress. What is larger than the
//! reserve is estimated before, or asked for in a way that can fail; see `ble_unwrap_core::memory`.

use std::alloc::{GlobalAlloc, Layout, System};
use std::ptr::null_mut;
use std::sync::atomic::{AtomicPtr, Ordering};

use ble_unwrap_core::memory::note_refusal;

#[global_allocator]
static ALLOCATOR: WithReserve = WithReserve;

/// The reserve: more than is allocated in the tenth of a second that work takes to stop, and so much that the system's
/// allocator returns it to the system when it is freed (the GNU C library keeps what is below 32 MiB).
const RESERVE: Layout = match Layout::from_size_align(64 << 20, 4096) {
    Ok(layout) => layout,
    Err(_) => panic!("a power of two"),
};

/// Null while there is none.
static HELD: AtomicPtr<u8> = AtomicPtr::new(null_mut());

struct WithReserve;

// SAFETY: everything is handed on to the system's allocator with the layout it came with. Freeing the reserve and noting a
// refusal neither allocate nor unwind.
unsafe impl GlobalAlloc for WithReserve {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller's promise.
        or_from_reserve(layout.size(), || unsafe { System.alloc(layout) })
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller's promise.
        or_from_reserve(layout.size(), || unsafe { System.alloc_zeroed(layout) })
    }

    unsafe fn realloc(&self, piece: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: the caller's promise; a refused piece is still what it was, so it may be tried again.
        or_from_reserve(size, || unsafe { System.realloc(piece, layout, size) })
    }

    unsafe fn dealloc(&self, piece: *mut u8, layout: Layout) {
        // SAFETY: the caller's promise.
        unsafe { System.dealloc(piece, layout) }
    }
}

fn or_from_reserve(size: usize, ask: impl Fn() -> *mut u8) -> *mut u8 {
    let piece = ask();
    if !piece.is_null() {
        return piece;
    }
    note_refusal(size as u64);
    let reserve = HELD.swap(null_mut(), Ordering::AcqRel);
    if reserve.is_null() {
        return null_mut();
    }
    // SAFETY: allocated in `hold_reserve` with this layout; the swap leaves it to this thread alone.
    unsafe { System.dealloc(reserve, RESERVE) };
    ask()
}

/// Lays the reserve in again, if it was used and there is room. To be called when work begins.
pub(crate) fn hold_reserve() {
    if !HELD.load(Ordering::Acquire).is_null() {
        return;
    }
    // SAFETY: the layout is not empty.
    let fresh = unsafe { System.alloc(RESERVE) };
    if fresh.is_null() {
        return;
    }
    if HELD.compare_exchange(null_mut(), fresh, Ordering::AcqRel, Ordering::Acquire).is_err() {
        // SAFETY: just allocated, and nobody else knows of it.
        unsafe { System.dealloc(fresh, RESERVE) };
    }
}
