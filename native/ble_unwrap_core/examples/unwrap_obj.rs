//! Unwraps a Wavefront OBJ file: `cargo run --release --example unwrap_obj -- in.obj out.obj [stretch_limit]`.
//!
//! Shows how the core is called from Rust; the Blender scripts do the same job for many formats.
#![expect(clippy::print_stdout, reason = "a command line program")]

use std::env;
use std::error::Error;
use std::fs::File;
use std::io::{BufWriter, Write};

use ble_unwrap_core::{MeshInput, Progress, Settings, unwrap};

mod obj;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let [input, output, rest @ ..] = arguments.as_slice() else {
        return Err("usage: unwrap_obj IN.obj OUT.obj [STRETCH_LIMIT]".into());
    };
    let mut settings = Settings::default();
    if let Some(limit) = rest.first() {
        settings.stretch_limit = limit.parse()?;
    }
    let mesh = obj::Polygons::read(input.as_ref())?;
    let input = MeshInput {
        positions: &mesh.positions,
        corner_vertices: &mesh.corner_vertices,
        face_offsets: &mesh.face_offsets,
        ..MeshInput::default()
    };
    let atlas = unwrap(&input, &settings, &Progress::new())?;
    println!("{:#?}", atlas.report);
    let mut file = BufWriter::new(File::create(output)?);
    for p in &mesh.positions {
        writeln!(file, "v {} {} {}", p[0], p[1], p[2])?;
    }
    for uv in &atlas.uv {
        writeln!(file, "vt {} {}", uv[0], uv[1])?;
    }
    for face in mesh.face_offsets.windows(2) {
        write!(file, "f")?;
        for corner in face[0]..face[1] {
            write!(file, " {}/{}", mesh.corner_vertices[usize::try_from(corner)?] + 1, corner + 1)?;
        }
        writeln!(file)?;
    }
    file.flush()?;
    Ok(())
}
