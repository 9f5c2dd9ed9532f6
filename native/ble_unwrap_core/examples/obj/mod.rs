//! The polygons of Wavefront OBJ files, for the examples.

use std::error::Error;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

/// Positions and faces in flat arrays, as the library takes them.
pub(crate) struct Polygons {
    pub(crate) positions: Vec<[f64; 3]>,
    pub(crate) corner_vertices: Vec<i32>,
    pub(crate) face_offsets: Vec<i32>,
}

impl Polygons {
    /// Reads vertices and faces; everything else in the file is left out.
    pub(crate) fn read(path: &Path) -> Result<Self, Box<dyn Error>> {
        let mut mesh = Self { positions: Vec::new(), corner_vertices: Vec::new(), face_offsets: vec![0] };
        for line in BufReader::new(File::open(path)?).lines() {
            let line = line?;
            let mut words = line.split_whitespace();
            match words.next() {
                Some("v") => {
                    let xyz = words.take(3).map(str::parse).collect::<Result<Vec<f64>, _>>()?;
                    mesh.positions.push(xyz.try_into().map_err(|_| "a vertex needs three coordinates")?);
                }
                Some("f") => {
                    let count = i32::try_from(mesh.positions.len())?;
                    for word in words {
                        let index: i32 = word.split('/').next().unwrap_or(word).parse()?;
                        mesh.corner_vertices.push(if index < 0 { count + index } else { index - 1 });
                    }
                    mesh.face_offsets.push(i32::try_from(mesh.corner_vertices.len())?);
                }
                _ => {}
            }
        }
        Ok(mesh)
    }
}
