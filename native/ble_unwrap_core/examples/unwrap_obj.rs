//! Unwraps a Wavefront OBJ file: `cargo run --release --example unwrap_obj -- in.obj out.obj [stretch_limit]`.
//!
//! Shows how the core is called from Rust; the Blender scripts do the same job for many formats.
#![expect(clippy::print_stdout, reason = "a command line program")]

use std::error::Error;
use std::fmt::Write as _;
use std::{env, fs};

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
    let (positions, faces) = obj::read(&fs::read_to_string(input)?)?;
    let corners: Vec<i32> = faces.iter().flatten().copied().collect();
    let mut offsets = vec![0];
    for face in &faces {
        offsets.push(offsets[offsets.len() - 1] + i32::try_from(face.len())?);
    }
    let mesh = MeshInput {
        positions: &positions,
        corner_vertices: &corners,
        face_offsets: &offsets,
        corner_triangles: None,
        ..MeshInput::default()
    };
    let atlas = unwrap(&mesh, &settings, &Progress::new())?;
    println!("{:#?}", atlas.report);
    let mut text = String::new();
    for p in &positions {
        writeln!(text, "v {} {} {}", p[0], p[1], p[2])?;
    }
    for uv in &atlas.uv {
        writeln!(text, "vt {} {}", uv[0], uv[1])?;
    }
    for (face, corner) in faces.iter().zip(&offsets) {
        text.push('f');
        for (k, v) in (1..).zip(face) {
            write!(text, " {}/{}", v + 1, corner + k)?;
        }
        text.push('\n');
    }
    fs::write(output, text)?;
    Ok(())
}
