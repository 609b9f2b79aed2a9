use super::{ApexGrid, Beam, LANES};
use crate::math::Segment;
use glam::{DMat3, DVec3, Vec3};
use rayon::prelude::*;

/// Beams per cell on average, width of a cell over its height, and cells along an axis at most. Cells of a row are read in one
/// go, so many narrow ones cost nothing, and few rows are sooner read than many.
const BEAMS_PER_CELL: f64 = 1.0;
const WIDTH_OVER_HEIGHT: f64 = 0.25;
const MAX_CELLS: f64 = 8192.0;
/// Beams that a thread looks at in one go; it takes long to wake others for fewer.
const PER_TASK: usize = 1 << 15;
/// Fewer beams are not worth a structure of their own.
const FEW: usize = 64;
/// Cosine to the axis below which slopes are too steep to be told apart in single precision.
const MIN_COSINE: f64 = 0.05;
/// Share of the coordinates that lines may pass beside the apex: what rays are moved off boundaries, ten times over.
const MAX_SLACK: f64 = 1e-3;

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
        let slopes = slopes(&beams, to_frame.as_dmat3())?;
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
}

/// How directions lean to either side of the axis, in the frame; none where one leans too far.
fn slopes(beams: &[(u32, Segment)], to_frame: DMat3) -> Option<Vec<[f32; 2]>> {
    let slopes = beams.par_iter().with_min_len(PER_TASK).map(|(_, segment)| {
        let d = to_frame * segment.direction.as_dvec3();
        (d.z >= MIN_COSINE).then_some([(d.x / d.z) as f32, (d.y / d.z) as f32])
    });
    slopes.collect()
}

/// The point nearest to all lines, in the least squares.
fn apex(beams: &[(u32, Segment)]) -> Option<Vec3> {
    // Relative to one of them, so that far from the world's origin no digits are lost.
    let base = beams[0].1.origin.as_dvec3();
    let of_beam = |(_, segment): &(u32, Segment)| {
        let d = segment.direction.as_dvec3();
        let across = DMat3::IDENTITY - DMat3::from_cols(d.x * d, d.y * d, d.z * d);
        (across, across * (segment.origin.as_dvec3() - base))
    };
    let plus = |a: (DMat3, DVec3), b: (DMat3, DVec3)| (a.0 + b.0, a.1 + b.1);
    let nothing = (DMat3::ZERO, DVec3::ZERO);
    // Part by part, so that roundings are the same whatever the number of threads.
    let parts: Vec<_> = beams
        .par_chunks(PER_TASK)
        .map(|part| part.iter().map(of_beam).fold(nothing, plus))
        .collect();
    let (matrix, vector) = parts.into_iter().fold(nothing, plus);
    let apex = base + matrix.inverse() * vector;
    apex.is_finite().then_some(apex.as_vec3())
}

/// How far the lines are from the apex at most, and how far behind it beams start.
fn slack(beams: &[(u32, Segment)], apex: DVec3) -> Option<f32> {
    let size = |segment: &Segment| f64::from(segment.origin.abs().max_element());
    let largest = beams.iter().map(|(_, s)| size(s)).fold(apex.abs().max_element(), f64::max);
    let of_beam = |(_, segment): &(u32, Segment)| {
        let (beside, behind) = offsets(segment, apex);
        beside.max(behind)
    };
    let slack = beams.par_iter().with_min_len(PER_TASK).map(of_beam).reduce(|| 0.0, f64::max);
    (slack <= MAX_SLACK * (1.0 + largest)).then_some((slack * (1.0 + 1e-6)) as f32)
}

/// How far a line passes beside a point, and how far behind it the segment starts.
pub(super) fn offsets(segment: &Segment, apex: DVec3) -> (f64, f64) {
    let d = segment.direction.as_dvec3().normalize();
    let from_apex = segment.origin.as_dvec3() - apex;
    let along = from_apex.dot(d);
    ((from_apex - along * d).length(), -along)
}
