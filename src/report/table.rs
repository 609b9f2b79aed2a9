//! The summary as a table of plain text.

use super::results::Comparison;
use super::summary::{Summary, LEVELS};
use super::{cells, text};

/// One line per method, columns aligned, and what their marks mean below.
pub fn table(comparison: &Comparison, summaries: &[Summary]) -> String {
    let mut rows = vec![header()];
    for (method, summary) in comparison.methods.iter().zip(summaries) {
        rows.push(row(text::marked_name(method), summary));
    }
    let width =
        |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..rows[0].len()).map(width).collect();
    let mut lines: Vec<String> = rows.iter().map(|row| line(row, &widths)).collect();
    lines.extend(text::explained_marks(comparison));
    lines.join("\n")
}

fn header() -> Vec<String> {
    let fixed = ["method", "error", "RMSE", "FLIP", "rate"].map(String::from);
    let levels = LEVELS.iter().flat_map(|level| [format!("{} %", 100.0 * level), "speed".into()]);
    fixed.into_iter().chain(levels).collect()
}

fn row(name: String, summary: &Summary) -> Vec<String> {
    let last = |value: Option<String>| value.unwrap_or_else(|| "–".into());
    let mut row = vec![
        name,
        last(summary.last.map(|errors| text::percent(errors.relative()))),
        last(summary.last.map(|errors| text::number(errors.rmse))),
        last(summary.last.map(|errors| text::number(errors.flip))),
        cells::rate(summary),
    ];
    for time in &summary.times {
        row.push(cells::reached(time));
        row.push(time.speed_up.map_or("–".into(), |ratio| format!("{}x", text::number(ratio))));
    }
    row
}

/// The first column to the left, the others to the right.
fn line(row: &[String], widths: &[usize]) -> String {
    let cells = row.iter().zip(widths).enumerate().map(|(column, (cell, width))| match column {
        0 => format!("{cell:<width$}"),
        _ => format!("{cell:>width$}"),
    });
    cells.collect::<Vec<_>>().join("  ").trim_end().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::summary::{summarize, tests::comparison};

    #[test]
    fn table_has_a_line_for_each_method_and_flaw() {
        let mut comparison = comparison();
        comparison.methods[1].flaw = Some("it sees no media".into());
        comparison.methods[0].shares_reference = true;
        let table = table(&comparison, &summarize(&comparison));
        let lines: Vec<&str> = table.lines().collect();
        assert_eq!(lines.len(), 5);
        assert!(lines[1].starts_with("ppt †  ") && lines[1].contains("2.50 %"), "{}", lines[1]);
        assert!(lines[2].starts_with("volpath *") && lines[2].contains("not reached"));
        assert_eq!(lines[3], "* volpath: it sees no media");
        assert!(lines[4].starts_with("† ppt: the reference"), "{}", lines[4]);
    }
}
