//! Before the first pass: what all passes go by, learnt from samples that are thrown away.

use super::{error_sums, Run};
use crate::method::balance::{self, Choice, Given};
use crate::method::emission::DirectEmission;
use crate::method::pass::{Pass, PILOT_PASSES};
use crate::method::trial::{Pilots, Trial};
use crate::method::{Counters, Parameters, RenderError};
use crate::plan::Connections;
use crate::transport::deposits::PixelSums;
use crate::transport::memory::HoldsReceivers;
use std::time::Instant;

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
        } else if self.emission.is_some() || self.next_number() > 0 {
            let pilots = self.pilots(self.plan.connections, true, body)?;
            if let Some(emission) = &mut self.emission {
                emission.learn_level(self.receivers.as_ref(), &pilots.sums[0]);
            }
        }
        self.seconds.photons += clock.elapsed().as_secs_f64();
        if self.jitter.is_some() && self.next_number() < u64::from(self.jitter_every) {
            self.trace_emission(0)?;
        }
        Ok(())
    }

    /// Runs two pilots, whose pictures and counts are thrown away; they teach the method, too.
    fn pilots(
        &self,
        connections: Connections,
        teaches: bool,
        body: &mut impl FnMut(&Pass<R>, &mut PixelSums) -> Result<Counters, RenderError>,
    ) -> Result<Pilots, RenderError> {
        let plan = self.plan.connecting(connections);
        let pilot = balance::pilot(self.sums.len() as u64);
        let walks_per_pass = match self.parameters.photons {
            0 => pilot,
            given => given,
        };
        let mut counters = Counters::default();
        let mut run = |number| -> Result<PixelSums, RenderError> {
            let mut thrown_away = self.receivers.as_ref().new_sums();
            let pass = Pass {
                plan: &plan,
                radii: self.initial_radii,
                walks: pilot.min(walks_per_pass),
                walks_per_pass,
                teaches,
                ..self.next_pass(number, false)
            };
            counters.add(&body(&pass, &mut thrown_away)?);
            Ok(thrown_away)
        };
        let [first, second] = PILOT_PASSES;
        let sums = [run(first)?, run(second)?];
        Ok(Pilots { sums, counters })
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
        let alone = is_free.then(|| self.pilots(Connections::NONE, true, body)).transpose()?;
        // By the guide of the first pilots: to learn another one is dear, and these photons are among those.
        let beside =
            candidates.any().then(|| self.pilots(candidates, !is_free, body)).transpose()?;
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
        let choice =
            balance::choose(&trial.judge(alone, beside, emission_share), candidates, given);
        self.take(choice);
        if is_free && choice.connections.any() {
            self.teach(body)?;
        }
        Ok(())
    }

    /// Has the method learn for the connections that were chosen, by a pass that is thrown away and shoots next to nothing. The
    /// number of photons was chosen before: who asks for few is not to wait for many.
    fn teach(
        &self,
        body: &mut impl FnMut(&Pass<R>, &mut PixelSums) -> Result<Counters, RenderError>,
    ) -> Result<(), RenderError> {
        let pass = Pass {
            radii: self.initial_radii,
            walks: 1,
            walks_per_pass: balance::pilot(self.sums.len() as u64).min(self.parameters.photons),
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
