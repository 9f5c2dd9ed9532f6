//! The exceptions of the module, and the one place where errors of the core become exceptions.

use std::fmt::Display;

use ble_unwrap_core::embedding::EmbeddingError;
use ble_unwrap_core::standalone::{
    CloudDistancesError, DistancesError, FlattenError, LayoutError, RelaxError, RepackError,
};
use ble_unwrap_core::{self as core, Certificate, CloudError, ErrorKind, UnwrapError};
use pyo3::create_exception;
use pyo3::exceptions::{PyException, PyMemoryError};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyDict, PyType};

use crate::report;

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
    UnprovenError,
    BleUnwrapError,
    "The layout could not be proven to hold what is promised. Its `certificate`, a dict, says what it breaks. Nothing was \
     produced."
);
create_exception!(
    ble_unwrap_native,
    InternalError,
    BleUnwrapError,
    "A defect of this library or a want of the machine, not of the input. Please report it."
);

/// `OutOfMemoryError`, of this module's exceptions and Python's `MemoryError`, too: PyO3's macro takes one base only.
fn out_of_memory_error(py: Python<'_>) -> PyResult<&Bound<'_, PyType>> {
    static TYPE: PyOnceLock<Py<PyType>> = PyOnceLock::new();
    let make = || {
        let bases = (py.get_type::<BleUnwrapError>(), py.get_type::<PyMemoryError>());
        let body = PyDict::new(py);
        body.set_item("__module__", "ble_unwrap_native")?;
        body.set_item(
            "__doc__",
            "There is not enough memory, found before the work began or while it went on. The text tells how much was \
             asked for. Nothing was produced.",
        )?;
        Ok(py.get_type::<PyType>().call1(("OutOfMemoryError", bases, body))?.cast_into::<PyType>()?.unbind())
    };
    TYPE.get_or_try_init(py, make).map(|kind| kind.bind(py))
}

/// Why a computation brought no result, as the worker leaves it: the exception to raise, and its text, which
/// is the core's own.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Failure {
    kind: Kind,
    text: String,
}

#[derive(Clone, Debug, PartialEq)]
enum Kind {
    Mesh,
    Argument,
    Cancelled,
    Memory,
    Unproven(Box<Certificate>),
    Internal,
}

impl Failure {
    /// The computation saw that it was to stop.
    pub(crate) fn cancelled() -> Self {
        core::Cancelled::OnRequest.into()
    }

    /// The core panicked.
    pub(crate) fn panic(text: &str) -> Self {
        Self { kind: Kind::Internal, text: format!("unexpected panic: {text}") }
    }

    /// The system gave no thread to work on: for want of memory for its stack, or of a limit on processes.
    pub(crate) fn threads(error: &dyn std::error::Error) -> Self {
        let text = format!("out of memory: cannot start threads ({error}); close something else, or raise the limits");
        Self { kind: Kind::Memory, text }
    }

    /// The result could not become a Python object.
    pub(crate) fn delivery(error: &PyErr) -> Self {
        Self { kind: Kind::Internal, text: format!("cannot make the result: {error}") }
    }

    /// The exception to raise.
    pub(crate) fn to_py_err(&self) -> PyErr {
        let text = self.text.clone();
        match &self.kind {
            Kind::Mesh => InvalidMeshError::new_err(text),
            Kind::Argument => InvalidArgumentError::new_err(text),
            Kind::Cancelled => Cancelled::new_err(text),
            Kind::Memory => Python::attach(|py| match out_of_memory_error(py) {
                Ok(kind) => PyErr::from_type(kind.clone(), text),
                Err(error) => error,
            }),
            Kind::Unproven(certificate) => Python::attach(|py| {
                let error = UnprovenError::new_err(text);
                let given = report::certificate_to_dict(py, certificate)
                    .and_then(|facts| error.value(py).setattr("certificate", facts));
                given.err().unwrap_or(error)
            }),
            Kind::Internal => InternalError::new_err(text),
        }
    }
}

impl Failure {
    fn of(kind: ErrorKind, error: &dyn Display) -> Self {
        let kind = match kind {
            ErrorKind::Mesh => Kind::Mesh,
            ErrorKind::Argument => Kind::Argument,
            ErrorKind::Cancelled => Kind::Cancelled,
            ErrorKind::OutOfMemory => Kind::Memory,
            // One that cannot prove its result, but has no certificate to show, does not keep its word.
            ErrorKind::Unproven | ErrorKind::Internal => Kind::Internal,
        };
        Self { kind, text: error.to_string() }
    }
}

impl From<UnwrapError> for Failure {
    fn from(error: UnwrapError) -> Self {
        let failure = Self::of(error.kind(), &error);
        match error {
            UnwrapError::Unproven(certificate) => Self { kind: Kind::Unproven(certificate), ..failure },
            _ => failure,
        }
    }
}

/// Errors that say all there is to know by their kind and their text.
macro_rules! raised {
    ($($error:ty),+) => {
        $(impl From<$error> for Failure {
            fn from(error: $error) -> Self {
                Self::of(error.kind(), &error)
            }
        })+
    };
}

raised!(
    core::Cancelled,
    CloudError,
    CloudDistancesError,
    DistancesError,
    EmbeddingError,
    FlattenError,
    LayoutError,
    RelaxError,
    RepackError
);

/// Adds the exceptions to the module.
pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = module.py();
    module.add("BleUnwrapError", py.get_type::<BleUnwrapError>())?;
    module.add("InvalidMeshError", py.get_type::<InvalidMeshError>())?;
    module.add("InvalidArgumentError", py.get_type::<InvalidArgumentError>())?;
    module.add("Cancelled", py.get_type::<Cancelled>())?;
    module.add("OutOfMemoryError", out_of_memory_error(py)?)?;
    module.add("UnprovenError", py.get_type::<UnprovenError>())?;
    module.add("InternalError", py.get_type::<InternalError>())
}
