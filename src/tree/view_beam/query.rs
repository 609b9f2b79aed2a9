use glam::Vec3;

use super::packet::Packet;
use super::tile::{Tile, TILE};
use super::{Leaf, ViewBeamTree};
use crate::math::mask;
use crate::tree::MAX_DEPTH;

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
        let radius_squared = radius * radius;
        let mut tile = Tile::empty();
        for (number, places) in places.chunks(LANES).enumerate() {
            let packet = Packet::<LANES>::new(places, |p| self.reach(p, radius));
            self.for_each_leaf(&packet, |leaf, near| {
                let mut visit = |lane, index, t, d2| visit(number * LANES + lane, index, t, d2);
                for beams in self.references[leaf.range()].chunks(TILE) {
                    tile.gather(&self.beams, beams);
                    mask::for_each_lane::<LANES>(near, |lane| {
                        tile.for_each_pair(places[lane], radius_squared, |which, t, d2| {
                            let beam = &self.beams[beams[which] as usize];
                            if leaf.cell.owns(beam.segment.at(t)) {
                                visit(lane, beam.index, t, d2);
                            }
                        });
                    });
                }
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

    /// Calls `visit` for the leaves that photons of a packet reach, with a bit for each of these.
    #[inline]
    fn for_each_leaf<const LANES: usize>(
        &self,
        packet: &Packet<LANES>,
        mut visit: impl FnMut(&Leaf, u32),
    ) {
        let mut postponed = [(0_u32, 0_u32); MAX_DEPTH];
        let mut waiting = 0;
        let (mut current, mut here) = (0, u32::MAX);
        loop {
            let node = self.nodes[current];
            if !node.is_leaf() {
                let (left, right) = (current + 1, node.target());
                let [to_left, to_right] =
                    packet.sides(node.axis(), node.plane).map(|side| side & here);
                if to_left != 0 && to_right != 0 {
                    postponed[waiting] = (right as u32, to_right);
                    waiting += 1;
                }
                (current, here) = if to_left != 0 { (left, to_left) } else { (right, to_right) };
                continue;
            }
            let leaf = &self.leaves[node.target()];
            let near = here & packet.reaching(&leaf.bounds);
            if near != 0 {
                visit(leaf, near);
            }
            if waiting == 0 {
                return;
            }
            waiting -= 1;
            let (next, those) = postponed[waiting];
            (current, here) = (next as usize, those);
        }
    }
}
