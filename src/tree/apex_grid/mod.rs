//! View beams through a pinhole: a grid over their directions.
//!
//! Lines that meet in one point are told apart by their directions alone, and a photon sees those within a disk of
//! directions around its own. So there is nothing to descend: the disk's box of cells is a few runs of neighbours in memory,
//! and what is found grows with what is looked at, however many beams there are. A photon beam sees those within a band of
//! directions: it is splatted row by row, as a line is drawn in an image.
//!
//! # Why no pair is lost
//!
//! Lines need not meet exactly: rays start on a near plane and a little behind boundaries. Every line is parallel to one through
//! the apex, at most `slack` beside it. If a photon is within `radius` of a beam, it is within `reach = radius + slack` (and
//! the roundings that [`crate::tree::ViewBeamTree`] allows for) of the line through the apex: the ball of that size around it
//! touches the line, whose slopes lie between those of the ball's tangents. For a photon beam this holds for the ball around
//! its end of the connection.

mod build;
mod candidates;
mod query;
mod query_segment;
mod tangents;
mod validate;

use super::beam::{self, Beam};
use super::heap_bytes;
use crate::math::Segment;
use glam::{Mat3, Vec3};

/// Slopes that are tested at once.
const LANES: usize = 8;
/// Share of a photon's distance by which the roundings of its place in the frame and of slopes may turn a line: twice the
/// sum of six roundings of the place per coordinate and six of the cross product.
const TURN: f32 = 32.0 * f32::EPSILON;
/// Share by which a ball and its slopes are widened for the roundings of single precision.
const WIDER: f32 = 1e-5;

/// A grid over the slopes of beams whose lines meet in one point.
#[derive(Clone, Debug)]
pub struct ApexGrid {
    apex: Vec3,
    /// From the world to a frame whose z axis is the mean direction.
    to_frame: Mat3,
    /// Largest distance of a line from the apex, and how far behind it a beam may start [length].
    slack: f32,
    /// Largest absolute coordinate of any origin.
    max_origin: f32,
    /// By axis: slope at the first cell's edge, cells per slope, cells.
    first: [f32; 2],
    scale: [f32; 2],
    cells: [usize; 2],
    /// First beam of every cell, row by row, and the end.
    starts: Vec<u32>,
    /// By cell.
    beams: Vec<Beam>,
    /// By axis, the slopes of the beams; and zeros, so that there are always [`LANES`].
    slopes: [Vec<f32>; 2],
}

impl ApexGrid {
    fn cell(&self, slope: [f32; 2]) -> usize {
        self.column(1, slope[1]) * self.cells[0] + self.column(0, slope[0])
    }

    /// The column or row of a slope, those at the edges for what lies beyond. Monotone in the slope.
    #[inline]
    fn column(&self, axis: usize, slope: f32) -> usize {
        let position = (slope - self.first[axis]) * self.scale[axis];
        (position.max(0.0) as usize).min(self.cells[axis] - 1)
    }

    /// Slopes of the grid's outermost edges along an axis.
    #[inline]
    fn edges(&self, axis: usize) -> [f32; 2] {
        [self.first[axis], self.edge(axis, self.cells[axis])]
    }

    /// Slope at which a column or row begins.
    #[inline]
    fn edge(&self, axis: usize, number: usize) -> f32 {
        self.first[axis] + number as f32 / self.scale[axis]
    }

    /// Beams in the grid.
    pub fn len(&self) -> usize {
        self.beams.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.beams.is_empty()
    }

    /// Bytes on the heap.
    pub fn memory_bytes(&self) -> usize {
        heap_bytes(&self.starts)
            + heap_bytes(&self.beams)
            + self.slopes.iter().map(heap_bytes).sum::<usize>()
    }

    /// Hands out the indices of the beams in the order of the cells, and numbers them in that order from now on.
    pub fn take_order(&mut self) -> Vec<u32> {
        beam::take_order(&mut self.beams)
    }

    /// A beam by its number, once the grid has numbered them.
    #[inline]
    pub fn segment(&self, place: u32) -> &Segment {
        &self.beams[place as usize].segment
    }

    /// The cell of the line through a point; photons in this order find the same beams one after another.
    #[inline]
    pub fn place(&self, p: Vec3) -> u32 {
        let q = self.to_frame * (p - self.apex);
        self.cell([q.x / q.z, q.y / q.z]) as u32
    }
}
