//! A body with few corners unfolded: cut to all of them it lies flat.

use std::borrow::Cow;

use crate::charts::Patch;
use crate::stretch;

use super::super::cost::CutPrice;
use super::dart::{cut_to, is_guided};

/// A patch with more corners has no net: a box has eight.
const MOST_CORNERS: usize = 8;

/// A patch that is flat but for a few corners, cut to all of these: a net, which unfolds without stretch. `None` where it
/// has none, too many, or curvature elsewhere, and where guides run inside it.
pub(crate) fn net(patch: &Patch) -> Option<Patch> {
    let mut net = Cow::Borrowed(patch);
    let is_closed = patch.mesh.halfedges().all(|h| !patch.mesh.is_boundary(h));
    for cuts in 0..=MOST_CORNERS {
        let corners = stretch::corners(&net.mesh, MOST_CORNERS)?;
        if cuts == 0 && (corners.is_empty() || is_guided(patch)) {
            return None;
        }
        // The first cut of a closed surface ends at its sharpest corner.
        let root = if cuts == 0 && is_closed { corners.first().copied() } else { None };
        let mut tips = corners.into_iter().filter(|v| Some(*v) != root).peekable();
        if tips.peek().is_none() {
            return if let Cow::Owned(net) = net { Some(net) } else { None };
        }
        net = Cow::Owned(tips.find_map(|tip| cut_to(&net, tip, root, CutPrice::OF_NET))?);
    }
    None
}

#[cfg(test)]
mod tests {
    use super::super::dart::tests::{moved, whole};
    use super::*;
    use crate::mesh::{HalfedgeId, TriMesh, test_surfaces};
    use nalgebra::Point3;

    #[test]
    fn a_box_has_a_net_whole_or_open_and_a_ball_has_none() {
        let cube = test_surfaces::cubes([1, 1, 1], |_| true);
        let box_of = |mesh| whole(moved(mesh, |p| Point3::new(p.x, 2.0 * p.y, 3.0 * p.z)));
        let closed = box_of(&cube);
        let unfolded = net(&closed).expect("a net");
        assert!(unfolded.mesh.topology().is_disk());
        assert_eq!(stretch::corners(&unfolded.mesh, 0), Some(Vec::new()), "no corner is left inside");
        let ball = whole(test_surfaces::sphere(3));
        assert!(net(&ball).is_none());
        let sheet = whole(test_surfaces::grid(4, 4, [1.0, 1.0], 0.0));
        assert!(net(&sheet).is_none(), "nothing to cut");
        let marks = closed.mesh.halfedges().map(|h| [h, closed.mesh.twin(h)].contains(&HalfedgeId::new(0))).collect();
        let guided = whole(TriMesh::clone(&closed.mesh).with_guides(marks));
        assert!(net(&guided).is_none(), "the user says where it is to be cut");
    }
}
