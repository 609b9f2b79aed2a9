//! How bright a picture is, whatever a few of its pixels show.

/// Share of the values that count as the least of them: a lamp that is seen, its glint in a mirror, one photon where photons are
/// rare are often brighter than all the rest together.
const BRIGHTEST: f64 = 0.01;
/// Values of which the limit is taken; so many tell it well.
const SAMPLE: usize = 1 << 16;

/// The mean of a picture's values, the brightest hundredth of which counts as the least of them; the plain mean where that is 0,
/// for then nothing but a few pixels is lit. See docs/EQUATIONS.md, Brightness.
pub fn brightness(values: impl ExactSizeIterator<Item = f64> + Clone) -> f64 {
    let count = values.len();
    let step = count.div_ceil(SAMPLE).max(1);
    // All of three channels, where they lie side by side.
    let step = if step % 3 == 0 { step + 1 } else { step };
    let mut sample: Vec<f64> = values.clone().step_by(step).collect();
    let Some(last) = sample.len().checked_sub(1) else { return 0.0 };
    let at = (last as f64 * (1.0 - BRIGHTEST)) as usize;
    let limit = *sample.select_nth_unstable_by(at, f64::total_cmp).1;
    let clipped = values.clone().map(|value| value.min(limit)).sum::<f64>() / count as f64;
    if clipped > 0.0 {
        clipped
    } else {
        values.sum::<f64>() / count as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_bright_pixels_make_no_picture_bright() {
        let picture = |bright: f64| (0..1000).map(move |i| if i % 200 == 7 { bright } else { 2.0 });
        assert_eq!(brightness(picture(2.0)), 2.0);
        assert_eq!(brightness(picture(1e6)), 2.0);
    }

    #[test]
    fn what_is_lit_is_told_where_it_is_little() {
        let picture = (0..1000).map(|i| if i == 7 { 3.0 } else { 0.0 });
        assert_eq!(brightness(picture), 3.0 / 1000.0);
        assert_eq!(brightness([].into_iter()), 0.0);
    }

    /// Of 0, 1, ... 999 the brightest ten count as 989: `(0 + ... + 989 + 10 * 989) / 1000`.
    #[test]
    fn the_brightest_hundredth_counts_as_the_least_of_it() {
        let values = (0..1000).map(f64::from);
        assert_eq!(brightness(values), (989.0 * 990.0 / 2.0 + 9890.0) / 1000.0);
    }

    #[test]
    fn large_pictures_are_sampled() {
        let values = |count: i32| (0..count).map(|i| f64::from(i % 1000));
        assert!((brightness(values(1_000_000)) - 499.0).abs() < 1.0);
        // A step of 3 would see the dark channel alone.
        let channels = (0..3 << 16).map(|i| if i % 3 == 0 { 1.0 } else { 3.0 });
        assert!((brightness(channels) - 7.0 / 3.0).abs() < 1e-9);
    }
}
