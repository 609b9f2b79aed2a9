//! Summaries as tables show them.

use super::curve::Reached;
use super::summary::{Summary, TimeTo};
use super::text::number;

/// `12.3 s`, `< 0.20 s`, `not reached`.
pub fn reached(time: &TimeTo) -> String {
    match time.reached {
        Reached::After { seconds } => format!("{} s", number(seconds)),
        Reached::Before { seconds } => format!("< {} s", number(seconds)),
        Reached::Never => "not reached".into(),
    }
}

/// `-0.49 ± 0.01`.
pub fn rate(summary: &Summary) -> String {
    match (summary.rate, summary.rate_error) {
        (Some(rate), Some(error)) => format!("{rate:.2} ± {error:.2}"),
        (Some(rate), None) => format!("{rate:.2}"),
        (None, _) => "–".into(),
    }
}
