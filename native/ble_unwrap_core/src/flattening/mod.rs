//! What takes one patch into the plane, step by step, and how it was got there.
//!
//! The [pipeline](crate::unwrap()) tries these steps under a limit, [`flatten`](crate::standalone::flatten()) shows them one by one.

mod rungs;
mod steps;

pub(crate) use rungs::{Rung, Rungs};
pub(crate) use steps::Steps;
