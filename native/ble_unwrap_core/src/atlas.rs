//! What unwrapping a mesh gives.

use crate::report::Report;

/// A UV for every corner of the input, and what is known about it.
#[derive(Clone, Debug)]
pub struct Atlas {
    /// One UV a corner, in [0, 1]²; (0, 0) for the corners of unmapped faces.
    pub uv: Vec<[f32; 2]>,
    /// Chart of each input face, from 0; −1 for unmapped faces.
    pub chart: Vec<i32>,
    /// Measures of the result.
    pub report: Report,
}
