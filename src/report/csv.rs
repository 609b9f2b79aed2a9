//! The snapshots as comma-separated values, one line each.

use super::results::Comparison;
use std::io::Write;

/// Writes a header and a line for every snapshot of every run.
pub fn write(comparison: &Comparison, out: impl Write) -> Result<(), csv::Error> {
    let mut writer = csv::Writer::from_writer(out);
    writer.write_record([
        "method",
        "seed",
        "seconds",
        "work",
        "rmse",
        "relative_mse",
        "relative_error",
        "flip",
        "image",
    ])?;
    for method in &comparison.methods {
        for run in &method.runs {
            for shot in &run.snapshots {
                let errors = shot.errors;
                writer.serialize((
                    &method.name,
                    run.seed,
                    shot.seconds,
                    shot.work,
                    errors.rmse,
                    errors.relative_mse,
                    errors.relative(),
                    errors.flip,
                    &shot.image,
                ))?;
            }
        }
    }
    Ok(writer.flush()?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::summary::tests::comparison;

    #[test]
    fn every_snapshot_has_a_line() {
        let mut bytes = Vec::new();
        write(&comparison(), &mut bytes).unwrap();
        let text = String::from_utf8(bytes).unwrap();
        assert_eq!(text.lines().count(), 1 + 2 * 2 * 7);
        assert!(text.lines().all(|line| line.split(',').count() == 9));
    }
}
