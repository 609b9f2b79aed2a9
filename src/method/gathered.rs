//! What passes brought, in a form that adds up: sums, weights and counts, never means.

use super::{Counters, PhaseSeconds};
use crate::film::error::ErrorSums;
use crate::film::layers::LayerSums;
use crate::film::{value_count, ExactSums, FilmSums};
use crate::markov::FamilyReport;
use crate::scene::{Scene, SceneDescription};
use crate::transport::photon::PerFamily;

/// Sums over whole jitters, and what it took.
#[derive(Debug, Clone, PartialEq)]
pub struct Gathered {
    pub film: ExactSums,
    /// None where emission that is seen directly has no film of its own. [Emission rays]
    pub emission: Option<ExactSums>,
    /// None where layers are not asked for.
    pub layers: Option<LayerSums>,
    /// None where no error is to be estimated.
    pub error: Option<ErrorSums>,
    pub passes: u32,
    pub counters: Counters,
    pub shooting: PerFamily<FamilyReport>,
    /// Wall time, and that of the phases.
    pub seconds: f64,
    pub phase_seconds: PhaseSeconds,
}

impl Gathered {
    pub fn new(
        description: &SceneDescription,
        has_emission_film: bool,
        layers: Option<LayerSums>,
        error: Option<ErrorSums>,
    ) -> Self {
        let sums = || ExactSums::new(value_count(description));
        Gathered {
            film: sums(),
            emission: has_emission_film.then(sums),
            layers,
            error,
            passes: 0,
            counters: Counters::default(),
            shooting: PerFamily::default(),
            seconds: 0.0,
            phase_seconds: PhaseSeconds::default(),
        }
    }

    /// Adds the films of a jitter.
    pub fn add(&mut self, scene: &dyn Scene, film: &FilmSums, emission: Option<&FilmSums>) {
        self.film.add(scene, film);
        if let (Some(sums), Some(emission)) = (&mut self.emission, emission) {
            sums.add(scene, emission);
        }
    }

    /// Adds what later passes of the same render brought. Films come out the same bits in whichever groups they are added.
    pub fn merge(&mut self, later: &Gathered) {
        self.film.merge(&later.film);
        if let (Some(mine), Some(theirs)) = (&mut self.emission, &later.emission) {
            mine.merge(theirs);
        }
        if let (Some(mine), Some(theirs)) = (&mut self.layers, &later.layers) {
            mine.merge(theirs);
        }
        if let (Some(mine), Some(theirs)) = (&mut self.error, &later.error) {
            mine.merge(theirs);
        }
        self.passes += later.passes;
        self.counters.add(&later.counters);
        let shooting = self.shooting;
        self.shooting = PerFamily::from_fn(|family| shooting[family].and(later.shooting[family]));
        self.seconds += later.seconds;
        self.phase_seconds.add(&later.phase_seconds);
    }

    /// The film of all that was gathered; `channels` are those of a pixel.
    pub fn picture(&self, channels: usize) -> FilmSums {
        combined(&self.film, self.emission.as_ref(), channels)
    }

    /// Weighted sums of the layers, if there are any.
    pub fn layer_sums(&self, channels: usize) -> Option<Vec<f64>> {
        let emission = self.emission.as_ref().map(ExactSums::rounded);
        let layers = self.layers.as_ref()?;
        Some(layers.finish(channels, &self.film.rounded(), emission.as_ref(), self.passes))
    }

    /// The film with a jitter on top.
    pub fn picture_with(
        &self,
        scene: &dyn Scene,
        film: &FilmSums,
        emission: Option<&FilmSums>,
    ) -> FilmSums {
        let channels = scene.description().film_channels as usize;
        let with = |sums: &ExactSums, film| {
            let mut sums = sums.clone();
            sums.add(scene, film);
            sums
        };
        let emission = self.emission.as_ref().zip(emission).map(|(sums, film)| with(sums, film));
        combined(&with(&self.film, film), emission.as_ref(), channels)
    }
}

fn combined(film: &ExactSums, emission: Option<&ExactSums>, channels: usize) -> FilmSums {
    let mut film = film.rounded();
    if let Some(emission) = emission {
        film.add_mean(&emission.rounded(), channels);
    }
    film
}
