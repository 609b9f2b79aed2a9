use crate::transport::memory::{HoldsReceivers, ReceiverMemory};
use crate::transport::view::ViewPaths;
use crate::tree::{ApexGrid, ViewBeamTree, ViewPointTree};
use rayon::join;

/// What photons are shot at between two jitters: ray paths and the trees over them.
pub struct Receivers {
    pub paths: ViewPaths,
    /// Beams straight from a pinhole; none where photon beams are shot, which ask the tree alone, and for other lenses.
    apex_grid: Option<ApexGrid>,
    /// Over all other beams, which follow those of the grid.
    beam_tree: ViewBeamTree,
    pub point_tree: ViewPointTree,
}

impl Receivers {
    /// The trees over traced paths. [Collin 2013 §5.1]
    pub fn build(paths: ViewPaths) -> Self {
        Receivers::beside_grid(paths, None)
    }

    /// The same for photon points, which find beams from a pinhole without a tree.
    pub fn build_for_points(mut paths: ViewPaths) -> Self {
        let indexed = (0u32..).zip(&paths.beams);
        let straight = indexed.filter(|(_, beam)| beam.depth == 0);
        let straight: Vec<_> = straight.map(|(index, beam)| (index, beam.segment)).collect();
        let mut grid = ApexGrid::build(&straight);
        if let Some(grid) = &mut grid {
            paths.move_beams_first(&grid.take_order());
        }
        Receivers::beside_grid(paths, grid)
    }

    /// The trees over what is not in the grid, whose beams are the first.
    fn beside_grid(mut paths: ViewPaths, apex_grid: Option<ApexGrid>) -> Self {
        let in_grid = apex_grid.as_ref().map_or(0, ApexGrid::len);
        let segments: Vec<_> = paths.beams[in_grid..].iter().map(|beam| beam.segment).collect();
        let positions = &paths.point_positions;
        let (beam_tree, mut point_tree) =
            join(|| ViewBeamTree::build(&segments), || ViewPointTree::build(positions));
        paths.sort_points(&point_tree.take_order());
        Receivers { paths, apex_grid, beam_tree, point_tree }
    }

    /// Calls `visit(index, t, distance_squared)` for every beam around a photon, see [`ViewBeamTree::query`].
    #[inline]
    pub fn beams_around(&self, p: glam::Vec3, radius: f32, mut visit: impl FnMut(u32, f32, f32)) {
        let mut in_grid = 0;
        if let Some(grid) = &self.apex_grid {
            grid.query(p, radius, &mut visit);
            in_grid = grid.len() as u32;
        }
        self.beam_tree.query(p, radius, |beam, t, d2| visit(in_grid + beam, t, d2));
    }

    /// The tree over all beams, for photon beams.
    pub fn beam_tree(&self) -> &ViewBeamTree {
        assert!(self.apex_grid.is_none(), "these receivers were built for photon points");
        &self.beam_tree
    }

    pub fn pixels(&self) -> usize {
        self.paths.film.len()
    }
}

impl HoldsReceivers for Receivers {
    fn memory(&self) -> ReceiverMemory {
        let grid = self.apex_grid.as_ref().map_or(0, ApexGrid::memory_bytes);
        let beams = grid + self.beam_tree.memory_bytes();
        ReceiverMemory::of(&self.paths, beams, self.point_tree.memory_bytes())
    }
}

impl AsRef<ViewPaths> for Receivers {
    fn as_ref(&self) -> &ViewPaths {
        &self.paths
    }
}
