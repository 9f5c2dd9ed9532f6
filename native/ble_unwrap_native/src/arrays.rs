//! Arrays in: one check of dtype, byte order and shape, one copy into Rust.
//!
//! Any object with the buffer protocol will do (numpy array, `memoryview`, `array.array`, ctypes
//! array), contiguous or not, aligned or not. The copy is made while the interpreter is held:
//! afterwards Python may write to its buffer, and the computation does not notice.

use ble_unwrap_core::memory;
use pyo3::buffer::{ElementType, PyUntypedBuffer};
use pyo3::prelude::*;
use pyo3::types::PyMemoryView;

use crate::errors::InvalidArgumentError;

/// What a function expects of one argument; the words of its error messages.
#[derive(Clone, Copy)]
pub(crate) struct Argument {
    /// The keyword by which Python knows it.
    pub(crate) name: &'static str,
    /// Shape in the notation of the documentation, such as `(n, 3)`.
    pub(crate) shape: &'static str,
}

const REALS: &str = "a float32 or float64";
const INDICES: &str = "an int32 or int64";
const FLAGS: &str = "a bool";

/// Rows of `N` real numbers, from float32 or float64 of shape (n, `N`).
pub(crate) fn real_rows<const N: usize>(object: &Bound<'_, PyAny>, argument: Argument) -> PyResult<Vec<[f64; N]>> {
    let view = View::new(object, argument, REALS)?;
    view.expect_columns(N)?;
    collect_rows(&view, |at| view.real(at))
}

/// Rows of `N` real numbers rounded to float32, from float32 or float64 of shape (n, `N`).
pub(crate) fn single_rows<const N: usize>(object: &Bound<'_, PyAny>, argument: Argument) -> PyResult<Vec<[f32; N]>> {
    let view = View::new(object, argument, REALS)?;
    view.expect_columns(N)?;
    collect_rows(&view, |at| view.real(at).map(|x| x as f32))
}

/// A row-major matrix of real numbers with its row and column counts, from float32 or float64 of shape (n, m).
pub(crate) fn real_matrix(object: &Bound<'_, PyAny>, argument: Argument) -> PyResult<(Vec<f64>, usize, usize)> {
    let view = View::new(object, argument, REALS)?;
    if view.shape.len() != 2 {
        return Err(view.refusal());
    }
    let (rows, columns) = (view.rows(), view.shape[1]);
    let mut values = view.reserve(rows.saturating_mul(columns))?;
    for i in 0..rows {
        for j in 0..columns {
            values.push(view.real([i, j])?);
        }
    }
    Ok((values, rows, columns))
}

/// Real numbers, from float32 or float64 of shape (n,).
pub(crate) fn reals(object: &Bound<'_, PyAny>, argument: Argument) -> PyResult<Vec<f64>> {
    let view = View::new(object, argument, REALS)?;
    if view.shape.len() != 1 {
        return Err(view.refusal());
    }
    let mut values = view.reserve(view.rows())?;
    for i in 0..view.rows() {
        values.push(view.real([i, 0])?);
    }
    Ok(values)
}

/// Real numbers rounded to float32, from float32 or float64 of shape (n,).
pub(crate) fn singles(object: &Bound<'_, PyAny>, argument: Argument) -> PyResult<Vec<f32>> {
    Ok(reals(object, argument)?.into_iter().map(|x| x as f32).collect())
}

/// Indices, from int32 or int64 of shape (n,); an int64 must fit 32 bits.
pub(crate) fn indices(object: &Bound<'_, PyAny>, argument: Argument) -> PyResult<Vec<i32>> {
    let view = View::new(object, argument, INDICES)?;
    if view.shape.len() != 1 {
        return Err(view.refusal());
    }
    let mut values = view.reserve(view.rows())?;
    for i in 0..view.rows() {
        values.push(view.index([i, 0])?);
    }
    Ok(values)
}

/// Yes or no, from bool of shape (n,).
pub(crate) fn flags(object: &Bound<'_, PyAny>, argument: Argument) -> PyResult<Vec<bool>> {
    let view = View::new(object, argument, FLAGS)?;
    if view.shape.len() != 1 {
        return Err(view.refusal());
    }
    let mut values = view.reserve(view.rows())?;
    for i in 0..view.rows() {
        // Any byte but 0 counts as true.
        values.push(view.read::<u8>([i, 0]) != 0);
    }
    Ok(values)
}

