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
    pub fn build(mut paths: ViewPaths) -> Self {
        let segments: Vec<_> = paths.beams.iter().map(|beam| beam.segment).collect();
        let positions = positions(&paths);
        let (beam_tree, mut point_tree) =
            join(|| ViewBeamTree::build(&segments), || ViewPointTree::build(&positions));
        paths.sort_points(&point_tree.take_order());
        Receivers { paths, apex_grid: None, beam_tree, point_tree }
    }

    /// The same for photon points, which find beams from a pinhole without a tree.
    pub fn build_for_points(mut paths: ViewPaths) -> Self {
        let indexed = (0u32..).zip(&paths.beams);
        let straight = indexed.filter(|(_, beam)| beam.depth == 0);
        let straight: Vec<_> = straight.map(|(index, beam)| (index, beam.segment)).collect();
        let Some(mut grid) = ApexGrid::build(&straight) else { return Receivers::build(paths) };
        let in_grid = grid.take_order();
        paths.move_beams_first(&in_grid);
        let other = &paths.beams[in_grid.len()..];
        let segments: Vec<_> = other.iter().map(|beam| beam.segment).collect();
        let positions = positions(&paths);
        let (beam_tree, mut point_tree) =
            join(|| ViewBeamTree::build(&segments), || ViewPointTree::build(&positions));
        paths.sort_points(&point_tree.take_order());
        Receivers { paths, apex_grid: Some(grid), beam_tree, point_tree }
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

fn positions(paths: &ViewPaths) -> Vec<glam::Vec3> {
    paths.points.iter().map(|point| point.position).collect()
}

impl AsRef<ViewPaths> for Receivers {
    fn as_ref(&self) -> &ViewPaths {
        &self.paths
    }
}
