//! The polygons of Wavefront OBJ files, for the examples.

use std::error::Error;

/// Positions, and the vertices of each face.
pub(crate) type Polygons = (Vec<[f64; 3]>, Vec<Vec<i32>>);

/// Reads vertices and faces; everything else in the file is left out.
pub(crate) fn read(text: &str) -> Result<Polygons, Box<dyn Error>> {
    let (mut positions, mut faces) = (Vec::new(), Vec::new());
    for line in text.lines() {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => {
                let xyz = words.take(3).map(str::parse).collect::<Result<Vec<f64>, _>>()?;
                positions.push(xyz.try_into().map_err(|_| "a vertex needs three coordinates")?);
            }
            Some("f") => {
                let count = i32::try_from(positions.len())?;
                let vertex = |word: &str| -> Result<i32, Box<dyn Error>> {
                    let index: i32 = word.split('/').next().unwrap_or(word).parse()?;
                    Ok(if index < 0 { count + index } else { index - 1 })
                };
                faces.push(words.map(vertex).collect::<Result<Vec<i32>, _>>()?);
            }
            _ => {}
        }
    }
    Ok((positions, faces))
}
