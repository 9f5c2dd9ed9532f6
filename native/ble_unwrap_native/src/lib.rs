//! Python bindings of BLE Unwrap: converts, calls the core, converts back. Registration alone is here.

mod allocator;
mod analysis;
mod arrays;
mod cloud;
mod distances;
mod embed;
mod errors;
mod flatten;
mod job;
mod measure;
mod owned_array;
mod pack;
mod place;
mod relax;
mod report;
mod settings;
mod unwrap;

/// Automatic UV unwrapping under a stretch bound, by Bernoulli logistic embedding.
///
/// The Python package around it re-exports everything; nobody imports this module by its name.
#[pyo3::pymodule(name = "_native")]
mod native {
    use pyo3::prelude::*;

    #[pymodule_export]
    use crate::analysis::{Analysis, analyse};
    #[pymodule_export]
    use crate::cloud::{PointAtlas, submit_unwrap_points, unwrap_points};
    #[pymodule_export]
    use crate::distances::{geodesic_distances, graph_distances};
    #[pymodule_export]
    use crate::embed::{Embedding, embed};
    #[pymodule_export]
    use crate::flatten::{Flattening, flatten};
    #[pymodule_export]
    use crate::job::Job;
    #[pymodule_export]
    use crate::measure::measure;
    #[pymodule_export]
    use crate::owned_array::Array;
    #[pymodule_export]
    use crate::pack::{PackedCharts, pack};
    #[pymodule_export]
    use crate::place::place;
    #[pymodule_export]
    use crate::relax::{RelaxedMap, relax};
    #[pymodule_export]
    use crate::settings::default_settings;
    #[pymodule_export]
    use crate::unwrap::{Atlas, submit_unwrap, unwrap};

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))?;
        crate::errors::register(module)
    }
}
