use glam::Vec3;

use super::packet::Packet;
use super::tile::{Tile, TILE};
use super::{Leaf, ViewBeamTree};
use crate::math::mask;

/// Photons that go down the tree together.
const TOGETHER: usize = 16;
/// Room for one that goes alone: fewer lanes are not compared at once.
const ALONE: usize = 4;

impl ViewBeamTree {
    /// Calls `visit(index, t, distance_squared)` once for every beam that the photon at `p`
    /// contributes to.
    ///
    /// That is, the orthogonal projection of `p` on the beam's line falls on the beam, `t` in `[0,
    /// length)`, and the distance to it is below `radius` (scene units), both as computed by
    /// [`Segment::project`]. There are no end caps: the kernel lives on the plane normal to the
    /// beam. The order of the calls is that of the leaves. If `p` or `radius` is NaN, or `radius <=
    /// 0`, there are none.
    ///
    /// [`Segment::project`]: crate::math::Segment::project
    #[inline]
    pub fn query(&self, p: Vec3, radius: f32, mut visit: impl FnMut(u32, f32, f32)) {
        self.query_packets::<ALONE>(&[p], radius, |_, index, t, distance_squared| {
            visit(index, t, distance_squared);
        });
    }

    /// For many photons, neighbours in space one after another: calls `visit(which, index, t, distance_squared)` for every
    /// beam that the photon at `places[which]` contributes to, in the order in which [`ViewBeamTree::query`] meets them.
    /// Neighbours take their calls in turns: they go down the tree together.
    #[inline]
    pub fn query_all(&self, places: &[Vec3], radius: f32, visit: impl FnMut(usize, u32, f32, f32)) {
        self.query_packets::<TOGETHER>(places, radius, visit);
    }

    #[inline]
    fn query_packets<const LANES: usize>(
        &self,
        places: &[Vec3],
        radius: f32,
        mut visit: impl FnMut(usize, u32, f32, f32),
    ) {
        if radius.is_nan() || radius <= 0.0 {
            return;
        }
        let mut tile = Tile::empty();
        for (number, places) in places.chunks(LANES).enumerate() {
            let packet = Packet::<LANES>::new(places, radius, |p| self.reach(p, radius));
            let divide = |part, axis, plane| packet.divide(part, axis, plane);
            self.descend(u32::MAX, divide, |leaf, part| {
                self.visit_owned_by_packet(leaf, &packet, part, &mut tile, |lane, index, t, d2| {
                    visit(number * LANES + lane, index, t, d2);
                });
            });
        }
    }

    /// The pairs that a leaf owns with a part of a packet's photons.
    #[inline]
    fn visit_owned_by_packet<const LANES: usize>(
        &self,
        leaf: &Leaf,
        packet: &Packet<LANES>,
        part: u32,
        tile: &mut Tile,
        mut visit: impl FnMut(usize, u32, f32, f32),
    ) {
        let near = part & packet.reaching(&leaf.bounds);
        if near == 0 {
            return;
        }
        for beams in self.references[leaf.range()].chunks(TILE) {
            tile.gather(&self.beams, beams);
            mask::for_each_lane::<LANES>(near, |lane| {
                tile.for_each_pair(packet.places[lane], packet.radius_squared, |which, t, d2| {
                    let beam = &self.beams[beams[which] as usize];
                    if leaf.cell.owns(beam.segment.at(t)) {
                        visit(lane, beam.index, t, d2);
                    }
                });
            });
        }
    }

    /// `radius`, widened by what rounding may put between a photon and the closest point that owns
    /// its pair.
    ///
    /// With u = ε/2 and per coordinate: `project` computes `r = fl(fl(p − o) − fl(t·d))`, `at`
    /// computes `c = fl(o + fl(t·d))` from the same product, hence `|p − c| <= (|r| + u(2|p| +
    /// |o|))(1 + 5u)`. A pair has `fl(r²) < fl(radius²)`, so `|r| < radius`. Twice the bound
    /// absorbs the rounding of this function, and `u(|p| + reach)` of the ends of what a photon
    /// reaches.
    #[inline]
    fn reach(&self, p: Vec3, radius: f32) -> f32 {
        radius + 2.0 * f32::EPSILON * (p.abs().max_element() + self.max_origin + 3.0 * radius)
    }
}
