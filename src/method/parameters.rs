use super::Preset;
use crate::density::radius::{Schedule, UnknownSchedule};
use crate::effect::{Effects, UnknownEffect};
use crate::plan::{Connections, Plan, Steering, Wishes};
use crate::scene::{PathLimits, SceneDescription};
use crate::transport::photon_beam::{BeamKind, UnknownBeamKind};
use serde::Serialize;
use std::time::Duration;

/// Photons per pixel and pass where none are given and chains shoot them.
const PHOTONS_OF_CHAINS: u64 = 2;
const FEWEST_PHOTONS: u64 = 1 << 14;
/// Chains of a family at most: each keeps a walk and what it adds, some kilobytes, from pass to pass.
const MOST_CHAINS: u64 = 1 << 20;
/// Passes at the same view rays where chains shoot: their states are seen anew at each change.
const PASSES_OF_CHAINS: u32 = 4;

const MOST_SAMPLES_OF_CONNECTIONS: u32 = 1024;

/// The algorithm that renders. [Collin 2013 §6]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Progressive photon tracing: uniform photons into view beams and visible points.
    Ppt,
    /// Progressive photon beam tracing: uniform photon beams into view beams.
    Ppbt,
    /// `ppt` with photons steered by Metropolis chains.
    PptMetro,
    /// `ppbt` with photons steered by Metropolis chains.
    PpbtMetro,
    /// A probabilistic approach (Knaus & Zwicker 2011): photon maps and the beam radiance estimate.
    Apa,
    /// Progressive photon beams (Jarosz et al. 2011): photon beams in a hierarchy.
    Ppb,
}

impl Method {
    pub const ALL: [Method; 6] =
        [Method::Ppt, Method::Ppbt, Method::PptMetro, Method::PpbtMetro, Method::Apa, Method::Ppb];

    pub fn name(self) -> &'static str {
        match self {
            Method::Ppt => "ppt",
            Method::Ppbt => "ppbt",
            Method::PptMetro => "ppt_metro",
            Method::PpbtMetro => "ppbt_metro",
            Method::Apa => "apa",
            Method::Ppb => "ppb",
        }
    }

    /// All names, for messages.
    fn names() -> String {
        Method::ALL.map(Method::name).join(", ")
    }
}

/// Where photons are shot from in primary sample space.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Shooting {
    /// Everywhere alike.
    Uniform,
    /// By chains that stay where photons are seen.
    Metropolis,
    /// Uniformly where a good share of the photons is seen, by chains where it is not; for surfaces and
    /// media each.
    Auto,
}

impl Shooting {
    pub fn name(self) -> &'static str {
        match self {
            Shooting::Uniform => "uniform",
            Shooting::Metropolis => "metropolis",
            Shooting::Auto => "auto",
        }
    }
}

/// Everything that a render depends on besides the scene. Names are those of the XML properties.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Parameters {
    pub method: Method,
    /// How photons are shot; none = as the method's name has it.
    pub shooting: Option<Shooting>,
    /// Metropolis chains per family; 0 = from the photons per pass.
    pub chains: u64,
    /// How far photon beams reach.
    pub photon_beams: BeamKind,
    /// Whether view beams and visible points find by themselves what comes straight from a lamp, so that photons carry the
    /// rest alone (`connections`); none = where a trial finds less noise for the time.
    pub connections: Option<bool>,
    /// Samples of the lamps for each receiver that looks for them (`connection_samples`); 0 = by how noisy they are.
    pub connection_samples: u32,
    /// Whether edges of lamps that are seen directly get rays of their own (`emission_rays`).
    pub emission_rays: bool,
    /// Whether view rays go on in the sharp directions of glossy surfaces (`glossy_chains`).
    pub glossy_chains: bool,
    /// Whether photons that are shot uniformly leave lamps where, and in directions in which, they are seen (`guided_emission`).
    pub guided_emission: bool,
    /// Effects that are simulated though the scene does not call for them.
    pub effects: Effects,
    /// Photon passes (`spp` of the scene's sampler).
    pub passes: u32,
    /// Number of the first of them; not 0 where those before it are rendered elsewhere.
    pub first_pass: u32,
    /// Walks emitted per pass (`photons`); 0 = by how noisy they are in the scene and what they cost.
    pub photons: u64,
    /// View rays are jittered and both trees rebuilt every so many passes (`jitter_every`); 0 = by the way of shooting.
    pub jitter_every: u32,
    /// Share of the photons kept from pass to pass, in (0,1) (`alpha`).
    pub alpha: f32,
    /// Radius of a visible point's disk in the first pass \[length\]; 0 = from the pixel footprint.
    pub surface_radius: f32,
    /// Radius of a view beam in the first pass \[length\]; 0 = from the pixel footprint.
    pub medium_radius: f32,
    pub radius_schedule: Schedule,
    #[serde(flatten)]
    pub limits: PathLimits,
    /// Whether noise and bias are estimated as the render runs (`estimate_error`).
    pub estimate_error: bool,
    /// Whether radiance of surfaces, of media and of direct emission is kept apart, too, and photons are counted by pixel
    /// (`layers`).
    pub layers: bool,
    /// The estimated relative error at which the render ends; 0 = none (`target_error`).
    pub target_error: f64,
    pub seed: u64,
    /// Wall time after which no new pass starts.
    #[serde(serialize_with = "serialize_timeout")]
    pub timeout: Option<Duration>,
}

