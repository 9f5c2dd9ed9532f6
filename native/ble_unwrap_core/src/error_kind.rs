//! Whose fault an error is, and so what a host makes of it.

/// What kind of error a call ended with. Every error type of this crate has a method `kind` that tells it.
///
/// The list is complete: an error that is added later will be of one of these kinds. A host may therefore map all of them
/// to exceptions of its own and have the compiler check that none is forgotten.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorKind {
    /// The arrays do not describe a mesh, or the mesh is not one that the function can work on.
    Mesh,
    /// Another argument or a setting is not what it has to be.
    Argument,
    /// The caller asked to stop.
    Cancelled,
    /// There is not enough memory.
    OutOfMemory,
    /// The result could not be proven to keep what the function promises.
    Unproven,
    /// A defect of this library.
    Internal,
}
