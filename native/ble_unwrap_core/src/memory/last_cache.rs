//! The size of the processor's last cache, as faer's kernels find it out.

use std::fs;
use std::path::Path;

/// Where the kernels' first source, `/sys`, cannot be read whole, they ask this program. Where there is none they ask the processor,
/// as on every other system.
const LSCPU: [&str; 3] = ["/usr/bin/lscpu", "/bin/lscpu", "/usr/local/bin/lscpu"];
/// The kernels take the cache to be at least so large: four times the second cache, of which 4 MiB are the most built.
const LEAST: u64 = 16 << 20;

/// An upper bound of what faer's kernels take for the size of the last cache, in bytes.
pub(crate) fn last_cache() -> u64 {
    let told = if LSCPU.iter().any(|path| Path::new(path).exists()) { of_all_cpus() } else { None };
    told.unwrap_or_else(|| of_package().max(of_all_cpus().unwrap_or(0))).max(LEAST)
}

/// The last caches of all processors together, from `/sys`.
fn of_all_cpus() -> Option<u64> {
    let mut sum = 0;
    for cpu in fs::read_dir("/sys/devices/system/cpu").ok()?.flatten() {
        let cache = cpu.path().join("cache/index3");
        let read = |name: &str| fs::read_to_string(cache.join(name)).ok();
        if let (Some(size), Some(shared)) = (read("size"), read("shared_cpu_list")) {
            sum += bytes(&size)? / sharing(&shared)?.max(1);
        }
    }
    (sum > 0).then_some(sum)
}

/// A size such as `32768K`.
fn bytes(text: &str) -> Option<u64> {
    let text = text.trim();
    let unit = [("K", 1 << 10), ("M", 1 << 20), ("G", 1 << 30)].into_iter();
    let in_unit = unit.filter_map(|(unit, bytes)| Some((text.strip_suffix(unit)?, bytes))).next();
    let (number, unit) = in_unit.unwrap_or((text, 1));
    number.parse::<u64>().ok()?.checked_mul(unit)
}

/// How many processors a list such as `0-3,8` names.
fn sharing(list: &str) -> Option<u64> {
    let count = |range: &str| {
        let (first, last) = range.split_once('-').unwrap_or((range, range));
        (last.parse::<u64>().ok()? + 1).checked_sub(first.parse().ok()?)
    };
    list.trim().split(',').map(count).sum()
}

/// As the processor itself tells it: AMD's that of all cores together.
#[cfg(target_arch = "x86_64")]
fn of_package() -> u64 {
    use raw_cpuid::CpuId;

    /// The unit of AMD's figure.
    const AMD_UNIT: u64 = 512 << 10;
    let cpu = CpuId::new();
    let levels = cpu.get_cache_parameters().into_iter().flatten().filter(|c| c.level() <= 3);
    let of_levels = levels.map(|c| c.associativity() as u64 * c.sets() as u64 * c.coherency_line_size() as u64).max();
    let amd = cpu.get_l2_l3_cache_and_tlb_info().map(|c| u64::from(c.l3cache_size()) * AMD_UNIT);
    of_levels.unwrap_or(0).max(amd.unwrap_or(0))
}

#[cfg(not(target_arch = "x86_64"))]
fn of_package() -> u64 {
    0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_and_lists_are_read_as_they_are_written() {
        assert_eq!(["32768K\n", "8M", "1G", "512"].map(bytes), [32 << 20, 8 << 20, 1 << 30, 512].map(Some));
        assert_eq!(["0-3,8\n", "7", "0-1,4-5"].map(sharing), [5, 1, 4].map(Some));
        assert_eq!([bytes("much"), bytes("1T"), sharing("3-1"), sharing("")], [None; 4]);
        assert!(last_cache() >= LEAST);
    }
}
