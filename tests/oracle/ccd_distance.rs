//! Distances of primitive pairs over all features, in f64: slow, plain, and sharing no code with the library.

pub type Point = [f64; 3];

fn sub(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Point, b: Point) -> Point {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn point_segment(p: Point, a: Point, b: Point) -> f64 {
    let (u, w) = (sub(b, a), sub(p, a));
    let uu = dot(u, u);
    let t = if uu > 0.0 { (dot(w, u) / uu).clamp(0.0, 1.0) } else { 0.0 };
    let r = [w[0] - t * u[0], w[1] - t * u[1], w[2] - t * u[2]];
    dot(r, r).sqrt()
}

pub fn point_triangle(x: &[Point; 4]) -> f64 {
    let [p, a, b, c] = *x;
    let mut best = point_segment(p, a, b).min(point_segment(p, b, c)).min(point_segment(p, c, a));
    let (e, f, d) = (sub(b, a), sub(c, a), sub(p, a));
    let n = cross(e, f);
    let nn = dot(n, n);
    if nn > 0.0 {
        let (u, v) = (dot(cross(d, f), n) / nn, dot(cross(e, d), n) / nn);
        if u >= 0.0 && v >= 0.0 && u + v <= 1.0 {
            best = best.min(dot(d, n).abs() / nn.sqrt());
        }
    }
    best
}

pub fn edge_edge(x: &[Point; 4]) -> f64 {
    let [a, b, c, d] = *x;
    let mut best =
        point_segment(a, c, d).min(point_segment(b, c, d)).min(point_segment(c, a, b)).min(point_segment(d, a, b));
    let (u, v, w) = (sub(b, a), sub(d, c), sub(c, a));
    let n = cross(u, v);
    let nn = dot(n, n);
    if nn > 0.0 {
        let (s, r) = (dot(cross(w, v), n) / nn, dot(cross(w, u), n) / nn);
        if (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&r) {
            best = best.min(dot(w, n).abs() / nn.sqrt());
        }
    }
    best
}

/// The configuration at time t.
pub fn at(x0: &[Point; 4], x1: &[Point; 4], t: f64) -> [Point; 4] {
    std::array::from_fn(|i| std::array::from_fn(|c| (1.0 - t) * x0[i][c] + t * x1[i][c]))
}
