//! Arrays out: memory of Rust that Python sees through the buffer protocol.

use std::ffi::{CStr, c_int};

use pyo3::exceptions::PyBufferError;
use pyo3::ffi;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyTuple, PyType};

use crate::errors::InvalidArgumentError;

/// What `__reduce__` gives to `pickle` and `copy`: the class and what it is made of.
pub(crate) type Reduced<'py, Parts> = (Bound<'py, PyType>, Parts);

/// Bytes, format and shape of an array.
type ArrayParts<'py> = (Bound<'py, PyBytes>, String, Bound<'py, PyTuple>);

/// A read-only array of numbers that a computation returned.
///
/// ``numpy.asarray(array)`` and ``memoryview(array)`` see the memory itself, without a copy, and keep
/// the array alive for as long as they live. The memory is row-major and never changes; copy it
/// (``numpy.array(array)``) to write. Blender's ``foreach_set`` takes the array as it is.
///
/// Attributes
/// ----------
/// shape : tuple of int
///     Length along each of the one or two dimensions.
/// format : str
///     Element type as in the ``struct`` module: ``"f"`` float32, ``"d"`` float64, ``"i"`` int32.
#[pyclass(frozen, module = "ble_unwrap_native")]
pub(crate) struct Array {
    elements: Elements,
    /// Lengths and, in bytes, distances along the dimensions. Views point into this object.
    shape: Vec<ffi::Py_ssize_t>,
    strides: Vec<ffi::Py_ssize_t>,
}

/// The numbers, row by row.
enum Elements {
    F32(Vec<f32>),
    F64(Vec<f64>),
    I32(Vec<i32>),
}

impl Elements {
    fn format(&self) -> &'static CStr {
        match self {
            Self::F32(_) => c"f",
            Self::F64(_) => c"d",
            Self::I32(_) => c"i",
        }
    }

    fn item_size(&self) -> usize {
        match self {
            Self::F32(_) => size_of::<f32>(),
            Self::F64(_) => size_of::<f64>(),
            Self::I32(_) => size_of::<i32>(),
        }
    }

    fn len(&self) -> usize {
        match self {
            Self::F32(v) => v.len(),
            Self::F64(v) => v.len(),
            Self::I32(v) => v.len(),
        }
    }

    fn as_ptr(&self) -> *const u8 {
        match self {
            Self::F32(v) => v.as_ptr().cast(),
            Self::F64(v) => v.as_ptr().cast(),
            Self::I32(v) => v.as_ptr().cast(),
        }
    }
}

/// Elements of `N` bytes each; what is left at the end is no element.
fn read<T, const N: usize>(bytes: &[u8], element: impl Fn([u8; N]) -> T) -> Vec<T> {
    bytes.as_chunks().0.iter().map(|chunk| element(*chunk)).collect()
}

impl Array {
    fn new(elements: Elements, shape: &[usize]) -> Self {
        assert_eq!(shape.iter().product::<usize>(), elements.len(), "the shape has as many elements as the data");
        let mut strides = vec![0; shape.len()];
        let mut stride = elements.item_size();
        for (s, &length) in strides.iter_mut().zip(shape).rev() {
            *s = stride as ffi::Py_ssize_t;
            stride *= length;
        }
        Self { elements, shape: shape.iter().map(|&n| n as ffi::Py_ssize_t).collect(), strides }
    }

    /// Takes float32 rows without copying: shape (n, `N`).
    pub(crate) fn from_f32_rows<const N: usize>(rows: Vec<[f32; N]>) -> Self {
        let shape = [rows.len(), N];
        Self::new(Elements::F32(rows.into_flattened()), &shape)
    }

    /// Takes a row-major float32 matrix.
    pub(crate) fn from_f32_matrix(values: Vec<f32>, shape: [usize; 2]) -> Self {
        Self::new(Elements::F32(values), &shape)
    }

    /// Takes a row-major float64 matrix.
    pub(crate) fn from_f64_matrix(values: Vec<f64>, shape: [usize; 2]) -> Self {
        Self::new(Elements::F64(values), &shape)
    }

    /// Takes float64 values: shape (n,).
    pub(crate) fn from_f64(values: Vec<f64>) -> Self {
        let shape = [values.len()];
        Self::new(Elements::F64(values), &shape)
    }

    /// Takes int32 values: shape (n,).
    pub(crate) fn from_i32(values: Vec<i32>) -> Self {
        let shape = [values.len()];
        Self::new(Elements::I32(values), &shape)
    }
}

