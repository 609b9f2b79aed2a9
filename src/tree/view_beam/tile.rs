use crate::math::{mask, FourSegments};
use crate::tree::beam::{self, Beam, LANES};
use glam::{Vec3, Vec4};

/// Beams in a tile at most: a bit for each.
pub(super) const TILE: usize = 32;
const QUADS: usize = TILE / LANES;

/// Beams of a leaf, coordinate by coordinate, that one photon after another is tested against.
pub(super) struct Tile {
    quads: [FourSegments; QUADS],
    count: usize,
    /// Where the photon that is being tested projects on each, and its squared distances.
    t: [Vec4; QUADS],
    distance_squared: [Vec4; QUADS],
}

impl Tile {
    pub fn empty() -> Self {
        let nothing = [Vec4::ZERO; QUADS];
        Tile {
            quads: [FourSegments::EMPTY; QUADS],
            count: 0,
            t: nothing,
            distance_squared: nothing,
        }
    }

    /// Takes the beams at these places, one at least, instead of those it has.
    #[inline]
    pub fn gather(&mut self, beams: &[Beam], places: &[u32]) {
        for (quad, places) in self.quads.iter_mut().zip(places.chunks(LANES)) {
            *quad = FourSegments::new(beam::four(beams, places).map(|beam| &beam.segment));
        }
        self.count = places.len();
    }

    /// Calls `visit(which, t, distance_squared)` for the beams, in order, that make a pair with a photon; see
    /// [`super::ViewBeamTree::query`].
    #[inline]
    pub fn for_each_pair(
        &mut self,
        photon: Vec3,
        radius_squared: f32,
        mut visit: impl FnMut(usize, f32, f32),
    ) {
        let pairs = self.pairs(photon, radius_squared);
        mask::for_each_lane::<TILE>(pairs, |which| {
            let (quad, lane) = (which / LANES, which % LANES);
            visit(which, self.t[quad][lane], self.distance_squared[quad][lane]);
        });
    }

    /// A bit for each beam that makes a pair.
    #[inline]
    fn pairs(&mut self, photon: Vec3, radius_squared: f32) -> u32 {
        let mut pairs = 0;
        for quad in 0..self.count.div_ceil(LANES).min(QUADS) {
            let segments = &self.quads[quad];
            let (t, distance_squared) = segments.project(photon);
            let of_quad = beam::pairs(segments, t, distance_squared, radius_squared);
            pairs |= of_quad.bitmask() << (LANES * quad);
            (self.t[quad], self.distance_squared[quad]) = (t, distance_squared);
        }
        // In the last of four a beam may be repeated.
        pairs & u32::MAX >> (TILE - self.count)
    }
}
