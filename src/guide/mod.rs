//! A density over the numbers that emit a walk, learnt from walks of which it is known what they added: photons leave lamps
//! where, and in directions in which, they are seen. [Guided emission]

mod learn;

use crate::math::uniform::BELOW_ONE;

pub use learn::{learn, of_equal_worth, Lesson};

/// Numbers of an emission that are guided: lamp, place on it, direction.
pub const GUIDED_DIMENSIONS: usize = 5;

/// A point of the unit cube of emission numbers.
pub type Numbers = [f32; GUIDED_DIMENSIONS];

/// A density over the unit cube, constant in each of the boxes of a kd-tree, and nowhere zero.
#[derive(Debug, Clone)]
pub struct EmissionGuide {
    nodes: Vec<Node>,
}

#[derive(Debug, Clone, Copy)]
enum Node {
    Inner {
        axis: usize,
        /// Where the box is cut.
        cut: f64,
        /// Probability of what is below the cut, given the box.
        below_share: f64,
        /// Indices of what is below the cut and above it.
        children: [u32; 2],
    },
    Leaf {
        density: f32,
    },
}

/// A box within the unit cube.
#[derive(Debug, Clone, Copy)]
struct Cell {
    least: [f64; GUIDED_DIMENSIONS],
    most: [f64; GUIDED_DIMENSIONS],
}

impl Cell {
    const WHOLE: Cell = Cell { least: [0.0; GUIDED_DIMENSIONS], most: [1.0; GUIDED_DIMENSIONS] };

    fn volume(&self) -> f64 {
        self.least.iter().zip(&self.most).map(|(least, most)| most - least).product()
    }

    /// The parts below and above a cut.
    fn cut(&self, axis: usize, at: f64) -> [Cell; 2] {
        let (mut below, mut above) = (*self, *self);
        below.most[axis] = at;
        above.least[axis] = at;
        [below, above]
    }
}

impl EmissionGuide {
    /// Carries independent uniform numbers to the guide's density; returns them with the density there.
    // [Guided emission]
    pub fn warp(&self, mut uniform: [f64; GUIDED_DIMENSIONS]) -> (Numbers, f32) {
        let (mut cell, mut node) = (Cell::WHOLE, 0);
        loop {
            match self.nodes[node as usize] {
                Node::Leaf { density } => {
                    let place = |axis: usize| {
                        let (least, most) = (cell.least[axis], cell.most[axis]);
                        ((least + uniform[axis] * (most - least)) as f32).min(BELOW_ONE)
                    };
                    return (std::array::from_fn(place), density);
                }
                Node::Inner { axis, cut, below_share, children } => {
                    let is_below = uniform[axis] < below_share;
                    if is_below {
                        uniform[axis] /= below_share;
                        cell.most[axis] = cut;
                    } else {
                        uniform[axis] = (uniform[axis] - below_share) / (1.0 - below_share);
                        cell.least[axis] = cut;
                    }
                    node = children[usize::from(!is_below)];
                }
            }
        }
    }

    /// The density at a point.
    pub fn density(&self, numbers: &Numbers) -> f32 {
        let mut node = 0;
        loop {
            match self.nodes[node as usize] {
                Node::Leaf { density } => return density,
                Node::Inner { axis, cut, children, .. } => {
                    node = children[usize::from(f64::from(numbers[axis]) >= cut)];
                }
            }
        }
    }

    /// Boxes of constant density.
    #[cfg(test)]
    fn leaves(&self) -> usize {
        self.nodes.iter().filter(|node| matches!(node, Node::Leaf { .. })).count()
    }
}

#[cfg(test)]
mod tests;
