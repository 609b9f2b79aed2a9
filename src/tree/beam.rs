use crate::math::{mask, Approach, FourSegments, Segment};
use glam::{BVec4A, Vec3, Vec4};

/// A segment and its index in the caller's slice; aligned so that a test touches one cache line.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub(super) struct Beam {
    pub segment: Segment,
    pub index: u32,
}

/// Beams that are tested at once.
pub(super) const LANES: usize = 4;

/// Calls `visit(beam, t, distance_squared)` for the beams at these places, in order, that make a pair with a photon; see
/// [`super::ViewBeamTree::query`].
#[inline]
pub(super) fn for_each_pair(
    beams: &[Beam],
    places: &[u32],
    photon: Vec3,
    radius_squared: f32,
    mut visit: impl FnMut(&Beam, f32, f32),
) {
    for places in places.chunks(LANES) {
        let four = four(beams, places);
        let segments = FourSegments::new(four.map(|beam| &beam.segment));
        let (t, distance_squared) = segments.project(photon);
        let are_pairs = pairs(&segments, t, distance_squared, radius_squared);
        mask::for_each_lane::<LANES>(distinct(are_pairs, places), |lane| {
            visit(four[lane], t[lane], distance_squared[lane]);
        });
    }
}

/// Calls `visit(beam, approach)` for the beams at these places, in order, that make a pair with a photon beam; see
/// [`super::ViewBeamTree::query_segment`].
#[inline]
pub(super) fn for_each_pair_along(
    beams: &[Beam],
    places: &[u32],
    photon_beam: &Segment,
    radius_squared: f32,
    mut visit: impl FnMut(&Beam, Approach),
) {
    for places in places.chunks(LANES) {
        let four = four(beams, places);
        let segments = FourSegments::new(four.map(|beam| &beam.segment));
        let all = segments.approach(photon_beam);
        let are_pairs = all.exist
            & all.distance_squared.cmplt(Vec4::splat(radius_squared))
            & all.t.cmpge(Vec4::ZERO)
            & all.t.cmplt(segments.length)
            & all.t_other.cmpge(Vec4::ZERO)
            & all.t_other.cmplt(Vec4::splat(photon_beam.length));
        mask::for_each_lane::<LANES>(distinct(are_pairs, places), |lane| {
            visit(four[lane], all.lane(lane));
        });
    }
}

/// Which of four beams make a pair with a photon, by its projections on them.
#[inline]
pub(super) fn pairs(
    segments: &FourSegments,
    t: Vec4,
    distance_squared: Vec4,
    radius_squared: f32,
) -> BVec4A {
    distance_squared.cmplt(Vec4::splat(radius_squared))
        & t.cmpge(Vec4::ZERO)
        & t.cmplt(segments.length)
}

/// The beams at up to four places, the last of them repeated.
#[inline]
pub(super) fn four<'a>(beams: &'a [Beam], places: &[u32]) -> [&'a Beam; LANES] {
    let last = places.len() - 1;
    std::array::from_fn(|lane| &beams[places[lane.min(last)] as usize])
}

/// The lanes that are set, without those in which [`four`] repeats a beam.
#[inline]
fn distinct(set: BVec4A, places: &[u32]) -> u32 {
    set.bitmask() & ((1 << places.len()) - 1)
}

/// Hands out the indices of beams in their order, and numbers them in that order from now on.
pub(super) fn take_order(beams: &mut [Beam]) -> Vec<u32> {
    (0..).zip(beams).map(|(place, beam)| std::mem::replace(&mut beam.index, place)).collect()
}
