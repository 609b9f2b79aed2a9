//! Before the first pass: what all passes go by, learnt from samples that are thrown away.

use super::{error_sums, Run};
use crate::method::balance::{self, Choice, Given};
use crate::method::emission::DirectEmission;
use crate::method::pass::{Pass, PILOT_PASSES};
use crate::method::trial::{Pilots, Trial};
use crate::method::{Counters, Parameters, RenderError};
use crate::plan::{Connections, Plan};
use crate::transport::deposits::PixelSums;
use crate::transport::memory::HoldsReceivers;
use std::time::Instant;

/// Part of a pilot's walks that tells what they cost.
const PROBE: u64 = 8;
/// Walks to learn from for the trial, in those of a pilot.
const PILOTS_OF_LESSONS: u64 = 8;
/// And for the passes to come, in theirs, or so many if that is more, but not more than in so many passes.
const PASSES_OF_LESSONS: u64 = 2;
const LESSONS: u64 = 1 << 18;
const MOST_PASSES_OF_LESSONS: u64 = 4;

/// Walks of a pilot pass, and those that the method may learn from before it, at most.
#[derive(Clone, Copy)]
struct Effort {
    walks: u64,
    lessons: u64,
}

impl<R: HoldsReceivers> Run<'_, R> {
    /// Learns before the first pass what all passes go by. Every render of these parameters does so from the same ray paths and
    /// with the first radii, whichever passes are its own, so that passes can be shared out.
    pub(super) fn learn_when_due(
        &mut self,
        body: &mut impl FnMut(&Pass<R>, &mut PixelSums) -> Result<Counters, RenderError>,
    ) -> Result<(), RenderError> {
        if std::mem::replace(&mut self.has_learnt, true) {
            return Ok(());
        }
        let clock = Instant::now();
        if let Some(trial) = self.trial.take() {
            self.choose(&trial, body)?;
        } else {
            self.teach(self.plan.connections, self.parameters.photons, body)?;
            if self.emission.is_some() {
                let connections = self.plan.connections;
                let walks = self.affordable_pilot(connections, body)?;
                let pilots = self.pilots(connections, Effort { walks, lessons: 0 }, body)?;
                if let Some(emission) = &mut self.emission {
                    emission.learn_level(self.receivers.as_ref(), &pilots.sums[0]);
                }
            }
        }
        self.seconds.photons += clock.elapsed().as_secs_f64();
        if self.jitter.is_some() && self.next_number() < u64::from(self.jitter_every) {
            self.trace_emission(0)?;
        }
        Ok(())
    }

    /// Walks of a pilot pass: not more than of those to come, and the fewer the dearer.
    fn affordable_pilot(
        &self,
        connections: Connections,
        body: &mut impl FnMut(&Pass<R>, &mut PixelSums) -> Result<Counters, RenderError>,
    ) -> Result<u64, RenderError> {
        let pilot = balance::pilot(self.sums.len() as u64);
        let walks = match self.parameters.photons {
            0 => pilot,
            given => pilot.min(given),
        };
        let probe = Effort { walks: walks.div_ceil(PROBE), lessons: 0 };
        let plan = self.plan.connecting(connections);
        let (_, counters) = self.pilot(&plan, PILOT_PASSES[0], probe, body)?;
        Ok(balance::affordable(walks, &counters))
    }

    /// Runs two pilots, whose pictures and counts are thrown away.
    fn pilots(
        &self,
        connections: Connections,
        effort: Effort,
        body: &mut impl FnMut(&Pass<R>, &mut PixelSums) -> Result<Counters, RenderError>,
    ) -> Result<Pilots, RenderError> {
        let plan = self.plan.connecting(connections);
        let [first, second] = PILOT_PASSES;
        let (first, mut counters) = self.pilot(&plan, first, effort, body)?;
        let (second, further) = self.pilot(&plan, second, effort, body)?;
        counters.add(&further);
        Ok(Pilots { sums: [first, second], counters })
    }

    fn pilot(
        &self,
        plan: &Plan,
        number: u64,
        Effort { walks, lessons }: Effort,
        body: &mut impl FnMut(&Pass<R>, &mut PixelSums) -> Result<Counters, RenderError>,
    ) -> Result<(PixelSums, Counters), RenderError> {
        let mut sums = self.receivers.as_ref().new_sums();
        let next = self.next_pass(number, false);
        let pass = Pass { plan, radii: self.initial_radii, walks, lessons, ..next };
        let counters = body(&pass, &mut sums)?;
        Ok((sums, counters))
    }

    /// Chooses, by a trial and by pilots, what nobody gave: who looks for lamps and how often, photons, rays for emission.
    // [Shares of a pass]
    fn choose(
        &mut self,
        trial: &Trial,
        body: &mut impl FnMut(&Pass<R>, &mut PixelSums) -> Result<Counters, RenderError>,
    ) -> Result<(), RenderError> {
        let (candidates, pixels) = (trial.candidates, self.sums.len() as u64);
        let Parameters { seed, photons, connections, connection_samples, .. } = self.parameters;
        let is_free = connections.is_none() || !candidates.any();
        let of_all = if is_free { Connections::NONE } else { candidates };
        let walks = self.affordable_pilot(of_all, body)?;
        let pilot = Effort { walks, lessons: 0 };
        let school = Effort { walks, lessons: PILOTS_OF_LESSONS * walks };
        let alone = is_free.then(|| self.pilots(of_all, school, body)).transpose()?;
        // By the guide of the first pilots: to learn another one is dear, and these photons are among those.
        let effort = if is_free { pilot } else { school };
        let beside = candidates.any().then(|| self.pilots(candidates, effort, body)).transpose()?;
        let (alone, beside) = (alone.as_ref(), beside.as_ref());
        if let Some(emission) = &mut self.emission {
            emission.level = trial.level(alone, beside);
            emission.learn(self.scene, &self.plan, seed, 0)?;
        }
        let emission_share = self.emission.as_ref().map(DirectEmission::share);
        let given = Given {
            photons_per_pixel: (photons > 0).then(|| photons as f64 / pixels as f64),
            lamp_samples: (connection_samples > 0).then_some(f64::from(connection_samples)),
            passes: f64::from(self.jitter_every),
        };
        let judge = |alone, beside, candidates| {
            balance::choose(&trial.judge(alone, beside, emission_share), candidates, given)
        };
        let first = judge(alone, beside, candidates);
        let connections = first.connections;
        if !self.parameters.guides_emission() {
            self.take(first);
            return Ok(());
        }
        self.teach(connections, first.photons(pixels), body)?;
        // How noisy photons are with all that is known by now.
        let taught = self.pilots(connections, pilot, body)?;
        let (alone, beside) =
            if connections.any() { (None, Some(&taught)) } else { (Some(&taught), None) };
        self.take(judge(alone, beside, connections));
        Ok(())
    }

    /// Has the method learn where such photons, so many of them in a pass, are to be shot, by a pass that is thrown away and
    /// shoots next to nothing. Who asks for few photons is not to wait for many.
    fn teach(
        &self,
        connections: Connections,
        photons: u64,
        body: &mut impl FnMut(&Pass<R>, &mut PixelSums) -> Result<Counters, RenderError>,
    ) -> Result<(), RenderError> {
        if !self.parameters.guides_emission() {
            return Ok(());
        }
        let plan = self.plan.connecting(connections);
        let pass = Pass {
            plan: &plan,
            radii: self.initial_radii,
            walks: 1,
            lessons: (PASSES_OF_LESSONS * photons)
                .max(LESSONS.min(MOST_PASSES_OF_LESSONS * photons)),
            ..self.next_pass(PILOT_PASSES[0], false)
        };
        body(&pass, &mut self.receivers.as_ref().new_sums())?;
        Ok(())
    }

    fn take(&mut self, choice: Choice) {
        self.plan.connections = choice.connections;
        if self.passes == 0 {
            self.gathered.error = error_sums(self.scene, &self.parameters, choice.connections);
        }
        if self.parameters.photons == 0 {
            self.parameters.photons = choice.photons(self.sums.len() as u64);
        }
        if choice.connections.any() {
            self.parameters.connection_samples = choice.connections.samples;
        }
        if let Some(emission) = &mut self.emission {
            emission.spend(choice.emission_rays);
        }
    }
}
