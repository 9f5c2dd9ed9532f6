//! What unwrapping a mesh gives.

use crate::error::UnwrapError;
use crate::report::Report;
use crate::verify::Certificate;

/// A UV for every corner of the input mesh, the measures of the layout, and the proof that the layout keeps what
/// [`unwrap()`](crate::unwrap()) promises.
///
/// There is no atlas without a valid certificate: [`unwrap()`](crate::unwrap()) returns an error where the layout cannot be
/// proven.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Atlas {
    /// One UV for each corner, in [0, 1]² or, with several [tiles](crate::settings::PackSettings::tiles), in one of these; (0, 0) for the corners of faces that are not mapped, because a vertex is not
    /// finite.
    pub uv: Vec<[f32; 2]>,
    /// The chart of each input face, numbered from 0; −1 for faces that are not mapped.
    pub chart: Vec<i32>,
    /// For each chart the stack that it belongs to, numbered from 0 in the order of their first charts; −1 for charts
    /// that lie alone, as all do unless [`Settings::stack`](crate::Settings::stack) says otherwise. Charts of a stack
    /// cover exactly the same place, and their vertices have the same UVs to the bit. Where some are mirror images of
    /// others, those that are fewer are mirrored as wholes.
    pub stack: Vec<i32>,
    /// Measures of the result.
    pub report: Report,
    /// The outcome of the exact checks of `uv`, which is [valid](Certificate::is_valid).
    pub certificate: Certificate,
}

impl Atlas {
    /// An atlas, if its certificate is valid.
    ///
    /// # Errors
    /// [`UnwrapError::Unproven`] with the certificate.
    pub(crate) fn proven(
        uv: Vec<[f32; 2]>,
        chart: Vec<i32>,
        stack: Vec<i32>,
        report: Report,
        certificate: Certificate,
    ) -> Result<Self, UnwrapError> {
        if certificate.is_valid() {
            Ok(Self { uv, chart, stack, report, certificate })
        } else {
            Err(UnwrapError::Unproven(Box::new(certificate)))
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;
    use crate::metrics::{Texture, UvMesh};
    use crate::progress::Progress;
    use crate::verify::verify;

    /// Two triangles of different charts, the second one moved to the right by `apart` texels of 64, with a margin of two.
    fn certificate(apart: f32, turned: bool) -> Certificate {
        let corner = |x: f32, y: f32| [x / 64.0, y / 64.0];
        let uv = [
            corner(1.0, 1.0),
            corner(9.0, 1.0),
            corner(9.0, 9.0),
            corner(9.0 + apart, 1.0),
            corner(17.0 + apart, 1.0),
            corner(9.0 + apart, 9.0),
        ];
        let positions = uv.map(|[x, y]| Point3::new(f64::from(x), f64::from(y), 0.0));
        let triangles = [[0, 1, 2], if turned { [3, 5, 4] } else { [3, 4, 5] }];
        let texture = Texture::square(64, 2.0);
        let mesh = UvMesh::new(&positions, &triangles, &uv, &triangles, &[0, 1], texture).expect("valid arrays");
        verify(&mesh, &Progress::new()).expect("not cancelled")
    }

    fn proven(certificate: Certificate) -> Result<Atlas, UnwrapError> {
        Atlas::proven(Vec::new(), Vec::new(), Vec::new(), Report::default(), certificate)
    }

    #[test]
    fn only_a_valid_certificate_makes_an_atlas() {
        let atlas = proven(certificate(2.0, false)).expect("two texels apart, as they should be");
        assert_eq!((atlas.certificate.gap_texels, atlas.certificate.margin_texels), (2.0, 2.0));
        assert_eq!(atlas.certificate.to_string(), "nothing");
        for (broken, text) in [
            (certificate(1.5, false), "charts 1.5 texels apart instead of 2"),
            (certificate(0.0, false), "charts 0 texels apart instead of 2"),
            (certificate(2.0, true), "1 flipped triangle, 1 chart without one outer boundary"),
            (Certificate { gap_texels: f64::NAN, ..certificate(2.0, false) }, "charts NaN texels apart instead of 2"),
            (Certificate { complete: false, ..certificate(2.0, false) }, "more contacts than can be looked at"),
        ] {
            let error = proven(broken.clone()).expect_err(text);
            assert!(error.to_string().contains(text), "{error}");
            let UnwrapError::Unproven(carried) = error else { panic!("{error}") };
            assert!(!carried.is_valid() && carried.to_string() == broken.to_string());
        }
    }
}
