//! What the unwrapper makes of a few meshes, within tolerances: a table to notice when quality moves.
//!
//! No UVs are compared. Where a change is an improvement, change the row.

use ble_unwrap_core::{MeshInput, Progress, Settings, unwrap};
use ble_unwrap_fixtures::catalogue;

/// A mesh of the catalogue and what is expected of it.
struct Row {
    name: &'static str,
    /// Fewest and most charts.
    charts: [usize; 2],
    /// L2 stretch of the worst chart.
    worst: f64,
    /// Length of the seams over √area.
    seams: f64,
    /// Covered share of the texture.
    efficiency: f64,
}

const fn row(name: &'static str, charts: [usize; 2], worst: f64, seams: f64, efficiency: f64) -> Row {
    Row { name, charts, worst, seams, efficiency }
}

// How far a figure may be from its row, either way: what is better than it was is a change to be looked at, too.

/// The worst chart's stretch may be off by so much, and by [`STRETCH_SHARE`].
const STRETCH: f64 = 1e-4;
/// Share of what the worst chart's stretch is above 1 by which it may be off.
const STRETCH_SHARE: f64 = 0.1;
/// Share of the length of the seams by which it may be off.
const SEAM_SHARE: f64 = 0.05;
/// The covered share of the texture may be off by so much.
const EFFICIENCY: f64 = 0.04;

static ROWS: [Row; 17] = [
    row("flat grid", [1, 1], 1.0, 0.0, 0.996),
    row("bumpy grid", [1, 1], 1.0238, 0.0, 0.902),
    row("disc", [1, 1], 1.0, 0.0, 0.783),
    row("L shape", [1, 1], 1.0, 0.0, 0.747),
    row("annulus", [1, 1], 1.0, 0.0, 0.658),
    row("cap of 40 degrees", [1, 1], 1.0008, 0.0, 0.782),
    row("hemisphere", [1, 1], 1.0211, 0.0, 0.782),
    row("icosphere", [1, 1], 1.0151, 2.092, 0.425),
    row("open cylinder", [1, 1], 1.0, 0.691, 0.476),
    row("capped cylinder", [3, 3], 1.0, 3.355, 0.475),
    row("cone", [1, 1], 1.0, 0.85, 0.54),
    row("torus", [2, 2], 1.0385, 2.284, 0.781),
    row("plate with five holes", [6, 6], 1.0, 6.083, 0.672),
    row("Moebius strip", [2, 2], 1.0, 0.617, 0.548),
    row("Klein bottle", [1, 1], 1.0251, 2.011, 0.571),
    row("face", [1, 1], 1.0063, 0.777, 0.570),
    row("small sculpt", [3, 3], 1.0281, 4.772, 0.624),
];

#[test]
fn quality_is_what_it_was() {
    let mut moved = Vec::new();
    for row in &ROWS {
        let case = catalogue().find(|c| c.name == row.name).expect("a mesh of the catalogue");
        let mesh = (case.build)();
        let flat = mesh.flat();
        let input = MeshInput {
            positions: &mesh.positions,
            corner_vertices: &flat.corner_vertices,
            face_offsets: &flat.face_offsets,
            corner_triangles: None,
            ..MeshInput::default()
        };
        let report = unwrap(&input, &Settings::default(), &Progress::new()).expect("unwraps").report;
        let near = |got: f64, wanted: f64, tolerance: f64| (got - wanted).abs() <= tolerance;
        let good = (row.charts[0]..=row.charts[1]).contains(&report.charts)
            && (report.flips, report.overlaps, report.charts_over_limit.len()) == (0, 0, 0)
            && near(report.l2_worst_chart, row.worst, STRETCH + STRETCH_SHARE * (row.worst - 1.0))
            && near(report.seam_length, row.seams, SEAM_SHARE * row.seams)
            && near(report.packing_efficiency, row.efficiency, EFFICIENCY);
        if !good {
            moved.push(format!(
                "{}: {} charts, worst {}, seams {}, efficiency {}, {} flips, {} overlaps, {} over the limit",
                row.name,
                report.charts,
                report.l2_worst_chart,
                report.seam_length,
                report.packing_efficiency,
                report.flips,
                report.overlaps,
                report.charts_over_limit.len()
            ));
        }
    }
    assert!(moved.is_empty(), "{}", moved.join("\n"));
}
