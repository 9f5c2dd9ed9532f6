//! A flame graph of one unwrap: `cargo run --release --example flamegraph -- out.svg [mesh.obj]`.
//!
//! Samples itself by a timer signal, so it needs neither `perf` nor the right to use it. Without a mesh it
//! unwraps a generated sculpt of 64,000 faces. On one thread: the graph shows work, not waiting.
#![expect(clippy::print_stdout, reason = "a command line program")]

use std::error::Error;

#[cfg(unix)]
mod obj;

#[cfg(unix)]
fn main() -> Result<(), Box<dyn Error>> {
    sampled::main()
}

#[cfg(not(unix))]
fn main() -> Result<(), Box<dyn Error>> {
    Err("sampling a process by signals is for Unix".into())
}

#[cfg(unix)]
mod sampled {
    use std::collections::BTreeMap;
    use std::error::Error;
    use std::path::Path;
    use std::time::Instant;
    use std::{env, fs};

    use ble_unwrap_core::{Atlas, MeshInput, Progress, Settings, unwrap};
    use ble_unwrap_fixtures::{PolyMesh, sculpt_like};
    use pprof::flamegraph::Options;
    use pprof::{Frames, ProfilerGuardBuilder, Report, Symbol};
    use rayon::ThreadPoolBuilder;

    use super::obj;

    /// Quads of the generated mesh: 64,000 triangles.
    const QUADS: usize = 32_000;
    /// Samples a second of processor time; not a divisor of anything periodic.
    const FREQUENCY: i32 = 997;
    /// Unwraps are repeated until this much was sampled, so that small meshes give a graph, too,
    const LEAST_SECONDS: f64 = 2.0;
    /// but not more often than this.
    const MOST_RUNS: usize = 200;
    /// Rows of the printed table.
    const ROWS: usize = 15;
    /// Frames of these crates are how work is handed on, or loops and arithmetic: their time is their caller's.
    const PLUMBING: [&str; 7] = ["rayon", "rayon-core", "core", "alloc", "std", "panic_unwind", "flamegraph"];
    /// Assembly does not tell where it was called from. The products of small matrices in sparse factorisations are such.
    const NO_TABLES: &str = "assembly without unwinding tables (matrix kernels)";
    const OURS: &str = "ble_unwrap_core";

    pub(super) fn main() -> Result<(), Box<dyn Error>> {
        let arguments: Vec<String> = env::args().skip(1).collect();
        let (output, mesh) = match arguments.as_slice() {
            [output] => (output, None),
            [output, mesh] => (output, Some(mesh)),
            _ => return Err("usage: flamegraph OUT.svg [MESH.obj]".into()),
        };
        let (name, mesh) = match mesh {
            Some(path) => {
                let name = Path::new(path).file_name().unwrap_or_default().to_string_lossy().into_owned();
                let mesh = obj::Polygons::read(path.as_ref()).map_err(|error| format!("{path}: {error}"))?;
                (name, polygons(mesh)?)
            }
            None => ("generated sculpt".to_string(), sculpt_like(QUADS)),
        };
        let (report, runs, seconds, atlas) = profile(&mesh)?;
        let faces = atlas.report.faces;
        println!(
            "{name}: {faces} faces, {} charts, {:.2} s an unwrap on one thread",
            atlas.report.charts,
            seconds / runs as f64
        );
        let samples: isize = report.data.values().sum();
        if samples <= 0 {
            return Err("the timer gave no sample: this system does not let a process profile itself".into());
        }
        print_table(&report, samples);
        let mut options = Options::default();
        options.title = format!("unwrap of {name}, {faces} faces: {samples} samples in {seconds:.1} s");
        options.count_name = "samples".to_string();
        options.image_width = Some(1600);
        options.min_width = 0.05;
        if let Some(directory) = Path::new(output).parent() {
            fs::create_dir_all(directory)?;
        }
        let mut svg = Vec::new();
        report.flamegraph_with_options(&mut svg, &mut options)?;
        fs::write(output, svg)?;
        println!("written to {output}");
        Ok(())
    }

    /// The polygons of a file, which are checked by the library.
    fn polygons(mesh: obj::Polygons) -> Result<PolyMesh, Box<dyn Error>> {
        let corner = |vertex: &i32| u32::try_from(*vertex).map_err(|_| "a face names a vertex before the first");
        let corners = mesh.corner_vertices.iter().map(corner).collect::<Result<Vec<u32>, _>>()?;
        let mut faces = Vec::with_capacity(mesh.face_offsets.len());
        for face in mesh.face_offsets.windows(2) {
            faces.push(corners[usize::try_from(face[0])?..usize::try_from(face[1])?].to_vec());
        }
        Ok(PolyMesh { positions: mesh.positions, faces })
    }

    /// Samples of unwraps of a mesh, their number, their seconds, and the last one's result.
    fn profile(mesh: &PolyMesh) -> Result<(Report, usize, f64, Atlas), Box<dyn Error>> {
        let flat = mesh.flat();
        let input = MeshInput {
            positions: &mesh.positions,
            corner_vertices: &flat.corner_vertices,
            face_offsets: &flat.face_offsets,
            corner_triangles: None,
            ..MeshInput::default()
        };
        let one = ThreadPoolBuilder::new().num_threads(1).build()?;
        let run = || one.install(|| unwrap(&input, &Settings::default(), &Progress::new()));
        run()?; // what is done but once, such as reading tables into memory, is no part of it
        // Unwinding inside these libraries can deadlock or crash: what malloc and memmove take is not seen.
        let blocked = ["libc", "libgcc", "pthread", "vdso"];
        let guard = ProfilerGuardBuilder::default().frequency(FREQUENCY).blocklist(&blocked).build()?;
        let start = Instant::now();
        let mut runs = 1;
        let mut atlas = run()?;
        while start.elapsed().as_secs_f64() < LEAST_SECONDS && runs < MOST_RUNS {
            atlas = run()?;
            runs += 1;
        }
        let seconds = start.elapsed().as_secs_f64();
        let report = guard.report().frames_post_processor(by_place).build()?;
        Ok((report, runs, seconds, atlas))
    }