/// Rows of `N` indices, from int32 or int64 of shape (n, `N`); an int64 must fit 32 bits.
pub(crate) fn index_rows<const N: usize>(object: &Bound<'_, PyAny>, argument: Argument) -> PyResult<Vec<[i32; N]>> {
    let view = View::new(object, argument, INDICES)?;
    view.expect_columns(N)?;
    collect_rows(&view, |at| view.index(at))
}

fn collect_rows<T: Copy + Default, const N: usize>(
    view: &View<'_>,
    read: impl Fn([usize; 2]) -> PyResult<T>,
) -> PyResult<Vec<[T; N]>> {
    let mut rows = view.reserve(view.rows())?;
    for i in 0..view.rows() {
        let mut row = [T::default(); N];
        for (j, value) in row.iter_mut().enumerate() {
            *value = read([i, j])?;
        }
        rows.push(row);
    }
    Ok(rows)
}

/// A scalar type that can be read from a buffer.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Scalar {
    F32,
    F64,
    I32,
    I64,
    U32,
    U64,
    Bool,
}

impl Scalar {
    /// Whether a number of this type is what an argument of the given description expects.
    fn is(self, expected: &str) -> bool {
        match self {
            Self::F32 | Self::F64 => expected == REALS,
            Self::Bool => expected == FLAGS,
            Self::I32 | Self::I64 | Self::U32 | Self::U64 => expected == INDICES,
        }
    }
}

/// A checked view of a Python buffer of one or two dimensions. Holds the interpreter's lifetime, so it
/// cannot be carried into a part that runs without it.
struct View<'py> {
    buffer: PyUntypedBuffer,
    object: &'py Bound<'py, PyAny>,
    argument: Argument,
    expected: &'static str,
    scalar: Scalar,
    shape: Vec<usize>,
    /// Bytes from one row and one column to the next; the second is 0 in one dimension.
    strides: [isize; 2],
}

impl<'py> View<'py> {
    /// Takes the buffer of `object` and checks its element type and number of dimensions.
    fn new(object: &'py Bound<'py, PyAny>, argument: Argument, expected: &'static str) -> PyResult<Self> {
        let Argument { name, shape } = argument;
        // Through a memoryview, which fills in the strides that some exporters (ctypes) leave out.
        let buffer = PyMemoryView::from(object).and_then(|view| PyUntypedBuffer::get(&view)).map_err(|_| {
            InvalidArgumentError::new_err(format!(
                "{name}: expected {expected} array of shape {shape}, found {}; pass a numpy array",
                type_name(object)
            ))
        })?;
        let scalar = scalar_of(&buffer).filter(|s| s.is(expected));
        let dimensions = buffer.dimensions();
        let (Some(scalar), 1..=2, None) = (scalar, dimensions, buffer.suboffsets()) else {
            return Err(refusal(object, &buffer, argument, expected));
        };
        let strides = [buffer.strides()[0], buffer.strides().get(1).copied().unwrap_or(0)];
        let shape = buffer.shape().to_vec();
        Ok(Self { buffer, object, argument, expected, scalar, shape, strides })
    }

    fn rows(&self) -> usize {
        self.shape[0]
    }

    fn expect_columns(&self, columns: usize) -> PyResult<()> {
        if self.shape.len() == 2 && self.shape[1] == columns { Ok(()) } else { Err(self.refusal()) }
    }

    fn refusal(&self) -> PyErr {
        refusal(self.object, &self.buffer, self.argument, self.expected)
    }

    /// An empty vector with room for `count` values. Counts are limited to 32 bits, as indices are,
    /// before memory is asked for: a broadcast array can be larger than the machine.
    fn reserve<T>(&self, count: usize) -> PyResult<Vec<T>> {
        let rows = i32::try_from(self.rows()).ok();
        rows.and_then(|_| memory::required(count).ok()).ok_or_else(|| {
            InvalidArgumentError::new_err(format!(
                "{}: expected at most {} rows that fit in memory, found shape {}",
                self.argument.name,
                i32::MAX,
                shape_text(&self.shape)
            ))
        })
    }

