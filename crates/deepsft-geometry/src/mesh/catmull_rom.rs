//! A smooth curve through values at whole numbers.

/// Weights of a Catmull-Rom spline (1974) for the values at -1, 0, 1 and 2. They give the value at `t`, 0 to 1; the
/// slope at each value is that of the line through its two neighbours.
pub fn catmull_rom(t: f64) -> [f64; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [
        0.5 * (-t3 + 2.0 * t2 - t),
        0.5 * (3.0 * t3 - 5.0 * t2 + 2.0),
        0.5 * (-3.0 * t3 + 4.0 * t2 + t),
        0.5 * (t3 - t2),
    ]
}
