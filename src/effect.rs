//! What a render can simulate, by name. Which of it a scene calls for is decided once, in
//! [`crate::plan`].

use serde::{Serialize, Serializer};

/// A part of the work that some scenes need and others do not.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u8)]
pub enum Effect {
    /// Photons on surfaces look for what the camera sees of them.
    SurfaceGathering,
    /// Smooth surfaces in view are kept as visible points, with a tree over them.
    VisiblePoints,
    /// View rays through scattering media are kept as view beams, with a tree over them.
    ViewBeams,
    /// Photons collide in media, and media attenuate view rays.
    MediumSampling,
    /// Photons go on after their first scattering.
    MultipleScattering,
    /// Optical depths along segments through varying media are tabulated.
    TransmittanceTables,
    /// Free flights and short photon beams weigh the colour channels against each other.
    ColouredExtinction,
    /// Pairs in media are weighted by a phase function that depends on directions.
    AnisotropicPhase,
    /// View rays go on behind delta and null lobes.
    SpecularChains,
    /// View rays are refracted into scattering media: part of `specular_chains` and `view_beams`.
    RefractionIntoMedia,
    /// Emitters are looked at where view rays end.
    DirectEmission,
    /// The sky is looked at where view rays leave the scene.
    Environment,
    /// View rays start from an aperture.
    DepthOfField,
    /// Photons on surfaces are steered by Metropolis chains.
    MetropolisSurface,
    /// Photons in media are steered by Metropolis chains.
    MetropolisMedium,
}

use Effect::*;

impl Effect {
    pub const ALL: [Effect; 15] = [
        SurfaceGathering,
        VisiblePoints,
        ViewBeams,
        MediumSampling,
        MultipleScattering,
        TransmittanceTables,
        ColouredExtinction,
        AnisotropicPhase,
        SpecularChains,
        RefractionIntoMedia,
        DirectEmission,
        Environment,
        DepthOfField,
        MetropolisSurface,
        MetropolisMedium,
    ];

    /// As in parameters, statistics and reports.
    pub const fn name(self) -> &'static str {
        match self {
            SurfaceGathering => "surface_gathering",
            VisiblePoints => "visible_points",
            ViewBeams => "view_beams",
            MediumSampling => "medium_sampling",
            MultipleScattering => "multiple_scattering",
            TransmittanceTables => "transmittance_tables",
            ColouredExtinction => "coloured_extinction",
            AnisotropicPhase => "anisotropic_phase",
            SpecularChains => "specular_chains",
            RefractionIntoMedia => "refraction_into_media",
            DirectEmission => "direct_emission",
            Environment => "environment",
            DepthOfField => "depth_of_field",
            MetropolisSurface => "metropolis_surface",
            MetropolisMedium => "metropolis_medium",
        }
    }

    /// What its work is counted in.
    pub const fn unit(self) -> &'static str {
        match self {
            SurfaceGathering => "photons that look for visible points",
            VisiblePoints => "visible points",
            ViewBeams => "view beams",
            MediumSampling => "free flights through media",
            MultipleScattering => "photon segments behind a scattering",
            TransmittanceTables => "samples of extinction",
            ColouredExtinction => "free flights with weighed channels",
            AnisotropicPhase => "pairs weighted by direction",
            SpecularChains => "view segments behind a delta or null lobe",
            RefractionIntoMedia => "view beams behind a refraction",
            DirectEmission => "ends of view segments asked for emission",
            Environment => "view rays asked for the sky",
            DepthOfField => "samples of the aperture",
            MetropolisSurface | MetropolisMedium => "mutated walks",
        }
    }

    const fn bit(self) -> u32 {
        1 << self as u32
    }
}

impl Serialize for Effect {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

/// A set of effects.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Effects(u32);

impl Effects {
    pub const NONE: Effects = Effects(0);
    pub const ALL: Effects = Effects((1 << Effect::ALL.len()) - 1);

    pub const fn has(self, effect: Effect) -> bool {
        self.0 & effect.bit() != 0
    }

    #[must_use]
    pub const fn with(self, effect: Effect) -> Self {
        Effects(self.0 | effect.bit())
    }

    #[must_use]
    pub const fn without(self, effect: Effect) -> Self {
        Effects(self.0 & !effect.bit())
    }

    /// One bit per effect, in the order of [`Effect::ALL`].
    pub const fn bits(self) -> u32 {
        self.0
    }

    /// From such bits; others are ignored.
    pub const fn from_bits(bits: u32) -> Self {
        Effects(bits & Effects::ALL.0)
    }

    pub fn iter(self) -> impl Iterator<Item = Effect> {
        Effect::ALL.into_iter().filter(move |effect| self.has(*effect))
    }
}

impl FromIterator<Effect> for Effects {
    fn from_iter<I: IntoIterator<Item = Effect>>(effects: I) -> Self {
        effects.into_iter().fold(Effects::NONE, Effects::with)
    }
}

/// As it is written in a scene: `auto`, `all`, or the names.
impl std::fmt::Display for Effects {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match *self {
            Effects::NONE => f.write_str("auto"),
            Effects::ALL => f.write_str("all"),
            some => {
                let names: Vec<_> = some.iter().map(Effect::name).collect();
                f.write_str(&names.join(","))
            }
        }
    }
}

impl Serialize for Effects {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// An effect's name that does not exist.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error(
    "unknown effect \"{0}\" in effects; use \"auto\" (what the scene calls for), \"all\", or names to force on, with \
     commas between them: {known}",
    known = Effect::ALL.map(Effect::name).join(", ")
)]
pub struct UnknownEffect(pub String);

/// The effects that are forced on: none for `auto`.
impl std::str::FromStr for Effects {
    type Err = UnknownEffect;
    fn from_str(text: &str) -> Result<Self, UnknownEffect> {
        let named = |name: &str| {
            let found = Effect::ALL.into_iter().find(|effect| effect.name() == name);
            found.ok_or_else(|| UnknownEffect(name.to_owned()))
        };
        match text {
            "auto" => Ok(Effects::NONE),
            "all" => Ok(Effects::ALL),
            names => names.split(',').map(|name| named(name.trim())).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_effect_has_a_bit_of_its_own() {
        for (index, effect) in Effect::ALL.into_iter().enumerate() {
            assert_eq!(effect.bit(), 1 << index, "{}", effect.name());
        }
        assert_eq!(Effects::ALL.iter().count(), Effect::ALL.len());
    }

    #[test]
    fn sets_are_read_as_they_are_written() {
        let some: Effects = [ViewBeams, DepthOfField].into_iter().collect();
        for set in [Effects::NONE, Effects::ALL, some] {
            assert_eq!(set.to_string().parse(), Ok(set));
        }
        assert_eq!("view_beams, depth_of_field".parse(), Ok(some));
        let error = "fog".parse::<Effects>().unwrap_err().to_string();
        assert!(error.contains("\"fog\"") && error.contains("view_beams"), "{error}");
    }
}
