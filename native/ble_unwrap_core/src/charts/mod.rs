//! Pieces of the surface on their way to becoming charts.
//!
//! *Terms.* A **patch** is a connected set of whole polygons with its own mesh. A **chart** is a
//! patch of genus 0 with a boundary, and its map to the plane.

mod cut_to_disk;
mod patch;
mod straight_cut;

pub(crate) use cut_to_disk::{cut_open, cut_to_disk, shortest_path_to_boundary};
pub(crate) use patch::{Chart, Patch};
pub(crate) use straight_cut::straight_cut;
