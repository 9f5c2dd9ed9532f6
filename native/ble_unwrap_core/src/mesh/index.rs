//! Typed indices: a vertex never passes for a face.

use std::fmt;

macro_rules! index {
    ($(#[$doc:meta])* $name:ident, $prefix:literal) => {
        $(#[$doc])*
        #[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[repr(transparent)]
        pub(crate) struct $name(u32);

        impl $name {
            /// Stands for "none" where an index is optional and kept in a flat array.
            pub(crate) const NONE: Self = Self(u32::MAX);

            /// Wraps a position in a flat array.
            ///
            /// # Panics
            /// If `index` does not fit: meshes are limited to 2³² − 1 elements, which
            /// [`condition`](super::condition()) checks before any index is made.
            #[inline]
            #[must_use]
            pub(crate) fn new(index: usize) -> Self {
                debug_assert!(index < u32::MAX as usize, "index {index} does not fit in 32 bits");
                #[expect(clippy::cast_possible_truncation, reason = "checked on entry")]
                Self(index as u32)
            }

            /// The position in a flat array.
            #[inline]
            #[must_use]
            pub(crate) fn index(self) -> usize {
                self.0 as usize
            }

            /// Whether this is [`Self::NONE`].
            #[inline]
            #[must_use]
            pub(crate) fn is_none(self) -> bool {
                self == Self::NONE
            }
        }

        impl fmt::Debug for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                if self.is_none() { f.write_str("none") } else { write!(f, concat!($prefix, "{}"), self.0) }
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                fmt::Debug::fmt(self, f)
            }
        }
    };
}

index!(
    /// A vertex of a [`TriMesh`](super::TriMesh).
    VertexId, "v"
);
index!(
    /// A triangle of a [`TriMesh`](super::TriMesh).
    FaceId, "f"
);
index!(
    /// A corner of a triangle and, at once, the half-edge that leaves it: `3·face + slot`.
    HalfedgeId, "h"
);

impl FaceId {
    /// The half-edge that leaves corner `slot` (0, 1 or 2) of this face.
    #[inline]
    #[must_use]
    pub(crate) fn halfedge(self, slot: usize) -> HalfedgeId {
        debug_assert!(slot < 3, "a triangle has no corner {slot}");
        HalfedgeId::new(3 * self.index() + slot)
    }

    /// The three half-edges in order.
    #[inline]
    #[must_use]
    pub(crate) fn halfedges(self) -> [HalfedgeId; 3] {
        [0, 1, 2].map(|slot| self.halfedge(slot))
    }
}

impl HalfedgeId {
    /// The face this half-edge belongs to.
    #[inline]
    #[must_use]
    pub(crate) fn face(self) -> FaceId {
        FaceId::new(self.index() / 3)
    }

    /// Which of the face's corners it leaves: 0, 1 or 2.
    #[inline]
    #[must_use]
    pub(crate) fn slot(self) -> usize {
        self.index() % 3
    }

    /// The next half-edge of the same face, counter-clockwise.
    #[inline]
    #[must_use]
    pub(crate) fn next(self) -> Self {
        if self.slot() == 2 { Self::new(self.index() - 2) } else { Self::new(self.index() + 1) }
    }

    /// The previous half-edge of the same face.
    #[inline]
    #[must_use]
    pub(crate) fn prev(self) -> Self {
        if self.slot() == 0 { Self::new(self.index() + 2) } else { Self::new(self.index() - 1) }
    }
}
