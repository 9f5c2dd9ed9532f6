//! A margin that is too large for a texture, made smaller where the caller allows it.

use super::PackError;

/// A margin below so many texels is given up: charts then only do not touch.
const LEAST: f64 = 0.125;

/// Whether a smaller margin may do where packing failed.
pub(super) fn helps(error: &PackError) -> bool {
    matches!(
        error,
        PackError::MarginTooLarge { .. } | PackError::TooManyCharts { .. } | PackError::NoRoomBetweenObstacles { .. }
    )
}

/// The error with the margin that was asked for, where more room was kept for [snapping](super::snap).
pub(super) fn with_margin(error: PackError, margin: f64) -> PackError {
    match error {
        PackError::MarginTooLarge { width, height, .. } => PackError::MarginTooLarge { margin, width, height },
        PackError::TooManyCharts { charts, width, height, .. } => {
            PackError::TooManyCharts { charts, margin, width, height }
        }
        PackError::NoRoomBetweenObstacles { charts, width, height, .. } => {
            PackError::NoRoomBetweenObstacles { charts, margin, width, height }
        }
        other => other,
    }
}

/// The next margin to try: half of it, and none at last.
pub(super) fn smaller(margin: f64) -> f64 {
    if margin >= 2.0 * LEAST { 0.5 * margin } else { 0.0 }
}

/// What the user is told where less than the margin that was asked for is kept.
pub(crate) fn told(asked: f64, kept: f64) -> Option<String> {
    (kept < asked).then(|| {
        format!(
            "a margin of {} texels leaves no room for the charts in this texture, so it was made {} texels; choose a \
             larger texture for more",
            rounded(asked),
            rounded(kept)
        )
    })
}

/// With two digits after the point at most.
fn rounded(texels: f64) -> f64 {
    (100.0 * texels).round() / 100.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::packing::tests::{check, items, mixture, packed, square};
    use crate::packing::{PackSettings, pack};
    use crate::progress::Progress;

    #[test]
    fn a_margin_comes_to_nothing_in_few_steps() {
        let mut margin = 1024.0;
        let steps = (0..).take_while(|_| {
            margin = smaller(margin);
            margin > 0.0
        });
        assert_eq!(steps.count(), 13);
        assert_eq!([smaller(0.25), smaller(0.2), smaller(0.0)], [0.125, 0.0, 0.0]);
        assert_eq!(told(4.0, 4.0), None);
        assert!(
            told(8.0 * 2.0f64.sqrt(), 4.0 * 2.0f64.sqrt())
                .is_some_and(|text| text.contains("11.31 texels leaves no room") && text.contains("made 5.66"))
        );
    }

    #[test]
    fn a_margin_shrinks_only_where_it_may_and_must() {
        let charts = mixture(12, 5);
        let (tight, loose) = (square(32, 20.0), square(256, 4.0));
        let refused = pack(&items(&charts), &tight, &Progress::new());
        assert!(refused.is_err_and(|error| helps(&error)));
        let refused = pack(&items(&charts), &PackSettings { snap: true, ..tight.clone() }, &Progress::new());
        assert!(refused.is_err_and(|error| error.to_string().contains("a margin of 20 texels")));
        for snap in [false, true] {
            let allowed = PackSettings { shrink_margin: true, snap, ..tight.clone() };
            let found = packed(&charts, &allowed);
            assert!(found.margin < 20.0 && found.margin >= 2.0, "{}", found.margin);
            check(&charts, &PackSettings { margin_texels: found.margin, ..allowed }, &found);
        }
        let allowed = PackSettings { shrink_margin: true, ..loose.clone() };
        assert_eq!(packed(&charts, &allowed), packed(&charts, &loose));
        assert_eq!(packed(&charts, &allowed).margin, 4.0);
        // More charts than texels fit at no margin.
        let many = mixture(50, 5);
        let tiny = PackSettings { shrink_margin: true, ..square(3, 1.0) };
        assert!(pack(&items(&many), &tiny, &Progress::new()).is_err());
    }
}
