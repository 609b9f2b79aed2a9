use crate::transport::view::ViewPaths;
use crate::tree::{ViewBeamTree, ViewPointTree};

/// What photons are shot at between two jitters: ray paths and the trees over them.
pub struct Receivers {
    pub paths: ViewPaths,
    pub beam_tree: ViewBeamTree,
    pub point_tree: ViewPointTree,
}

impl Receivers {
    /// The trees over traced paths. [Collin 2013 §5.1]
    pub fn build(paths: ViewPaths) -> Self {
        let segments: Vec<_> = paths.beams.iter().map(|beam| beam.segment).collect();
        let points: Vec<_> = paths.points.iter().map(|point| point.position).collect();
        let (beam_tree, point_tree) =
            rayon::join(|| ViewBeamTree::build(&segments), || ViewPointTree::build(&points));
        Receivers { paths, beam_tree, point_tree }
    }

    pub fn pixels(&self) -> usize {
        self.paths.film.len()
    }
}

impl AsRef<ViewPaths> for Receivers {
    fn as_ref(&self) -> &ViewPaths {
        &self.paths
    }
}
