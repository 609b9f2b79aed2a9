//! The map of photon beams, asked by view beams [Jarosz 2011].

use super::bvh::{Bvh, Stats};
use crate::math::{Aabb, Approach, Segment};

/// Pieces that long beams are cut into, per beam on average; there are at most this many and one
/// more. Boxes have an eighth of the surface of whole beams; time to build and memory grow in
/// proportion.
const PIECES_PER_BEAM: f64 = 8.0;

/// Photon beams in a hierarchy that finds those within a radius of a view beam.
///
/// The dual of [`ViewBeamTree::query_segment`]: it has the same pairs, but holds the beams of one
/// pass. Coordinates and radii are in scene units.
///
/// The box of a beam is mostly empty, so beams are cut into pieces with boxes of their own. A pair
/// belongs to the piece whose half-open range of parameters holds the closest point, so it is found
/// once.
///
/// [`ViewBeamTree::query_segment`]: super::ViewBeamTree::query_segment
#[derive(Clone, Debug)]
pub struct PhotonBeams {
    bvh: Bvh,
    /// In the order of the leaves.
    pieces: Vec<Piece>,
    non_finite: usize,
    empty: usize,
}

/// The part of a photon beam with parameters in `[start, end)`.
#[derive(Clone, Copy, Debug)]
struct Piece {
    /// All of the beam: whose piece it is makes no difference to the bits of a pair.
    beam: Segment,
    start: f32,
    end: f32,
    /// In the caller's slice.
    index: u32,
}

impl PhotonBeams {
    /// Builds over the photon beams of a pass.
    ///
    /// Segments that are not finite or hold no point have no pairs and are left out;
    /// [`PhotonBeams::non_finite`] and [`PhotonBeams::empty`] count them. The result does not depend
    /// on the number of threads.
    ///
    /// # Panics
    ///
    /// If there are more than `u32::MAX` pieces, of which each segment makes 9 on average.
    pub fn build(segments: &[Segment]) -> Self {
        assert!(u32::try_from(segments.len()).is_ok(), "{} beams exceed 32 bits", segments.len());
        let non_finite = segments.iter().filter(|segment| !segment.is_finite()).count();
        let kept: Vec<_> = (0..)
            .zip(segments)
            .filter(|(_, segment)| segment.is_finite() && segment.length > 0.0)
            .collect();
        let total: f64 = kept.iter().map(|(_, segment)| emptiness(segment)).sum();
        let pieces_per_emptiness = PIECES_PER_BEAM * kept.len() as f64 / total;
        let mut pieces = Vec::with_capacity((PIECES_PER_BEAM + 1.0) as usize * kept.len());
        for &(index, &beam) in &kept {
            // Without any emptiness this is NaN, which the cast sends to 0.
            let count = (emptiness(&beam) * pieces_per_emptiness).ceil() as u32;
            pieces.extend(cut(beam, index, count.max(1)));
        }
        let boxes: Vec<_> = pieces.iter().map(Piece::bounds).collect();
        let bvh = Bvh::build(&boxes);
        let pieces = bvh.order().iter().map(|&position| pieces[position as usize]).collect();
        Self { bvh, pieces, non_finite, empty: segments.len() - kept.len() - non_finite }
    }

    /// Calls `visit(index, approach)` once for every photon beam that contributes to `view_beam`: the
    /// approach from the view beam exists, `t` and `t_other` fall on the beams, and the distance is
    /// below `radius` (scene units), as computed by [`Segment::approach`].
    ///
    /// Pair by pair what [`ViewBeamTree::query_segment`] finds, to the last bit; the order is that
    /// of the leaves. A view beam that is not finite has no pairs, and if `radius` is NaN or `<= 0`
    /// there are none.
    ///
    /// [`ViewBeamTree::query_segment`]: super::ViewBeamTree::query_segment
    #[inline]
    pub fn query(&self, view_beam: &Segment, radius: f32, mut visit: impl FnMut(u32, Approach)) {
        if !view_beam.is_finite() || radius.is_nan() || radius <= 0.0 {
            return;
        }
        let radius_squared = radius * radius;
        self.bvh.for_each_leaf(view_beam, radius, |leaf| {
            for piece in &self.pieces[leaf] {
                let Some(approach) = view_beam.approach(&piece.beam) else {
                    continue;
                };
                let is_pair = (approach.distance_squared < radius_squared)
                    & (approach.t >= 0.0)
                    & (approach.t < view_beam.length)
                    & (approach.t_other >= piece.start)
                    & (approach.t_other < piece.end);
                if is_pair {
                    visit(piece.index, approach);
                }
            }
        });
    }

    /// Counts of pieces (as boxes), nodes and leaves.
    pub fn stats(&self) -> Stats {
        self.bvh.stats()
    }

    /// Beams left out because a coordinate, the length or the end point is NaN or infinite.
    pub fn non_finite(&self) -> usize {
        self.non_finite
    }

    /// Beams left out because they hold no point (`length <= 0`).
    pub fn empty(&self) -> usize {
        self.empty
    }

    /// Bytes on the heap.
    pub fn memory_bytes(&self) -> usize {
        self.bvh.memory_bytes() + size_of_val(&self.pieces[..])
    }
}

/// The side of a square as large as half the surface of the beam's box.
///
/// n pieces of a beam have 1/n of that surface in all, and lines meet boxes in proportion to their
/// surface. For a given number of pieces over all beams the sum is least where each beam's number is
/// in proportion to the root of its surface: long oblique beams are cut, those along an axis are not.
fn emptiness(segment: &Segment) -> f64 {
    let d = segment.direction.as_dvec3().abs();
    f64::from(segment.length) * (d.x * d.y + d.y * d.z + d.z * d.x).sqrt()
}

/// Cuts a beam into `count` pieces of equal length, up to rounding; neighbours share the bits of
/// their boundary.
fn cut(beam: Segment, index: u32, count: u32) -> impl Iterator<Item = Piece> {
    let boundary = move |number: u32| {
        let share = f64::from(number) / f64::from(count);
        (share * f64::from(beam.length)) as f32
    };
    (0..count).map(move |number| Piece {
        beam,
        start: boundary(number),
        end: boundary(number + 1),
        index,
    })
}

impl Piece {
    /// Holds [`Segment::at`] of all parameters, which is monotone in each coordinate.
    fn bounds(&self) -> Aabb {
        let mut bounds = Aabb::EMPTY;
        bounds.grow(self.beam.at(self.start));
        bounds.grow(self.beam.at(self.end));
        bounds
    }
}
