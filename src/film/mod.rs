//! Sums of film samples over all jitters of the view rays.

/// Weighted sums per pixel and channel, as the scene's film lays them out (its reconstruction
/// filter applied, weights in a channel of their own). Kept in f64: f32 sums stop moving.
#[derive(Debug, Clone, PartialEq)]
pub struct FilmSums {
    pub values: Vec<f64>,
}

impl FilmSums {
    pub fn new(values: usize) -> Self {
        FilmSums { values: vec![0.0; values] }
    }
}