/// In seconds, as the XML has it; `null` without a timeout.
fn serialize_timeout<S: serde::Serializer>(
    timeout: &Option<Duration>,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    timeout.map(|timeout| timeout.as_secs_f64()).serialize(serializer)
}

impl Default for Parameters {
    fn default() -> Self {
        Preset::default().parameters()
    }
}

/// A parameter that cannot be used, with the mend.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ParameterError {
    #[error("unknown method \"{0}\"; use one of: {known}", known = Method::names())]
    UnknownMethod(String),
    #[error("unknown shooting \"{0}\"; use \"uniform\", \"metropolis\" or \"auto\"")]
    UnknownShooting(String),
    #[error(
        "shooting is {shooting}, but method \"{method}\" always shoots otherwise; leave shooting out or \
         use method \"{other}\"",
        shooting = .shooting.name(), method = .method.name(), other = .other.name()
    )]
    ShootingAgainstMethod { shooting: Shooting, method: Method, other: Method },
    #[error(transparent)]
    UnknownBeamKind(#[from] UnknownBeamKind),
    #[error(transparent)]
    UnknownEffect(#[from] UnknownEffect),
    #[error(transparent)]
    UnknownSchedule(#[from] UnknownSchedule),
    #[error("{name} is {value}, but must be a finite number >= 0 (0 = from the pixel footprint)")]
    BadRadius { name: &'static str, value: f32 },
    #[error("alpha is {0}, but must lie strictly between 0 and 1")]
    BadAlpha(f32),
    #[error("unknown preset \"{0}\"; use \"fast\" or \"paper\"")]
    UnknownPreset(String),
    #[error("{name} is {value}, but must be at least 0 (0 = automatic)")]
    TooSmall { name: &'static str, value: i64 },
    #[error(
        "connection_samples is {0}, but must lie between 0 (automatic) and {MOST_SAMPLES_OF_CONNECTIONS}"
    )]
    BadConnectionSamples(i64),
    #[error("passes is 0, but must be at least 1")]
    NoPasses,
    #[error(
        "the passes begin at {first_pass}, but view rays stay for {jitter_every} passes (jitter_every), which cannot be shared \
         out; begin at {before} or {next}",
        next = u64::from(*before) + u64::from(*jitter_every)
    )]
    SplitJitter { first_pass: u32, jitter_every: u32, before: u32 },
    #[error("chains is {0}, but must be at least 0 (0 = from the photons per pass)")]
    BadChains(i64),
    #[error("chains is {0}, but must be at most {MOST_CHAINS}; 0 chooses by the photons per pass")]
    TooManyChains(u64),
    #[error("max_depth is {0}, but must be -1 (unbounded) or at least 0")]
    BadMaxDepth(i64),
    #[error("target_error is {0}, but must be a finite number >= 0 (0.01 is 1 %; 0 = none)")]
    BadTargetError(f64),
    #[error(
        "target_error is {0}, but estimate_error is false, so it could never be reached; set \
         estimate_error to true"
    )]
    BlindTarget(f64),
    #[error("rr_depth is {0}, but must be at least 1")]
    BadRrDepth(i64),
}

impl std::str::FromStr for Method {
    type Err = ParameterError;
    fn from_str(name: &str) -> Result<Self, ParameterError> {
        Method::ALL
            .into_iter()
            .find(|method| method.name() == name)
            .ok_or_else(|| ParameterError::UnknownMethod(name.to_owned()))
    }
}

