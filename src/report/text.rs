//! Numbers as people read them.

use super::results::{Comparison, Method};

/// Three digits.
pub fn number(value: f64) -> String {
    match value.abs() {
        0.0 => "0".into(),
        v if (0.01..1000.0).contains(&v) => {
            let digits = (2 - v.log10().floor() as i32).max(0) as usize;
            format!("{value:.digits$}")
        }
        _ => format!("{value:.2e}"),
    }
}

/// `2.34 %`.
pub fn percent(share: f64) -> String {
    format!("{} %", number(100.0 * share))
}

/// The name, with a star where the picture is not that of the scene and a dagger where the reference was rendered by
/// the same estimator.
pub fn marked_name(method: &Method) -> String {
    let star = if method.flaw.is_some() { " *" } else { "" };
    let dagger = if method.shares_reference { " †" } else { "" };
    format!("{}{star}{dagger}", method.name)
}

/// What the marks of the names mean, a line each.
pub fn explained_marks(comparison: &Comparison) -> Vec<String> {
    let methods = comparison.methods.iter();
    let flaw = |method: &Method| Some(format!("* {}: {}", method.name, method.flaw.as_ref()?));
    let mut lines: Vec<String> = methods.clone().filter_map(flaw).collect();
    let kin: Vec<&str> =
        methods.filter(|method| method.shares_reference).map(|m| m.name.as_str()).collect();
    if !kin.is_empty() {
        lines.push(format!(
            "† {}: the reference was rendered by the same estimator; what both get wrong is not seen",
            kin.join(", ")
        ));
    }
    lines
}

/// `12.3 MiB`, or a dash where it is not known.
pub fn memory(bytes: Option<u64>) -> String {
    bytes.map_or("–".into(), |bytes| format!("{} MiB", number(bytes as f64 / 1048576.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_digits() {
        for (value, text) in
            [(0.0, "0"), (0.0123, "0.0123"), (1.5, "1.50"), (123.4, "123"), (1e-4, "1.00e-4")]
        {
            assert_eq!(number(value), text);
        }
        assert_eq!(percent(0.0234), "2.34 %");
        assert_eq!((memory(None), memory(Some(3 << 20))), ("–".into(), "3.00 MiB".into()));
    }
}