#[pymethods]
impl Array {
    /// An array of these bytes: its elements row by row, the lowest byte first.
    #[new]
    #[pyo3(signature = (data, format, shape, /))]
    fn from_bytes(data: &Bound<'_, PyBytes>, format: &str, shape: Vec<usize>) -> PyResult<Self> {
        let bytes = data.as_bytes();
        let elements = match format {
            "f" => Elements::F32(read(bytes, f32::from_le_bytes)),
            "d" => Elements::F64(read(bytes, f64::from_le_bytes)),
            "i" => Elements::I32(read(bytes, i32::from_le_bytes)),
            _ => {
                return Err(InvalidArgumentError::new_err(format!(
                    "format: expected 'f', 'd' or 'i'; found {format:?}"
                )));
            }
        };
        let bytes_of = |least: usize| {
            let product = shape.iter().try_fold(elements.item_size(), |bytes, &n| bytes.checked_mul(n.max(least)));
            product.filter(|&bytes| isize::try_from(bytes).is_ok())
        };
        // Distances along the dimensions are counted where there are no elements, too.
        let fits = bytes_of(1).is_some();
        if !(1..=2).contains(&shape.len()) || !fits || bytes_of(0) != Some(bytes.len()) {
            return Err(InvalidArgumentError::new_err(format!(
                "shape: expected one or two lengths of {} elements together; found {shape:?}",
                elements.len()
            )));
        }
        Ok(Self::new(elements, &shape))
    }

    /// For `pickle` and `copy`.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Reduced<'py, ArrayParts<'py>>> {
        let (py, array) = (slf.py(), slf.get());
        let bytes: Vec<u8> = match &array.elements {
            Elements::F32(v) => v.iter().flat_map(|x| x.to_le_bytes()).collect(),
            Elements::F64(v) => v.iter().flat_map(|x| x.to_le_bytes()).collect(),
            Elements::I32(v) => v.iter().flat_map(|x| x.to_le_bytes()).collect(),
        };
        Ok((slf.get_type(), (PyBytes::new(py, &bytes), array.format(), array.shape(py)?)))
    }

    #[getter]
    fn shape<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, &self.shape)
    }

    #[getter]
    fn format(&self) -> String {
        self.elements.format().to_string_lossy().into_owned()
    }

    fn __len__(&self) -> usize {
        self.shape.first().map_or(0, |&n| n.unsigned_abs())
    }

    fn __repr__(&self) -> String {
        let shape: Vec<String> = self.shape.iter().map(ToString::to_string).collect();
        let comma = if shape.len() == 1 { "," } else { "" };
        format!("Array(format={:?}, shape=({}{comma}))", self.format(), shape.join(", "))
    }

    /// Fills in a view for a consumer: read-only, C-contiguous.
    ///
    /// # Safety
    /// `view` must be null or point to a `Py_buffer` to be written, as the buffer protocol has it.
    unsafe fn __getbuffer__(slf: Bound<'_, Self>, view: *mut ffi::Py_buffer, flags: c_int) -> PyResult<()> {
        if view.is_null() {
            return Err(PyBufferError::new_err("the view is null"));
        }
        let array = slf.get();
        let asks = |flag: c_int| flags & flag == flag;
        // SAFETY: the consumer hands a `Py_buffer` to be filled in; a null owner says that we refused.
        unsafe { (*view).obj = std::ptr::null_mut() };
        if asks(ffi::PyBUF_WRITABLE) {
            return Err(PyBufferError::new_err("the array is read-only; copy it to write"));
        }
        let flat = array.shape.len() == 1 || array.shape.contains(&1) || array.elements.len() == 0;
        if asks(ffi::PyBUF_F_CONTIGUOUS) && !asks(ffi::PyBUF_ANY_CONTIGUOUS) && !flat {
            return Err(PyBufferError::new_err("the array is row-major, not column-major"));
        }
        // SAFETY: as above. Every pointer leads to memory owned by `slf`, which is frozen, so it
        // neither moves nor changes, and which the view keeps alive through `obj`.
        unsafe {
            (*view).buf = array.elements.as_ptr().cast_mut().cast();
            (*view).len = (array.elements.len() * array.elements.item_size()) as ffi::Py_ssize_t;
            (*view).itemsize = array.elements.item_size() as ffi::Py_ssize_t;
            (*view).readonly = 1;
            (*view).format = if asks(ffi::PyBUF_FORMAT) {
                array.elements.format().as_ptr().cast_mut()
            } else {
                std::ptr::null_mut()
            };
            (*view).ndim = if asks(ffi::PyBUF_ND) { array.shape.len() as c_int } else { 1 };
            (*view).shape = if asks(ffi::PyBUF_ND) { array.shape.as_ptr().cast_mut() } else { std::ptr::null_mut() };
            (*view).strides =
                if asks(ffi::PyBUF_STRIDES) { array.strides.as_ptr().cast_mut() } else { std::ptr::null_mut() };
            (*view).suboffsets = std::ptr::null_mut();
            (*view).internal = std::ptr::null_mut();
            (*view).obj = slf.into_any().into_ptr();
        }
        Ok(())
    }
}
