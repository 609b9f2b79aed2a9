//! Who renders the reference: the one whose picture has the smaller error after the same short time.

use crate::cli::text::percent;
use vpt::report::halves::Square;

/// The two differ by more than what is known of the photon tracer's bias if it is more than so many times that.
const BEYOND_BIAS: f64 = 3.0;
/// A path tracer that is darker by this share than the photon tracer, and differs from it, misses light.
const MISSED_LIGHT: f64 = 0.01;
/// One that is darker by this share does so whatever is known of the difference: blur moves light and keeps its sum, and a path
/// tracer's rare and bright pixels, which hide what the others lack, hardly count in the brightness.
const MUCH_MISSED_LIGHT: f64 = 0.1;

/// What a trial of a candidate came to.
#[derive(Debug, Clone)]
pub struct Trial {
    pub name: String,
    /// Root mean square, relative to the photon tracer's picture.
    pub noise: f64,
    /// An upper estimate of its root mean square, in the same measure; None where it could not be told.
    pub bias: Option<f64>,
    /// Of the picture, see [`vpt::report::picture::Picture::brightness`].
    pub brightness: f64,
}

/// Whom the trials speak for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Chosen {
    Mitsuba,
    Ours,
}

impl Trial {
    /// A bias that could not be told may be all of the picture.
    fn error(&self) -> f64 {
        self.noise.hypot(self.bias.unwrap_or(1.0))
    }

    fn tell(&self) -> String {
        let bias = match self.bias {
            Some(0.0) => String::new(),
            Some(bias) => format!(" and a bias of about {}", percent(bias)),
            None => " and a bias that is not known".to_owned(),
        };
        format!("{} had a noise of {}{bias}", self.name, percent(self.noise))
    }
}

/// Chooses, and says why. `apart` is the squared difference of what the two expect, relative to the photon tracer's
/// picture.
pub fn choose(mitsuba: &Trial, ours: &Trial, apart: Square) -> (Chosen, String) {
    let told = format!("{}, {}", mitsuba.tell(), ours.tell());
    let beyond =
        apart.is_significant() && ours.bias.is_some_and(|bias| apart.root() > BEYOND_BIAS * bias);
    let missed = 1.0 - mitsuba.brightness / ours.brightness;
    let bearable = if beyond { MISSED_LIGHT } else { MUCH_MISSED_LIGHT };
    if missed > bearable {
        let missed = percent(missed);
        return (
            Chosen::Ours,
            format!("{told}, and {} misses {missed} of the light", mitsuba.name),
        );
    }
    // A path tracer that misses nothing shows the bias itself.
    let shown = if apart.is_significant() { apart.root() } else { 0.0 };
    match ours.error().max(ours.noise.hypot(shown)) < mitsuba.error() {
        true => (Chosen::Ours, told),
        false => (Chosen::Mitsuba, told),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trial(name: &str, noise: f64, bias: Option<f64>, brightness: f64) -> Trial {
        Trial { name: name.into(), noise, bias, brightness }
    }

    #[test]
    fn smaller_error_is_chosen() {
        let nothing = Square { mean: 0.0, error: 1e-4 };
        let volpath = |noise| trial("volpath", noise, Some(0.0), 1.0);
        let ppt = |noise, bias| trial("ppt", noise, bias, 1.0);
        let chosen = |volpath: Trial, ppt: Trial| choose(&volpath, &ppt, nothing).0;
        assert_eq!(chosen(volpath(0.02), ppt(0.01, Some(0.01))), Chosen::Ours);
        assert_eq!(chosen(volpath(0.02), ppt(0.01, Some(0.03))), Chosen::Mitsuba);
        assert_eq!(chosen(volpath(0.9), ppt(0.01, None)), Chosen::Mitsuba);
        assert_eq!(chosen(volpath(9.0), ppt(0.01, None)), Chosen::Ours);
    }

    #[test]
    fn light_that_a_path_tracer_never_finds_is_missed_without_noise() {
        let (dark, bright) =
            (trial("volpath", 0.001, Some(0.0), 0.95), trial("ppt", 0.05, Some(0.02), 1.0));
        let far = Square { mean: 0.09, error: 0.001 };
        let (chosen, reason) = choose(&dark, &bright, far);
        assert_eq!(chosen, Chosen::Ours);
        assert!(reason.ends_with("volpath misses 5.0 % of the light"), "{reason}");
        // A difference that the photon tracer's own bias explains tells nothing.
        let near = Square { mean: 0.0016, error: 0.0001 };
        assert_eq!(choose(&dark, &bright, near).0, Chosen::Mitsuba);
        // Without missing light, the difference is a bias that was told too small.
        let whole = trial("volpath", 0.06, Some(0.0), 1.0);
        let smooth = trial("ppt", 0.01, Some(0.03), 1.0);
        let apart = Square { mean: 0.0064, error: 0.0001 };
        assert_eq!(choose(&whole, &smooth, apart).0, Chosen::Mitsuba);
    }

    /// A window that the sun shines through: what little of its light is found makes pixels of a thousand times the brightness, so
    /// that no difference is significant, and two passes of photons tell next to nothing of their bias.
    #[test]
    fn a_dark_picture_with_rare_bright_pixels_is_no_reference() {
        let volpath = |brightness| trial("volpath", 0.56, Some(0.0), brightness);
        let ppt = trial("ppt", 0.48, Some(1.12), 1.0);
        let unknown = Square { mean: 50.0, error: 40.0 };
        assert_eq!(choose(&volpath(0.2), &ppt, unknown).0, Chosen::Ours);
        assert_eq!(choose(&volpath(0.97), &ppt, unknown).0, Chosen::Mitsuba);
        // A black picture misses nothing of another.
        let black = trial("ppt", 0.0, Some(0.0), 0.0);
        assert_eq!(choose(&volpath(0.0), &black, unknown).0, Chosen::Ours);
    }
}
