//! Rounding to decimals, as files hold numbers.

/// Returns `value` rounded to `decimals` decimals; never -0.
pub fn rounded(value: f64, decimals: i32) -> f64 {
    let unit = 10f64.powi(decimals);
    // Adding 0.0 turns -0 into 0.
    (value * unit).round() / unit + 0.0
}
