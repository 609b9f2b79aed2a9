//! Radii as functions of the global pass number, so that passes can run anywhere and be merged.

/// Which exponents shrink the radii from pass to pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Schedule {
    /// As printed by Collin et al. 2013 (8): square root on surfaces, cube root in media.
    Paper,
    /// The exponent of the kernel's dimension (Knaus & Zwicker 2011): square root for both.
    Matched,
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

/// Both radii [length] of one pass.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
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
    initial: Radii,
    /// Product of `(k + alpha) / (k + 1)` over the passes `k` so far.
    shrink: f64,
    pass: u64,
}

impl RadiusSequence {
    pub fn new(initial: Radii, alpha: f32, schedule: Schedule) -> Self {
        RadiusSequence { alpha: f64::from(alpha), schedule, initial, shrink: 1.0, pass: 0 }
    }

    /// Radii of the pass that is next.
    pub fn current(&self) -> Radii {
        let medium_exponent = match self.schedule {
            Schedule::Paper => 1.0 / 3.0,
            Schedule::Matched => 1.0 / 2.0,
        };
        Radii {
            surface: (f64::from(self.initial.surface) * self.shrink.sqrt()) as f32,
            medium: (f64::from(self.initial.medium) * self.shrink.powf(medium_exponent)) as f32,
        }
    }

    /// Moves on to the following pass.
    // [Collin 2013 (8)] [Knaus 2011 (12)]
    pub fn advance(&mut self) {
        self.pass += 1;
        let n = self.pass as f64;
        self.shrink *= (n + self.alpha) / (n + 1.0);
    }
}
