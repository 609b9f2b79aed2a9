use glam::Vec3;
use rayon::prelude::*;

use super::{Bvh, Node, Stats};
use crate::math::Aabb;

/// Ranges of at most this many boxes are not divided.
const SMALL_LEAF: usize = 4;

/// Ranges of more boxes than this are always divided.
pub(super) const LARGE_LEAF: usize = 8;

/// Cost of a node's visit in tests of one box's content.
const NODE_COST: f32 = 2.0;

/// Most bins per axis, as in [Wald 2007]; ranges of fewer boxes make do with fewer.
const BINS: usize = 16;

/// Ranges with more boxes than this are divided by several threads. Fixed, so that the hierarchy
/// does not depend on them.
const PARALLEL_BOXES: usize = 1 << 12;

/// Level of nodes from which on ranges are halved by number. Boxes that shrink geometrically toward a
/// point get here.
const HALVING_LEVEL: usize = 24;

/// Most nodes from root to leaf; sizes the stack of a query. Halved at least once on each of 30
/// levels, 2³² boxes fit into small leaves.
pub(super) const MAX_LEVELS: usize = HALVING_LEVEL + 30;

impl Bvh {
    /// Builds by the surface area heuristic over bins [Wald 2007].
    ///
    /// Boxes that are empty or not finite are left out; [`Bvh::stats`] counts them. The result does
    /// not depend on the number of threads.
    ///
    /// # Panics
    ///
    /// If there are more than `u32::MAX` boxes.
    pub fn build(boxes: &[Aabb]) -> Self {
        assert!(u32::try_from(boxes.len()).is_ok(), "{} boxes exceed 32 bits", boxes.len());
        let is_kept =
            |bounds: &Aabb| bounds.min.is_finite() && bounds.max.is_finite() && !bounds.is_empty();
        let mut items: Vec<Item> = (0..)
            .zip(boxes)
            .filter(|(_, bounds)| is_kept(bounds))
            .map(|(index, &bounds)| Item { bounds, index })
            .collect();
        let extents = Extents::of(&items);
        let mut nodes = Vec::new();
        if !items.is_empty() {
            grow(Range { first: 0, items: &mut items, extents }, 0).flatten(&mut nodes);
        }
        let order: Vec<u32> = items.iter().map(|item| item.index).collect();
        let stats = count(&nodes, order.len(), boxes.len() - order.len());
        Self { nodes, order, bounds: extents.bounds, stats }
    }
}

/// A box and its index in the caller's slice.
#[derive(Clone, Copy)]
struct Item {
    bounds: Aabb,
    index: u32,
}

impl Item {
    /// Halved before the sum, so that no box overflows.
    fn middle(&self) -> Vec3 {
        0.5 * self.bounds.min + 0.5 * self.bounds.max
    }
}

/// The box of some boxes and that of their middles.
#[derive(Clone, Copy)]
struct Extents {
    bounds: Aabb,
    middles: Aabb,
}

impl Extents {
    const EMPTY: Self = Self { bounds: Aabb::EMPTY, middles: Aabb::EMPTY };

    fn with(mut self, item: &Item) -> Self {
        self.bounds = self.bounds.union(&item.bounds);
        self.middles.grow(item.middle());
        self
    }

    fn union(self, other: Self) -> Self {
        Self {
            bounds: self.bounds.union(&other.bounds),
            middles: self.middles.union(&other.middles),
        }
    }

    fn of(items: &[Item]) -> Self {
        fold_chunks(items, || Self::EMPTY, |extents, item| extents.with(item), Self::union)
    }
}

/// Folds by several threads if there are many items. `merge` is exact, so the chunks do not matter.
fn fold_chunks<T: Send>(
    items: &[Item],
    empty: impl Fn() -> T + Sync + Send,
    add: impl Fn(T, &Item) -> T + Sync + Send,
    merge: impl Fn(T, T) -> T + Sync + Send,
) -> T {
    if items.len() <= 4 * PARALLEL_BOXES {
        return items.iter().fold(empty(), &add);
    }
    let chunks = items.par_chunks(PARALLEL_BOXES).map(|chunk| chunk.iter().fold(empty(), &add));
    chunks.reduce(&empty, &merge)
}

