//! The kd-tree over view beams [Collin 2013 §5.1; Havran 2005].
//!
//! The cells of the leaves tile all of space, half-open and without bounds outwards. A beam is
//! listed in every leaf whose cell it crosses, yet a photon must meet it once: the leaf whose cell
//! owns the beam's closest point to the photon owns the pair, and the other leaves pass it over.
//!
//! # Why this is exact in floating point
//!
//! The closest point is [`Segment::at`]`(t)` with the `t` of [`Segment::project`], rounding errors
//! included. Its coordinates are monotone functions of `t`, so at every plane the parameters of a
//! beam fall apart in two ranges, one per side, and `build` keeps for each side an interval that
//! contains the range (the bound on the rounding is derived there). By induction the leaf that owns
//! `at(t)` lists the beam, for each `t` in `[0, length)`. Since space is tiled, there is one such
//! leaf. `query` reaches it because it widens the radius by what `project` and `at` may disagree
//! (derived there too).
//!
//! [`Segment::at`]: crate::math::Segment::at
//! [`Segment::project`]: crate::math::Segment::project

mod build;
mod descent;
mod packet;
mod query;
mod query_segment;
mod tile;
mod validate;

pub use build::{BuildOptions, SplitAxis};

use super::beam::{self, Beam};
use super::heap_bytes;
use crate::math::{Aabb, Segment};

/// A kd-tree over segments that finds those within a radius of a point.
///
/// Coordinates and radii are in scene units. Segments keep the index they had in the slice given to
/// `build`.
#[derive(Clone, Debug)]
pub struct ViewBeamTree {
    /// Depth first: the left child follows its parent.
    nodes: Vec<Node>,
    /// In the order in which a depth-first walk meets them.
    leaves: Vec<Leaf>,
    /// Positions in `beams`, one ascending run per leaf.
    references: Vec<u32>,
    /// Along a Morton curve, so that a leaf's beams are neighbours in memory.
    beams: Vec<Beam>,
    /// Largest absolute coordinate of any origin in `beams`; scales the rounding errors of
    /// `project`.
    max_origin: f32,
    stats: Stats,
}

/// What a [`ViewBeamTree`] is made of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Stats {
    /// Segments in the tree.
    pub beams: usize,
    /// Segments left out because a coordinate, the length or the end point is NaN or infinite.
    pub non_finite: usize,
    /// Segments left out because they hold no point (`length <= 0`).
    pub empty: usize,
    pub nodes: usize,
    pub leaves: usize,
    /// Beams over all leaves, each counted in every leaf that lists it.
    pub references: usize,
    /// Beams in the fullest leaf.
    pub largest_leaf: usize,
    /// Planes between the root and the deepest leaf.
    pub depth: usize,
}

impl ViewBeamTree {
    /// Counts of beams, nodes, leaves and references.
    pub fn stats(&self) -> Stats {
        self.stats
    }

    /// Hands out the indices of the segments in the order of the curve, and numbers them in that order from now on.
    pub fn take_order(&mut self) -> Vec<u32> {
        beam::take_order(&mut self.beams)
    }

    /// A segment by its number, once the tree has numbered them.
    #[inline]
    pub fn segment(&self, place: u32) -> &Segment {
        &self.beams[place as usize].segment
    }

    /// Bytes on the heap.
    pub fn memory_bytes(&self) -> usize {
        heap_bytes(&self.nodes)
            + heap_bytes(&self.leaves)
            + heap_bytes(&self.references)
            + heap_bytes(&self.beams)
    }
}

/// An interior node or a leaf in eight bytes, as in [Wald 2001].
///
/// The two low bits of `link` are the axis of the plane, or [`Node::LEAF`]; the other bits are the
/// position of the right child in `nodes`, or that of the leaf in `leaves`.
#[derive(Clone, Copy, Debug)]
struct Node {
    /// The left cell owns coordinates `< plane`, the right cell those `>= plane`.
    plane: f32,
    link: u32,
}

impl Node {
    const LEAF: u32 = 3;
    const MAX_TARGET: usize = (u32::MAX >> 2) as usize;

    fn interior(axis: usize, plane: f32, right: usize) -> Self {
        debug_assert!(axis < 3 && right <= Self::MAX_TARGET);
        Self { plane, link: (right as u32) << 2 | axis as u32 }
    }

    fn leaf(leaf: usize) -> Self {
        debug_assert!(leaf <= Self::MAX_TARGET);
        Self { plane: 0.0, link: (leaf as u32) << 2 | Self::LEAF }
    }

    #[inline]
    fn is_leaf(self) -> bool {
        self.link & 3 == Self::LEAF
    }

    /// In `0..=3`, below 3 for interior nodes.
    #[inline]
    fn axis(self) -> usize {
        (self.link & 3) as usize
    }

    /// The right child of an interior node, the leaf of a leaf node.
    #[inline]
    fn target(self) -> usize {
        (self.link >> 2) as usize
    }
}

#[derive(Clone, Copy, Debug)]
struct Leaf {
    /// Owns the pairs; infinite towards the outside of the scene.
    cell: Aabb,
    /// Holds every closest point that the leaf may own; lets a photon in an empty corner of the
    /// cell leave at once.
    bounds: Aabb,
    /// First position in `references`.
    first: u32,
    count: u32,
}

impl Leaf {
    #[inline]
    fn range(&self) -> std::ops::Range<usize> {
        self.first as usize..(self.first + self.count) as usize
    }
}
