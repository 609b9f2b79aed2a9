use glam::{Vec3, Vec3A};
use rayon::prelude::*;

use super::{Beam, Leaf, Node, Stats, ViewBeamTree};
use crate::math::{Aabb, MortonCurve, Segment};
use crate::tree::MAX_DEPTH;

/// Nodes with more pieces than this are divided by several threads. Fixed, so that the tree does
/// not depend on them.
const PARALLEL_PIECES: usize = 1 << 12;

/// Pieces that one thread sorts to the sides of a plane at a time.
const CHUNK: usize = 1 << 15;

/// A node is left whole if a plane is expected to cut a larger share of its pieces on every axis.
/// Then they run from corner to corner, closer together than 1/256 of their length (or they are
/// copies), and no affordable number of planes separates them.
const MAX_CUT_SHARE: f32 = 1.0 - 1.0 / 256.0;

/// Smallest share of the pieces' total extent that an axis is credited with in
/// [`SplitAxis::Relative`]. Keeps cells around exactly parallel beams from becoming slabs.
const MIN_EXTENT_SHARE: f32 = 0.05;

/// When to stop and where to put planes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BuildOptions {
    /// Nodes with at most this many beams become leaves.
    pub leaf_size: usize,
    /// Most planes between root and leaf; at most [`MAX_DEPTH`].
    pub max_depth: usize,
    /// Bound on the references of the whole tree, per beam; at least 1. A node is only split if its
    /// share of them pays for both children. Memory is at most 4 bytes per reference, and some 70
    /// bytes per leaf.
    pub references_per_beam: usize,
    pub split_axis: SplitAxis,
}

/// Which axis of a node's box the plane cuts, in the middle.
///
/// The box is that of the pieces of beams inside the cell. Where they end is known after each cut,
/// so the box is as tight as in figure 3 of the paper. Its middle, the spatial median, halves the
/// photons to be expected. The median of the beams would make small cells where beams are dense;
/// for the same memory that costs more than cells of one size, because a smaller cell also means
/// that each beam is listed more often.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SplitAxis {
    /// The largest axis, as printed in [Collin 2013 §5.1]. Where beams run alike it keeps cutting
    /// them across.
    Largest,
    /// The largest axis in units of the mean extent of the pieces. A plane anywhere in the box is
    /// expected to cut the share (mean extent / extent of the box) of them: this takes the axis
    /// with the least, and cells grow long along bundles. Against [`SplitAxis::Largest`] that is 1
    /// to 2 times fewer tests for a wide camera, 3 to 10 times fewer tests or references for a
    /// telephoto lens.
    Relative,
}

impl Default for BuildOptions {
    /// The paper's leaf size and greatest depth. With fewer references a million beams take half
    /// the time to build and over twice the time to query; with more, memory grows and queries
    /// hardly gain.
    fn default() -> Self {
        Self {
            leaf_size: 32,
            max_depth: 30,
            references_per_beam: 64,
            split_axis: SplitAxis::Relative,
        }
    }
}

impl ViewBeamTree {
    /// Builds with the default options.
    ///
    /// Segments that are not finite, or hold no point, have no pairs and are left out;
    /// [`ViewBeamTree::stats`] counts them. The result does not depend on the number of threads.
    pub fn build(segments: &[Segment]) -> Self {
        Self::build_with(segments, &BuildOptions::default())
    }

    /// As [`ViewBeamTree::build`], with `options`.
    ///
    /// # Panics
    ///
    /// If `options.max_depth` exceeds [`MAX_DEPTH`], or there are more than `u32::MAX` segments.
    pub fn build_with(segments: &[Segment], options: &BuildOptions) -> Self {
        assert!(
            options.max_depth <= MAX_DEPTH,
            "max_depth {} exceeds {MAX_DEPTH}",
            options.max_depth
        );
        assert!(
            u32::try_from(segments.len()).is_ok(),
            "{} segments exceed 32 bits",
            segments.len()
        );
        let (beams, kept) = collect_beams(segments);
        let builder = Builder { beams: &beams, options };
        let mut whole = Subtree::default();
        builder.grow(builder.root()).flatten(&mut whole);
        let stats = whole.count(kept);
        whole.nodes.shrink_to_fit();
        whole.leaves.shrink_to_fit();
        whole.references.shrink_to_fit();
        Self {
            nodes: whole.nodes,
            leaves: whole.leaves,
            references: whole.references,
            max_origin: max_origin(&beams),
            beams,
            stats,
        }
    }
}

fn max_origin(beams: &[Beam]) -> f32 {
    let largest = |beam: &Beam| beam.segment.origin.abs().max_element();
    beams.iter().map(largest).fold(0.0, f32::max)
}

