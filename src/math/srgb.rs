//! The transfer curve of screens. [IEC 61966-2-1]

/// What a screen is told for linear light, both in \[0,1\].
pub fn encode(linear: f64) -> f64 {
    if linear <= 0.003_130_8 {
        12.92 * linear
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    }
}

/// Linear light as a byte, clipped; what is not a number is black.
pub fn byte(linear: f32) -> u8 {
    (255.0 * encode(f64::from(linear).clamp(0.0, 1.0))).round() as u8
}

#[cfg(test)]
mod tests {
    use super::byte;

    /// The curve's ends, and linear 0.5: 1.055 * 0.5^(1/2.4) - 0.055 = 0.73536, times 255 = 187.5.
    #[test]
    fn bytes() {
        assert_eq!([-1.0, 0.0, 1.0, 2.0, f32::NAN].map(byte), [0, 0, 255, 255, 0]);
        assert!((187..=188).contains(&byte(0.5)));
    }
}
