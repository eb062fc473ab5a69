//! Vectors of three f32 and one of padding, so that four-lane registers apply without any special instruction set.

use super::Vec3;

/// Three numbers and a zero.
pub type Quad = [f32; 4];

/// `s v`, rounded.
#[inline(always)]
pub fn round(v: Vec3, s: f64) -> Quad {
    [(s * v[0]) as f32, (s * v[1]) as f32, (s * v[2]) as f32, 0.0]
}

/// `s a` in double precision.
#[inline(always)]
pub fn widen(a: Quad, s: f64) -> Vec3 {
    [s * f64::from(a[0]), s * f64::from(a[1]), s * f64::from(a[2])]
}

#[inline(always)]
fn zip(a: Quad, b: Quad, f: impl Fn(f32, f32) -> f32) -> Quad {
    [f(a[0], b[0]), f(a[1], b[1]), f(a[2], b[2]), f(a[3], b[3])]
}

/// `a + b`
#[inline(always)]
pub fn add(a: Quad, b: Quad) -> Quad {
    zip(a, b, |a, b| a + b)
}

/// `a - b`
#[inline(always)]
pub fn sub(a: Quad, b: Quad) -> Quad {
    zip(a, b, |a, b| a - b)
}

/// `a b`, entry by entry.
#[inline(always)]
pub fn multiply(a: Quad, b: Quad) -> Quad {
    zip(a, b, |a, b| a * b)
}

/// `s a`
#[inline(always)]
pub fn scale(s: f32, a: Quad) -> Quad {
    a.map(|a| s * a)
}

/// `a + s b`
#[inline(always)]
pub fn add_scaled(a: Quad, s: f32, b: Quad) -> Quad {
    zip(a, b, |a, b| a + s * b)
}

/// `x[0] m[0] + x[1] m[1] + x[2] m[2]`: the product of a matrix given by its columns.
#[inline(always)]
pub fn combine(m: &[Quad; 3], x: Quad) -> Quad {
    add_scaled(add_scaled(scale(x[0], m[0]), x[1], m[1]), x[2], m[2])
}

/// The cross product.
#[inline(always)]
pub fn cross(a: Quad, b: Quad) -> Quad {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0], 0.0]
}

/// The sum of the entries, in double precision.
#[inline(always)]
pub fn total(a: Quad) -> f64 {
    (f64::from(a[0]) + f64::from(a[1])) + (f64::from(a[2]) + f64::from(a[3]))
}
