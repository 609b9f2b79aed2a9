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
        let place = |p| self.place_among_beams(p);
        let (photons, positions) = along_curve(photons, |photon| photon.position, place);
        self.beams_around(&positions, radius, |which, index, t, d2| {
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
        let place = |p| self.place_among_points(p);
        let (photons, positions) = along_curve(photons, |photon| photon.position, place);
        self.point_tree.query_all(&positions, radius, |which, index, position, d2| {
            visit(photons[which], index, position, d2);
        });
    }
}

/// Photons by their places on a curve, those of one place in their own order; and where they are.
fn along_curve<'a, P>(
    photons: impl Iterator<Item = &'a P>,
    position: impl Fn(&P) -> Vec3,
    place: impl Fn(Vec3) -> u32,
) -> (Vec<&'a P>, Vec<Vec3>) {
    let photons: Vec<&P> = photons.collect();
    let mut order: Vec<(u32, u32)> =
        photons.iter().map(|photon| place(position(photon))).zip(0..).collect();
    radsort::sort_by_key(&mut order, |(place, _)| *place);
    let in_order = order.into_iter().map(|(_, index)| photons[index as usize]);
    in_order.map(|photon| (photon, position(photon))).unzip()
}
