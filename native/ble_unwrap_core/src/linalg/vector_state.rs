//! Leaving the processor's vector registers as they were found.

use faer::MatRef;

/// Undoes a side effect of faer: call it on the same thread after a factorisation, before other arithmetic.
///
/// faer's multiplication kernels leave the upper halves of the wide x86 registers marked as in use. From then
/// on, every change between code for the plain instruction set (ours) and for the wide one (the system's
/// `log`, `sin`, ...) costs some 70 cycles: measured on an Ice Lake Xeon after one eigenvalue problem of size
/// 100, a logarithm takes 147 ns instead of 4, and keeps doing so for the life of the thread. A function
/// compiled for the wide registers clears the mark when it returns; faer's norm is one that can be called
/// without `unsafe`. Results do not change; costs about 50 ns. Elsewhere than on x86 nothing happens.
pub(crate) fn restore_vector_state() {
    const SIDE: usize = 16;
    let ones = [1.0_f64; SIDE * SIDE];
    let norm = MatRef::from_row_major_slice(std::hint::black_box(&ones), SIDE, SIDE).norm_max();
    std::hint::black_box(norm);
}
