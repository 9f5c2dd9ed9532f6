//! Charts: connected, oriented parts of the surface of genus 0 with a boundary.

mod cut_to_disk;

pub use cut_to_disk::{cut_open, cut_to_disk, shortest_path_to_boundary};
