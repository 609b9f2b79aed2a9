use super::photon::{Family, PerFamily};
use serde::{Deserialize, Serialize};

/// What a deposit costs, in segments of walks; measured on two cores, see docs/PERFORMANCE.md.
const SEGMENTS_PER_DEPOSIT: f64 = 1.0 / 3.0;
/// What a walk costs where photons are not dear, deposits included: so much of it is planned with before anything is known.
pub const SEGMENTS_PER_USUAL_WALK: f64 = 8.0;

/// What was done, counted.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counters {
    pub view_rays: u64,
    pub view_beams: u64,
    /// Of these, view beams behind a refraction.
    pub refracted_beams: u64,
    pub visible_points: u64,
    /// View segments behind a delta or null lobe.
    pub chain_segments: u64,
    /// Ends of view segments that were asked for emission, and view rays that were asked for the sky.
    pub emission_queries: u64,
    pub sky_queries: u64,
    /// View rays that drew a place on the aperture.
    pub aperture_samples: u64,
    /// Points at which extinction was asked for, on behalf of tables along view segments and photon beams.
    pub view_table_samples: u64,
    pub photon_table_samples: u64,
    /// Receivers that looked for a lamp.
    pub connections: u64,
    /// Walks emitted.
    pub walks: u64,
    /// Segments of all walks.
    pub segments: u64,
    /// Of these, segments through media, those of them with weighed channels, and segments behind a scattering.
    pub flights: u64,
    pub weighed_flights: u64,
    pub scattered_segments: u64,
    /// Walks of the uniform stream, and those of them that added something to a pixel, by family. The
    /// ratio is the visible share.
    pub uniform_walks: u64,
    pub visible_walks: PerFamily<u64>,
    /// Photons that looked for receivers: hits on smooth surfaces, and collisions or beams in media.
    pub medium_photons: u64,
    pub surface_photons: u64,
    /// Pairs in media that were weighted by a phase function which depends on directions.
    pub directional_pairs: u64,
    /// Photons that fell within a receiver's radius.
    pub medium_deposits: u64,
    pub surface_deposits: u64,
    /// Samples that were not finite, and were dropped.
    pub dropped_photons: u64,
    pub dropped_deposits: u64,
    pub dropped_view_rays: u64,
}

impl Counters {
    pub fn add(&mut self, o: &Counters) {
        self.view_rays += o.view_rays;
        self.view_beams += o.view_beams;
        self.refracted_beams += o.refracted_beams;
        self.visible_points += o.visible_points;
        self.chain_segments += o.chain_segments;
        self.emission_queries += o.emission_queries;
        self.sky_queries += o.sky_queries;
        self.aperture_samples += o.aperture_samples;
        self.view_table_samples += o.view_table_samples;
        self.photon_table_samples += o.photon_table_samples;
        self.connections += o.connections;
        self.walks += o.walks;
        self.segments += o.segments;
        self.flights += o.flights;
        self.weighed_flights += o.weighed_flights;
        self.scattered_segments += o.scattered_segments;
        self.uniform_walks += o.uniform_walks;
        self.add_visible(o.visible_walks);
        self.medium_photons += o.medium_photons;
        self.surface_photons += o.surface_photons;
        self.directional_pairs += o.directional_pairs;
        self.medium_deposits += o.medium_deposits;
        self.surface_deposits += o.surface_deposits;
        self.dropped_photons += o.dropped_photons;
        self.dropped_deposits += o.dropped_deposits;
        self.dropped_view_rays += o.dropped_view_rays;
    }

    /// What walks took, in units of a segment: an emission takes about as much, and so do some eight
    /// deposits.
    pub fn effort(&self) -> u64 {
        self.walks + self.segments + (self.surface_deposits + self.medium_deposits) / 8
    }

    /// What walks with their deposits cost, in segments.
    pub fn cost(&self) -> f64 {
        let deposits = (self.surface_deposits + self.medium_deposits) as f64;
        self.segments as f64 + SEGMENTS_PER_DEPOSIT * deposits
    }

    /// What one of the walks did; at least a segment.
    pub fn cost_of_walk(&self) -> f64 {
        (self.cost() / self.walks.max(1) as f64).max(1.0)
    }

    pub fn add_visible(&mut self, walks: PerFamily<u64>) {
        for family in Family::ALL {
            self.visible_walks[family] += walks[family];
        }
    }

    /// What was dropped, and whether nothing was seen, in sentences for the user.
    pub fn warnings(&self) -> Vec<String> {
        let dropped = self.dropped_warnings();
        dropped.into_iter().chain(self.invisible_warning()).collect()
    }

    fn invisible_warning(&self) -> Option<String> {
        let receivers = self.view_beams + self.visible_points;
        let deposits = self.medium_deposits + self.surface_deposits;
        (receivers > 0 && self.walks > 0 && deposits + self.connections == 0).then(|| {
            format!(
                "none of {} photon walks reached what the camera sees, so the picture shows directly seen \
                 emission alone; check that the lamps light the view, or give more photons or larger radii",
                self.walks
            )
        })
    }

    fn dropped_warnings(&self) -> Vec<String> {
        [
            (self.dropped_photons, "photons"),
            (self.dropped_deposits, "contributions"),
            (self.dropped_view_rays, "view rays"),
        ]
        .into_iter()
        .filter(|(count, _)| *count > 0)
        .map(|(count, what)| {
            format!(
                "{count} {what} were not finite and were dropped, so the picture may be too dark"
            )
        })
        .collect()
    }
}
