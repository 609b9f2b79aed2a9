//! A bounding volume hierarchy over boxes, four children to a node [Wald 2008].
//!
//! Photon maps are built for every pass and asked once per view beam: they want a tree that is quick
//! to build and cheap to walk with a ray. A node holds the boxes of its children side by side, so
//! that one walk step tests four of them at once.

mod build;
mod query;
mod validate;

use glam::Vec4;

use crate::math::Aabb;

/// A hierarchy over boxes that finds those within a radius of a segment.
///
/// Coordinates and radii are in scene units. Boxes keep the index they had in the slice given to
/// `build`; the boxes themselves are not kept.
#[derive(Clone, Debug)]
pub struct Bvh {
    /// Depth first; none if there is no box.
    nodes: Vec<Node>,
    /// Indices in the caller's slice, leaf by leaf.
    order: Vec<u32>,
    bounds: Aabb,
    stats: Stats,
}

/// What a [`Bvh`] is made of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Stats {
    /// Boxes in the hierarchy.
    pub boxes: usize,
    /// Boxes left out because a corner is NaN or infinite, or because they are empty.
    pub non_finite: usize,
    pub nodes: usize,
    pub leaves: usize,
    /// Boxes in the fullest leaf.
    pub largest_leaf: usize,
    /// Nodes between the root and the deepest leaf, the root included.
    pub depth: usize,
}

impl Bvh {
    /// Counts of boxes, nodes and leaves.
    pub fn stats(&self) -> Stats {
        self.stats
    }

    /// Indices in the caller's slice in the order of the leaves: what is stored in this order has
    /// the primitives of a leaf side by side.
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// Bytes on the heap.
    pub fn memory_bytes(&self) -> usize {
        size_of_val(&self.nodes[..]) + size_of_val(&self.order[..])
    }
}

/// Four children, component by component: two cache lines.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct Node {
    /// Least and greatest corner of each child's box, axis by axis.
    corners: [[Vec4; 3]; 2],
    /// Position of a child node in `nodes`, or of a leaf's first index in `order`.
    first: [u32; 4],
    /// Length of a leaf, 0 where there is no child, or [`Node::INTERIOR`].
    count: [u32; 4],
}

impl Node {
    const INTERIOR: u32 = u32::MAX;
    /// Without children; their empty boxes lie beyond all others.
    const CHILDLESS: Self = Self {
        corners: [[Vec4::INFINITY; 3], [Vec4::NEG_INFINITY; 3]],
        first: [0; 4],
        count: [0; 4],
    };

    fn set_child(&mut self, slot: usize, bounds: &Aabb, first: usize, count: u32) {
        for axis in 0..3 {
            self.corners[0][axis][slot] = bounds.min[axis];
            self.corners[1][axis][slot] = bounds.max[axis];
        }
        self.first[slot] = first as u32;
        self.count[slot] = count;
    }
}
