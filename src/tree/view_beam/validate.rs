use std::ops::Range;

use rayon::prelude::*;

use super::{Beam, Leaf, ViewBeamTree};
use crate::math::Aabb;

impl ViewBeamTree {
    /// Checks every invariant that [`ViewBeamTree::query`] relies on and describes the first
    /// violation.
    ///
    /// Nodes and leaves lie in depth-first order, planes cut the inside of their cells, leaves hold
    /// the cells that the planes make, the counts add up, and each leaf lists all beams that have a
    /// closest point to own there. The last is decided for every single-precision `t`, without the
    /// error bounds of the build. For tests: this takes longer than to build the tree.
    pub fn validate(&self) -> Result<(), String> {
        let mut walk = Walk::default();
        self.check_node(0, &Aabb::UNBOUNDED, 0, &mut walk)?;
        let counted = [walk.nodes, walk.leaves, walk.references, walk.largest_leaf, walk.depth];
        let stored = [
            self.nodes.len(),
            self.leaves.len(),
            self.references.len(),
            walk.largest_leaf,
            walk.depth,
        ];
        let stats = self.stats;
        let reported =
            [stats.nodes, stats.leaves, stats.references, stats.largest_leaf, stats.depth];
        if counted != stored || counted != reported || stats.beams != self.beams.len() {
            return Err(format!(
                "walk counts {counted:?}, tree stores {stored:?}, stats say {stats:?}"
            ));
        }
        (0..self.beams.len() as u32)
            .into_par_iter()
            .try_for_each(|position| self.check_beam(position))
    }

    fn check_node(
        &self,
        position: usize,
        cell: &Aabb,
        depth: usize,
        walk: &mut Walk,
    ) -> Result<(), String> {
        if position != walk.nodes || position >= self.nodes.len() {
            return Err(format!(
                "node {position} met as number {} of {}",
                walk.nodes,
                self.nodes.len()
            ));
        }
        walk.nodes += 1;
        walk.depth = walk.depth.max(depth);
        let node = self.nodes[position];
        if node.is_leaf() {
            return self.check_leaf(node.target(), cell, walk);
        }
        let (axis, plane) = (node.axis(), node.plane);
        if !(cell.min[axis] < plane && plane < cell.max[axis]) {
            return Err(format!(
                "node {position} has its plane {plane} on axis {axis} outside {cell:?}"
            ));
        }
        let (mut left, mut right) = (*cell, *cell);
        left.max[axis] = plane;
        right.min[axis] = plane;
        self.check_node(position + 1, &left, depth + 1, walk)?;
        self.check_node(node.target(), &right, depth + 1, walk)
    }

    fn check_leaf(&self, position: usize, cell: &Aabb, walk: &mut Walk) -> Result<(), String> {
        let Some(leaf) = self.leaves.get(position).filter(|_| position == walk.leaves) else {
            return Err(format!(
                "leaf {position} met as number {} of {}",
                walk.leaves,
                self.leaves.len()
            ));
        };
        if leaf.cell != *cell {
            return Err(format!("leaf {position} holds {:?}, its planes make {cell:?}", leaf.cell));
        }
        if leaf.first as usize != walk.references || leaf.range().end > self.references.len() {
            return Err(format!(
                "leaf {position} lists {:?}, expected from {}",
                leaf.range(),
                walk.references
            ));
        }
        let listed = &self.references[leaf.range()];
        let ascends = listed.windows(2).all(|pair| pair[0] < pair[1]);
        if !ascends || listed.last().is_some_and(|&last| last as usize >= self.beams.len()) {
            return Err(format!("leaf {position} lists beams out of order or range: {listed:?}"));
        }
        walk.leaves += 1;
        walk.references += listed.len();
        walk.largest_leaf = walk.largest_leaf.max(listed.len());
        Ok(())
    }

    /// Descends with all parameters of one beam to the leaves that own their points.
    fn check_beam(&self, position: u32) -> Result<(), String> {
        let beam = &self.beams[position as usize];
        // Non-negative floats sort like their bits, so a range of bits is a range of parameters.
        let mut open = vec![(0, 0..beam.segment.length.to_bits())];
        while let Some((current, parameters)) = open.pop() {
            if parameters.is_empty() {
                continue;
            }
            let node = self.nodes[current];
            if node.is_leaf() {
                self.check_owner(&self.leaves[node.target()], position, parameters)?;
                continue;
            }
            let (left, right) = beam.divide(parameters, node.axis(), node.plane);
            open.push((current + 1, left));
            open.push((node.target(), right));
        }
        Ok(())
    }

    fn check_owner(
        &self,
        leaf: &Leaf,
        position: u32,
        parameters: Range<u32>,
    ) -> Result<(), String> {
        let segment = &self.beams[position as usize].segment;
        let (first, last) = (f32::from_bits(parameters.start), f32::from_bits(parameters.end - 1));
        if self.references[leaf.range()].binary_search(&position).is_err() {
            return Err(format!("{segment:?}, t from {first} to {last}, is missing in {leaf:?}"));
        }
        let held =
            |t| leaf.cell.owns(segment.at(t)) && leaf.bounds.is_within_reach(segment.at(t), 0.0);
        if !(held(first) && held(last)) {
            return Err(format!("{segment:?}, t from {first} to {last}, sticks out of {leaf:?}"));
        }
        Ok(())
    }
}

impl Beam {
    /// The parameters (as bits) that [`Segment::at`] puts on the left and on the right of a plane.
    ///
    /// [`Segment::at`]: crate::math::Segment::at
    fn divide(&self, parameters: Range<u32>, axis: usize, plane: f32) -> (Range<u32>, Range<u32>) {
        let is_left = |bits| self.segment.at(f32::from_bits(bits))[axis] < plane;
        let starts_left = is_left(parameters.start);
        let (mut low, mut high) = (parameters.start, parameters.end);
        while low < high {
            let middle = low + (high - low) / 2;
            if is_left(middle) == starts_left {
                low = middle + 1;
            } else {
                high = middle;
            }
        }
        let (first, second) = (parameters.start..low, low..parameters.end);
        if starts_left {
            (first, second)
        } else {
            (second, first)
        }
    }
}

/// What a depth-first walk has met so far.
#[derive(Default)]
struct Walk {
    nodes: usize,
    leaves: usize,
    references: usize,
    largest_leaf: usize,
    depth: usize,
}
