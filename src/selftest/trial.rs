//! One run of a case: it renders, holds what it measured against what it expects, and keeps the readings.

use super::bench::{Bench, SelftestError};
use super::judge::Estimate;
use crate::host::session::LoadedScene;
use crate::method::{self, Counters, Method, Parameters, Preset, Silent};
use crate::scene::Scene;
use serde::Serialize;

/// Independent renders per reading.
const SEEDS: u64 = 32;
/// Passes into which the default preset divides those of a case: a sample of a lamp for each takes several.
const FAST_PASSES: u32 = 8;
/// Segments of a walk, on average over a render, beyond which work is not bounded.
const SEGMENTS_PER_WALK: f64 = 400.0;

/// One comparison.
#[derive(Debug, Clone, Serialize)]
pub struct Reading {
    /// Which method, channel or quantity.
    pub what: String,
    pub expected: f64,
    pub measured: f64,
    pub standard_error: f64,
    /// Deviation from what is allowed, in standard errors; 0 where there is none.
    pub z: f64,
    /// Share of photons, contributions and view rays that were dropped.
    pub dropped: f64,
    /// Why the reading does not pass.
    pub fault: Option<String>,
}

/// What a render's film must show on average.
#[derive(Debug, Clone, Copy)]
pub struct Expected {
    /// By channel.
    pub radiance: [f64; 3],
    /// Relative error of the method that the case has derived a bound for.
    pub bias: f64,
    /// Relative fault that must be noticed.
    pub noticed: f64,
    /// Share of samples that may be dropped.
    pub dropped: f64,
}

impl Expected {
    /// The same in all channels; a fault of 30 % must be noticed.
    pub fn grey(radiance: f64) -> Self {
        Expected::rgb([radiance; 3])
    }

    pub fn rgb(radiance: [f64; 3]) -> Self {
        Expected { radiance, bias: 0.0, noticed: 0.3, dropped: 0.0 }
    }

    pub fn with_bias(self, bias: f64) -> Self {
        Expected { bias, ..self }
    }

    pub fn noticing(self, noticed: f64) -> Self {
        Expected { noticed, ..self }
    }
}

/// The renders of one scene with one method.
struct Renders {
    /// Film means by channel, one value per seed.
    means: [Vec<f64>; 3],
    finite: bool,
    counters: Counters,
}

/// A case under way.
pub struct Trial<'a> {
    pub bench: &'a Bench,
    readings: Vec<Reading>,
}

impl<'a> Trial<'a> {
    pub(super) fn new(bench: &'a Bench) -> Self {
        Trial { bench, readings: Vec::new() }
    }

    pub(super) fn into_readings(self) -> Vec<Reading> {
        self.readings
    }

    /// Renders with several methods and judges the mean of the film.
    pub fn film_by(
        &mut self,
        methods: &[Method],
        what: &str,
        scene: &dyn Scene,
        parameters: &Parameters,
        expected: Expected,
    ) -> Result<(), SelftestError> {
        for &method in methods {
            let parameters = Parameters { method, ..parameters.clone() };
            self.film(&format!("{what} {}", method.name()), scene, &parameters, expected)?;
        }
        if methods.contains(&Method::Ppt) {
            self.film(&format!("{what} fast"), scene, &by_default(parameters), expected)?;
        }
        Ok(())
    }

    /// Renders from independent seeds and judges the mean of the film.
    pub fn film(
        &mut self,
        what: &str,
        scene: &dyn Scene,
        parameters: &Parameters,
        expected: Expected,
    ) -> Result<(), SelftestError> {
        let renders = render(scene, parameters)?;
        let dropped = dropped_share(&renders.counters);
        let [r, g, b] = expected.radiance;
        let grey = r == g && g == b && renders.means[0] == renders.means[1];
        for channel in 0..if grey { 1 } else { 3 } {
            let radiance = expected.radiance[channel];
            let estimate = Estimate::of(&renders.means[channel]);
            let bias = expected.bias * radiance.abs();
            let (low, high) = (radiance - bias, radiance + bias);
            let noticed = expected.noticed * radiance.abs().max(f64::MIN_POSITIVE);
            let fault = broken(&renders, dropped, expected.dropped)
                .or_else(|| estimate.fault(low, high, noticed));
            let suffix = if grey { "" } else { [" red", " green", " blue"][channel] };
            self.readings.push(Reading {
                what: format!("{what}{suffix}"),
                expected: radiance,
                measured: estimate.mean,
                standard_error: estimate.standard_error,
                z: estimate.z(low, high),
                dropped,
                fault,
            });
        }
        Ok(())
    }

