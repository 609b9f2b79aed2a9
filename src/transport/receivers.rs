use crate::math::{Aabb, Approach, MortonCurve, Segment};
use crate::scene::work;
use crate::scene::Scene;
use crate::transport::memory::{HoldsReceivers, ReceiverMemory};
use crate::transport::view::{in_order, ViewBeam, ViewPaths};
use crate::tree::{ApexGrid, ViewBeamTree, ViewPointTree};
use glam::Vec3;

/// What photons are shot at between two jitters: ray paths and the trees over them.
pub struct Receivers {
    pub paths: ViewPaths,
    /// Beams straight from a pinhole; none for other lenses.
    apex_grid: Option<ApexGrid>,
    /// Over all other beams, which follow those of the grid.
    beam_tree: ViewBeamTree,
    pub point_tree: ViewPointTree,
    around_beams: MortonCurve,
    around_points: MortonCurve,
}

impl Receivers {
    /// The trees over traced paths, and a grid over what comes straight from a pinhole. The scene lends the threads that build
    /// them. [Collin 2013 §5.1]
    pub fn build(scene: &dyn Scene, mut paths: ViewPaths) -> Self {
        let points = std::mem::take(&mut paths.points);
        let positions = std::mem::take(&mut paths.point_positions);
        let ((apex_grid, beam_tree, around_beams), (point_tree, points)) = work::join(
            scene,
            || over_beams(&mut paths),
            || {
                let mut tree = ViewPointTree::build(&positions);
                let points = in_order(&points, &tree.take_order());
                (tree, points)
            },
        );
        paths.points = points;
        let around_points = curve_around(positions.iter().copied());
        Receivers { paths, apex_grid, beam_tree, point_tree, around_beams, around_points }
    }

    /// For many photons, neighbours one after another: calls `visit(which, index, t, distance_squared)` for every beam around
    /// each, see [`ViewBeamTree::query`].
    #[inline]
    pub fn beams_around(
        &self,
        photons: &[Vec3],
        radius: f32,
        mut visit: impl FnMut(usize, u32, f32, f32),
    ) {
        let mut in_grid = 0;
        if let Some(grid) = &self.apex_grid {
            for (which, &p) in photons.iter().enumerate() {
                grid.query(p, radius, |index, t, d2| visit(which, index, t, d2));
            }
            in_grid = grid.len() as u32;
        }
        self.beam_tree.query_all(photons, radius, |which, beam, t, d2| {
            visit(which, in_grid + beam, t, d2);
        });
    }

    /// Calls `visit(index, approach)` for every beam that a photon beam comes near to, see [`ViewBeamTree::query_segment`].
    #[inline]
    pub fn beams_along(
        &self,
        photon_beam: &Segment,
        radius: f32,
        mut visit: impl FnMut(u32, Approach),
    ) {
        let mut in_grid = 0;
        if let Some(grid) = &self.apex_grid {
            grid.query_segment(photon_beam, radius, &mut visit);
            in_grid = grid.len() as u32;
        }
        self.beam_tree.query_segment(photon_beam, radius, |beam, pair| visit(in_grid + beam, pair));
    }

    /// A beam that was found.
    #[inline]
    pub fn view_beam(&self, index: u32) -> ViewBeam<'_> {
        let record = &self.paths.beams[index as usize];
        let segment = match &self.apex_grid {
            Some(grid) if (index as usize) < grid.len() => grid.segment(index),
            Some(grid) => self.beam_tree.segment(index - grid.len() as u32),
            None => self.beam_tree.segment(index),
        };
        ViewBeam { record, segment }
    }

    /// Photons in a medium in this order find the same beams one after another.
    #[inline]
    pub fn place_among_beams(&self, p: Vec3) -> u32 {
        match &self.apex_grid {
            Some(grid) => grid.place(p),
            None => self.around_beams.place(p),
        }
    }

    /// Photons on surfaces in this order find the same points one after another.
    #[inline]
    pub fn place_among_points(&self, p: Vec3) -> u32 {
        self.around_points.place(p)
    }
}

impl HoldsReceivers for Receivers {
    fn memory(&self) -> ReceiverMemory {
        let grid = self.apex_grid.as_ref().map_or(0, ApexGrid::memory_bytes);
        let beams = grid + self.beam_tree.memory_bytes();
        ReceiverMemory::of(&self.paths, beams, self.point_tree.memory_bytes())
    }
}

/// The grid over beams straight from a pinhole, the tree over all others and the curve around those. The grid's beams become the
/// first.
fn over_beams(paths: &mut ViewPaths) -> (Option<ApexGrid>, ViewBeamTree, MortonCurve) {
    let indexed = (0u32..).zip(paths.beam_segments.iter().copied());
    let is_straight = |index: u32| paths.beams[index as usize].depth == 0;
    let straight: Vec<_> = indexed.filter(|(index, _)| is_straight(*index)).collect();
    let mut grid = ApexGrid::build(&straight);
    if let Some(grid) = &mut grid {
        paths.move_beams_first(&grid.take_order());
    }
    let in_grid = grid.as_ref().map_or(0, ApexGrid::len);
    let segments = &paths.beam_segments[in_grid..];
    let ends = segments.iter().flat_map(|segment| [segment.origin, segment.at(segment.length)]);
    let around = curve_around(ends);
    let mut tree = ViewBeamTree::build(segments);
    let in_tree = tree.take_order().into_iter().map(|index| in_grid as u32 + index);
    paths.sort_beams(&(0..in_grid as u32).chain(in_tree).collect::<Vec<_>>());
    (grid, tree, around)
}

fn curve_around(places: impl IntoIterator<Item = Vec3>) -> MortonCurve {
    let mut bounds = Aabb::EMPTY;
    places.into_iter().for_each(|p| bounds.grow(p));
    MortonCurve::through(&bounds)
}

impl AsRef<ViewPaths> for Receivers {
    fn as_ref(&self) -> &ViewPaths {
        &self.paths
    }
}
