//! Memory: what is left of it, and how a refusal reaches the user as an error.
//!
//! What a call computes never depends on how much memory is free: the call returns its one result, or it ends with
//! [`OutOfMemory`]. This is ensured in three ways. A call estimates how much memory it will need, and compares this with
//! what is available before it begins. Large arrays are allocated in a way that can fail ([`required`], which hosts may use
//! for arrays of their own). And an allocator that had to fall back on a reserve reports this by [`note_refusal`]; every
//! computation under way then stops the next time it looks at its [`Progress`](crate::Progress).

mod container;
mod last_cache;

use std::fs;
use std::sync::atomic::{AtomicU64, Ordering};

use thiserror::Error;

pub(crate) use last_cache::last_cache;

/// The computation needs more memory than there is, and nothing was produced.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum OutOfMemory {
    /// The lack of memory was found before the work began.
    #[error(
        "not enough memory: this takes about {}, and {} are left; close something else, give the mesh in parts, or lower \
         the texture size or the number of landmarks",
        text(*needed),
        text(*available)
    )]
    Foreseen {
        /// What the work takes, in bytes: an estimate that is rather too high than too low.
        needed: u64,
        /// The memory that this process can still get, in bytes.
        available: u64,
    },
    /// An allocation failed.
    #[error(
        "out of memory: {} more were asked for and refused; close something else, give the mesh in parts, or lower the \
         texture size or the number of landmarks",
        text(*bytes)
    )]
    Refused {
        /// Bytes asked for.
        bytes: u64,
    },
}

/// A number of bytes in the unit in which it reads best.
pub(crate) fn text(bytes: u64) -> String {
    let unit = ["bytes", "KiB", "MiB", "GiB", "TiB"];
    let power = (0..4).take_while(|p| bytes >> (10 * (p + 1)) > 0).count();
    if power == 0 {
        return format!("{bytes} {}", unit[0]);
    }
    format!("{:.1} {} ({bytes} bytes)", bytes as f64 / f64::powi(1024.0, power as i32), unit[power])
}

/// Fails if less than so many bytes are left to this process, as far as the platform tells.
///
/// # Errors
/// [`OutOfMemory::Foreseen`].
pub(crate) fn require(needed: u64) -> Result<(), OutOfMemory> {
    match available() {
        Some(available) if available < needed => Err(OutOfMemory::Foreseen { needed, available }),
        _ => Ok(()),
    }
}

/// An empty vector with room for `count` elements, for arrays whose size a caller chooses freely. If the array takes more
/// memory than the platform says is left, no allocation is tried.
///
/// # Errors
/// [`OutOfMemory::Foreseen`] if the platform says that too little is left; [`OutOfMemory::Refused`] if the allocation
/// fails, or if the size in bytes overflows.
pub fn required<T>(count: usize) -> Result<Vec<T>, OutOfMemory> {
    require((count as u64).saturating_mul(size_of::<T>() as u64))?;
    reserve(count)
}

/// An empty vector with room for so many elements.
///
/// # Errors
/// [`OutOfMemory::Refused`], also where the size overflows.
pub(crate) fn reserve<T>(count: usize) -> Result<Vec<T>, OutOfMemory> {
    let mut room = Vec::new();
    match room.try_reserve_exact(count) {
        Ok(()) => Ok(room),
        Err(_) => Err(OutOfMemory::Refused { bytes: (count as u64).saturating_mul(size_of::<T>() as u64) }),
    }
}

/// A vector of so many equal elements; errors as for [`reserve`].
pub(crate) fn filled<T: Clone>(count: usize, value: T) -> Result<Vec<T>, OutOfMemory> {
    let mut room = reserve(count)?;
    room.resize(count, value);
    Ok(room)
}

