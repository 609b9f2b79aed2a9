use crate::math::Segment;
use crate::transport::view::ViewPaths;
use crate::tree::{ApexGrid, ViewBeamTree, ViewPointTree};
use rayon::join;

/// What photons are shot at between two jitters: ray paths and the trees over them.
pub struct Receivers {
    pub paths: ViewPaths,
    /// Beams straight from a pinhole; none where photon beams are shot, which ask the tree alone, and for other lenses.
    apex_grid: Option<ApexGrid>,
    /// Over all other beams.
    beam_tree: ViewBeamTree,
    /// Of each beam of the tree, its index in the paths; none where it is the same.
    in_tree: Option<Vec<u32>>,
    pub point_tree: ViewPointTree,
}

impl Receivers {
    /// The trees over traced paths. [Collin 2013 §5.1]
    pub fn build(paths: ViewPaths) -> Self {
        let segments: Vec<_> = paths.beams.iter().map(|beam| beam.segment).collect();
        let positions = positions(&paths);
        let (beam_tree, point_tree) =
            join(|| ViewBeamTree::build(&segments), || ViewPointTree::build(&positions));
        Receivers { paths, apex_grid: None, beam_tree, in_tree: None, point_tree }
    }

    /// The same for photon points, which find beams from a pinhole without a tree.
    pub fn build_for_points(paths: ViewPaths) -> Self {
        let indexed = (0u32..).zip(&paths.beams);
        let (straight, other): (Vec<_>, Vec<_>) = indexed.partition(|(_, beam)| beam.depth == 0);
        let straight: Vec<(u32, Segment)> =
            straight.into_iter().map(|(index, beam)| (index, beam.segment)).collect();
        let Some(apex_grid) = ApexGrid::build(&straight) else { return Receivers::build(paths) };
        let segments: Vec<_> = other.iter().map(|(_, beam)| beam.segment).collect();
        let in_tree = other.iter().map(|(index, _)| *index).collect();
        let positions = positions(&paths);
        let (beam_tree, point_tree) =
            join(|| ViewBeamTree::build(&segments), || ViewPointTree::build(&positions));
        let apex_grid = Some(apex_grid);
        Receivers { paths, apex_grid, beam_tree, in_tree: Some(in_tree), point_tree }
    }

    /// Calls `visit(index, t, distance_squared)` for every beam around a photon, see [`ViewBeamTree::query`].
    #[inline]
    pub fn beams_around(&self, p: glam::Vec3, radius: f32, mut visit: impl FnMut(u32, f32, f32)) {
        if let Some(grid) = &self.apex_grid {
            grid.query(p, radius, &mut visit);
        }
        match &self.in_tree {
            None => self.beam_tree.query(p, radius, visit),
            Some(index) => {
                self.beam_tree.query(p, radius, |beam, t, d2| visit(index[beam as usize], t, d2));
            }
        }
    }

    /// The tree over all beams, for photon beams.
    pub fn beam_tree(&self) -> &ViewBeamTree {
        assert!(self.in_tree.is_none(), "these receivers were built for photon points");
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