/// Items that become a node or a leaf.
struct Range<'a> {
    /// Position of the first item among all.
    first: usize,
    items: &'a mut [Item],
    extents: Extents,
}

/// A node over those below it.
struct Branch {
    /// The links to leaves are final, those to nodes are set by [`Branch::flatten`].
    node: Node,
    /// By slot.
    children: Vec<(usize, Branch)>,
}

impl Branch {
    /// Appends the subtree depth first and returns the position of its root.
    fn flatten(self, nodes: &mut Vec<Node>) -> usize {
        let position = nodes.len();
        nodes.push(self.node);
        for (slot, child) in self.children {
            nodes[position].first[slot] = child.flatten(nodes) as u32;
        }
        position
    }
}

/// Divides a range into up to four and these in turn.
fn grow(range: Range, level: usize) -> Branch {
    let many = range.items.len() > PARALLEL_BOXES;
    let mut node = Node::CHILDLESS;
    let mut interior = Vec::new();
    for (slot, part) in divide_in_four(range, level).into_iter().enumerate() {
        let count = if part.is_final { part.range.items.len() as u32 } else { Node::INTERIOR };
        node.set_child(slot, &part.range.extents.bounds, part.range.first, count);
        if !part.is_final {
            interior.push((slot, part.range));
        }
    }
    let deepen = |(slot, range)| (slot, grow(range, level + 1));
    let children = if many {
        interior.into_par_iter().map(deepen).collect()
    } else {
        interior.into_iter().map(deepen).collect()
    };
    Branch { node, children }
}

/// What becomes a child of a node.
struct Part<'a> {
    range: Range<'a>,
    /// Whether it is to be a leaf.
    is_final: bool,
}

/// Splits the part with the largest surface again and again until there are four.
fn divide_in_four(range: Range, level: usize) -> Vec<Part> {
    let is_final = range.items.len() <= SMALL_LEAF;
    let mut parts = vec![Part { range, is_final }];
    while parts.len() < 4 {
        let area = |part: &Part| half_area(&part.range.extents.bounds);
        let larger = |a: &(usize, &Part), b: &(usize, &Part)| area(a.1).total_cmp(&area(b.1));
        let open = parts.iter().enumerate().filter(|(_, part)| !part.is_final).max_by(larger);
        let Some((position, _)) = open else {
            break;
        };
        let part = parts.swap_remove(position);
        match choose_split(&part.range, level) {
            Some(split) => parts.extend(divide(part.range, split).map(|range| {
                let is_final = range.items.len() <= SMALL_LEAF;
                Part { range, is_final }
            })),
            None => parts.push(Part { is_final: true, ..part }),
        }
    }
    parts
}

/// How a range falls apart.
enum Split {
    /// By the bin of the middle: those below `bin` go first.
    Bin { axis: usize, bin: usize },
    /// By number, where no plane separates the middles.
    Halves,
}

/// The split of least expected cost, or none if the range is cheaper as a leaf.
fn choose_split(range: &Range, level: usize) -> Option<Split> {
    let count = range.items.len();
    if level >= HALVING_LEVEL {
        return Some(Split::Halves);
    }
    let bins = Bins::of(range);
    let Some((cost, axis, bin)) = bins.cheapest() else {
        return (count > LARGE_LEAF).then_some(Split::Halves);
    };
    let area = half_area(&range.extents.bounds);
    let is_worth_it = cost + NODE_COST * area < count as f32 * area;
    (is_worth_it || count > LARGE_LEAF).then_some(Split::Bin { axis, bin })
}

/// Half the surface of a box: in proportion to it, lines meet a box.
fn half_area(bounds: &Aabb) -> f32 {
    let extent = bounds.extent();
    extent.x * extent.y + extent.y * extent.z + extent.z * extent.x
}

/// Which bin a middle lies in. A flat box of middles divides by zero; the cast sends NaN to bin 0.
#[derive(Clone, Copy)]
struct Grid {
    min: Vec3,
    scale: Vec3,
    /// Bins per axis.
    count: usize,
}

impl Grid {
    fn over(range: &Range) -> Self {
        let middles = &range.extents.middles;
        let count = range.items.len().min(BINS);
        Self { min: middles.min, scale: count as f32 / middles.extent(), count }
    }

