use super::candidates::Candidates;
use super::tangents::tangents;
use super::{ApexGrid, LANES, TURN, WIDER};
use crate::math::{mask, Approach, Segment};
use crate::tree::beam::{for_each_pair_along, Beam};
use crate::tree::interval::Interval;
use glam::Vec3;

/// Candidates that are tested in one go.
const WAITING: usize = 64;

impl ApexGrid {
    /// As [`crate::tree::ViewBeamTree::query_segment`], pairs of the same bits, in the order of the cells.
    #[inline]
    pub fn query_segment(
        &self,
        photon_beam: &Segment,
        radius: f32,
        mut visit: impl FnMut(u32, Approach),
    ) {
        if !photon_beam.is_finite() || radius.is_nan() || radius <= 0.0 {
            return;
        }
        let capsule = Capsule::new(self, photon_beam, radius);
        let Some((seen, rows)) = self.seen_rows(&capsule) else {
            return;
        };
        let band = Band::new(self, &capsule);
        let radius_squared = radius * radius;
        let mut judge = |near: &[u32]| {
            let visit = |beam: &Beam, approach| visit(beam.index, approach);
            for_each_pair_along(&self.beams, near, photon_beam, radius_squared, visit);
        };
        let mut candidates = Candidates::<WAITING>::none();
        for row in rows[0]..=rows[1] {
            if let Some(columns) = self.seen_columns(&capsule, seen, row) {
                candidates.add(self, row, columns, |slopes| band.touches(slopes), &mut judge);
            }
        }
        candidates.flush(&mut judge);
    }

    /// The part of a capsule that may touch lines of the grid, and the first and last row of these.
    #[inline]
    fn seen_rows(&self, capsule: &Capsule) -> Option<(Interval, [usize; 2])> {
        // No beam reaches behind the plane of the apex by more than the slack.
        let in_front = Interval { start: 0.0, end: capsule.length }.clip(
            -capsule.origin.z,
            -capsule.slope.z,
            capsule.reach,
        );
        let seen = (0..2).fold(in_front, |part, axis| capsule.within(part, axis, self.edges(axis)));
        (!seen.is_empty()).then(|| (seen, self.between_tangents(capsule, seen, 1)))
    }

    /// First and last column of the lines of a row that this part of a capsule may touch; none where it passes by.
    #[inline]
    fn seen_columns(&self, capsule: &Capsule, seen: Interval, row: usize) -> Option<[usize; 2]> {
        let part = capsule.within(seen, 1, [self.edge(1, row), self.edge(1, row + 1)]);
        (!part.is_empty()).then(|| self.between_tangents(capsule, part, 0))
    }

    /// First and last column or row of the lines that this part of a capsule touches: its shadow is the hull of those of its
    /// ends, unless it comes near the plane of the apex.
    #[inline]
    fn between_tangents(&self, capsule: &Capsule, part: Interval, axis: usize) -> [usize; 2] {
        let at = |t: f32| {
            let q = capsule.origin + t * capsule.slope;
            tangents(q[axis], q.z, capsule.reach)
        };
        let (Some(start), Some(end)) = (at(part.start), at(part.end)) else {
            return [0, self.cells[axis] - 1];
        };
        let (low, high) = (start[0].min(end[0]), start[1].max(end[1]));
        let wider = WIDER * (1.0 + low.abs().max(high.abs()));
        [self.column(axis, low - wider), self.column(axis, high + wider)]
    }
}

/// A photon beam in the frame and how far around it a pair may lie.
struct Capsule {
    origin: Vec3,
    slope: Vec3,
    length: f32,
    reach: f32,
    /// Distance of its farther end from the apex.
    farthest: f32,
}

impl Capsule {
    /// The reach is that of [`crate::tree::ViewBeamTree::query_segment`], with the slack, and with what the roundings of a
    /// place in the frame may move it.
    #[inline]
    fn new(grid: &ApexGrid, beam: &Segment, radius: f32) -> Self {
        let end = beam.at(beam.length);
        let largest = beam.origin.abs().max(end.abs()).max_element();
        let rounding = 16.0 * f32::EPSILON * (radius + largest + grid.max_origin);
        let [origin, last] = [beam.origin, end].map(|p| grid.to_frame * (p - grid.apex));
        let farthest = origin.length().max(last.length());
        Capsule {
            origin,
            slope: grid.to_frame * beam.direction,
            length: beam.length,
            reach: (radius + grid.slack + rounding + TURN * farthest) * (1.0 + WIDER),
            farthest,
        }
    }

    /// The part of an interval where balls of the reach touch lines between two slopes.
    #[inline]
    fn within(&self, part: Interval, axis: usize, [low, high]: [f32; 2]) -> Interval {
        let clip = |part: Interval, edge: f32, side: f32| {
            // Slopes beyond an edge by a rounding are in its cell, too.
            let edge = edge + side * WIDER * (1.0 + edge.abs());
            let beyond = |v: Vec3| side * (v[axis] - edge * v.z);
            let limit = self.reach * (1.0 + edge * edge).sqrt() * (1.0 + WIDER);
            part.clip(beyond(self.origin), beyond(self.slope), limit)
        };
        clip(clip(part, low, -1.0), high, 1.0)
    }
}

/// Lines through the apex near the line of a photon beam.
struct Band {
    slope: Vec3,
    /// The plane's normal that holds both apex and beam, as long as the beam's distance from the apex.
    normal: Vec3,
    /// What roundings may add to a line's part along the normal.
    rounding: f32,
    reach_squared: f32,
}

impl Band {
    #[inline]
    fn new(grid: &ApexGrid, capsule: &Capsule) -> Self {
        let steepest = |axis: usize| grid.edges(axis).map(f32::abs).into_iter().fold(1.0, f32::max);
        let longest = 1.0 + steepest(0) + steepest(1);
        Band {
            slope: capsule.slope,
            normal: capsule.slope.cross(capsule.origin),
            rounding: TURN * (capsule.farthest + capsule.reach) * longest,
            reach_squared: capsule.reach * capsule.reach,
        }
    }

    /// A bit for each line through the apex that passes the beam's line within the reach: with `d = (x, y, 1)`,
    /// `|d · normal| <= reach · |d × slope|`.
    #[inline]
    fn touches(&self, [x, y]: [&[f32; LANES]; 2]) -> u32 {
        let (n, e) = (self.normal, self.slope);
        let nearest: [f32; LANES] = std::array::from_fn(|lane| {
            let (x, y) = (x[lane], y[lane]);
            let along = ((x * n.x + y * n.y + n.z).abs() - self.rounding).max(0.0);
            along * along
        });
        let limits = std::array::from_fn(|lane| {
            let (x, y) = (x[lane], y[lane]);
            let across = [y * e.z - e.y, e.x - x * e.z, x * e.y - y * e.x];
            let sine_squared =
                across[0] * across[0] + across[1] * across[1] + across[2] * across[2];
            self.reach_squared * sine_squared
        });
        mask::at_most(&nearest, &limits)
    }
}
