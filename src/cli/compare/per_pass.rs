//! Photons per pass where they depend on what a method makes of them.

use vpt::method::Method;

/// Walks per pass by what they leave.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PerPass {
    pub photons: u64,
    pub beams: u64,
}

impl PerPass {
    pub fn of(self, method: Method) -> u64 {
        match method {
            Method::Ppt | Method::PptMetro | Method::Apa => self.photons,
            Method::Ppbt | Method::PpbtMetro | Method::Ppb => self.beams,
        }
    }
}
