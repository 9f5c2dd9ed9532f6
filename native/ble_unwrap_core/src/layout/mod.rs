//! Charts to atlas: scale, pack, round, check, and mend what the checks find.

mod cover;
mod mend;
mod narrow;
mod placed;
mod quads;
mod scale;
mod stacks;
mod summary;
mod upright;

use std::collections::BTreeSet;

use crate::atlas::Atlas;
use crate::cache::Run;
use crate::charts::Chart;
use crate::clock::Clock;
use crate::cutting::{self, Originals, Price};
use crate::error::UnwrapError;
use crate::flattening::Rungs;
use crate::mesh::{MeshInput, Surface};
use crate::metrics::{self, LayoutArrays, Texture};
use crate::progress::Stage;
use crate::settings::Settings;
use crate::verify::{self, Certificate};

pub(crate) use cover::cover;
use mend::Faults;
use placed::Placed;
use stacks::Stacks;

/// Rounds of packing, checking and mending. Needles that rounding breaks are gone after one; the rest
/// is for charts whose parts break again.
const MOST_ROUNDS: usize = 12;
/// Charts that came out too near are packed at least so many texels further apart.
const LEAST_WIDENING: f64 = 1.0 / 16.0;

/// Packs the charts and proves the result. `originals` tells which may lie on each other.
pub(crate) fn lay_out(
    input: &MeshInput<'_>,
    surface: &Surface,
    mut charts: Vec<Chart>,
    originals: &Originals,
    mut rungs: Rungs,
    settings: &Settings,
    mut clock: Clock,
    run: &Run<'_>,
) -> Result<Atlas, UnwrapError> {
    let arrays = LayoutArrays::new(input, surface);
    let mut texture = Texture::of(&settings.packing);
    let margin = texture.margin;
    let mut packing = settings.packing.with_whole_margin();
    let mut round = 0;
    let mut alone = BTreeSet::new();
    loop {
        run.progress.enter(Stage::Pack);
        scale::scale(&mut charts, settings);
        let stacks = Stacks::of(&charts, originals, &alone, settings, run.progress)?;
        let layout = Placed::new(input, surface, &charts, &stacks, &packing, settings, run.progress)?;
        // Where the margin may shrink, less is kept than was asked for, and that is proven.
        texture.margin = margin.min(layout.margin);
        clock.lap("pack");
        round += 1;
        if !layout.unstackable.is_empty() && round < MOST_ROUNDS {
            alone.extend(layout.unstackable.iter().filter_map(|&number| stacks::lowest_face(&charts[number])));
            continue;
        }
        run.progress.enter(Stage::Verify);
        let mesh = arrays.uv_mesh(&layout.uv, &layout.face_chart, texture)?.with_stacks(&layout.stack);
        let certificate = verify::verify(&mesh, run.progress)?;
        match next_step(&certificate, !layout.broken.is_empty(), round) {
            NextStep::End => {
                drop(charts);
                let measures = metrics::measure(&mesh, run.progress)?;
                clock.lap("verify");
                let mut report = summary::report_of(input, surface, &layout, &measures, settings, run.progress)?;
                report.rungs = rungs.taken();
                report.seconds = clock.into_laps();
                let atlas = Atlas::proven(layout.uv, layout.polygon_chart, layout.stack, report, certificate)?;
                run.progress.enter(Stage::Done);
                return Ok(atlas);
            }
            NextStep::Widen(shortfall) => packing.margin_texels += shortfall,
            NextStep::Mend => {
                let mut faulty: BTreeSet<usize> =
                    certificate.faulty_charts.iter().filter_map(|&c| usize::try_from(c).ok()).collect();
                // The charts of a stack have the faults of the one that was looked at.
                let faulty_stacks: BTreeSet<i32> =
                    faulty.iter().map(|&c| layout.stack[c]).filter(|&s| s >= 0).collect();
                faulty.extend((0..charts.len()).filter(|&c| faulty_stacks.contains(&layout.stack[c])));
                let faults = Faults { round, faulty: &faulty, broken: &layout.broken };
                // Sides that could be straightened are so already, and what is made anew is not looked at for them.
                let unstraightened = Settings { straighten: 0.0, ..settings.clone() };
                charts = mend::mend(surface, charts, &faults, &mut rungs, &unstraightened, run)?;
                let price = Price::new(&surface.mesh, &unstraightened);
                charts = cutting::touch_up(charts, &price, &unstraightened, &mut rungs, run.progress)?;
            }
        }
        clock.lap("mend");
    }
}

/// What follows from the checks of a layout.
#[derive(Debug, PartialEq)]
enum NextStep {
    /// It is proven, or there is nothing left to try.
    End,
    /// Charts that break a rule are made anew.
    Mend,
    /// Charts are packed so many texels further apart: rounding has moved some towards each other.
    Widen(f64),
}

/// `has_broken` tells whether rounding turned faces over; rounds count from 1.
fn next_step(certificate: &Certificate, has_broken: bool, round: usize) -> NextStep {
    let has_faults = has_broken || !certificate.faulty_charts.is_empty();
    if round >= MOST_ROUNDS || certificate.is_valid() && !has_broken {
        NextStep::End
    } else if has_faults {
        NextStep::Mend
    } else if certificate.is_injective() && certificate.gap_texels < certificate.margin_texels {
        NextStep::Widen(LEAST_WIDENING.max(certificate.margin_texels - certificate.gap_texels))
    } else {
        NextStep::End
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::verify::Defect;

    fn checked(change: impl FnOnce(&mut Certificate)) -> Certificate {
        let mut certificate =
            Certificate { complete: true, gap_texels: 4.0, margin_texels: 4.0, ..Certificate::default() };
        change(&mut certificate);
        certificate
    }

    #[test]
    fn a_proven_layout_is_the_end_and_any_fault_is_mended_first() {
        let proven = checked(|_| ());
        assert_eq!(next_step(&proven, false, 1), NextStep::End);
        assert_eq!(next_step(&proven, true, 1), NextStep::Mend);
        let flipped = checked(|c| {
            c.flipped = Defect { count: 1, first: Some(3) };
            c.faulty_charts = vec![0];
            c.gap_texels = 0.0;
        });
        assert_eq!(next_step(&flipped, false, 1), NextStep::Mend);
        assert_eq!(next_step(&flipped, true, MOST_ROUNDS - 1), NextStep::Mend);
        assert_eq!(next_step(&flipped, true, MOST_ROUNDS), NextStep::End, "with an error that carries the certificate");
    }

    #[test]
    fn charts_too_near_are_packed_further_apart() {
        let near = checked(|c| c.gap_texels = 3.75);
        assert_eq!(next_step(&near, false, 1), NextStep::Widen(0.25));
        let all_but = checked(|c| c.gap_texels = 3.9999);
        assert_eq!(next_step(&all_but, false, 1), NextStep::Widen(LEAST_WIDENING));
        assert_eq!(next_step(&near, false, MOST_ROUNDS), NextStep::End);
    }

    #[test]
    fn what_cannot_be_checked_is_not_tried_for_ever() {
        let endless = checked(|c| c.complete = false);
        assert_eq!(next_step(&endless, false, 1), NextStep::End);
        let unmeasured = checked(|c| c.gap_texels = f64::NAN);
        assert_eq!(next_step(&unmeasured, false, 1), NextStep::End);
    }
}
