//! Uniform grids over the unit box, as wide as four radii of beams or two radii of points.

use glam::{IVec3, Vec3};
use vpt::math::Segment;

/// A list of entries for each cell.
struct Cells<T> {
    per_side: i32,
    starts: Vec<u32>,
    entries: Vec<T>,
}

impl<T: Copy> Cells<T> {
    /// `list` calls back with every cell and what to enter there; it is asked twice.
    fn fill(per_side: i32, empty: T, list: impl Fn(&mut dyn FnMut(usize, T))) -> Self {
        let mut starts = vec![0_u32; (per_side as usize).pow(3) + 1];
        list(&mut |cell, _| starts[cell + 1] += 1);
        for cell in 1..starts.len() {
            starts[cell] += starts[cell - 1];
        }
        let mut next = starts.clone();
        let mut entries = vec![empty; starts[starts.len() - 1] as usize];
        list(&mut |cell, entry| {
            entries[next[cell] as usize] = entry;
            next[cell] += 1;
        });
        Cells { per_side, starts, entries }
    }

    fn of(&self, first: usize, last: usize) -> &[T] {
        &self.entries[self.starts[first] as usize..self.starts[last + 1] as usize]
    }
}

/// The cell that holds a place, or the nearest one.
fn cell_at(per_side: i32, p: Vec3) -> IVec3 {
    (p * per_side as f32).floor().as_ivec3().clamp(IVec3::ZERO, IVec3::splat(per_side - 1))
}

fn number(per_side: i32, cell: IVec3) -> usize {
    ((cell.z * per_side + cell.y) * per_side + cell.x) as usize
}

/// Points by cell; a photon looks into all cells that its ball touches.
pub struct PointCells {
    cells: Cells<Vec3>,
    radius: f32,
}

impl PointCells {
    pub fn over(points: &[Vec3], radius: f32) -> Self {
        let per_side = (0.5 / radius) as i32;
        let list = |enter: &mut dyn FnMut(usize, Vec3)| {
            for &p in points {
                enter(number(per_side, cell_at(per_side, p)), p);
            }
        };
        PointCells { cells: Cells::fill(per_side, Vec3::ZERO, list), radius }
    }

    pub fn around(&self, p: Vec3, mut visit: impl FnMut(Vec3)) {
        let per_side = self.cells.per_side;
        let [low, high] = [-1.0, 1.0].map(|side| cell_at(per_side, p + side * self.radius));
        for z in low.z..=high.z {
            for y in low.y..=high.y {
                let row = [low.x, high.x].map(|x| number(per_side, IVec3::new(x, y, z)));
                self.cells.of(row[0], row[1]).iter().for_each(|&near| visit(near));
            }
        }
    }
}

/// The beams that come within a radius of each cell; a photon looks into its own cell.
pub struct BeamCells(Cells<u32>);

impl BeamCells {
    pub fn over(beams: &[Segment], radius: f32) -> Self {
        let per_side = (0.25 / radius) as i32;
        let list = |enter: &mut dyn FnMut(usize, u32)| {
            for (index, beam) in (0..).zip(beams) {
                rasterise(beam, radius, per_side, |cell| enter(cell, index));
            }
        };
        BeamCells(Cells::fill(per_side, 0, list))
    }

    pub fn around(&self, p: Vec3) -> &[u32] {
        let cell = number(self.0.per_side, cell_at(self.0.per_side, p));
        self.0.of(cell, cell)
    }
}

/// Cuts a beam where it crosses the layers of cells along its main axis; each piece is in the cells around its box.
fn rasterise(beam: &Segment, radius: f32, per_side: i32, mut enter: impl FnMut(usize)) {
    let axis = beam.direction.abs().max_position();
    let reach = Vec3::splat(radius * 1.001);
    let (start, end) = (beam.origin, beam.at(beam.length));
    let first = cell_at(per_side, start.min(end) - reach)[axis];
    let last = cell_at(per_side, start.max(end) + reach)[axis];
    for layer in first..=last {
        let [t0, t1] = [layer, layer + 1].map(|plane| {
            let side = (plane - layer) as f32 * 2.0 - 1.0;
            let edge = plane as f32 / per_side as f32 + side * reach[axis];
            ((edge - beam.origin[axis]) / beam.direction[axis]).clamp(0.0, beam.length)
        });
        let (a, b) = (beam.at(t0), beam.at(t1));
        let mut low = cell_at(per_side, a.min(b) - reach);
        let mut high = cell_at(per_side, a.max(b) + reach);
        (low[axis], high[axis]) = (layer, layer);
        for z in low.z..=high.z {
            for y in low.y..=high.y {
                (low.x..=high.x).for_each(|x| enter(number(per_side, IVec3::new(x, y, z))));
            }
        }
    }
}
