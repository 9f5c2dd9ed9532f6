//! Surface to charts: make a patch one chart or split it, until all are charts.

use std::collections::HashSet;

use crate::cache::{Fingerprint, Run};
use crate::charts::{Chart, Patch};
use crate::flattening::Rungs;
use crate::geodesics::LandmarkDistances;
use crate::mesh::FaceId;
use crate::progress::Cancelled;
use crate::rounds::{self, Outcome};
use crate::settings::Settings;

use super::attempt::Attempt;
use super::cost::Price;
use super::measured::Measured;
use super::moves::split;

/// The charts of a surface and how they came about.
pub(crate) struct Charting {
    pub(crate) charts: Vec<Chart>,
    /// For each chart, the split that it came out of, if any; the same for both halves of a split in two, and else for no
    /// other.
    pub(super) family: Vec<Option<u32>>,
    pub(crate) rungs: Rungs,
    /// The faces, ascending, of patches that are known not to be one chart.
    pub(super) refused: Refused,
}

/// Sets of faces that are known not to be one chart, by their fingerprints.
#[derive(Default)]
pub(super) struct Refused(HashSet<Fingerprint>);

impl Refused {
    pub(super) fn of(keys: impl Iterator<Item = Fingerprint>) -> Self {
        Self(keys.collect())
    }

    pub(super) fn contains(&self, faces: &[FaceId]) -> bool {
        self.0.contains(&Self::key(faces))
    }

    #[cfg(test)]
    pub(super) fn len(&self) -> usize {
        self.0.len()
    }

    /// For faces in ascending order, as patches have them.
    pub(super) fn key(faces: &[FaceId]) -> Fingerprint {
        let mut key = Fingerprint::new();
        key.indices(faces.iter().map(|f| f.index()));
        key
    }
}

struct Piece {
    patch: Patch,
    splits: u32,
    /// Distances taken over from the patch it was split from.
    inherited: Option<LandmarkDistances>,
}

/// Cuts and flattens patches until every chart is under the limit, and no split can be worth its seam ([`Price::limit`]). Rounds over all open pieces, in
/// parallel; a piece is split into two or more of fewer polygons, so there are at most as many rounds
/// as polygons, and in practice some ten. `done` is told the faces of each chart as it is accepted.
/// Charts come sorted by lowest face.
pub(crate) fn divide(
    patches: Vec<Patch>,
    price: &Price,
    settings: &Settings,
    done: &(dyn Fn(f64) + Sync),
    run: &Run<'_>,
) -> Result<Charting, Cancelled> {
    let pieces = patches.into_iter().map(|patch| Piece { patch, splits: 0, inherited: None }).collect();
    let rounds = rounds::until_made(
        pieces,
        |p| (std::cmp::Reverse(p.patch.faces.len()), p.patch.faces[0]),
        || (),
        |piece, ()| {
            let mut rungs = Rungs::default();
            let outcome = step(piece, price, settings, &mut rungs, run)?;
            let refused = match &outcome {
                Outcome::Made(_) => {
                    done(piece.patch.faces.len() as f64);
                    None
                }
                Outcome::Divided(_) => Some(Refused::key(&piece.patch.faces)),
            };
            Ok((outcome, (rungs, refused)))
        },
    )?;
    let mut rungs = Rungs::default();
    rounds.notes.iter().for_each(|(steps, _)| rungs.add(steps));
    let refused = Refused::of(rounds.notes.into_iter().filter_map(|(_, key)| key));
    let mut made = rounds.made;
    made.sort_by_key(|(c, _)| c.patch.faces[0]);
    let (charts, family) = made.into_iter().unzip();
    Ok(Charting { charts, family, rungs, refused })
}

fn step(
    piece: &Piece,
    price: &Price,
    settings: &Settings,
    rungs: &mut Rungs,
    run: &Run<'_>,
) -> Result<Outcome<Chart, Piece>, Cancelled> {
    run.progress.check()?;
    let (patch, splits) = (&piece.patch, piece.splits);
    let settings = &Settings { stretch_limit: price.limit(patch, settings), ..settings.clone() };
    let measured = Measured::new(patch, piece.inherited.as_ref(), settings, run);
    let attempt = Attempt::new(&measured, settings, run);
    if patch.is_one_polygon() {
        return Ok(Outcome::Made(attempt.polygon(rungs)?));
    }
    if let Some(strip) = attempt.strip(price, rungs) {
        return Ok(Outcome::Made(strip));
    }
    if let Some(chart) = attempt.run(rungs)? {
        return Ok(Outcome::Made(chart));
    }
    let part = |patch| {
        let inherited = measured.inherited_by(&patch);
        Piece { patch, splits: splits + 1, inherited }
    };
    Ok(Outcome::Divided(split::split(&measured, splits, settings, rungs, run)?.into_iter().map(part).collect()))
}

/// The parts of a patch that is known not to be one chart, and that is not one polygon.
pub(super) fn split_once(
    patch: &Patch,
    settings: &Settings,
    rungs: &mut Rungs,
    run: &Run<'_>,
) -> Result<Vec<Patch>, Cancelled> {
    split::split(&Measured::new(patch, None, settings, run), 1, settings, rungs, run)
}