    /// Names each frame by where its source lies, `stage::file::function`, and drops those that say nothing. Frames that
    /// were inlined carry bare names of functions: `run` could be anybody's.
    fn by_place(frames: &mut Frames) {
        frames.thread_name = "unwrap".to_string();
        for inlined in &mut frames.frames {
            inlined.retain_mut(|symbol| {
                let name = symbol.name();
                let label = match symbol.filename.as_deref() {
                    Some(file) => label(file, &name),
                    // Assembly of the kernels of linear algebra, and of the system's libraries.
                    None => Some(without_generics(&name)).filter(|name| !name.is_empty()),
                };
                symbol.name = label.map(String::into_bytes);
                symbol.name.is_some()
            });
        }
        frames.frames.retain(|inlined| !inlined.is_empty());
        if frames.frames.is_empty() {
            let name = Some(NO_TABLES.as_bytes().to_vec());
            frames.frames.push(vec![Symbol { name, addr: None, lineno: None, filename: None }]);
        }
    }

    /// `None` for plumbing and for closures, whose time is that of the function around them.
    fn label(file: &Path, name: &str) -> Option<String> {
        let parts: Vec<String> =
            file.with_extension("").iter().map(|part| part.to_string_lossy().into_owned()).collect();
        let source = parts.iter().rposition(|part| part == "src")?;
        let directory = parts.get(source.checked_sub(1)?)?;
        // A directory of the registry carries a version: faer-0.24.4.
        let crate_name = match directory.rsplit_once('-') {
            Some((name, version)) if version.starts_with(|c: char| c.is_ascii_digit()) => name,
            _ => directory,
        };
        let function = without_generics(name);
        let function = function.rsplit("::").find(|part| !part.is_empty())?;
        if PLUMBING.contains(&crate_name) || function.starts_with('{') {
            return None;
        }
        let mut path: Vec<&str> =
            parts[source + 1..].iter().map(String::as_str).filter(|part| *part != "mod").collect();
        if crate_name != OURS {
            path.insert(0, crate_name);
        }
        path.push(function);
        Some(path.join("::"))
    }

    fn without_generics(name: &str) -> String {
        let mut depth = 0;
        let mut kept = String::new();
        for c in name.replace("->", "").chars() {
            match c {
                '<' => depth += 1,
                '>' => depth -= 1,
                _ if depth == 0 => kept.push(c),
                _ => {}
            }
        }
        kept
    }

    /// The functions in which most samples were taken.
    fn print_table(report: &Report, samples: isize) {
        let mut own: BTreeMap<String, isize> = BTreeMap::new();
        for (frames, count) in &report.data {
            let innermost = frames.frames.iter().flatten().next().map(|symbol| symbol.name());
            *own.entry(innermost.unwrap_or_else(|| "elsewhere".to_string())).or_default() += count;
        }
        let mut rows: Vec<_> = own.into_iter().collect();
        rows.sort_by(|a, b| b.1.cmp(&a.1).then_with(|| a.0.cmp(&b.0)));
        println!("share of the samples by function, without what it calls:");
        for (name, count) in rows.iter().take(ROWS) {
            println!("  {:5.1} %  {name}", 100.0 * *count as f64 / samples as f64);
        }
    }

    #[cfg(test)]
    mod tests {
        use super::*;

        #[test]
        fn frames_are_named_by_their_source() {
            let cases = [
                ("native/ble_unwrap_core/src/stretch/newton.rs", "minimise", Some("stretch::newton::minimise")),
                ("/x/ble_unwrap_core/src/packing/mod.rs", "ble_unwrap_core::packing::pack", Some("packing::pack")),
                (
                    "src/faer-0.24.4/src/sparse/linalg/cholesky.rs",
                    "solve<u32, f64>",
                    Some("faer::sparse::linalg::cholesky::solve"),
                ),
                ("/x/private-gemm-x86-0.1.20/src/lib.rs", "<A as B<C>>::gemm", Some("private-gemm-x86::lib::gemm")),
                ("native/ble_unwrap_core/src/lib.rs", "f<fn(u8) -> u8>", Some("lib::f")),
                ("native/ble_unwrap_core/src/cutting/search.rs", "{closure#4}<u8>", None),
                ("/x/rayon-core-1.13.0/src/join/mod.rs", "join_context", None),
                ("/rustc/1234/library/core/src/ops/function.rs", "call_mut", None),
                ("no/such/place.rs", "f", None),
                ("src/main.rs", "main", None),
            ];
            for (file, name, expected) in cases {
                assert_eq!(label(Path::new(file), name).as_deref(), expected, "{file} {name}");
            }
        }

        #[test]
        fn faces_before_the_first_vertex_are_refused() {
            let triangle = |corner_vertices| {
                let (positions, face_offsets) = (vec![[0.0; 3]; 3], vec![0, 3]);
                polygons(obj::Polygons { positions, corner_vertices, face_offsets })
            };
            assert!(triangle(vec![0, 1, -1]).is_err());
            assert_eq!(triangle(vec![0, 1, 2]).expect("a triangle").faces, [[0, 1, 2]]);
        }
    }
}
