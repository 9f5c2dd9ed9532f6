//! What the container of this process leaves it, where Linux bounds the memory of a group of processes.

use std::fs;
use std::path::{Path, PathBuf};

/// Where the groups are found.
const ROOT: &str = "/sys/fs/cgroup";

/// The names of a group's files: its limit, what it takes, and in which line of `memory.stat` the file cache stands that the
/// system takes back before it refuses anything.
struct Names {
    limit: &'static str,
    taken: &'static str,
    cache: &'static str,
}

const SECOND: Names = Names { limit: "memory.max", taken: "memory.current", cache: "inactive_file" };
const FIRST: Names =
    Names { limit: "memory.limit_in_bytes", taken: "memory.usage_in_bytes", cache: "total_inactive_file" };

/// Bytes that the group of this process, and the groups around that, leave it; `None` where there is no limit, or none is told.
pub(super) fn left() -> Option<u64> {
    let groups = fs::read_to_string("/proc/self/cgroup").ok()?;
    let (folder, names) = group(&groups)?;
    let own = Path::new(ROOT).join(&folder);
    // Inside a container its own group often stands at the root.
    let around = own.ancestors().take_while(|path| path.starts_with(ROOT)).map(PathBuf::from);
    around.filter_map(|path| left_in(&path, &names)).min()
}

/// The folder of a process's group below the root, by `/proc/self/cgroup`.
fn group(groups: &str) -> Option<(PathBuf, Names)> {
    let of = |wanted: &dyn Fn(&str) -> bool| {
        groups.lines().find_map(|line| {
            let mut fields = line.splitn(3, ':').skip(1);
            let (controllers, path) = (fields.next()?, fields.next()?);
            wanted(controllers).then(|| path.trim_start_matches('/').to_owned())
        })
    };
    if let Some(path) = of(&|controllers| controllers.split(',').any(|c| c == "memory")) {
        return Some((Path::new("memory").join(path), FIRST));
    }
    of(&str::is_empty).map(|path| (PathBuf::from(path), SECOND))
}

fn left_in(folder: &Path, names: &Names) -> Option<u64> {
    let read = |name: &str| fs::read_to_string(folder.join(name)).ok();
    let limit: u64 = read(names.limit)?.trim().parse().ok()?;
    let taken: u64 = read(names.taken)?.trim().parse().ok()?;
    let cache = read("memory.stat").and_then(|text| field(&text, names.cache)).unwrap_or(0);
    Some(limit.saturating_sub(taken.saturating_sub(cache)))
}

/// The number in the line of `memory.stat` that begins with a name.
fn field(text: &str, name: &str) -> Option<u64> {
    text.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(' ')?.trim().parse().ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_are_read_as_they_are_written() {
        let path = |text: &str| group(text).map(|(folder, names)| (folder, names.limit));
        let second = path("0::/user.slice/session-2.scope\n");
        assert_eq!(second, Some((PathBuf::from("user.slice/session-2.scope"), "memory.max")));
        let first = path("5:cpu,cpuacct:/\n4:memory:/docker/ab:c\n0::/\n");
        assert_eq!(first, Some((PathBuf::from("memory/docker/ab:c"), "memory.limit_in_bytes")));
        assert_eq!(path("nothing of the kind"), None);
        assert_eq!(field("file 12\ninactive_file 34\n", "inactive_file"), Some(34));
        assert_eq!(field("inactive_files 34\n", "inactive_file"), None);
    }

    #[test]
    fn a_limit_leaves_what_is_not_taken_the_cache_apart() {
        let folder = std::env::temp_dir().join(format!("ble_unwrap_group_{}", std::process::id()));
        fs::create_dir_all(&folder).expect("a folder for temporary files");
        let write = |name: &str, text: &str| fs::write(folder.join(name), text).expect("room for a few bytes");
        write("memory.current", "700\n");
        write("memory.stat", "anon 500\ninactive_file 200\n");
        write("memory.max", "max\n");
        assert_eq!(left_in(&folder, &SECOND), None);
        write("memory.max", "1000\n");
        assert_eq!(left_in(&folder, &SECOND), Some(500));
        write("memory.max", "100\n");
        assert_eq!(left_in(&folder, &SECOND), Some(0));
        fs::remove_dir_all(&folder).expect("it is ours");
    }
}
