use super::build::{LARGE_LEAF, MAX_LEVELS};
use super::{Bvh, Node};
use crate::math::Aabb;

impl Bvh {
    /// Checks every invariant that [`Bvh::query`] relies on, given the boxes that it was built from,
    /// and describes the first violation.
    ///
    /// Leaves list each finite box once, in order; the box of every child holds what lies below it;
    /// counts and bounds add up; the stack of a query is deep enough. For tests.
    pub fn validate(&self, boxes: &[Aabb]) -> Result<(), String> {
        let mut listed = self.order.clone();
        listed.sort_unstable();
        if listed.windows(2).any(|pair| pair[0] == pair[1]) {
            return Err("a box is listed twice".into());
        }
        if listed.len() != self.stats.boxes
            || self.stats.boxes + self.stats.non_finite != boxes.len()
        {
            return Err(format!("{} boxes are listed, stats say {:?}", listed.len(), self.stats));
        }
        let mut walk = Walk::default();
        let bounds = match self.nodes.is_empty() {
            true => Aabb::EMPTY,
            false => self.check_node(0, 1, boxes, &mut walk)?,
        };
        let counted = (walk.nodes, walk.leaves, walk.largest_leaf, walk.depth, walk.listed);
        let stats = self.stats;
        let stored = (stats.nodes, stats.leaves, stats.largest_leaf, stats.depth, stats.boxes);
        if counted != stored || walk.nodes != self.nodes.len() || bounds != self.bounds {
            return Err(format!("walk finds {walk:?} in {bounds:?}, tree stores {self:?}"));
        }
        Ok(())
    }

    /// Returns the box of all that lies below.
    fn check_node(
        &self,
        position: usize,
        level: usize,
        boxes: &[Aabb],
        walk: &mut Walk,
    ) -> Result<Aabb, String> {
        if position != walk.nodes || position >= self.nodes.len() || level > MAX_LEVELS {
            return Err(format!("node {position}, met as number {}, level {level}", walk.nodes));
        }
        walk.nodes += 1;
        walk.depth = walk.depth.max(level);
        let node = &self.nodes[position];
        let mut whole = Aabb::EMPTY;
        for slot in 0..4 {
            let (first, count) = (node.first[slot] as usize, node.count[slot]);
            let held = match count {
                0 => Aabb::EMPTY,
                Node::INTERIOR => self.check_node(first, level + 1, boxes, walk)?,
                _ => self.check_leaf(first, count as usize, boxes, walk)?,
            };
            let stored = node.child_bounds(slot);
            if stored != held {
                return Err(format!("child {slot} of {position}: {stored:?} is not {held:?}"));
            }
            whole = whole.union(&stored);
        }
        Ok(whole)
    }

    fn check_leaf(
        &self,
        first: usize,
        count: usize,
        boxes: &[Aabb],
        walk: &mut Walk,
    ) -> Result<Aabb, String> {
        let listed = self.order.get(first..first + count);
        let Some(listed) = listed.filter(|_| count <= LARGE_LEAF) else {
            return Err(format!("a leaf lists {count} boxes from {first}"));
        };
        walk.leaves += 1;
        walk.listed += count;
        walk.largest_leaf = walk.largest_leaf.max(count);
        let grow = |whole: Aabb, &index: &u32| whole.union(&boxes[index as usize]);
        Ok(listed.iter().fold(Aabb::EMPTY, grow))
    }
}

impl Node {
    fn child_bounds(&self, slot: usize) -> Aabb {
        let corner = |side: usize| self.corners[side].map(|coordinates| coordinates[slot]).into();
        Aabb { min: corner(0), max: corner(1) }
    }
}

/// What a depth-first walk has met so far.
#[derive(Debug, Default)]
struct Walk {
    nodes: usize,
    leaves: usize,
    listed: usize,
    largest_leaf: usize,
    depth: usize,
}
