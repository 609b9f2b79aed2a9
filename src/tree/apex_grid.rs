//! View beams through a pinhole: a grid over their directions.
//!
//! Lines that meet in one point are told apart by their directions alone, and a photon sees those within a disk of
//! directions around its own. So there is nothing to descend: the disk's box of cells is a few runs of neighbours in memory,
//! and what is found grows with what is looked at, however many beams there are.
//!
//! # Why no pair is lost
//!
//! Lines need not meet exactly: rays start on a near plane and a little behind boundaries. Every line is parallel to one through
//! the apex, at most `slack` beside it. If a photon is within `radius` of a beam, it is within `reach = radius + slack` (and
//! the roundings that [`super::ViewBeamTree`] allows for) of the line through the apex: the ball of that size around it
//! touches the line, whose slopes lie between those of the ball's tangents.

use super::beam::{self, Beam};
use super::heap_bytes;
use crate::math::Segment;
use glam::{DMat3, DVec3, Mat3, Vec3};

/// Beams per cell on average, width of a cell over its height, and cells along an axis at most. Cells of a row are read in one
/// go, so many narrow ones cost nothing, and few rows are sooner read than many.
const BEAMS_PER_CELL: f64 = 1.0;
const WIDTH_OVER_HEIGHT: f64 = 0.25;
const MAX_CELLS: f64 = 8192.0;
/// Slopes that are tested at once.
const LANES: usize = 8;
/// Beams that wait for their exact test.
const WAITING: usize = 64;
/// Share of a photon's distance by which the roundings of its place in the frame and of slopes may turn a line: twice the
/// sum of six roundings of the place per coordinate and six of the cross product.
const TURN: f32 = 32.0 * f32::EPSILON;
/// Fewer beams are not worth a structure of their own.
const FEW: usize = 64;
/// Cosine to the axis below which slopes are too steep to be told apart in single precision.
const MIN_COSINE: f64 = 0.05;
/// Share of the coordinates that lines may pass beside the apex: what rays are moved off boundaries, ten times over.
const MAX_SLACK: f64 = 1e-3;
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
    /// A grid over beams with their indices; none if they are few, do not meet in a point that they all come from, or look
    /// too far around.
    pub fn build(beams: &[(u32, Segment)]) -> Option<Self> {
        let holds = |segment: &Segment| segment.length > 0.0 && segment.is_finite();
        let beams: Vec<_> = beams.iter().copied().filter(|(_, s)| holds(s)).collect();
        if beams.len() < FEW {
            return None;
        }
        let apex = apex(&beams)?;
        let slack = slack(&beams, apex.as_dvec3())?;
        let axis = beams.iter().map(|(_, s)| s.direction.as_dvec3()).sum::<DVec3>().normalize();
        let (x, y) = axis.any_orthonormal_pair();
        // Rounded once: beams and photons are turned by the same matrix.
        let to_frame = DMat3::from_cols(x, y, axis).transpose().as_mat3();
        let mut slopes = Vec::with_capacity(beams.len());
        for (_, segment) in &beams {
            let d = to_frame.as_dmat3() * segment.direction.as_dvec3();
            if d.z.is_nan() || d.z < MIN_COSINE {
                return None;
            }
            slopes.push([(d.x / d.z) as f32, (d.y / d.z) as f32]);
        }
        let mut grid = ApexGrid {
            apex,
            to_frame,
            slack,
            max_origin: beams.iter().map(|(_, s)| s.origin.abs().max_element()).fold(0.0, f32::max),
            first: [0.0; 2],
            scale: [0.0; 2],
            cells: [1; 2],
            starts: Vec::new(),
            beams: Vec::new(),
            slopes: [Vec::new(), Vec::new()],
        };
        grid.lay_out(&slopes);
        grid.sort(&beams, &slopes);
        Some(grid)
    }

    /// Chooses the cells.
    fn lay_out(&mut self, slopes: &[[f32; 2]]) {
        let bound = |axis: usize, from: f32, pick: fn(f32, f32) -> f32| {
            slopes.iter().map(|slope| slope[axis]).fold(from, pick)
        };
        let low = [0, 1].map(|axis| bound(axis, f32::INFINITY, f32::min));
        let high = [0, 1].map(|axis| bound(axis, f32::NEG_INFINITY, f32::max));
        let extent = [0, 1].map(|axis| f64::from(high[axis] - low[axis]).max(1e-6));
        let density = (slopes.len() as f64 / BEAMS_PER_CELL / (extent[0] * extent[1])).sqrt();
        let stretch = WIDTH_OVER_HEIGHT.sqrt();
        for (axis, per_slope) in [density / stretch, density * stretch].into_iter().enumerate() {
            self.cells[axis] = (extent[axis] * per_slope).ceil().clamp(1.0, MAX_CELLS) as usize;
            self.first[axis] = low[axis];
            self.scale[axis] = (self.cells[axis] as f64 / extent[axis]) as f32;
        }
    }

    fn sort(&mut self, beams: &[(u32, Segment)], slopes: &[[f32; 2]]) {
        let cells: Vec<usize> = slopes.iter().map(|&slope| self.cell(slope)).collect();
        self.starts = vec![0; self.cells[0] * self.cells[1] + 1];
        for &cell in &cells {
            self.starts[cell + 1] += 1;
        }
        for cell in 1..self.starts.len() {
            self.starts[cell] += self.starts[cell - 1];
        }
        let mut next = self.starts.clone();
        let (index, segment) = beams[0];
        self.beams = vec![Beam { segment, index }; beams.len()];
        self.slopes = [(); 2].map(|()| vec![0.0; beams.len() + LANES]);
        for ((&cell, &(index, segment)), slope) in cells.iter().zip(beams).zip(slopes) {
            let place = next[cell] as usize;
            self.beams[place] = Beam { segment, index };
            (self.slopes[0][place], self.slopes[1][place]) = (slope[0], slope[1]);
            next[cell] += 1;
        }
    }

    fn cell(&self, slope: [f32; 2]) -> usize {
        self.column(1, slope[1]) * self.cells[0] + self.column(0, slope[0])
    }

    /// The column or row of a slope, those at the edges for what lies beyond. Monotone in the slope.
    #[inline]
    fn column(&self, axis: usize, slope: f32) -> usize {
        let position = (slope - self.first[axis]) * self.scale[axis];
        (position.max(0.0) as usize).min(self.cells[axis] - 1)
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

    /// As [`super::ViewBeamTree::query`], pairs of the same bits, in the order of the cells.
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
            for &place in near {
                let beam = &self.beams[place as usize];
                if let Some((t, distance_squared)) = beam.pair(p, radius_squared) {
                    visit(beam.index, t, distance_squared);
                }
            }
        };
        let (mut near, mut waiting) = ([0; WAITING], 0);
        for row in rows[0]..=rows[1] {
            let mut first = self.starts[row * self.cells[0] + columns[0]] as usize;
            let end = self.starts[row * self.cells[0] + columns[1] + 1] as usize;
            while first < end {
                let left = LANES.min(end - first);
                let touched = ball.touches(self.slopes_from(first)) & ((1 << left) - 1);
                let lanes = &SET_LANES[touched as usize % SET_LANES.len()];
                let free = &mut near[waiting..waiting + LANES];
                for (place, lane) in free.iter_mut().zip(lanes) {
                    *place = first as u32 + lane;
                }
                waiting += touched.count_ones() as usize;
                if waiting > WAITING - LANES {
                    judge(&near[..waiting]);
                    waiting = 0;
                }
                first += LANES;
            }
        }
        judge(&near[..waiting]);
    }

    #[inline]
    fn slopes_from(&self, first: usize) -> [&[f32; LANES]; 2] {
        let lanes = |axis: usize| self.slopes[axis][first..].first_chunk();
        [0, 1].map(|axis| lanes(axis).expect("slopes are followed by as many zeros"))
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
            let edges =
                [self.first[axis], self.first[axis] + self.cells[axis] as f32 / self.scale[axis]];
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

    /// Checks every invariant that a query relies on and describes the first violation.
    pub fn validate(&self) -> Result<(), String> {
        if self.slopes.iter().any(|slopes| slopes.len() != self.beams.len() + LANES) {
            return Err("slopes are not as many as beams and lanes".into());
        }
        if self.starts.len() != self.cells[0] * self.cells[1] + 1
            || self.starts.first() != Some(&0)
            || self.starts.last().map(|&end| end as usize) != Some(self.beams.len())
        {
            return Err(format!("{} starts for {:?} cells", self.starts.len(), self.cells));
        }
        for cell in 0..self.starts.len() - 1 {
            if self.starts[cell] > self.starts[cell + 1] {
                return Err(format!("cell {cell} ends before it starts"));
            }
            for place in self.starts[cell] as usize..self.starts[cell + 1] as usize {
                self.check(cell, place)?;
            }
        }
        Ok(())
    }

    fn check(&self, cell: usize, place: usize) -> Result<(), String> {
        let segment = &self.beams[place].segment;
        let d = self.to_frame.as_dmat3() * segment.direction.as_dvec3();
        let slope = [(d.x / d.z) as f32, (d.y / d.z) as f32];
        let (column, row) = (cell % self.cells[0], cell / self.cells[0]);
        let near = |axis: usize, at: usize| {
            let wider = WIDER * (1.0 + slope[axis].abs());
            (self.column(axis, slope[axis] - wider)..=self.column(axis, slope[axis] + wider))
                .contains(&at)
        };
        let (beside, behind) = offsets(segment, self.apex.as_dvec3());
        let stored = [0, 1].map(|axis| self.slopes[axis][place]);
        if stored != slope {
            return Err(format!("a beam of slope {slope:?} is listed with {stored:?}"));
        }
        if !(near(0, column) && near(1, row)) {
            return Err(format!("a beam of slope {slope:?} lies in cell {column}, {row}"));
        }
        if beside.max(behind) > f64::from(self.slack) {
            return Err(format!(
                "a line passes {beside} beside the apex, and starts {behind} behind"
            ));
        }
        Ok(())
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
        let touches: [bool; LANES] = std::array::from_fn(|lane| {
            let (x, y) = (x[lane], y[lane]);
            let across = [q.y - q.z * y, q.z * x - q.x, q.x * y - q.y * x];
            let distance_squared =
                across[0] * across[0] + across[1] * across[1] + across[2] * across[2];
            distance_squared <= self.radius_squared * (1.0 + x * x + y * y)
        });
        let bit = |(lane, &touches): (usize, &bool)| u32::from(touches) << lane;
        touches.iter().enumerate().map(bit).fold(0, |mask, bit| mask | bit)
    }
}

