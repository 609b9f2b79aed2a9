//! Photons as pairs and photon maps see them, read from the vertices of walks.

use crate::math::Rgb;
use crate::plan::Plan;
use crate::scene::{photon_event, PhotonVertices};
use glam::Vec3;

/// Which of the two densities a photon belongs to; each has its own radius and its own chains.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Family {
    Surface,
    Medium,
}

impl Family {
    pub const ALL: [Family; 2] = [Family::Surface, Family::Medium];
}

/// One value per family.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct PerFamily<T> {
    pub surface: T,
    pub medium: T,
}

impl<T> PerFamily<T> {
    pub fn from_fn(mut f: impl FnMut(Family) -> T) -> Self {
        PerFamily { surface: f(Family::Surface), medium: f(Family::Medium) }
    }

    pub fn iter_mut(&mut self) -> impl Iterator<Item = (Family, &mut T)> {
        [(Family::Surface, &mut self.surface), (Family::Medium, &mut self.medium)].into_iter()
    }

    pub fn as_ref(&self) -> PerFamily<&T> {
        PerFamily { surface: &self.surface, medium: &self.medium }
    }
}

impl<T> std::ops::Index<Family> for PerFamily<T> {
    type Output = T;
    fn index(&self, family: Family) -> &T {
        match family {
            Family::Surface => &self.surface,
            Family::Medium => &self.medium,
        }
    }
}

impl<T> std::ops::IndexMut<Family> for PerFamily<T> {
    fn index_mut(&mut self, family: Family) -> &mut T {
        match family {
            Family::Surface => &mut self.surface,
            Family::Medium => &mut self.medium,
        }
    }
}

/// A photon at a real collision.
#[derive(Debug, Clone, Copy)]
pub struct MediumPhoton {
    pub position: Vec3,
    pub direction: Vec3,
    /// \[W\] per emitted walk, the albedo applied.
    pub flux: Rgb,
    pub medium: u32,
    pub depth: u32,
    pub walk: u32,
}

/// A photon on a surface with a smooth lobe.
#[derive(Debug, Clone, Copy)]
pub struct SurfacePhoton {
    pub position: Vec3,
    pub direction: Vec3,
    /// As the shape is oriented.
    pub geometric_normal: Vec3,
    /// \[W\] per emitted walk, before the BSDF.
    pub flux: Rgb,
    pub depth: u32,
    pub walk: u32,
    /// As in [`PhotonVertices`] \[1/sr\].
    pub lamp_density: f32,
    /// Whether visible points find this light by themselves, on the viewer's side. \[Connection\]
    pub is_found: bool,
}

/// What a vertex gives to a density estimate.
#[derive(Debug, Clone, Copy)]
pub enum Event {
    Nothing,
    Medium(MediumPhoton),
    Surface(SurfacePhoton),
}

/// Whether receivers find by themselves what comes along a lane's segment. \[Connection\]
pub fn is_found(v: &PhotonVertices, lane: usize, plan: &Plan, family: Family) -> bool {
    let connects = match family {
        Family::Surface => plan.connections.visible_points,
        Family::Medium => plan.connections.view_beams,
    };
    connects && v.event[lane] & photon_event::STRAIGHT != 0
}

/// The photon at the end of a lane's segment. Walks that end here because their flux is no longer
/// finite, and photons that are not, add to `dropped`.
pub fn event(v: &PhotonVertices, lane: usize, plan: &Plan, dropped: &mut u64) -> Event {
    *dropped += u64::from(v.event[lane] & photon_event::INVALID != 0);
    let event = photon_event::kind(v.event[lane]);
    if event == photon_event::MEDIUM && is_found(v, lane, plan, Family::Medium) {
        return Event::Nothing;
    }
    if event == photon_event::NONE {
        return Event::Nothing;
    }
    let (position, flux) = (v.position.get(lane), v.flux.rgb(lane));
    if !flux.is_finite() || !position.is_finite() {
        *dropped += 1;
        return Event::Nothing;
    }
    let (direction, depth, walk) = (v.direction.get(lane), v.depth[lane], v.walk[lane]);
    if event == photon_event::MEDIUM {
        let medium = v.medium[lane];
        return Event::Medium(MediumPhoton { position, direction, flux, medium, depth, walk });
    }
    let geometric_normal = v.geometric_normal.get(lane);
    Event::Surface(SurfacePhoton {
        position,
        direction,
        geometric_normal,
        flux,
        depth,
        walk,
        lamp_density: v.lamp_density.as_ref().map_or(0.0, |density| density[lane]),
        is_found: is_found(v, lane, plan, Family::Surface),
    })
}
