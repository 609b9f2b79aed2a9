//! Parts that are added up, one after another.

use super::{Difference, Part, PassRanges};

/// Parts that do not add up, by the names of their files.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum MergeError {
    #[error("\"{}\" and \"{}\" are parts of different pictures: {}{}", .files[0], .files[1], told(.differences), mend(.differences))]
    Different { files: [String; 2], differences: Vec<Difference> },
    #[error(
        "\"{}\" and \"{}\" both hold the passes {passes}, which would count twice; leave one of them out",
        .files[0], .files[1]
    )]
    Overlap { files: [String; 2], passes: PassRanges },
    #[error("there are no parts to merge; name at least one")]
    Nothing,
}

/// `seed is 1 in the first and 2 in the second`
pub(super) fn told(differences: &[Difference]) -> String {
    let one = |d: &Difference| {
        format!("{} is {} in the first and {} in the second", d.what, d.values[0], d.values[1])
    };
    differences.iter().map(one).collect::<Vec<_>>().join("; ")
}

/// What to do about numbers that other machines count out otherwise.
fn mend(differences: &[Difference]) -> &'static str {
    let learnt = ["parameters.photons", "parameters.connection_samples"];
    let counted = |d: &Difference| {
        learnt.contains(&d.what.as_str())
            || d.what.starts_with("connections.")
            || d.what.starts_with("radii.")
    };
    if differences.iter().all(counted) {
        " (parts that are rendered on different kinds of machines need --set photons=N, connections, connection_samples, \
         surface_radius and medium_radius)"
    } else {
        ""
    }
}

/// Adds parts up, whatever their order.
#[derive(Debug, Default)]
pub struct Merger {
    sum: Option<Part>,
    held: Vec<(String, PassRanges)>,
}

impl Merger {
    pub fn new() -> Self {
        Merger::default()
    }

    /// Adds a part, by the name of its file. A part that is refused leaves the others as they are.
    pub fn add(&mut self, name: &str, part: Part) -> Result<(), MergeError> {
        for (other, passes) in &self.held {
            if let Some(common) = passes.overlap(&part.passes) {
                let files = [other.clone(), name.to_owned()];
                return Err(MergeError::Overlap { files, passes: PassRanges::of(common) });
            }
        }
        if let (Some(sum), Some((first, _))) = (&self.sum, self.held.first()) {
            let differences = sum.ground.differences(&part.ground);
            if !differences.is_empty() {
                let files = [first.clone(), name.to_owned()];
                return Err(MergeError::Different { files, differences });
            }
        }
        self.held.push((name.to_owned(), part.passes.clone()));
        self.sum = Some(match self.sum.take() {
            None => part,
            Some(sum) => sum.and(part),
        });
        Ok(())
    }

    pub fn finish(self) -> Result<Part, MergeError> {
        self.sum.ok_or(MergeError::Nothing)
    }
}

impl Part {
    /// Both together; they belong to one picture and hold different passes.
    fn and(self, other: Part) -> Part {
        let (mut first, later) = match self.passes.start() <= other.passes.start() {
            true => (self, other),
            false => (other, self),
        };
        first.passes = first.passes.union(&later.passes);
        first.gathered.merge(&later.gathered);
        first
    }
}
