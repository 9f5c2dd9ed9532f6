//! What takes one patch into the plane, and how it was got there.
//!
//! `steps` holds the steps, each by itself: [`flatten`](crate::standalone::flatten()) shows them one by one. `ladder` tries them
//! under a limit, each where the one before does not do, and `polygon` is its last rung, for single polygons. `strip` is for thin rings.

mod ladder;
mod polygon;
mod rungs;
mod steps;
mod strip;

pub(crate) use ladder::{
    Flattened, Polished, Positions, flatten, flatten_apart, isometric, l2, lying, opened, part_of_chart, polish,
    projected, sewn,
};
pub(crate) use polygon::{flatten_polygon, thicken};
pub(crate) use rungs::{Rung, Rungs};
pub(crate) use steps::Steps;
pub(crate) use strip::strip;