/// The beams that can have pairs, along a Morton curve through their middles, and the counts of
/// segments.
fn collect_beams(segments: &[Segment]) -> (Vec<Beam>, Stats) {
    let mut stats = Stats::default();
    let mut beams = Vec::with_capacity(segments.len());
    let mut middles = Aabb::EMPTY;
    for (index, &segment) in segments.iter().enumerate() {
        if !segment.is_finite() {
            stats.non_finite += 1;
        } else if segment.length <= 0.0 {
            stats.empty += 1;
        } else {
            middles.grow(middle(&segment));
            beams.push(Beam { segment, index: index as u32 });
        }
    }
    stats.beams = beams.len();
    (sort_along_curve(&beams, &middles), stats)
}

/// Sorts by the cells of a grid that the middles lie in; an error in a cell costs speed alone.
fn sort_along_curve(beams: &[Beam], middles: &Aabb) -> Vec<Beam> {
    let curve = MortonCurve::through(middles);
    let place = |beam: &Beam| curve.place(middle(&beam.segment));
    let mut order: Vec<(u32, u32)> =
        (beams.par_iter().zip(0..beams.len() as u32).with_min_len(CHUNK))
            .map(|(beam, position)| (place(beam), position))
            .collect();
    radsort::sort_by_key(&mut order, |(place, _)| *place);
    let beam = |&(_, position): &(u32, u32)| beams[position as usize];
    order.par_iter().with_min_len(CHUNK).map(beam).collect()
}

fn middle(segment: &Segment) -> Vec3 {
    segment.at(0.5 * segment.length)
}

/// The part of a beam inside a cell: each `t` of the beam with `at(t)` in the cell lies in `[start,
/// end]`.
#[derive(Clone, Copy)]
struct Piece {
    beam: u32,
    start: f32,
    end: f32,
}

/// The pieces inside a cell.
struct Content {
    pieces: Vec<Piece>,
    /// Corners of the box of the pieces. Padded vectors: this is where a build spends its time.
    min: Vec3A,
    max: Vec3A,
    /// Sum over the pieces of their extent on each axis.
    extent: Vec3A,
}

impl Content {
    fn with_capacity(capacity: usize) -> Self {
        Self {
            pieces: Vec::with_capacity(capacity),
            min: Vec3A::INFINITY,
            max: Vec3A::NEG_INFINITY,
            extent: Vec3A::ZERO,
        }
    }

    /// Adds a piece; its ends, computed as [`Segment::at`] does, bound all of it because
    /// coordinates are monotone.
    #[inline]
    fn push(&mut self, segment: &Segment, piece: Piece) {
        let (origin, direction) = (Vec3A::from(segment.origin), Vec3A::from(segment.direction));
        let (start, end) = (origin + piece.start * direction, origin + piece.end * direction);
        self.min = self.min.min(start.min(end));
        self.max = self.max.max(start.max(end));
        self.extent += (end - start).abs();
        self.pieces.push(piece);
    }

    /// Concatenates in order; sums made chunk by chunk stay accurate in single precision.
    fn concatenate(parts: &[Self]) -> Self {
        let mut whole = Self::with_capacity(parts.iter().map(Self::len).sum());
        for part in parts {
            whole.pieces.extend_from_slice(&part.pieces);
            whole.min = whole.min.min(part.min);
            whole.max = whole.max.max(part.max);
            whole.extent += part.extent;
        }
        whole
    }

    fn len(&self) -> usize {
        self.pieces.len()
    }

    fn bounds(&self) -> Aabb {
        Aabb { min: self.min.into(), max: self.max.into() }
    }
}

/// A node yet to be made.
struct Job {
    content: Content,
    cell: Aabb,
    /// Most references below this node.
    budget: usize,
    depth: usize,
}

struct Division {
    axis: usize,
    plane: f32,
    left: Job,
    right: Job,
}

/// The top of the tree, over subtrees that one thread each has made.
enum Branch {
    Interior { axis: usize, plane: f32, children: Box<[Branch; 2]> },
    Subtree(Subtree),
}

#[derive(Default)]
struct Subtree {
    nodes: Vec<Node>,
    leaves: Vec<Leaf>,
    references: Vec<u32>,
    depth: usize,
}

struct Builder<'a> {
    beams: &'a [Beam],
    options: &'a BuildOptions,
}

