//! What receivers take of memory from the first pass of a jitter to the last.

use super::view::ViewPaths;
use serde::Serialize;

/// Bytes of the receivers of one jitter: records, what lies beside them, and the structures that find them. What there is per
/// pixel, however many receivers it has, is left out, and so is what the scene keeps of the points that it evaluates.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct ReceiverMemory {
    pub view_beam_bytes: u64,
    pub visible_point_bytes: u64,
    /// None where there is none.
    pub bytes_per_view_beam: Option<f64>,
    pub bytes_per_visible_point: Option<f64>,
}

impl ReceiverMemory {
    /// Of ray paths and, in bytes, the structures over their beams and points.
    pub fn of(paths: &ViewPaths, over_beams: usize, over_points: usize) -> Self {
        let per = |bytes: usize, count: usize| (count > 0).then(|| bytes as f64 / count as f64);
        let beams = paths.beam_bytes() + over_beams;
        let points = paths.point_bytes() + over_points;
        ReceiverMemory {
            view_beam_bytes: beams as u64,
            visible_point_bytes: points as u64,
            bytes_per_view_beam: per(beams, paths.beams.len()),
            bytes_per_visible_point: per(points, paths.points.len()),
        }
    }
}

/// Receivers as a method holds them from pass to pass.
pub trait HoldsReceivers: AsRef<ViewPaths> {
    fn memory(&self) -> ReceiverMemory;
}

/// Without a structure over them.
impl HoldsReceivers for ViewPaths {
    fn memory(&self) -> ReceiverMemory {
        ReceiverMemory::of(self, 0, 0)
    }
}
