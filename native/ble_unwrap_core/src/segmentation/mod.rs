//! Where a surface is cut into charts.

mod min_cut;

pub use min_cut::CutGraph;
