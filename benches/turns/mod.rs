//! Contestants that take turns, so that drift of the machine hits them alike: what is told are medians over the turns and
//! quartiles of ratios within a turn.

/// What so many turns measure, after one that warms up.
pub fn take<const N: usize>(count: usize, mut turn: impl FnMut() -> [f64; N]) -> Vec<[f64; N]> {
    turn();
    (0..count).map(|_| turn()).collect()
}

/// The median of one contestant.
pub fn median<const N: usize>(turns: &[[f64; N]], which: usize) -> f64 {
    quantile(turns.iter().map(|turn| turn[which]), 0.5)
}

/// The median of the first over the second, and its quartiles in brackets.
pub fn ratio<const N: usize>(turns: &[[f64; N]], digits: usize) -> String {
    let [low, middle, high] =
        [0.25, 0.5, 0.75].map(|share| quantile(turns.iter().map(|turn| turn[0] / turn[1]), share));
    format!("{middle:.digits$} ({low:.digits$} to {high:.digits$})")
}

fn quantile(values: impl Iterator<Item = f64>, share: f64) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values[(share * (values.len() - 1) as f64).round() as usize]
}
