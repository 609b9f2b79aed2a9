use serde::Serialize;

/// What was done, counted.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Counters {
    pub view_rays: u64,
    pub view_beams: u64,
    pub visible_points: u64,
    /// Walks emitted.
    pub walks: u64,
    /// Events that asked a tree: collisions in media and hits on smooth surfaces.
    pub medium_photons: u64,
    pub surface_photons: u64,
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
        self.visible_points += o.visible_points;
        self.walks += o.walks;
        self.medium_photons += o.medium_photons;
        self.surface_photons += o.surface_photons;
        self.medium_deposits += o.medium_deposits;
        self.surface_deposits += o.surface_deposits;
        self.dropped_photons += o.dropped_photons;
        self.dropped_deposits += o.dropped_deposits;
        self.dropped_view_rays += o.dropped_view_rays;
    }

    /// What was dropped, in sentences for the user.
    pub fn warnings(&self) -> Vec<String> {
        [
            (self.dropped_photons, "photons"),
            (self.dropped_deposits, "contributions of photons"),
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
