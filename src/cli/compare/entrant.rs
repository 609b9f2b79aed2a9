//! The names of `--methods`: a method or integrator, and the variant that it shall render in.

use super::error::CompareError;
use crate::cli::job::check_variant;

/// One name, such as `ppt` or `volpath@llvm_ad_rgb`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Entrant {
    /// As it is shown: the variant follows where it is not the program's own.
    pub name: String,
    /// One of vpt's methods or of Mitsuba's integrators.
    pub integrator: String,
    pub variant: String,
}

impl Entrant {
    /// Reads a name; `own` is the variant of those that do not name one.
    pub fn parse(text: &str, own: &str) -> Result<Self, CompareError> {
        let (integrator, variant) = text.trim().split_once('@').unwrap_or((text.trim(), own));
        if integrator.is_empty() {
            return Err(CompareError::EmptyMethod);
        }
        check_variant(variant)?;
        let name = match variant == own {
            true => integrator.to_owned(),
            false => format!("{integrator}@{variant}"),
        };
        Ok(Entrant { name, integrator: integrator.to_owned(), variant: variant.to_owned() })
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
    fn same_contestant_in_two_spellings_is_refused() {
        let names = ["ppt".to_owned(), "ppt@scalar_rgb".to_owned()];
        assert!(matches!(
            Entrant::parse_all(&names, "scalar_rgb"),
            Err(CompareError::MethodTwice(name)) if name == "ppt"
        ));
        assert_eq!(Entrant::parse_all(&names, "llvm_ad_rgb").unwrap().len(), 2);
    }
}