/// Bytes left to this process: the least of what its own limits and those of its container leave and what the machine has to
/// give, swap included. `None` where the platform does not tell. Read from `/proc` and the control groups on Linux; elsewhere the system's own refusal has to do.
#[must_use]
pub(crate) fn available() -> Option<u64> {
    if !cfg!(target_os = "linux") {
        return None;
    }
    let read = |name: &str| fs::read_to_string(name).ok();
    let status = read("/proc/self/status");
    let taken = |field: &str| kibibytes(status.as_deref()?, field);
    let limits = read("/proc/self/limits");
    let limit = |name: &str| soft_limit(limits.as_deref()?, name);
    let left = |limit: Option<u64>, taken: Option<u64>| Some(limit?.saturating_sub(taken?));
    let machine = read("/proc/meminfo").and_then(|text| {
        Some(kibibytes(&text, "MemAvailable:")?.saturating_add(kibibytes(&text, "SwapFree:").unwrap_or(0)))
    });
    let all = [
        left(limit("Max address space"), taken("VmSize:")),
        left(limit("Max data size"), taken("VmData:")),
        machine,
        container::left(),
    ];
    all.into_iter().flatten().min()
}

/// A field of `/proc` given in kB, in bytes.
fn kibibytes(text: &str, field: &str) -> Option<u64> {
    let rest = text.lines().find_map(|line| line.strip_prefix(field))?;
    rest.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()?.checked_mul(1024)
}

/// The soft limit of a row of `/proc/self/limits`; `None` if there is none.
fn soft_limit(text: &str, name: &str) -> Option<u64> {
    let rest = text.lines().find_map(|line| line.strip_prefix(name))?;
    rest.split_whitespace().next()?.parse().ok()
}

/// Refusals noted so far in this process, and the bytes of the last.
static REFUSALS: AtomicU64 = AtomicU64::new(0);
static REFUSED_BYTES: AtomicU64 = AtomicU64::new(0);

/// Called by an allocator to report that `bytes` bytes were refused and that it had to use its reserve instead. Every
/// computation under way in this process soon ends with [`OutOfMemory::Refused`]. This function neither allocates nor
/// blocks.
pub fn note_refusal(bytes: u64) {
    REFUSED_BYTES.store(bytes, Ordering::Relaxed);
    REFUSALS.fetch_add(1, Ordering::Release);
}

/// How many refusals have been noted.
pub(crate) fn refusals() -> u64 {
    REFUSALS.load(Ordering::Acquire)
}

/// Fails if a refusal was noted since there were so many.
pub(crate) fn none_since(count: u64) -> Result<(), OutOfMemory> {
    if refusals() == count {
        Ok(())
    } else {
        Err(OutOfMemory::Refused { bytes: REFUSED_BYTES.load(Ordering::Relaxed) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_had_is_refused_with_the_bytes() {
        let bytes = 8 * (1 << 59);
        assert_eq!(reserve::<u64>(1 << 59).map(|v| v.len()), Err(OutOfMemory::Refused { bytes }));
        assert_eq!(filled(3, 7u8), Ok(vec![7; 3]));
        let text = OutOfMemory::Refused { bytes: 3 << 29 }.to_string();
        assert!(text.contains("1.5 GiB (1610612736 bytes)"), "{text}");
        assert!(OutOfMemory::Refused { bytes: 12 }.to_string().contains("12 bytes"));
    }

    #[test]
    fn more_than_the_machine_has_is_foreseen() {
        assert_eq!(require(0), Ok(()));
        if cfg!(target_os = "linux") {
            let available = available().expect("Linux tells");
            assert!(available > 1 << 20, "{available}");
            assert!(matches!(require(u64::MAX), Err(OutOfMemory::Foreseen { needed: u64::MAX, .. })));
        }
    }

    #[test]
    fn limits_and_fields_are_read_as_they_are_written() {
        let limits = "Limit                     Soft Limit           Hard Limit           Units     \n\
                      Max data size             unlimited            unlimited            bytes     \n\
                      Max address space         2097152000           unlimited            bytes     \n";
        assert_eq!(soft_limit(limits, "Max address space"), Some(2_097_152_000));
        assert_eq!(soft_limit(limits, "Max data size"), None);
        assert_eq!(kibibytes("VmPeak:\t 9 kB\nVmSize:\t  12 kB\n", "VmSize:"), Some(12 << 10));
        assert_eq!(kibibytes("VmPeak:\t 9 kB\n", "VmSize:"), None);
    }
}
