//! BLE Unwrap: automatic UV unwrapping by Bernoulli logistic embedding.
//!
//! [`unwrap()`] takes a polygon mesh ([`MeshInput`]) and returns an [`Atlas`]: one UV for every polygon corner, with the
//! surface cut into few charts, each of which has bounded stretch, no flipped triangles and no overlap. [`unwrap_points()`]
//! does the same for point clouds, as far as that can be told without triangles.
//!
//! | module | for |
//! |---|---|
//! | this module | unwrapping meshes and point clouds; a [`Progress`] watches and cancels it |
//! | [`settings`] | every parameter, its range, and how a host can present it |
//! | [`standalone`] | single steps: computing distances, flattening a patch, measuring or certifying a layout, relaxing islands, packing charts |
//! | [`embedding`] | the paper's method for points of any kind |
//! | [`memory`] | hosts with an allocator of their own |
//!
//! All functions take and return plain arrays, and check what they are given. Vertices, corners and faces are numbered from
//! 0, as in the input. The work is done on the caller's `rayon` thread pool, and the result is the same, bit for bit, for
//! any number of threads.
//!
//! # Unwrapping a mesh
//!
//! ```
//! use ble_unwrap_core::{MeshInput, Progress, Settings, unwrap};
//!
//! // A cube: eight vertices, and six quads by their corners.
//! let positions = [
//!     [0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0],
//!     [0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 1.0, 1.0], [0.0, 1.0, 1.0],
//! ];
//! let corner_vertices = [0, 3, 2, 1, 4, 5, 6, 7, 0, 1, 5, 4, 1, 2, 6, 5, 2, 3, 7, 6, 3, 0, 4, 7];
//! let mesh = MeshInput {
//!     positions: &positions,
//!     corner_vertices: &corner_vertices,
//!     face_offsets: &[0, 4, 8, 12, 16, 20, 24],
//!     ..MeshInput::default()
//! };
//! let settings = Settings { stretch_limit: 1.05, ..Settings::default() };
//! let atlas = unwrap(&mesh, &settings, &Progress::new())?;
//! assert_eq!((atlas.uv.len(), atlas.chart.len()), (24, 6)); // one UV per corner, one chart per face
//! assert!(atlas.report.l2_worst_chart < 1.05);
//! assert!(atlas.certificate.is_valid()); // true for every atlas
//! # Ok::<(), ble_unwrap_core::UnwrapError>(())
//! ```
//!
//! # What an error looks like
//!
//! Every error is an enumeration whose text names the offending element and, where there is one, the remedy. Its method
//! `kind` says whose fault the error is; a host can choose an exception of its own by it.
//!
//! ```
//! use ble_unwrap_core::{ErrorKind, MeshInput, Progress, Settings, unwrap};
//!
//! let mesh = MeshInput {
//!     positions: &[[0.0; 3]; 3],
//!     corner_vertices: &[0, 1, 7],
//!     face_offsets: &[0, 3],
//!     ..MeshInput::default()
//! };
//! let error = unwrap(&mesh, &Settings::default(), &Progress::new()).expect_err("there is no vertex 7");
//! assert_eq!(error.kind(), ErrorKind::Mesh);
//! assert_eq!(
//!     error.to_string(),
//!     "corner 2, of face 0, names vertex 7, but the vertices are numbered 0 to 3 (exclusive); correct or remove the face"
//! );
//! ```
//!
//! # Judging any layout
//!
//! [`measure_layout`](standalone::measure_layout) says how good a layout is, whoever made it.
//! [`certify`](standalone::certify) either proves that a layout keeps what an atlas promises, or names the rules that it
//! breaks.
//!
//! ```
//! use ble_unwrap_core::standalone::{certify, measure_layout};
//! use ble_unwrap_core::{MeshInput, Progress, Settings};
//!
//! // Two squares side by side, and a layout that puts one on top of the other.
//! let mesh = MeshInput {
//!     positions: &[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0], [2.0, 1.0, 0.0]],
//!     corner_vertices: &[0, 1, 4, 3, 1, 2, 5, 4],
//!     face_offsets: &[0, 4, 8],
//!     ..MeshInput::default()
//! };
//! let square = [[0.2, 0.2], [0.6, 0.2], [0.6, 0.6], [0.2, 0.6]];
//! let uv = [square, square].concat();
//! let settings = Settings::default();
//! let layout = measure_layout(&mesh, &uv, None, &[], &settings, &Progress::new())?;
//! assert!((layout.measures.l2 - 1.0).abs() < 1e-6 && layout.measures.overlaps > 0);
//! let certificate = certify(&mesh, &uv, &[0, 1], &[], &settings, &Progress::new())?;
//! assert!(!certificate.is_valid() && certificate.crossings_between.first.is_some());
//! # Ok::<(), ble_unwrap_core::standalone::LayoutError>(())
//! ```
//!
//! # Embedding as in the paper
//!
//! ```
//! use ble_unwrap_core::Progress;
//! use ble_unwrap_core::embedding::{EmbedInput, EmbedOptions, EmbeddingSettings, embed};
//!
//! // Distances of the 25 points of a square grid.
//! let place = |i: usize| [(i % 5) as f64, (i / 5) as f64];
//! let distance = |i: usize, j: usize| f64::hypot(place(i)[0] - place(j)[0], place(i)[1] - place(j)[1]);
//! let data: Vec<f64> = (0..25 * 25).map(|k| distance(k / 25, k % 25)).collect();
//! let input = EmbedInput::Distances { n: 25, data: &data };
//!
//! // The model as printed, from a random start. Each sweep of its serial updates raises the likelihood.
//! let printed = embed(input, &EmbedOptions::default(), &EmbeddingSettings::paper(), &Progress::new())?;
//! assert_eq!(printed.coordinates.len(), 2 * 25);
//! assert!(printed.trace.windows(2).all(|pair| pair[1] >= pair[0]));
//!
//! // The default model, which has intercepts, reproduces the distances in a flat figure, in units of √sigma.
//! let found = embed(input, &EmbedOptions::default(), &EmbeddingSettings::default(), &Progress::new())?;
//! let x = |i: usize| &found.coordinates[2 * i..2 * i + 2];
//! let between = f64::hypot(x(0)[0] - x(24)[0], x(0)[1] - x(24)[1]) * found.sigma.sqrt();
//! assert!((between - distance(0, 24)).abs() < 1e-3);
//! # Ok::<(), ble_unwrap_core::embedding::EmbeddingError>(())
//! ```
//!
//! # What may change
//!
//! Errors, results, reports and enumerations may grow in any release, and are therefore `non_exhaustive`. The exceptions
//! are [`ErrorKind`] and the rows and kinds of the table of [`settings`], because a host has to know all of them.
//! Structures of parameters may grow, too. Where such a structure has a default, build it by `..Default::default()`, as
//! above, rather than from all its fields.
//!
//! # The paper
//!
//! "The paper" is *Bernoulli Embedding Model and Its Application in Texture Mapping*, revised 2006. Where a function
//! follows it, the documentation of the function names the section and the number of the equation.
#![forbid(unsafe_code)]
#![warn(unnameable_types)]

mod atlas;
mod cache;
mod charts;
mod choice;
mod clock;
mod cloud;
mod collections;
mod cutting;
mod distortion;
pub mod embedding;
mod error;
mod error_kind;
mod flattening;
mod geodesics;
#[doc(hidden)]
pub mod internals;
mod layout;
mod linalg;
pub mod memory;
mod mesh;
mod metrics;
mod packing;
mod predicates;
mod progress;
mod random;
mod report;
mod rounding;
mod rounds;
mod segmentation;
pub mod settings;
pub mod standalone;
mod stretch;
mod unwrap;
mod verify;
mod visibility;

pub use atlas::Atlas;
pub use cloud::{CloudError, CloudReport, PointAtlas, PointDefect, unwrap_points};
pub use error::UnwrapError;
pub use error_kind::ErrorKind;
pub use mesh::{MeshError, MeshInput};
pub use packing::PackError;
pub use progress::{Cancelled, Progress, Stage};
pub use report::Report;
pub use settings::Settings;
pub use unwrap::{Analysis, unwrap};
pub use verify::{Certificate, Defect};