    /// Renders from independent seeds and judges that the mean of the film is not above a bound, nor below 0.
    pub fn at_most(
        &mut self,
        what: &str,
        scene: &dyn Scene,
        parameters: &Parameters,
        bound: f64,
    ) -> Result<(), SelftestError> {
        let renders = render(scene, parameters)?;
        let dropped = dropped_share(&renders.counters);
        let estimate = Estimate::of(&renders.means[1]);
        let fault =
            broken(&renders, dropped, 0.0).or_else(|| estimate.fault(0.0, bound, f64::INFINITY));
        self.readings.push(Reading {
            what: what.to_owned(),
            expected: bound,
            measured: estimate.mean,
            standard_error: estimate.standard_error,
            z: estimate.z(0.0, bound),
            dropped,
            fault,
        });
        Ok(())
    }

    /// The mean of the film by one of Mitsuba's own integrators.
    pub fn seen_by_mitsuba(
        &self,
        scene: &LoadedScene,
        integrator: &str,
        spp: u32,
    ) -> Result<[f64; 3], SelftestError> {
        let picture = self.bench.render_with(scene, integrator, spp)?;
        let pixels = (picture.len() / 3) as f64;
        let sum = |channel| picture.iter().skip(channel).step_by(3).copied().map(f64::from).sum();
        Ok([0, 1, 2].map(sum).map(|sum: f64| sum / pixels))
    }

    /// Compares two numbers that hold no noise, up to a relative bound.
    pub fn number(&mut self, what: &str, measured: f64, expected: f64, bound: f64) {
        let off = (measured - expected).abs();
        let allowed = bound * expected.abs();
        let fault = (off.is_nan() || off > allowed)
            .then(|| format!("off by {off:.3e}, where {allowed:.3e} is allowed"));
        self.readings.push(Reading {
            what: what.to_owned(),
            expected,
            measured,
            standard_error: 0.0,
            z: 0.0,
            dropped: 0.0,
            fault,
        });
    }
}

/// The same photons with the radii of the first pass, and all that the default preset adds to them.
pub(super) fn by_default(parameters: &Parameters) -> Parameters {
    let Parameters { connections, emission_rays, glossy_chains, guided_emission, .. } =
        Preset::Fast.parameters();
    let passes = parameters.passes * FAST_PASSES;
    Parameters {
        method: Method::Ppt,
        passes,
        jitter_every: 1,
        photons: (parameters.photons / u64::from(FAST_PASSES)).max(1),
        alpha: 1.0 - f32::EPSILON,
        connections,
        emission_rays,
        glossy_chains,
        guided_emission,
        ..parameters.clone()
    }
}

fn render(scene: &dyn Scene, parameters: &Parameters) -> Result<Renders, SelftestError> {
    let channels = scene.description().film_channels as usize;
    let mut renders =
        Renders { means: [const { Vec::new() }; 3], finite: true, counters: Counters::default() };
    for seed in 0..SEEDS {
        let parameters = Parameters { seed, ..parameters.clone() };
        let outcome = method::render(scene, &parameters, &mut Silent)?;
        renders.counters.add(&outcome.stats.counters);
        let values = &outcome.film.values;
        renders.finite &= values.iter().all(|value| value.is_finite());
        let sum = |channel| values.chunks_exact(channels).map(|pixel| pixel[channel]).sum::<f64>();
        let weight = sum(channels - 1);
        for (channel, means) in renders.means.iter_mut().enumerate() {
            means.push(sum(channel) / weight);
        }
    }
    Ok(renders)
}

/// What is wrong with renders whatever their mean.
fn broken(renders: &Renders, dropped: f64, may_drop: f64) -> Option<String> {
    let Counters { segments, walks, .. } = renders.counters;
    if !renders.finite {
        return Some("a pixel is not finite".to_owned());
    }
    if dropped > may_drop {
        return Some(format!("a share of {dropped:.1e} was dropped, {may_drop:.1e} may be"));
    }
    let length = segments as f64 / walks.max(1) as f64;
    (length > SEGMENTS_PER_WALK).then(|| format!("walks have {length:.0} segments on average"))
}

/// The largest share of photons, contributions or view rays that was dropped.
fn dropped_share(c: &Counters) -> f64 {
    let share = |dropped: u64, kept: u64| dropped as f64 / (dropped + kept).max(1) as f64;
    share(c.dropped_photons, c.medium_photons + c.surface_photons)
        .max(share(c.dropped_deposits, c.medium_deposits + c.surface_deposits))
        .max(share(c.dropped_view_rays, c.view_rays))
}
