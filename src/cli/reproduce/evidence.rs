//! What was measured of the scenes, by this run or an earlier one into the same folder.

use super::growth::{self, Growth};
use super::scenes::PaperScene;
use super::verdict::Interval;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use vpt::report::curve::Curve;
use vpt::report::results::{Comparison, Method};

/// All measurements of one scene.
#[derive(Debug, Clone)]
pub struct Evidence {
    pub comparison: Comparison,
    pub growth: Vec<Growth>,
}

/// By scene.
pub type AllEvidence = BTreeMap<PaperScene, Evidence>;

/// Reads what a folder holds of each scene.
pub fn read(output: &Path) -> AllEvidence {
    let one = |scene: PaperScene| {
        let folder = output.join(scene.name());
        let text = fs::read_to_string(folder.join("results.json")).ok()?;
        let comparison = serde_json::from_str(&text).ok()?;
        Some((scene, Evidence { comparison, growth: growth::read(&folder) }))
    };
    PaperScene::ALL.into_iter().filter_map(one).collect()
}

/// An error can be told from one of the reference's that is smaller by this factor.
const MARGIN: f64 = std::f64::consts::SQRT_2;

/// The errors of two methods held against each other.
#[derive(Debug, Clone, PartialEq)]
pub struct Ratio {
    pub of: String,
    pub to: String,
    /// When, in seconds.
    pub seconds: f64,
    /// Natural logarithm of the one's RMSE over the other's.
    pub log: Interval,
}

impl Ratio {
    /// `ppt / apa = 0.93 [0.90, 0.97]`.
    pub fn tell(&self) -> String {
        let Interval { mean, low, high } = self.log;
        let [mean, low, high] = [mean, low, high].map(f64::exp);
        format!("RMSE of {} / {} = {mean:.2} [{low:.2}, {high:.2}]", self.of, self.to)
    }
}

impl Evidence {
    pub fn method(&self, name: &str) -> Option<&Method> {
        self.comparison.methods.iter().find(|method| method.name == name)
    }

    /// Compares two methods at the end.
    pub fn ratio(&self, of: &str, to: &str) -> Result<Ratio, String> {
        self.ratio_at(of, to, self.comparison.seconds)
    }

    /// Compares two methods at a time [s].
    pub fn ratio_at(&self, of: &str, to: &str, seconds: f64) -> Result<Ratio, String> {
        let (a, b) = (self.log_errors(of, seconds)?, self.log_errors(to, seconds)?);
        let log = Interval::difference(&a, &b)
            .ok_or("fewer than two seeds tell nothing of the uncertainty; use --seeds")?;
        Ok(Ratio { of: of.to_owned(), to: to.to_owned(), seconds, log })
    }

    /// The earliest time [s] at which all runs of the methods have pictures.
    pub fn first_common(&self, names: &[&str]) -> Option<f64> {
        let methods = names.iter().map(|name| self.method(name));
        let methods = methods.collect::<Option<Vec<_>>>()?;
        let runs = methods.iter().flat_map(|method| &method.runs);
        let first = runs.map(|run| run.snapshots.first().map(|shot| shot.seconds));
        first.collect::<Option<Vec<_>>>()?.into_iter().reduce(f64::max)
    }

    /// Logarithms of a method's errors at a time, one for each seed, without the part that the reference's noise has
    /// in them.
    fn log_errors(&self, name: &str, seconds: f64) -> Result<Vec<f64>, String> {
        let method = self.method(name).ok_or(format!("{name} was not measured"))?;
        let noise = self.comparison.reference.noise.map_or(0.0, |noise| noise.rmse);
        let bias = self.comparison.reference.bias.unwrap_or(0.0);
        let log_error = |run: &vpt::report::results::Run| {
            let last = run.snapshots.last().map_or(0.0, |shot| shot.errors.relative());
            if last < MARGIN * bias {
                return Err(format!(
                    "the error of {name} is lost in the bias of the reference; use a better one"
                ));
            }
            let curve = Curve::new(run.snapshots.iter().map(|s| (s.seconds, s.errors.rmse)));
            let error =
                error_at(&curve, seconds).ok_or(format!("{name} has no picture so early"))?;
            let own = error * error - noise * noise;
            match error > MARGIN * noise {
                true => Ok(0.5 * own.ln()),
                false => Err(format!(
                    "the error of {name} is lost in the noise of the reference; use a better one"
                )),
            }
        };
        method.runs.iter().map(log_error).collect()
    }
}

/// The error at a time, or the last one where the run ended before it.
fn error_at(curve: &Curve, seconds: f64) -> Option<f64> {
    let &(last, error) = curve.points().last()?;
    if last <= seconds {
        return Some(error);
    }
    curve.at(seconds).or((curve.points().len() == 1).then_some(error))
}
