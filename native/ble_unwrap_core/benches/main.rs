//! Benchmarks, one file a stage. Names read `stage/mesh/size`; see README.md for the command and the figures.

use criterion::{criterion_group, criterion_main};

mod embedding;
mod surfaces;

criterion_group!(benches, embedding::benches);
criterion_main!(benches);
