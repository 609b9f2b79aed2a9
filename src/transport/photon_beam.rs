//! Photon beams: the ways of photons through media, from one vertex to the next. [Jarosz 2011]

use super::extent::{far, visible_length};
use super::photon::{is_found, Family};
use super::tabulate::{tabulate, Crossing};
use crate::math::{Aabb, Rgb, Segment};
use crate::medium::{transmittance, TransmittanceTables, NO_TABLE};
use crate::plan::Plan;
use crate::scene::*;
use rand_pcg::Pcg64Mcg;
use serde::Serialize;

/// How far a photon beam reaches.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum BeamKind {
    /// To where the photon collided: how often it gets there stands for the transmittance.
    Short,
    /// To the next surface, with the transmittance as a weight.
    Long,
}

/// A beam's name that does not exist.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("unknown photon_beams \"{0}\"; use \"short\" or \"long\"")]
pub struct UnknownBeamKind(pub String);

impl std::str::FromStr for BeamKind {
    type Err = UnknownBeamKind;
    fn from_str(name: &str) -> Result<Self, UnknownBeamKind> {
        match name {
            "short" => Ok(BeamKind::Short),
            "long" => Ok(BeamKind::Long),
            _ => Err(UnknownBeamKind(name.to_owned())),
        }
    }
}

/// What happens to a beam's flux on its way.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Attenuation {
    /// A short beam in a grey medium.
    None,
    /// A short beam in a coloured medium: it got here as any hero channel might have.
    Mixture { density: Rgb },
    /// A long beam.
    Transmittance,
}

/// A photon beam.
#[derive(Debug, Clone, Copy)]
pub struct PhotonBeam {
    pub segment: Segment,
    /// [W] per emitted walk, at the start of the segment.
    flux: Rgb,
    attenuation: Attenuation,
    /// Transmittance table along the beam, or [`NO_TABLE`].
    table: u32,
    pub medium: u32,
    pub depth: u32,
    pub walk: u32,
}

impl PhotonBeam {
    /// The beam of a vertex's segment; none in vacuum and where nothing scatters. The table is not made.
    fn of_lane(
        kind: BeamKind,
        media: &[Medium],
        bounds: &Aabb,
        v: &PhotonVertices,
        lane: usize,
    ) -> Option<Self> {
        let segments = v.segments.as_ref().expect("segments were asked for");
        let medium_index = v.medium[lane];
        if medium_index == VACUUM {
            return None;
        }
        let medium = &media[medium_index as usize];
        if !medium.scatters() {
            return None;
        }
        let (attenuation, length) = match kind {
            BeamKind::Long => (Attenuation::Transmittance, segments.reach[lane]),
            BeamKind::Short if medium.grey => (Attenuation::None, v.length[lane]),
            BeamKind::Short => {
                (Attenuation::Mixture { density: segments.density.rgb(lane) }, v.length[lane])
            }
        };
        let (origin, direction) = (segments.origin.get(lane), v.direction.get(lane));
        // Nothing is scattered or absorbed outside the bounds of a varying medium.
        let (start, end) = match medium.extinction {
            Extinction::Constant(sigma_t) => (0.0, visible_length(sigma_t, bounds)),
            Extinction::Varying { .. } => {
                let (start, end) = medium.bounds.clip(origin, direction)?;
                (start, end.min(start + far(bounds)))
            }
        };
        let (origin, length) = (origin + start * direction, length.min(end) - start);
        let flux = segments.flux.rgb(lane);
        let is_beam = length > 0.0 && flux.is_finite() && flux.max_component() > 0.0;
        is_beam.then_some(PhotonBeam {
            segment: Segment { origin, direction, length },
            flux,
            attenuation,
            table: NO_TABLE,
            medium: medium_index,
            depth: v.depth[lane],
            walk: v.walk[lane],
        })
    }

    /// Whether the flux along the beam takes a table.
    fn needs_table(&self, media: &[Medium]) -> bool {
        let varying = matches!(media[self.medium as usize].extinction, Extinction::Varying { .. });
        varying && self.attenuation != Attenuation::None
    }

    /// Flux \[W\] per emitted walk at distance `t`.
    // [Short beam] [Long beam]
    pub fn flux_at(&self, t: f32, media: &[Medium], tables: &TransmittanceTables) -> Rgb {
        let tr = || match media[self.medium as usize].extinction {
            Extinction::Constant(sigma_t) => transmittance(sigma_t, t),
            Extinction::Varying { .. } if self.table == NO_TABLE => Rgb::ONE,
            Extinction::Varying { .. } => tables.transmittance(self.table, t),
        };
        match self.attenuation {
            Attenuation::None => self.flux,
            Attenuation::Transmittance => self.flux * tr(),
            Attenuation::Mixture { density } => {
                let tr = tr();
                self.flux * tr / (density * tr).mean().max(f32::MIN_POSITIVE)
            }
        }
    }
}

/// Photon beams and their tables.
#[derive(Debug, Default)]
pub struct PhotonBeams {
    pub beams: Vec<PhotonBeam>,
    pub tables: TransmittanceTables,
    /// Points at which extinction was asked for.
    pub table_samples: u64,
}

impl PhotonBeams {
    /// The beams of one step of walks.
    pub fn of_vertices(
        kind: BeamKind,
        scene: &dyn Scene,
        plan: &Plan,
        v: &PhotonVertices,
        rng: &mut Pcg64Mcg,
    ) -> SceneResult<Self> {
        let (media, bounds) = (&plan.media, &scene.description().bounds);
        let of_lane = |lane| PhotonBeam::of_lane(kind, media, bounds, v, lane);
        let lanes = (0..v.event.len()).filter(|&lane| !is_found(v, lane, plan, Family::Medium));
        let mut out =
            PhotonBeams { beams: lanes.filter_map(of_lane).collect(), ..PhotonBeams::default() };
        out.tabulate(scene, media, rng)?;
        Ok(out)
    }

    fn tabulate(
        &mut self,
        scene: &dyn Scene,
        media: &[Medium],
        rng: &mut Pcg64Mcg,
    ) -> SceneResult<()> {
        let mut beams: Vec<_> = self.beams.iter_mut().filter(|b| b.needs_table(media)).collect();
        let crossings: Vec<_> = beams
            .iter()
            .map(|beam| Crossing { segment: beam.segment, medium: beam.medium })
            .collect();
        let (tables, samples) = tabulate(scene, media, &crossings, rng, &mut self.tables)?;
        self.table_samples += samples;
        for (beam, table) in beams.iter_mut().zip(tables) {
            beam.table = table;
        }
        Ok(())
    }

    /// Takes over other beams.
    pub fn append(&mut self, other: PhotonBeams) {
        let offset = self.tables.append(other.tables);
        self.table_samples += other.table_samples;
        self.beams.extend(other.beams.into_iter().map(|beam| {
            let table = if beam.table == NO_TABLE { NO_TABLE } else { beam.table + offset };
            PhotonBeam { table, ..beam }
        }));
    }
}
