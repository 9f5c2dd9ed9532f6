//! Benchmarks: the stages of an unwrap and the whole, and the embedding by itself. Names read `stage/mesh/size`; see README.md for the command and the figures.

use criterion::{criterion_group, criterion_main};

mod embedding;
mod stages;
mod surfaces;

criterion_group!(benches, stages::benches, embedding::benches);
criterion_main!(benches);
