//! Python bindings of BLE Unwrap: converts, calls the core, converts back. Registration alone is here.

mod arrays;
mod errors;
mod job;
mod owned_array;

use pyo3::prelude::*;

#[pymodule]
mod ble_unwrap_native {
    use super::*;

    #[pymodule_export]
    use crate::job::Job;
    #[pymodule_export]
    use crate::owned_array::Array;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))?;
        errors::register(module)
    }
}
