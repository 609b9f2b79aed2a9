//! What came of a plan: effects, and the work that each took.

use crate::effect::Effect;
use crate::markov::{FamilyReport, Mode};
use crate::plan::{Finding, Plan};
use crate::transport::counters::Counters;
use crate::transport::photon::PerFamily;
use serde::Serialize;

/// An effect, whether it was simulated and why, and the work that it took.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EffectReport {
    #[serde(flatten)]
    pub finding: Finding,
    pub work: Work,
    /// What the work is counted in.
    pub unit: &'static str,
}

/// Work done for view rays, which comes with each jitter, and for photons, which comes with each pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Work {
    pub view: u64,
    pub photons: u64,
}

impl Work {
    const fn of_view(view: u64) -> Self {
        Work { view, photons: 0 }
    }

    const fn of_photons(photons: u64) -> Self {
        Work { view: 0, photons }
    }

    pub fn total(self) -> u64 {
        self.view + self.photons
    }
}

impl EffectReport {
    /// The reports on all effects of a plan, in their order.
    pub fn all(
        plan: &Plan,
        counters: &Counters,
        shooting: PerFamily<FamilyReport>,
    ) -> Vec<EffectReport> {
        let report = |finding: &Finding| {
            let work = work(finding.effect, counters, shooting);
            let unit = finding.effect.unit();
            EffectReport { finding: settled(finding, work, shooting), work, unit }
        };
        plan.findings.iter().map(report).collect()
    }
}

/// The work that was done for an effect, in its unit.
fn work(effect: Effect, c: &Counters, shooting: PerFamily<FamilyReport>) -> Work {
    match effect {
        Effect::SurfaceGathering => Work::of_photons(c.surface_photons),
        Effect::VisiblePoints => Work::of_view(c.visible_points),
        Effect::ViewBeams => Work::of_view(c.view_beams),
        Effect::MediumSampling => Work::of_photons(c.flights),
        Effect::MultipleScattering => Work::of_photons(c.scattered_segments),
        Effect::TransmittanceTables => {
            Work { view: c.view_table_samples, photons: c.photon_table_samples }
        }
        Effect::ColouredExtinction => Work::of_photons(c.weighed_flights),
        Effect::AnisotropicPhase => Work::of_photons(c.directional_pairs),
        Effect::SpecularChains => Work::of_view(c.chain_segments),
        Effect::RefractionIntoMedia => Work::of_view(c.refracted_beams),
        Effect::DirectEmission => Work::of_view(c.emission_queries),
        Effect::Environment => Work::of_view(c.sky_queries),
        Effect::DepthOfField => Work::of_view(c.aperture_samples),
        Effect::MetropolisSurface => Work::of_photons(shooting.surface.counts.mutated_walks),
        Effect::MetropolisMedium => Work::of_photons(shooting.medium.counts.mutated_walks),
    }
}

/// A finding, narrowed down by what came up and by the visible share.
fn settled(finding: &Finding, work: Work, shooting: PerFamily<FamilyReport>) -> Finding {
    if !finding.on || finding.forced {
        return finding.clone();
    }
    match finding.effect {
        Effect::MetropolisSurface => by_share(finding, shooting.surface),
        Effect::MetropolisMedium => by_share(finding, shooting.medium),
        _ if work.total() == 0 => {
            let reason = format!("nothing to do it on came into view; {}", finding.reason);
            Finding { on: false, reason, ..finding.clone() }
        }
        _ => finding.clone(),
    }
}

/// What the shooter decided about a family's chains.
fn by_share(finding: &Finding, family: FamilyReport) -> Finding {
    let share = 100.0 * family.visible_share;
    let (on, reason) = match family.mode {
        Mode::Metropolis => (true, format!("{share:.2} % of the photons are seen")),
        Mode::Uniform => (false, format!("{share:.2} % of the photons are seen, which is enough")),
        Mode::Off => (false, "nothing that photons could be steered to is in view".to_owned()),
    };
    Finding { on, reason, ..finding.clone() }
}