    fn real(&self, at: [usize; 2]) -> PyResult<f64> {
        Ok(match self.scalar {
            Scalar::F32 => f64::from(self.read::<f32>(at)),
            _ => self.read::<f64>(at),
        })
    }

    fn index(&self, at: [usize; 2]) -> PyResult<i32> {
        let wide = match self.scalar {
            Scalar::I32 => return Ok(self.read::<i32>(at)),
            Scalar::U32 => i128::from(self.read::<u32>(at)),
            Scalar::U64 => i128::from(self.read::<u64>(at)),
            _ => i128::from(self.read::<i64>(at)),
        };
        i32::try_from(wide).map_err(|_| {
            let [row, column] = at;
            let place = if self.shape.len() == 2 { format!("[{row}, {column}]") } else { format!("[{row}]") };
            let name = self.argument.name;
            InvalidArgumentError::new_err(format!("{name}{place}: expected an index of 32 bits, found {wide}"))
        })
    }

    /// Reads one element, whatever its alignment. `T` must be the type that `scalar` names.
    fn read<T: Copy>(&self, [row, column]: [usize; 2]) -> T {
        debug_assert_eq!(size_of::<T>(), self.buffer.item_size());
        assert!(row < self.shape[0] && column < self.shape.get(1).copied().unwrap_or(1), "inside the buffer");
        let offset = row as isize * self.strides[0] + column as isize * self.strides[1];
        // SAFETY: the exporter promises that every index below its shape, taken through its strides,
        // lies in its memory, and `buffer` keeps that memory alive. The interpreter is held, so no
        // Python code writes meanwhile. `scalar_of` has compared type and size of the elements; all
        // bit patterns of these number types are valid.
        unsafe { self.buffer.buf_ptr().cast::<u8>().offset(offset).cast::<T>().read_unaligned() }
    }
}

/// The element type, if it is one we read and in the byte order of this machine.
fn scalar_of(buffer: &PyUntypedBuffer) -> Option<Scalar> {
    let format = buffer.format().to_bytes();
    let foreign: &[u8] = if cfg!(target_endian = "little") { b">!" } else { b"<" };
    if format.first().is_some_and(|order| foreign.contains(order)) {
        return None;
    }
    let (scalar, bytes) = match ElementType::from_format(buffer.format()) {
        ElementType::Float { bytes: 4 } => (Scalar::F32, 4),
        ElementType::Float { bytes: 8 } => (Scalar::F64, 8),
        ElementType::SignedInteger { bytes: 4 } => (Scalar::I32, 4),
        ElementType::SignedInteger { bytes: 8 } => (Scalar::I64, 8),
        ElementType::UnsignedInteger { bytes: 4 } => (Scalar::U32, 4),
        ElementType::UnsignedInteger { bytes: 8 } => (Scalar::U64, 8),
        ElementType::Bool => (Scalar::Bool, 1),
        _ => return None,
    };
    (buffer.item_size() == bytes).then_some(scalar)
}

fn refusal(object: &Bound<'_, PyAny>, buffer: &PyUntypedBuffer, argument: Argument, expected: &str) -> PyErr {
    InvalidArgumentError::new_err(format!(
        "{}: expected {expected} array of shape {}, found {} of {} and shape {}",
        argument.name,
        argument.shape,
        type_name(object),
        element_text(object, buffer),
        shape_text(buffer.shape())
    ))
}

fn type_name(object: &Bound<'_, PyAny>) -> String {
    object.get_type().name().map_or_else(|_| "an object".into(), |name| name.to_string())
}

/// The element type as the user knows it: numpy's name where there is one, else the format string.
fn element_text(object: &Bound<'_, PyAny>, buffer: &PyUntypedBuffer) -> String {
    match object.getattr("dtype").and_then(|dtype| dtype.str()) {
        Ok(name) => name.to_string(),
        Err(_) => format!("format '{}'", buffer.format().to_string_lossy()),
    }
}

fn shape_text(shape: &[usize]) -> String {
    match shape {
        [n] => format!("({n},)"),
        _ => format!("({})", shape.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")),
    }
}
