//! Whose fault an error is, and so what a host makes of it.

/// What kind of error a call ended with. Every error of this crate has one, by its method `kind`.
///
/// The list is complete: an error that is added later is of one of these kinds. A host may therefore map all of them to
/// exceptions of its own and let the compiler see that none is forgotten.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorKind {
    /// The arrays do not describe a mesh, or not one that this function can work on.
    Mesh,
    /// Another argument or a setting is not what it has to be.
    Argument,
    /// The caller asked to stop.
    Cancelled,
    /// There is not enough memory.
    OutOfMemory,
    /// The result could not be proven to hold what is promised.
    Unproven,
    /// A defect of this library.
    Internal,
}