impl Builder<'_> {
    fn root(&self) -> Job {
        let chunks: Vec<_> = (self.beams.par_chunks(CHUNK).enumerate())
            .map(|(chunk, beams)| whole_beams(beams, chunk * CHUNK))
            .collect();
        let budget = self.beams.len().saturating_mul(self.options.references_per_beam.max(1));
        Job {
            content: Content::concatenate(&chunks),
            cell: Aabb::UNBOUNDED,
            budget: budget.min(Node::MAX_TARGET),
            depth: 0,
        }
    }

    fn grow(&self, job: Job) -> Branch {
        let mut subtree = Subtree::default();
        if job.content.len() <= PARALLEL_PIECES {
            self.grow_alone(job, &mut subtree);
            return Branch::Subtree(subtree);
        }
        let Some(division) = self.divide(&job) else {
            subtree.push_leaf(&job);
            return Branch::Subtree(subtree);
        };
        drop(job);
        let (left, right) = rayon::join(|| self.grow(division.left), || self.grow(division.right));
        Branch::Interior {
            axis: division.axis,
            plane: division.plane,
            children: Box::new([left, right]),
        }
    }

    fn grow_alone(&self, job: Job, subtree: &mut Subtree) {
        let Some(division) = self.divide(&job) else {
            return subtree.push_leaf(&job);
        };
        drop(job);
        let parent = subtree.open_interior();
        self.grow_alone(division.left, subtree);
        subtree.close_interior(parent, division.axis, division.plane);
        self.grow_alone(division.right, subtree);
    }

    /// Splits a node; none if it is to be a leaf.
    fn divide(&self, job: &Job) -> Option<Division> {
        let (axis, plane) = self.choose_plane(job)?;
        let (left, right) = self.partition(&job.content.pieces, axis, plane);
        if left.len() + right.len() > job.budget {
            return None;
        }
        let left_budget = share_budget(job.budget, &left, &right);
        let (mut left_cell, mut right_cell) = (job.cell, job.cell);
        left_cell.max[axis] = plane;
        right_cell.min[axis] = plane;
        let child = |content, cell, budget| Job { content, cell, budget, depth: job.depth + 1 };
        Some(Division {
            axis,
            plane,
            left: child(left, left_cell, left_budget),
            right: child(right, right_cell, job.budget - left_budget),
        })
    }

    /// The plane through the middle of the box of the pieces, or none if the node is to be a leaf.
    fn choose_plane(&self, job: &Job) -> Option<(usize, f32)> {
        let count = job.content.len();
        if count <= self.options.leaf_size || job.depth >= self.options.max_depth {
            return None;
        }
        let bounds = job.content.bounds().intersection(&job.cell);
        let extent = bounds.extent();
        let piece_extent = Vec3::from(job.content.extent) / count as f32;
        let cut_share = [0, 1, 2].map(|axis| match extent[axis] > 0.0 {
            true => piece_extent[axis] / extent[axis],
            false => 1.0,
        });
        if cut_share.iter().all(|&share| share > MAX_CUT_SHARE) {
            return None;
        }
        let size = match self.options.split_axis {
            SplitAxis::Largest => extent,
            SplitAxis::Relative => {
                extent
                    / piece_extent.max(Vec3::splat(MIN_EXTENT_SHARE * piece_extent.element_sum()))
            }
        };
        let axis = size.max_position();
        let plane = 0.5 * bounds.min[axis] + 0.5 * bounds.max[axis];
        let leaves_room =
            job.cell.min[axis] < plane && plane < job.cell.max[axis] && bounds.min[axis] < plane;
        let expected = count as f32 * (1.0 + cut_share[axis]);
        (leaves_room && expected <= job.budget as f32).then_some((axis, plane))
    }

    fn partition(&self, pieces: &[Piece], axis: usize, plane: f32) -> (Content, Content) {
        if pieces.len() <= CHUNK {
            return self.partition_chunk(pieces, axis, plane);
        }
        let parts: Vec<_> = pieces
            .par_chunks(CHUNK)
            .map(|chunk| self.partition_chunk(chunk, axis, plane))
            .collect();
        let (left, right): (Vec<_>, Vec<_>) = parts.into_iter().unzip();
        (Content::concatenate(&left), Content::concatenate(&right))
    }

    fn partition_chunk(&self, pieces: &[Piece], axis: usize, plane: f32) -> (Content, Content) {
        let mut left = Content::with_capacity(pieces.len());
        let mut right = Content::with_capacity(pieces.len());
        for &piece in pieces {
            let segment = &self.beams[piece.beam as usize].segment;
            match cut(segment, piece, axis, plane) {
                Cut::Left => left.push(segment, piece),
                Cut::Right => right.push(segment, piece),
                Cut::Across(on_left, on_right) => {
                    left.push(segment, on_left);
                    right.push(segment, on_right);
                }
            }
        }
        (left, right)
    }
}

/// The pieces of the root: beams as they are, the first at position `first`.
fn whole_beams(beams: &[Beam], first: usize) -> Content {
    let mut content = Content::with_capacity(beams.len());
    for (position, beam) in (first..).zip(beams) {
        let piece = Piece { beam: position as u32, start: 0.0, end: beam.segment.length };
        content.push(&beam.segment, piece);
    }
    content
}

