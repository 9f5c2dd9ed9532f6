//! The buffers that faer's dense products pack their factors into.
//!
//! Each thread makes them once, at its first larger product, twice the size of the last cache: up to a gigabyte of address
//! space a thread on some servers, of which hardly anything is ever touched. Where that is refused the process ends, so it is asked
//! for here before, in a way that can fail.

use std::cell::RefCell;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, Par};

use super::vector_state::restore_vector_state;
use crate::memory::{self, OutOfMemory};

/// A product of this side takes faer's packed kernels.
const SIDE: usize = 96;
/// What else is allocated while a thread makes its buffers: its own bookkeeping and small arrays of other threads.
const SLACK: u64 = 4 << 20;

/// Threads alive that have their buffers.
static READY: AtomicUsize = AtomicUsize::new(0);
/// One thread at a time, or two could each find room for one.
static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

/// Held by a thread that has its buffers, for as long as it lives.
struct Ready;

impl Drop for Ready {
    fn drop(&mut self) {
        READY.fetch_sub(1, Ordering::Relaxed);
    }
}

thread_local! {
    static OF_THIS_THREAD: RefCell<Option<Ready>> = const { RefCell::new(None) };
}

/// Makes the buffers of this thread, if it has none. To be called before a factorisation or a dense product.
///
/// # Errors
/// [`OutOfMemory::Refused`] where there is no room for them.
pub(super) fn reserve() -> Result<(), OutOfMemory> {
    OF_THIS_THREAD.with_borrow_mut(|ready| {
        if ready.is_some() {
            return Ok(());
        }
        let turn = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
        let bytes = bytes_a_thread() + SLACK;
        drop(memory::reserve::<u8>(usize::try_from(bytes).unwrap_or(usize::MAX))?);
        let one = Mat::<f64>::identity(SIDE, SIDE);
        let mut product = Mat::<f64>::zeros(SIDE, SIDE);
        matmul(product.as_mut(), Accum::Replace, one.as_ref(), one.as_ref(), 1.0, Par::Seq);
        restore_vector_state();
        std::hint::black_box(&product);
        drop(turn);
        READY.fetch_add(1, Ordering::Relaxed);
        *ready = Some(Ready);
        Ok(())
    })
}

/// Address space that so many threads will take for buffers they do not have yet, in bytes.
pub(crate) fn bytes_of_packing_buffers(threads: usize) -> u64 {
    let missing = threads.saturating_sub(READY.load(Ordering::Relaxed));
    (missing as u64).saturating_mul(bytes_a_thread() + SLACK)
}

/// Twice the last cache; elsewhere than on x86 the buffers are as large as the second one, which the slack covers.
fn bytes_a_thread() -> u64 {
    static BYTES: OnceLock<u64> = OnceLock::new();
    *BYTES.get_or_init(|| if cfg!(target_arch = "x86_64") { 2 * memory::last_cache() } else { 0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thread_that_has_its_buffers_asks_for_no_more() {
        std::thread::spawn(|| {
            let before = bytes_of_packing_buffers(1 << 20);
            assert_eq!(reserve(), Ok(()));
            assert_eq!(reserve(), Ok(()));
            let most = bytes_a_thread() + SLACK;
            // Other tests make and end threads meanwhile.
            assert!(bytes_of_packing_buffers(1 << 20) < before + 64 * most);
            assert_eq!(bytes_of_packing_buffers(0), 0);
        })
        .join()
        .expect("no panic");
    }

    #[cfg(all(target_os = "linux", target_arch = "x86_64"))]
    #[test]
    fn the_kernels_take_no_more_than_is_said() {
        // In a process of its own, where no other test allocates.
        const ASKED: &str = "BLE_UNWRAP_PACKING_BUFFERS";
        if std::env::var_os(ASKED).is_none() {
            let name = "linalg::packing_buffers::tests::the_kernels_take_no_more_than_is_said";
            let own = std::env::current_exe().expect("this test");
            let run =
                std::process::Command::new(own).args([name, "--exact", "--test-threads=1"]).env(ASKED, "1").output();
            let run = run.expect("starts");
            assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stdout));
            return;
        }
        let size = || {
            let status = std::fs::read_to_string("/proc/self/status").expect("Linux");
            let line = status.lines().find(|l| l.starts_with("VmSize:")).expect("field").to_owned();
            line.split_whitespace().nth(1).and_then(|kb| kb.parse::<u64>().ok()).expect("number") << 10
        };
        let before = size();
        assert_eq!(reserve(), Ok(()));
        let taken = size() - before;
        assert!(taken <= bytes_a_thread() + SLACK, "{taken} of {}", bytes_a_thread());
        // A large factorisation finds them made.
        let n = 700;
        let matrix: Vec<f64> = (0..n * n).map(|i| if i % (n + 1) == 0 { 2.0 } else { 1.0 / n as f64 }).collect();
        let before = size();
        let pairs = crate::linalg::symmetric::leading_eigenpairs(&matrix, n, 2).expect("finite");
        assert_eq!(pairs.values.len(), n);
        assert!(size() - before < 64 << 20, "{} more", size() - before);
    }
}
