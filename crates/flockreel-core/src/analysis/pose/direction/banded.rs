//! Normal equations of a least-squares problem in which each residual involves at most three successive
//! frames.
//!
//! The matrix is then a band, and Cholesky factorisation takes time proportional to the number of frames.

use super::state::N_STATE;

/// Width of the band. A residual involves at most three successive frames.
const BAND: usize = 3 * N_STATE;

/// The normal equations `H x = -g` of a sum of squares. `H` is stored by rows, each from the diagonal
/// leftward.
pub(super) struct NormalEquations {
    rows: Vec<[f64; BAND]>,
    gradient: Vec<f64>,
    /// The weighted sum of squared residuals, without the factor 1/2.
    pub(super) cost: f64,
}

impl NormalEquations {
    pub(super) fn new(n_unknowns: usize) -> NormalEquations {
        NormalEquations {
            rows: vec![[0.0; BAND]; n_unknowns],
            gradient: vec![0.0; n_unknowns],
            cost: 0.0,
        }
    }

    /// Adds a residual with its weight. `terms` are pairs of unknown and derivative, by ascending unknown.
    pub(super) fn add(&mut self, residual: f64, weight: f64, terms: &[(usize, f64)]) {
        for (k, &(row, slope)) in terms.iter().enumerate() {
            let weighted_slope = weight * slope;
            self.gradient[row] += weighted_slope * residual;
            for &(column, other) in &terms[..=k] {
                self.rows[row][row - column] += weighted_slope * other;
            }
        }
    }

    /// Returns the step that minimises the quadratic model with `damping` times the diagonal added (Marquardt
    /// 1963).
    ///
    /// Unknowns for which `is_fixed` returns true do not move. Returns `None` when the system is not positive
    /// definite.
    pub(super) fn step(&self, damping: f64, is_fixed: impl Fn(usize) -> bool) -> Option<Vec<f64>> {
        let n = self.rows.len();
        let mut factor = self.rows.clone();
        let mut x: Vec<f64> = self.gradient.iter().map(|g| -g).collect();
        for (k, row) in factor.iter_mut().enumerate() {
            row[0] = row[0] * (1.0 + damping) + 1e-9;
            if is_fixed(k) {
                *row = [0.0; BAND];
                row[0] = 1.0;
                x[k] = 0.0;
            } else {
                for back in 1..BAND.min(k + 1) {
                    if is_fixed(k - back) {
                        row[back] = 0.0;
                    }
                }
            }
        }
        // From here on each diagonal entry holds its reciprocal, because divisions are slow.
        for i in 0..n {
            let (done, rest) = factor.split_at_mut(i);
            let row = &mut rest[0];
            let reach = BAND.min(i + 1);
            for back in (1..reach).rev() {
                // Column j = i - back: subtract the dot product of rows i and j, left of column j.
                let other = &done[i - back];
                let sum = row[back] - dot(&row[back + 1..], &other[1..BAND - back]);
                row[back] = sum * other[0];
            }
            let sum = row[0] - dot(&row[1..], &row[1..]);
            if sum.is_nan() || sum <= 0.0 {
                return None;
            }
            row[0] = 1.0 / sum.sqrt();
            for back in 1..reach {
                let known = x[i - back];
                x[i] -= row[back] * known;
            }
            x[i] *= row[0];
        }
        for i in (0..n).rev() {
            let solved = x[i] * factor[i][0];
            x[i] = solved;
            for back in 1..BAND.min(i + 1) {
                x[i - back] -= factor[i][back] * solved;
            }
        }
        Some(x)
    }
}

/// Returns the dot product. Four independent sums let the processor overlap the additions.
#[inline]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<4>(), b.as_chunks::<4>());
    let mut sums = [0.0; 4];
    for (a, b) in a.iter().zip(b) {
        for k in 0..4 {
            sums[k] += a[k] * b[k];
        }
    }
    for (k, (a, b)) in a_rest.iter().zip(b_rest).enumerate() {
        sums[k] += a * b;
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random;

    #[test]
    fn the_step_solves_the_normal_equations() {
        let mut count = 0;
        let mut normal_number = || {
            count += 1;
            random::normal(3, &[count])
        };
        let n = 40;
        let mut normal = NormalEquations::new(n);
        let mut dense = vec![vec![0.0; n]; n];
        let mut right = vec![0.0; n];
        for start in 0..n - BAND + 1 {
            for _ in 0..20 {
                let residual = normal_number();
                let terms: Vec<(usize, f64)> =
                    (0..BAND).map(|k| (start + k, normal_number())).collect();
                normal.add(residual, 0.7, &terms);
                for &(i, a) in &terms {
                    right[i] -= 0.7 * a * residual;
                    for &(j, b) in &terms {
                        dense[i][j] += 0.7 * a * b;
                    }
                }
            }
        }
        let x = normal.step(0.0, |_| false).expect("definite");
        for i in 0..n {
            let got: f64 = (0..n).map(|j| dense[i][j] * x[j]).sum();
            assert!((got - right[i]).abs() < 1e-5, "{got} {}", right[i]);
        }
        let fixed = normal.step(0.0, |k| k < 7).expect("definite");
        assert!(fixed[..7].iter().all(|&v| v == 0.0));
        for i in 7..n {
            let got: f64 = (7..n).map(|j| dense[i][j] * fixed[j]).sum();
            assert!((got - right[i]).abs() < 1e-5);
        }
    }
}