/// Where a piece lies with respect to a plane.
enum Cut {
    Left,
    Right,
    /// The parts on the left and on the right.
    Across(Piece, Piece),
}

/// The parts of a piece that [`Segment::at`] puts below `plane`, and at or above it.
///
/// Which sides there are is exact, because the coordinate is monotone in `t`: the ends of the piece
/// tell. Where a piece is cut its parts overlap by a bound on the rounding. Let u = ε/2, d > 0, and
/// η half the smallest subnormal. `fl(o + fl(td)) < s` implies `o + fl(td) < s`, so `t·d(1 − u) < s
/// − o + η`; `>= s` implies `t·d(1 + u) > s − o − u|s| − η`. The quotient `fl(fl(s − o)/d)` itself
/// is off by `2u` and `η`. So `t` passes the computed quotient by at most `4u|quotient| + u|s/d| +
/// 3η/d`; the code allows for over twice that. Where an infinite slack makes NaN, `min` and `max`
/// keep the old end.
#[inline]
fn cut(segment: &Segment, piece: Piece, axis: usize, plane: f32) -> Cut {
    let (origin, slope) = (segment.origin[axis], segment.direction[axis]);
    let start_is_left = origin + piece.start * slope < plane;
    let end_is_left = origin + piece.end * slope < plane;
    if start_is_left == end_is_left {
        return if start_is_left { Cut::Left } else { Cut::Right };
    }
    let crossing = (plane - origin) / slope;
    let slack = 4.0 * f32::EPSILON * (crossing.abs() + (plane / slope).abs())
        + f32::MIN_POSITIVE / slope.abs();
    let first = Piece { end: (crossing + slack).min(piece.end), ..piece };
    let second = Piece { start: (crossing - slack).max(piece.start), ..piece };
    if start_is_left {
        Cut::Across(first, second)
    } else {
        Cut::Across(second, first)
    }
}

/// The left child's part of the budget: in proportion to the length of the pieces, but so that each
/// child can pay for the leaf that it is already.
///
/// With cells of side s, photons spread evenly meet (density · s²) beams and a beam meets (length /
/// s) cells. For a given number of references the mean cost is least where s is the same
/// everywhere, however dense the beams are.
fn share_budget(budget: usize, left: &Content, right: &Content) -> usize {
    let (left_length, right_length) = (left.extent.element_sum(), right.extent.element_sum());
    let wanted = budget as f32 * (left_length / (left_length + right_length));
    (wanted as usize).clamp(left.len(), budget - right.len())
}

impl Subtree {
    fn push_leaf(&mut self, job: &Job) {
        self.nodes.push(Node::leaf(self.leaves.len()));
        self.leaves.push(Leaf {
            cell: job.cell,
            bounds: job.content.bounds().intersection(&job.cell),
            first: self.references.len() as u32,
            count: job.content.len() as u32,
        });
        self.references.extend(job.content.pieces.iter().map(|piece| piece.beam));
        self.depth = self.depth.max(job.depth);
    }

    /// Completes the counts of segments.
    fn count(&self, kept: Stats) -> Stats {
        let fullest = self.leaves.iter().map(|leaf| leaf.count as usize).max();
        Stats {
            nodes: self.nodes.len(),
            leaves: self.leaves.len(),
            references: self.references.len(),
            largest_leaf: fullest.unwrap_or(0),
            depth: self.depth,
            ..kept
        }
    }

    /// Keeps the place of a node whose left subtree comes next.
    fn open_interior(&mut self) -> usize {
        self.nodes.push(Node::leaf(0));
        self.nodes.len() - 1
    }

    /// Fills the place, now that the left subtree is there and the right one comes next.
    fn close_interior(&mut self, position: usize, axis: usize, plane: f32) {
        self.nodes[position] = Node::interior(axis, plane, self.nodes.len());
    }

    fn append(&mut self, other: &Self) {
        let (nodes, leaves, references) =
            (self.nodes.len(), self.leaves.len(), self.references.len());
        self.nodes.extend(other.nodes.iter().map(|node| match node.is_leaf() {
            true => Node::leaf(node.target() + leaves),
            false => Node::interior(node.axis(), node.plane, node.target() + nodes),
        }));
        self.leaves.extend(
            other.leaves.iter().map(|leaf| Leaf { first: leaf.first + references as u32, ..*leaf }),
        );
        self.references.extend_from_slice(&other.references);
        self.depth = self.depth.max(other.depth);
    }
}

impl Branch {
    fn flatten(self, into: &mut Subtree) {
        match self {
            Branch::Interior { axis, plane, children } => {
                let [left, right] = *children;
                let parent = into.open_interior();
                left.flatten(into);
                into.close_interior(parent, axis, plane);
                right.flatten(into);
            }
            Branch::Subtree(subtree) => into.append(&subtree),
        }
    }
}
