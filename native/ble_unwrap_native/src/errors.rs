//! The exceptions of the module, and the one place where errors of the core become exceptions.

use ble_unwrap_core::Cancelled as CoreCancelled;
use pyo3::create_exception;
use pyo3::exceptions::PyException;
use pyo3::prelude::*;

create_exception!(ble_unwrap_native, BleUnwrapError, PyException, "Base of all exceptions of this module.");
create_exception!(
    ble_unwrap_native,
    InvalidMeshError,
    BleUnwrapError,
    "The arrays do not describe a mesh. The text names the first offending element."
);
create_exception!(
    ble_unwrap_native,
    InvalidArgumentError,
    BleUnwrapError,
    "An argument or a setting is not what it has to be. The text names it, what was expected and what was found."
);
create_exception!(
    ble_unwrap_native,
    Cancelled,
    BleUnwrapError,
    "The job was cancelled before it was finished. Nothing was produced."
);
create_exception!(
    ble_unwrap_native,
    InternalError,
    BleUnwrapError,
    "A defect of this library or a want of the machine, not of the input. Please report it."
);

/// Why a computation brought no result, as the worker leaves it.
#[derive(Debug)]
pub(crate) enum Failure {
    /// Asked to stop.
    Cancelled(CoreCancelled),
    /// The core panicked; the text of the panic.
    Panic(String),
    /// No thread to work on; the text of the system.
    Threads(String),
    /// The result could not become a Python object; the text of Python's error.
    Delivery(String),
}

impl From<CoreCancelled> for Failure {
    fn from(cancelled: CoreCancelled) -> Self {
        Self::Cancelled(cancelled)
    }
}

impl Failure {
    /// The exception to raise; its text is the core's own.
    pub(crate) fn to_py_err(&self) -> PyErr {
        match self {
            Self::Cancelled(error) => Cancelled::new_err(error.to_string()),
            Self::Panic(text) => InternalError::new_err(format!("unexpected panic: {text}")),
            Self::Threads(text) => InternalError::new_err(format!("cannot start threads: {text}")),
            Self::Delivery(text) => InternalError::new_err(format!("cannot make the result: {text}")),
        }
    }
}

/// Adds the exceptions to the module.
pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = module.py();
    module.add("BleUnwrapError", py.get_type::<BleUnwrapError>())?;
    module.add("InvalidMeshError", py.get_type::<InvalidMeshError>())?;
    module.add("InvalidArgumentError", py.get_type::<InvalidArgumentError>())?;
    module.add("Cancelled", py.get_type::<Cancelled>())?;
    module.add("InternalError", py.get_type::<InternalError>())
}
