//! How photons of one task look for their receivers: in the order of space, so that neighbours find what others have brought
//! to the cache, or look together.

use super::photon::{MediumPhoton, SurfacePhoton};
use super::receivers::Receivers;
use glam::Vec3;

impl Receivers {
    /// Calls `visit(photon, index, t, distance_squared)` for every beam around each photon, see [`Receivers::beams_around`]. Most
    /// of the time goes by waiting for memory, and what one photon has brought to the cache its neighbours find there.
    #[inline]
    pub fn beams_around_each<'a>(
        &self,
        photons: impl Iterator<Item = &'a MediumPhoton>,
        radius: f32,
        mut visit: impl FnMut(&'a MediumPhoton, u32, f32, f32),
    ) {
        let photons: Vec<_> =
            along_curve(photons, |p| self.place_among_beams(p.position)).collect();
        let places: Vec<Vec3> = photons.iter().map(|photon| photon.position).collect();
        self.beams_around(&places, radius, |which, index, t, d2| {
            visit(photons[which], index, t, d2)
        });
    }

    /// Calls `visit(photon, index, position, distance_squared)` for every visible point closer to a photon than `radius`.
    #[inline]
    pub fn points_around_each<'a>(
        &self,
        photons: impl Iterator<Item = &'a SurfacePhoton>,
        radius: f32,
        mut visit: impl FnMut(&'a SurfacePhoton, u32, Vec3, f32),
    ) {
        let photons: Vec<_> =
            along_curve(photons, |p| self.place_among_points(p.position)).collect();
        let places: Vec<Vec3> = photons.iter().map(|photon| photon.position).collect();
        self.point_tree.query_all(&places, radius, |which, index, position, d2| {
            visit(photons[which], index, position, d2);
        });
    }
}

/// Photons by their places, those of one place in their own order.
fn along_curve<'a, P: 'a>(
    photons: impl Iterator<Item = &'a P>,
    place: impl Fn(&P) -> u32,
) -> impl Iterator<Item = &'a P> {
    let photons: Vec<&P> = photons.collect();
    let mut order: Vec<(u32, u32)> = photons.iter().map(|photon| place(photon)).zip(0..).collect();
    radsort::sort_by_key(&mut order, |(place, _)| *place);
    order.into_iter().map(move |(_, index)| photons[index as usize])
}
