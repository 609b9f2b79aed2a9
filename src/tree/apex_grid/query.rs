use super::candidates::Candidates;
use super::tangents::tangents;
use super::{ApexGrid, LANES, TURN, WIDER};
use crate::math::mask;
use crate::tree::beam::{for_each_pair, Beam};
use glam::Vec3;

/// Candidates that are tested in one go: a photon has a dozen, and room for more has to be cleared.
const WAITING: usize = 32;

impl ApexGrid {
    /// As [`crate::tree::ViewBeamTree::query`], pairs of the same bits, in the order of the cells.
    #[inline]
    pub fn query(&self, p: Vec3, radius: f32, mut visit: impl FnMut(u32, f32, f32)) {
        if radius.is_nan() || radius <= 0.0 {
            return;
        }
        let rounding = 4.0 * f32::EPSILON * (p.abs().max_element() + self.max_origin + radius);
        let reach = (radius + self.slack + rounding) * (1.0 + WIDER);
        let q = self.to_frame * (p - self.apex);
        let Some([columns, rows]) = self.seen(q, reach) else {
            return;
        };
        let ball = Ball::new(q, reach);
        let radius_squared = radius * radius;
        let mut judge = |near: &[u32]| {
            let visit = |beam: &Beam, t, d2| visit(beam.index, t, d2);
            for_each_pair(&self.beams, near, p, radius_squared, visit);
        };
        let mut candidates = Candidates::<WAITING>::none();
        for row in rows[0]..=rows[1] {
            candidates.add(self, row, columns, |slopes| ball.touches(slopes), &mut judge);
        }
        candidates.flush(&mut judge);
    }

    /// First and last column and row of the lines that a ball touches, by its middle in the frame; none where it touches no
    /// line of the grid.
    #[inline]
    fn seen(&self, q: Vec3, reach: f32) -> Option<[[usize; 2]; 2]> {
        if q.is_nan() || q.z < -reach {
            return None;
        }
        let mut range = [[0; 2]; 2];
        for axis in 0..2 {
            let edges = self.edges(axis);
            let [low, high] = tangents(q[axis], q.z, reach).unwrap_or(edges);
            let misses = |edge: f32, side: f32| {
                // The ball lies beyond the plane of all lines with the slope of an edge.
                side * (q[axis] - edge * q.z) > reach * (1.0 + edge * edge).sqrt() * (1.0 + WIDER)
            };
            if misses(edges[0], -1.0) || misses(edges[1], 1.0) {
                return None;
            }
            let wider = WIDER * (1.0 + low.abs().max(high.abs()));
            range[axis] = [self.column(axis, low - wider), self.column(axis, high + wider)];
        }
        Some(range)
    }
}

/// The ball around a photon, in the frame, wide enough for roundings.
struct Ball {
    middle: Vec3,
    radius_squared: f32,
}

impl Ball {
    #[inline]
    fn new(middle: Vec3, reach: f32) -> Self {
        let radius = (reach + TURN * middle.length()) * (1.0 + WIDER);
        Ball { middle, radius_squared: radius * radius }
    }

    /// A bit for each line through the origin that touches the ball: with `d = (x, y, 1)`, `|middle × d| <= radius · |d|`.
    #[inline]
    fn touches(&self, [x, y]: [&[f32; LANES]; 2]) -> u32 {
        let q = self.middle;
        let distances_squared: [f32; LANES] = std::array::from_fn(|lane| {
            let (x, y) = (x[lane], y[lane]);
            let across = [q.y - q.z * y, q.z * x - q.x, q.x * y - q.y * x];
            across[0] * across[0] + across[1] * across[1] + across[2] * across[2]
        });
        let limits = std::array::from_fn(|lane| {
            let (x, y) = (x[lane], y[lane]);
            self.radius_squared * (1.0 + x * x + y * y)
        });
        mask::at_most(&distances_squared, &limits)
    }
}