    #[inline]
    fn bins(&self, item: &Item) -> [usize; 3] {
        let place = (item.middle() - self.min) * self.scale;
        place.to_array().map(|x| (x as usize).min(self.count - 1))
    }
}

/// Boxes and numbers of the items in each bin, axis by axis.
struct Bins {
    /// Bins per axis; the rest is empty.
    count: usize,
    bounds: [[Aabb; BINS]; 3],
    counts: [[usize; BINS]; 3],
}

impl Bins {
    fn of(range: &Range) -> Self {
        let grid = Grid::over(range);
        let count = grid.count;
        let empty = || Self { count, bounds: [[Aabb::EMPTY; BINS]; 3], counts: [[0; BINS]; 3] };
        let add = |mut bins: Self, item: &Item| {
            for (axis, bin) in grid.bins(item).into_iter().enumerate() {
                bins.bounds[axis][bin] = bins.bounds[axis][bin].union(&item.bounds);
                bins.counts[axis][bin] += 1;
            }
            bins
        };
        fold_chunks(range.items, empty, add, Self::merge)
    }

    fn merge(mut self, other: Self) -> Self {
        for axis in 0..3 {
            for bin in 0..self.count {
                self.bounds[axis][bin] = self.bounds[axis][bin].union(&other.bounds[axis][bin]);
                self.counts[axis][bin] += other.counts[axis][bin];
            }
        }
        self
    }

    /// Cost, axis and first bin of the second part; none if all middles fall in one bin.
    fn cheapest(&self) -> Option<(f32, usize, usize)> {
        let candidates = (0..3).flat_map(|axis| {
            let costs = self.costs(axis);
            (1..self.count).filter_map(move |bin| costs[bin].map(|cost| (cost, axis, bin)))
        });
        candidates.min_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// Sum over both parts of surface times number, for each first bin of the second part.
    fn costs(&self, axis: usize) -> [Option<f32>; BINS] {
        let (bounds, counts) = (&self.bounds[axis], &self.counts[axis]);
        let mut above = [(0.0, 0); BINS];
        let (mut grown, mut count) = (Aabb::EMPTY, 0);
        for bin in (1..self.count).rev() {
            grown = grown.union(&bounds[bin]);
            count += counts[bin];
            above[bin] = (half_area(&grown) * count as f32, count);
        }
        let mut costs = [None; BINS];
        (grown, count) = (Aabb::EMPTY, 0);
        for bin in 1..self.count {
            grown = grown.union(&bounds[bin - 1]);
            count += counts[bin - 1];
            let divides = count > 0 && above[bin].1 > 0;
            costs[bin] = divides.then(|| half_area(&grown) * count as f32 + above[bin].0);
        }
        costs
    }
}

fn divide(range: Range, split: Split) -> [Range; 2] {
    let middle = match split {
        Split::Bin { axis, bin } => {
            let grid = Grid::over(&range);
            partition(range.items, |item| grid.bins(item)[axis] < bin)
        }
        Split::Halves => range.items.len() / 2,
    };
    let (left, right) = range.items.split_at_mut(middle);
    [(range.first, left), (range.first + middle, right)].map(|(first, items)| {
        let extents = Extents::of(items);
        Range { first, items, extents }
    })
}

/// Moves the items that go first to the front and returns their number.
fn partition(items: &mut [Item], goes_first: impl Fn(&Item) -> bool) -> usize {
    let (mut front, mut back) = (0, items.len());
    while front < back {
        if goes_first(&items[front]) {
            front += 1;
        } else {
            back -= 1;
            items.swap(front, back);
        }
    }
    front
}

fn count(nodes: &[Node], boxes: usize, non_finite: usize) -> Stats {
    let mut stats = Stats { boxes, non_finite, nodes: nodes.len(), ..Stats::default() };
    let mut levels = vec![1; nodes.len()];
    for (position, node) in nodes.iter().enumerate() {
        stats.depth = stats.depth.max(levels[position]);
        for (first, count) in node.first.into_iter().zip(node.count) {
            match count {
                0 => {}
                Node::INTERIOR => levels[first as usize] = levels[position] + 1,
                _ => {
                    stats.leaves += 1;
                    stats.largest_leaf = stats.largest_leaf.max(count as usize);
                }
            }
        }
    }
    stats
}
