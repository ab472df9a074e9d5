//! The few f64 vector operations that scenes need.
//!
//! Additions, multiplications, divisions and square roots only, in a fixed order: IEEE 754 gives them
//! one result, so scenes and rays are the same bits on every machine.

/// A vector or a point.
pub type Vec3 = [f64; 3];

/// `a + s · b`.
pub fn along(a: Vec3, s: f64, b: Vec3) -> Vec3 {
    [0, 1, 2].map(|i| a[i] + s * b[i])
}

/// `a - b`.
pub fn sub(a: Vec3, b: Vec3) -> Vec3 {
    [0, 1, 2].map(|i| a[i] - b[i])
}

/// The scalar product.
pub fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The vector product.
pub fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The vector of unit length in that direction; zero stays zero.
pub fn normalize(a: Vec3) -> Vec3 {
    // Scaled first, so that neither tiny nor huge vectors leave the range of f64.
    let largest = a.into_iter().map(f64::abs).fold(0.0, f64::max);
    if largest == 0.0 {
        return a;
    }
    let scaled = a.map(|c| c / largest);
    let length = dot(scaled, scaled).sqrt();
    scaled.map(|c| c / length)
}

/// Two unit vectors that make a right-handed frame with the unit vector `n` as the third.
pub fn tangents(n: Vec3) -> [Vec3; 2] {
    let helper = if n[0].abs() < 0.6 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
    let first = normalize(cross(helper, n));
    [first, cross(n, first)]
}

/// To f32, rounded to nearest.
pub fn narrow(a: Vec3) -> [f32; 3] {
    a.map(|c| c as f32)
}

/// From f32, exactly.
pub fn widen(a: [f32; 3]) -> Vec3 {
    a.map(f64::from)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tangents_are_an_orthonormal_right_handed_frame() {
        for n in [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 2.0, -3.0]] {
            let n = normalize(n);
            let [s, t] = tangents(n);
            for (a, b, expect) in [(s, s, 1.0), (t, t, 1.0), (s, t, 0.0), (s, n, 0.0), (t, n, 0.0)]
            {
                assert!((dot(a, b) - expect).abs() < 1e-12);
            }
            assert!((dot(cross(s, t), n) - 1.0).abs() < 1e-12);
        }
        assert_eq!(normalize([0.0; 3]), [0.0; 3]);
        assert_eq!(normalize([1e-300, 0.0, 0.0]), [1.0, 0.0, 0.0]);
    }
}
