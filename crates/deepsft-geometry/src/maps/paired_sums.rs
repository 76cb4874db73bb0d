//! Sums over pairs of values: how one follows the other.

/// Sums over pairs (a, b), for the straight line from a to b and for their correlation.
#[derive(Clone, Copy, Default)]
pub(crate) struct PairedSums {
    pub(crate) count: f64,
    a: f64,
    b: f64,
    aa: f64,
    bb: f64,
    ab: f64,
}

impl PairedSums {
    pub(crate) fn add(&mut self, a: f64, b: f64) {
        self.count += 1.0;
        self.a += a;
        self.b += b;
        self.aa += a * a;
        self.ab += a * b;
        self.bb += b * b;
    }

    /// Sum of the squared distances of the b from the best line. Where all a are alike the line is level.
    pub(crate) fn residual(&self) -> f64 {
        let spread = |a: f64, b: f64, ab: f64| ab - a * b / self.count.max(1.0);
        let (along, across) = (spread(self.a, self.a, self.aa), spread(self.b, self.b, self.bb));
        let together = spread(self.a, self.b, self.ab);
        let explained = if along > 1e-9 { together * together / along } else { 0.0 };
        (across - explained).max(0.0)
    }

    /// -1 to 1; a grey level squared of variance is added to both, so that even surfaces correlate with nothing.
    pub(crate) fn correlation(&self) -> f64 {
        let (n, mean_a, mean_b) = (self.count, self.a / self.count, self.b / self.count);
        let (aa, bb) = (self.aa / n - mean_a * mean_a, self.bb / n - mean_b * mean_b);
        (self.ab / n - mean_a * mean_b) / ((aa + 1.0) * (bb + 1.0)).sqrt()
    }
}
