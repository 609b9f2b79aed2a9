//! How a guide is learnt: boxes are cut where that saves the most variance, for as long as the samples bear it out.

use super::{Cell, EmissionGuide, Node, Numbers, GUIDED_DIMENSIONS};
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// Probability that is spread evenly over the cube: no walk weighs more than its inverse.
const EVEN_SHARE: f64 = 0.3;
/// Slices of a box between which it may be cut.
const SLICES: usize = 8;
/// A cut has to save more than so many times what chance would save where nothing is to be saved.
const SIGNIFICANCE: f64 = 1.0;
/// Lessons that each cut is given beforehand, spread evenly over the box: where few walks were seen from none may be, by chance.
const BEFOREHAND: f64 = 8.0;
/// Boxes at most, and what a cut has to save of the whole cost at least.
const MOST_LEAVES: usize = 1 << 14;
const LEAST_SAVING: f64 = 1e-6;
/// Boxes are not narrower than this along any axis: numbers have 24 bits.
const NARROWEST: f64 = 1.0 / (1 << 14) as f64;

/// A walk that was seen.
#[derive(Debug, Clone, Copy)]
pub struct Lesson {
    pub numbers: Numbers,
    /// Second moment of what a walk from here adds, over the density that it was drawn with.
    pub worth: f64,
}

/// So many lessons of equal worth would have as much noise as these.
pub fn of_equal_worth(lessons: &[Lesson]) -> f64 {
    let worth: f64 = lessons.iter().map(|lesson| lesson.worth).sum();
    let squares: f64 = lessons.iter().map(|lesson| lesson.worth * lesson.worth).sum();
    worth * worth / squares.max(f64::MIN_POSITIVE)
}

/// The guide under which walks like those of the lessons would have had the least variance; none where there are no lessons.
// [Guided emission]
pub fn learn(mut lessons: Vec<Lesson>) -> Option<EmissionGuide> {
    lessons.retain(|lesson| lesson.worth > 0.0 && lesson.worth.is_finite());
    if lessons.is_empty() {
        return None;
    }
    let mut growing = Growing { nodes: Vec::new(), open: BinaryHeap::new(), cost: 0.0 };
    growing.add(Cell::WHOLE, lessons);
    while growing.nodes.len() < 2 * MOST_LEAVES {
        let Some(best) = growing.open.pop() else { break };
        growing.cut(best);
    }
    Some(growing.settle())
}

/// A tree whose leaves may be cut.
struct Growing {
    nodes: Vec<Grown>,
    open: BinaryHeap<Candidate>,
    /// Of all leaves.
    cost: f64,
}

struct Grown {
    cell: Cell,
    worth: f64,
    lessons_of_equal_worth: f64,
    /// The leaf's part of the cost.
    cost: f64,
    lessons: Vec<Lesson>,
    cut: Option<(usize, f64, [u32; 2])>,
}

/// The best cut of a leaf.
struct Candidate {
    node: u32,
    axis: usize,
    at: f64,
    saving: f64,
}

impl PartialEq for Candidate {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Candidate {}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> Ordering {
        self.saving.total_cmp(&other.saving).then_with(|| other.node.cmp(&self.node))
    }
}

impl Growing {
    fn add(&mut self, cell: Cell, lessons: Vec<Lesson>) -> u32 {
        let node = self.nodes.len() as u32;
        let worth: f64 = lessons.iter().map(|lesson| lesson.worth).sum();
        let cost = cost(&cell, worth);
        self.cost += cost;
        let lessons_of_equal_worth = of_equal_worth(&lessons);
        let least = (SIGNIFICANCE * cost / lessons_of_equal_worth).max(LEAST_SAVING * self.cost);
        let candidate = best_cut(&cell, &lessons, worth, least);
        self.open.extend(candidate.map(|(axis, at, saving)| Candidate { node, axis, at, saving }));
        self.nodes.push(Grown { cell, worth, lessons_of_equal_worth, cost, lessons, cut: None });
        node
    }

