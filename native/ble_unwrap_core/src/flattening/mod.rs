//! What takes one patch into the plane, and how it was got there.
//!
//! `steps` holds the steps, each by itself: [`flatten`](crate::standalone::flatten()) shows them one by one. `flat` is what
//! comes of them and whether it keeps a limit. `ladder` tries them under a limit, each where the one before does not do, and `polygon` is its last rung, for single polygons. `strip` is for thin rings.

mod flat;
mod ladder;
mod polygon;
mod rungs;
mod steps;
mod strip;

pub(crate) use flat::{NEGLIGIBLE, Positions, l2};
pub(crate) use ladder::{
    Flattened, Polished, flatten, flatten_apart, isometric, lying, opened, part_of_chart, polish, projected, sewn,
};
pub(crate) use polygon::{flatten_polygon, thicken};
pub(crate) use rungs::{Rung, Rungs};
pub(crate) use steps::Steps;
pub(crate) use strip::strip;