impl std::str::FromStr for Shooting {
    type Err = ParameterError;
    fn from_str(name: &str) -> Result<Self, ParameterError> {
        [Shooting::Uniform, Shooting::Metropolis, Shooting::Auto]
            .into_iter()
            .find(|shooting| shooting.name() == name)
            .ok_or_else(|| ParameterError::UnknownShooting(name.to_owned()))
    }
}

impl Parameters {
    /// How photons are shot.
    pub fn shooting(&self) -> Shooting {
        self.shooting.unwrap_or(match self.method {
            Method::PptMetro | Method::PpbtMetro => Shooting::Metropolis,
            Method::Ppt | Method::Ppbt | Method::Apa | Method::Ppb => Shooting::Uniform,
        })
    }

    /// Whether photons leave the lamps as is learnt before the first pass: those of methods that shoot them uniformly and keep
    /// none.
    pub fn guides_emission(&self) -> bool {
        let streams = matches!(self.method, Method::Ppt | Method::Ppbt);
        self.guided_emission && streams && self.shooting() == Shooting::Uniform
    }

    /// What is simulated of a scene.
    pub fn plan(&self, scene: &SceneDescription) -> Plan {
        let steering = match self.shooting() {
            Shooting::Uniform => Steering::Never,
            Shooting::Metropolis => Steering::Always,
            Shooting::Auto => Steering::Measured,
        };
        let Parameters { limits, effects: forced, glossy_chains, .. } = *self;
        let samples = self.connection_samples.max(1);
        let wanted = self.connections == Some(true);
        let connections = Connections { visible_points: wanted, view_beams: wanted, samples };
        Plan::new(scene, Wishes { limits, forced, steering, connections, glossy_chains })
    }

    /// The same with numbers in place of what is to be chosen by the scene's film; photons that are shot uniformly stay
    /// open, for they depend on what a pilot costs.
    pub fn settled(&self, scene: &SceneDescription) -> Parameters {
        let [width, height] = scene.film_size.map(u64::from);
        let with_chains = self.shooting() != Shooting::Uniform;
        let photons = match self.photons {
            0 if with_chains => (PHOTONS_OF_CHAINS * width * height).max(FEWEST_PHOTONS),
            given => given,
        };
        let jitter_every = match self.jitter_every {
            0 if with_chains => PASSES_OF_CHAINS,
            0 => 1,
            given => given,
        };
        Parameters { photons, jitter_every, ..self.clone() }
    }

    /// Checks ranges before any work is done.
    pub fn validate(&self) -> Result<(), ParameterError> {
        self.check_shooting()?;
        for (name, value) in
            [("surface_radius", self.surface_radius), ("medium_radius", self.medium_radius)]
        {
            if !(value.is_finite() && value >= 0.0) {
                return Err(ParameterError::BadRadius { name, value });
            }
        }
        if !(self.alpha > 0.0 && self.alpha < 1.0) {
            return Err(ParameterError::BadAlpha(self.alpha));
        }
        self.check_target_error()?;
        if self.connection_samples > MOST_SAMPLES_OF_CONNECTIONS {
            return Err(ParameterError::BadConnectionSamples(self.connection_samples.into()));
        }
        if self.passes < 1 {
            return Err(ParameterError::NoPasses);
        }
        if self.chains > MOST_CHAINS {
            return Err(ParameterError::TooManyChains(self.chains));
        }
        Ok(())
    }

    fn check_target_error(&self) -> Result<(), ParameterError> {
        let target = self.target_error;
        if !(target.is_finite() && target >= 0.0) {
            return Err(ParameterError::BadTargetError(target));
        }
        if target > 0.0 && !self.estimate_error {
            return Err(ParameterError::BlindTarget(target));
        }
        Ok(())
    }

    /// A name that says one thing and a parameter that says another are a mistake.
    fn check_shooting(&self) -> Result<(), ParameterError> {
        let Some(shooting) = self.shooting else { return Ok(()) };
        let other = match (self.method, shooting) {
            (Method::Ppt, Shooting::Metropolis) => Method::PptMetro,
            (Method::Ppbt, Shooting::Metropolis) => Method::PpbtMetro,
            (Method::PptMetro, Shooting::Uniform) => Method::Ppt,
            (Method::PpbtMetro, Shooting::Uniform) => Method::Ppbt,
            (Method::Apa, Shooting::Metropolis | Shooting::Auto) => Method::PptMetro,
            (Method::Ppb, Shooting::Metropolis | Shooting::Auto) => Method::PpbtMetro,
            _ => return Ok(()),
        };
        Err(ParameterError::ShootingAgainstMethod { shooting, method: self.method, other })
    }
}
