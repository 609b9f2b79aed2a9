//! Numbers as people read them.

/// A count with three digits and a prefix: `12.3 M`.
pub fn count(value: f64) -> String {
    let (scaled, prefix) = match value {
        v if v >= 1e9 => (v / 1e9, " G"),
        v if v >= 1e6 => (v / 1e6, " M"),
        v if v >= 1e3 => (v / 1e3, " k"),
        v => return format!("{v:.0}"),
    };
    let digits = match scaled {
        s if s < 10.0 => 2,
        s if s < 100.0 => 1,
        _ => 0,
    };
    format!("{scaled:.digits$}{prefix}")
}

/// A span of time: `0.25 s`, `12 s`, `3 min 20 s`, `2 h 5 min`.
pub fn seconds(value: f64) -> String {
    if value < 10.0 {
        return format!("{value:.2} s");
    }
    let whole = value.round() as u64;
    match (whole / 3600, whole / 60 % 60, whole % 60) {
        (0, 0, s) => format!("{s} s"),
        (0, min, s) => format!("{min} min {s} s"),
        (h, min, _) => format!("{h} h {min} min"),
    }
}

/// A span of time that is not known well: `0.3 s`, `12 s`, `3 min`, `2 h`.
pub fn about(value: f64) -> String {
    match value {
        v if v < 9.5 => format!("{v:.1} s"),
        v if v < 90.0 => format!("{v:.0} s"),
        v if v < 90.0 * 60.0 => format!("{:.0} min", v / 60.0),
        v if v < 48.0 * 3600.0 => format!("{:.0} h", v / 3600.0),
        v => format!("{:.0} days", v / 86400.0),
    }
}

/// A radius in the scene's unit of length, with three digits.
pub fn length(value: f32) -> String {
    format!("{value:.2e}")
}

/// A share with two digits: `34 %`, `0.12 %`, `0.0010 %`.
pub fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    let digits = if percent >= 9.95 || percent <= 0.0 {
        0
    } else {
        (1.0 - percent.log10().floor()).max(0.0) as usize
    };
    format!("{percent:.digits$} %")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_have_prefixes() {
        for (value, text) in
            [(0.0, "0"), (999.0, "999"), (1234.0, "1.23 k"), (4.56e7, "45.6 M"), (2e11, "200 G")]
        {
            assert_eq!(count(value), text);
        }
    }

    #[test]
    fn seconds_have_units() {
        for (value, text) in
            [(0.254, "0.25 s"), (12.4, "12 s"), (200.0, "3 min 20 s"), (7530.0, "2 h 5 min")]
        {
            assert_eq!(seconds(value), text);
        }
    }

    #[test]
    fn rough_times_are_rough() {
        for (value, text) in
            [(0.26, "0.3 s"), (12.4, "12 s"), (175.0, "3 min"), (9000.0, "2 h"), (4e5, "5 days")]
        {
            assert_eq!(about(value), text);
        }
    }

    #[test]
    fn shares_have_two_digits() {
        for (value, text) in [
            (0.0, "0 %"),
            (1.0, "100 %"),
            (0.341, "34 %"),
            (0.0567, "5.7 %"),
            (0.00123, "0.12 %"),
            (1e-5, "0.0010 %"),
        ] {
            assert_eq!(percent(value), text);
        }
    }
}