/// For each set of lanes, those in it, in order, before the others' zeros.
static SET_LANES: [[u32; LANES]; 1 << LANES] = {
    let mut sets = [[0; LANES]; 1 << LANES];
    let mut set = 0;
    while set < sets.len() {
        let (mut lane, mut count) = (0, 0);
        while lane < LANES {
            if set >> lane & 1 == 1 {
                sets[set][count] = lane as u32;
                count += 1;
            }
            lane += 1;
        }
        set += 1;
    }
    sets
};

/// Slopes of the two lines through the origin that touch a circle; none where it reaches the plane of the origin.
#[inline]
fn tangents(x: f32, z: f32, radius: f32) -> Option<[f32; 2]> {
    if z <= radius * (1.0 + WIDER) {
        return None;
    }
    let touching = radius * (x * x + (z - radius) * (z + radius)).sqrt();
    let scale = 1.0 / ((z - radius) * (z + radius));
    Some([(x * z - touching) * scale, (x * z + touching) * scale])
}

/// The point nearest to all lines, in the least squares.
fn apex(beams: &[(u32, Segment)]) -> Option<Vec3> {
    // Relative to one of them, so that far from the world's origin no digits are lost.
    let base = beams[0].1.origin.as_dvec3();
    let (mut matrix, mut vector) = (DMat3::ZERO, DVec3::ZERO);
    for (_, segment) in beams {
        let d = segment.direction.as_dvec3();
        let across = DMat3::IDENTITY - DMat3::from_cols(d.x * d, d.y * d, d.z * d);
        matrix += across;
        vector += across * (segment.origin.as_dvec3() - base);
    }
    let apex = base + matrix.inverse() * vector;
    apex.is_finite().then_some(apex.as_vec3())
}

/// How far the lines are from the apex at most, and how far behind it beams start.
fn slack(beams: &[(u32, Segment)], apex: DVec3) -> Option<f32> {
    let size = |segment: &Segment| f64::from(segment.origin.abs().max_element());
    let largest = beams.iter().map(|(_, s)| size(s)).fold(apex.abs().max_element(), f64::max);
    let mut slack = 0.0f64;
    for (_, segment) in beams {
        let (beside, behind) = offsets(segment, apex);
        slack = slack.max(beside).max(behind);
    }
    (slack <= MAX_SLACK * (1.0 + largest)).then_some((slack * (1.0 + 1e-6)) as f32)
}

/// How far a line passes beside a point, and how far behind it the segment starts.
fn offsets(segment: &Segment, apex: DVec3) -> (f64, f64) {
    let d = segment.direction.as_dvec3().normalize();
    let from_apex = segment.origin.as_dvec3() - apex;
    let along = from_apex.dot(d);
    ((from_apex - along * d).length(), -along)
}