    fn cut(&mut self, candidate: Candidate) {
        let Candidate { node, axis, at, .. } = candidate;
        let parent = &mut self.nodes[node as usize];
        let lessons = std::mem::take(&mut parent.lessons);
        let (cell, cost) = (parent.cell, parent.cost);
        self.cost -= cost;
        let (below, above): (Vec<_>, Vec<_>) =
            lessons.into_iter().partition(|lesson| f64::from(lesson.numbers[axis]) < at);
        let [below_cell, above_cell] = cell.cut(axis, at);
        let children = [self.add(below_cell, below), self.add(above_cell, above)];
        self.nodes[node as usize].cut = Some((axis, at, children));
    }

    /// Gives every leaf its probability, and every inner node the shares of its children.
    fn settle(self) -> EmissionGuide {
        let worths = self.smoothed_worths();
        let leaves = self.nodes.iter().zip(&worths).filter(|(grown, _)| grown.cut.is_none());
        let whole: f64 = leaves.map(|(grown, &worth)| cost(&grown.cell, worth)).sum();
        let mut probability = vec![0.0; self.nodes.len()];
        let mut nodes = vec![Node::Leaf { density: 1.0 }; self.nodes.len()];
        // Children stand behind their parents.
        for (index, grown) in self.nodes.iter().enumerate().rev() {
            (probability[index], nodes[index]) = match grown.cut {
                None => {
                    let volume = grown.cell.volume();
                    let guided = cost(&grown.cell, worths[index]) / whole;
                    let own = EVEN_SHARE * volume + (1.0 - EVEN_SHARE) * guided;
                    (own, Node::Leaf { density: (own / volume) as f32 })
                }
                Some((axis, cut, children)) => {
                    let [below, above] = children.map(|child| probability[child as usize]);
                    let below_share = below / (below + above);
                    (below + above, Node::Inner { axis, cut, below_share, children })
                }
            };
        }
        EmissionGuide { nodes }
    }

    /// What each box is worth if every cut had [`BEFOREHAND`] even lessons more.
    fn smoothed_worths(&self) -> Vec<f64> {
        let mut worths: Vec<f64> = self.nodes.iter().map(|grown| grown.worth).collect();
        for (index, grown) in self.nodes.iter().enumerate() {
            let Some((.., children)) = grown.cut else { continue };
            for child in children.map(|child| child as usize) {
                let seen = self.nodes[child].worth / grown.worth * grown.lessons_of_equal_worth;
                let even = BEFOREHAND * self.nodes[child].cell.volume() / grown.cell.volume();
                let share = (seen + even) / (grown.lessons_of_equal_worth + BEFOREHAND);
                worths[child] = worths[index] * share;
            }
        }
        worths
    }
}

/// What a leaf adds to the standard deviation under the best densities.
// [Guided emission]
fn cost(cell: &Cell, worth: f64) -> f64 {
    (worth * cell.volume()).sqrt()
}

/// Axis, place and saving of the cut of a box that saves the most, if that is more than the `least`.
fn best_cut(cell: &Cell, lessons: &[Lesson], worth: f64, least: f64) -> Option<(usize, f64, f64)> {
    let cost = cost(cell, worth);
    let mut best = None;
    let mut best_saving = least;
    for axis in 0..GUIDED_DIMENSIONS {
        let (start, width) = (cell.least[axis], cell.most[axis] - cell.least[axis]);
        if width < NARROWEST {
            continue;
        }
        let mut slices = [0.0; SLICES];
        for lesson in lessons {
            let place = (f64::from(lesson.numbers[axis]) - start) / width * SLICES as f64;
            slices[(place as usize).min(SLICES - 1)] += lesson.worth;
        }
        let mut below = 0.0;
        for (slice, slice_worth) in slices.iter().enumerate().take(SLICES - 1) {
            below += slice_worth;
            let share = (slice + 1) as f64 / SLICES as f64;
            let parts = (below * share).sqrt() + ((worth - below).max(0.0) * (1.0 - share)).sqrt();
            let saving = cost * (1.0 - parts / worth.sqrt());
            if saving > best_saving {
                best_saving = saving;
                best = Some((axis, start + share * width, saving));
            }
        }
    }
    best
}
