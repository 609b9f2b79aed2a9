//! Radii as functions of the global pass number, so that passes can run anywhere and be merged.

/// Which exponents shrink the radii from pass to pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Schedule {
    /// As printed by Collin et al. 2013 (8): square root on surfaces, cube root in media.
    Paper,
    /// The exponent of the kernel's dimension (Knaus & Zwicker 2011): square root for disks, first power
    /// for the interval that two beams share.
    Matched,
}

/// Dimensions of the spaces in which photons miss their receivers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct KernelDimensions {
    pub surface: u32,
    pub medium: u32,
}

impl KernelDimensions {
    /// Photons against visible points and view beams.
    pub const POINTS: Self = KernelDimensions { surface: 2, medium: 2 };
    /// Photons against visible points, photon beams against view beams.
    pub const BEAMS: Self = KernelDimensions { surface: 2, medium: 1 };
}

/// A schedule's name that does not exist.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("unknown radius_schedule \"{0}\"; use \"matched\" or \"paper\"")]
pub struct UnknownSchedule(pub String);

impl std::str::FromStr for Schedule {
    type Err = UnknownSchedule;
    fn from_str(name: &str) -> Result<Self, UnknownSchedule> {
        match name {
            "paper" => Ok(Schedule::Paper),
            "matched" => Ok(Schedule::Matched),
            _ => Err(UnknownSchedule(name.to_owned())),
        }
    }
}

/// Both radii \[length\] of one pass.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Radii {
    /// Of the disk around a visible point.
    pub surface: f32,
    /// Of the cylinder around a view beam.
    pub medium: f32,
}

/// Shrinks the radii from pass to pass. Kept in f64: the product runs over every pass.
#[derive(Debug, Clone)]
pub struct RadiusSequence {
    alpha: f64,
    schedule: Schedule,
    kernels: KernelDimensions,
    initial: Radii,
    least: Radii,
    /// Product of `(k + alpha) / (k + 1)` over the passes `k` so far.
    shrink: f64,
    pass: u64,
}

impl RadiusSequence {
    pub fn new(initial: Radii, alpha: f32, schedule: Schedule, kernels: KernelDimensions) -> Self {
        let alpha = f64::from(alpha);
        let least = Radii { surface: 0.0, medium: 0.0 };
        RadiusSequence { alpha, schedule, kernels, initial, least, shrink: 1.0, pass: 0 }
    }

    /// Radii stay at `least` once they have shrunk to it, but for those that are 0 from the beginning.
    pub fn not_below(self, least: Radii) -> Self {
        RadiusSequence { least, ..self }
    }

    /// Radii of the pass that is next.
    pub fn current(&self) -> Radii {
        let (surface, medium) = match self.schedule {
            Schedule::Paper => (2, 3),
            Schedule::Matched => (self.kernels.surface, self.kernels.medium),
        };
        let shrunk = |initial: f32, least: f32, root: u32| {
            let radius = (f64::from(initial) * self.shrink.powf(1.0 / f64::from(root))) as f32;
            if initial > 0.0 {
                radius.max(least)
            } else {
                radius
            }
        };
        Radii {
            surface: shrunk(self.initial.surface, self.least.surface, surface),
            medium: shrunk(self.initial.medium, self.least.medium, medium),
        }
    }

    /// Moves on by so many passes.
    pub fn advance_by(&mut self, passes: u32) {
        (0..passes).for_each(|_| self.advance());
    }

    /// Moves on to the following pass.
    // [Collin 2013 (8)] [Knaus 2011 (12)]
    pub fn advance(&mut self) {
        self.pass += 1;
        let n = self.pass as f64;
        self.shrink *= (n + self.alpha) / (n + 1.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn radii_stop_at_the_least_and_those_of_0_stay() {
        let initial = Radii { surface: 1.0, medium: 0.0 };
        let least = Radii { surface: 0.9, medium: 0.9 };
        let mut radii =
            RadiusSequence::new(initial, 0.7, Schedule::Matched, KernelDimensions::POINTS)
                .not_below(least);
        assert_eq!(radii.current(), initial);
        (0..10).for_each(|_| radii.advance());
        assert_eq!(radii.current(), Radii { surface: 0.9, medium: 0.0 });
    }
}
