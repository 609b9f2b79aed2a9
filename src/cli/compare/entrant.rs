//! The names of `--methods`: a method or integrator, parameters of its own, and the variant that it shall render in.

use super::error::CompareError;
use crate::cli::job::check_variant;

/// One name, such as `ppt`, `volpath@llvm_ad_rgb` or `ppt+connections=true+jitter_every=1`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Entrant {
    /// As it is shown: the variant follows where it is not the program's own.
    pub name: String,
    /// One of vpt's methods or of Mitsuba's integrators.
    pub integrator: String,
    /// Parameters that it has and others have not.
    pub settings: Vec<(String, String)>,
    pub variant: String,
}

impl Entrant {
    /// Reads a name; `own` is the variant of those that do not name one.
    pub fn parse(text: &str, own: &str) -> Result<Self, CompareError> {
        let (called, variant) = text.trim().split_once('@').unwrap_or((text.trim(), own));
        let mut parts = called.split('+');
        let integrator = parts.next().unwrap_or_default();
        if integrator.is_empty() {
            return Err(CompareError::EmptyMethod);
        }
        let setting = |part: &str| {
            let (name, value) = part.split_once('=').filter(|(name, _)| !name.is_empty())?;
            Some((name.to_owned(), value.to_owned()))
        };
        let settings = parts
            .map(|part| setting(part).ok_or_else(|| CompareError::BadSetting(part.to_owned())));
        let settings = settings.collect::<Result<Vec<_>, _>>()?;
        check_variant(variant)?;
        let name = match variant == own {
            true => called.to_owned(),
            false => format!("{called}@{variant}"),
        };
        let (integrator, variant) = (integrator.to_owned(), variant.to_owned());
        Ok(Entrant { name, integrator, settings, variant })
    }

    /// Reads all names, which must differ.
    pub fn parse_all(names: &[String], own: &str) -> Result<Vec<Self>, CompareError> {
        let mut entrants: Vec<Entrant> = Vec::new();
        for name in names {
            let entrant = Entrant::parse(name, own)?;
            if entrants.contains(&entrant) {
                return Err(CompareError::MethodTwice(entrant.name));
            }
            entrants.push(entrant);
        }
        Ok(entrants)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn variant_is_shown_where_it_is_another() {
        let parse = |text| Entrant::parse(text, "scalar_rgb").unwrap();
        let plain = parse("volpath");
        assert_eq!((plain.name.as_str(), plain.variant.as_str()), ("volpath", "scalar_rgb"));
        assert_eq!(parse("volpath@scalar_rgb"), plain);
        let other = parse(" ppt@llvm_ad_rgb ");
        assert_eq!(other.name, "ppt@llvm_ad_rgb");
        assert_eq!((other.integrator.as_str(), other.variant.as_str()), ("ppt", "llvm_ad_rgb"));
    }

    #[test]
    fn contestants_have_parameters_of_their_own() {
        let entrant =
            Entrant::parse("ppt+connections=true+photons=20000@llvm_ad_rgb", "scalar_rgb").unwrap();
        assert_eq!(entrant.name, "ppt+connections=true+photons=20000@llvm_ad_rgb");
        assert_eq!(entrant.integrator, "ppt");
        let settings = [("connections", "true"), ("photons", "20000")];
        assert_eq!(entrant.settings, settings.map(|(a, b)| (a.to_owned(), b.to_owned())));
        for bad in ["ppt+photons", "ppt+", "ppt+=3"] {
            let error = Entrant::parse(bad, "scalar_rgb").unwrap_err();
            assert!(matches!(error, CompareError::BadSetting(_)), "{bad}");
        }
    }

    #[test]
    fn same_contestant_in_two_spellings_is_refused() {
        let names = ["ppt".to_owned(), "ppt@scalar_rgb".to_owned()];
        assert!(matches!(
            Entrant::parse_all(&names, "scalar_rgb"),
            Err(CompareError::MethodTwice(name)) if name == "ppt"
        ));
        assert_eq!(Entrant::parse_all(&names, "llvm_ad_rgb").unwrap().len(), 2);
    }
}
