//! Stars of vertices that certainly do not cross themselves: edges and faces of these need not be compared.
//!
//! The star of a vertex is all faces around it. Seen along some direction it is one to one if its faces turn the same way
//! about the vertex and together once at most; then what is apart in the mesh is apart in space. Nearly all pairs with
//! overlapping boxes in a smooth sheet are an edge opposite to a vertex and another face of that vertex: stars rule them
//! out before they are found.

use super::intersection::{Rounding, SINGLE};
use super::ownership::Lists;
use super::primitives::Primitives;
use crate::math::simd::points::{Point, cross, dot, gather_quads, largest, sub};
use crate::math::simd::{Kernel, Lanes, run_wide};
use crate::parallel::Par;

/// Stars side by side.
const WIDTH: usize = 8;

/// Faces of a star at most; larger ones are left to the search.
const FACES: usize = 12;

/// Stars of one task.
const PART: usize = 1024;

/// Stars with one number of faces.
#[derive(Clone, Debug)]
struct Fans {
    faces: usize,
    /// Whether they go all the way round.
    closed: bool,
    centres: Vec<u32>,
    /// Vertices around each centre in order, one more than faces; the last is the first of a closed one.
    rings: Vec<u32>,
}

/// The stars of a mesh that are a disk or a part of one.
#[derive(Clone, Debug, Default)]
pub struct Stars {
    fans: Vec<Fans>,
    /// Vertices of faces are below this.
    size: usize,
}

impl Stars {
    /// The stars of all faces. Cost: linear where no vertex has many faces.
    pub fn build(primitives: &Primitives) -> Stars {
        let faces = primitives.faces;
        let size = faces.iter().flatten().max().map_or(0, |v| *v as usize + 1);
        let corners = faces.iter().zip(0..).flat_map(|(f, number)| f.map(|v| (v, number)));
        let around = Lists::collect(size, &corners.collect::<Vec<_>>());
        let mut stars = Stars { fans: Vec::new(), size };
        let mut sides = Vec::new();
        for v in 0..size as u32 {
            sides.clear();
            sides.extend(around.of(v).iter().filter_map(|f| side(faces[*f as usize], v)));
            if sides.len() < around.of(v).len() || sides.len() > FACES {
                continue;
            }
            let Some(ring) = ring(&mut sides) else { continue };
            let (count, closed) = (ring.len() - 1, ring[0] == ring[ring.len() - 1]);
            let is_alike = |fans: &Fans| fans.faces == count && fans.closed == closed;
            let place = stars.fans.iter().position(is_alike).unwrap_or_else(|| {
                stars.fans.push(Fans { faces: count, closed, centres: Vec::new(), rings: Vec::new() });
                stars.fans.len() - 1
            });
            stars.fans[place].centres.push(v);
            stars.fans[place].rings.extend(ring);
        }
        stars
    }

    /// By vertex, whether its star certainly does not cross itself at `x`: no edge of one of its faces shares a point with
    /// another of them that shares no vertex with the edge.
    ///
    /// `x` are positions in the unit cube, as of [`super::screening::Coarse`]. Cost: linear.
    pub(super) fn clear(&self, x: &[[f32; 4]], par: Par) -> Vec<bool> {
        let mut clear = vec![false; self.size];
        for fans in &self.fans {
            let parts = fans.centres.chunks(PART).zip(fans.rings.chunks(PART * (fans.faces + 1)));
            let judge = |(centres, rings)| {
                let Fans { faces, closed, .. } = *fans;
                (centres, run_wide(Judge { x, faces, closed, centres, rings }))
            };
            par.fold_tasks(parts, judge, |(centres, judged): (&[u32], Vec<bool>)| {
                centres.iter().zip(judged).for_each(|(v, is_clear)| clear[*v as usize] = is_clear);
            });
        }
        clear
    }
}

/// The two other corners of a face; `None` where it is not a triangle.
fn side(face: [u32; 3], v: u32) -> Option<[u32; 2]> {
    let [a, b, c] = face;
    let [p, q] = match v {
        v if v == a => [b, c],
        v if v == b => [c, a],
        _ => [a, b],
    };
    (p != q && p != v && q != v).then_some([p, q])
}

/// The corners of the sides of a star in their order around it, if they make one chain; no two faces alike. Consumes the sides.
fn ring(sides: &mut Vec<[u32; 2]>) -> Option<Vec<u32>> {
    let degree = |sides: &[[u32; 2]], v: u32| sides.iter().flatten().filter(|u| **u == v).count();
    if sides.iter().flatten().any(|v| degree(sides, *v) > 2) {
        return None;
    }
    let is_end = |v: &u32| degree(sides, *v) == 1;
    let start = sides.iter().flatten().copied().find(is_end).or(Some(sides.first()?[0]))?;
    let mut ring = vec![start];
    let mut at = start;
    while let Some(next) = sides.iter().position(|side| side.contains(&at)) {
        let [p, q] = sides.swap_remove(next);
        at = if p == at { q } else { p };
        ring.push(at);
    }
    // Two faces on one pair of vertices turn back on each other.
    (sides.is_empty() && !(ring.len() == 3 && ring[0] == ring[2])).then_some(ring)
}

/// Whether each of some stars is clear.
struct Judge<'a> {
    x: &'a [[f32; 4]],
    faces: usize,
    closed: bool,
    centres: &'a [u32],
    rings: &'a [u32],
}

impl Kernel for Judge<'_> {
    type Output = Vec<bool>;

    #[inline(always)]
    fn run(self) -> Vec<bool> {
        let count = self.centres.len();
        let mut judged = Vec::with_capacity(count);
        let mut start = 0;
        while start < count {
            // Lanes beyond the last star repeat it.
            let mut star = [0; WIDTH];
            for l in 0..WIDTH {
                star[l] = (start + l).min(count - 1);
            }
            let mut ring = [[Lanes::splat(0.0); 3]; FACES + 1];
            let centre = self.points(|l| self.centres[star[l]]);
            for i in 0..=self.faces {
                ring[i] = sub(&self.points(|l| self.rings[star[l] * (self.faces + 1) + i]), &centre);
            }
            let margin = margin(&ring[..=self.faces], self.closed, &SINGLE);
            for l in 0..WIDTH.min(count - start) {
                judged.push(margin.0[l] > 0.0);
            }
            start += WIDTH;
        }
        judged
    }
}

impl Judge<'_> {
    #[inline(always)]
    fn points(&self, vertex: impl Fn(usize) -> u32) -> Point<WIDTH, f32> {
        let mut v = [[0]; WIDTH];
        for l in 0..WIDTH {
            v[l] = [vertex(l) as usize];
        }
        gather_quads(self.x, &v).0[0]
    }
}

/// Greater than zero where a fan about the origin is certainly one to one seen along the sum of its normals: each face
/// turns from its first corner to the next by less than half a turn the same way, all together by a full turn at most.
///
/// `n·(a x b)` of ring vertices a, b no longer than E, differences of positions that are each off by `absolute` as
/// [`Rounding`] says, is off by less than `2 (absolute + relative E) E |n|_1`: twice the error of a difference times E for
/// the product, and its rounding.
#[inline(always)]
fn margin<const L: usize>(ring: &[Point<L, f32>], closed: bool, rounding: &Rounding<f32>) -> Lanes<L, f32> {
    let faces = ring.len() - 1;
    let mut normals = [[Lanes::splat(0.0); 3]; FACES];
    let mut n = [Lanes::splat(0.0); 3];
    let mut extent = Lanes::splat(0.0);
    for i in 0..faces {
        normals[i] = cross(&ring[i], &ring[i + 1]);
        n = [n[0] + normals[i][0], n[1] + normals[i][1], n[2] + normals[i][2]];
        extent = extent.max(largest(&ring[i]));
    }
    extent = extent.max(largest(&ring[faces]));
    let size = (n[0].abs() + n[1].abs() + n[2].abs()) * extent;
    let error = Lanes::splat(2.0) * size * (Lanes::splat(rounding.absolute) + Lanes::splat(rounding.relative) * extent);
    let mut margin = Lanes::splat(f32::INFINITY);
    for normal in &normals[..faces] {
        margin = margin.min(dot(&n, normal) - error);
    }
    // On one side of the first corner's ray, then on the other, and not back: at most one of them may be on it.
    let mut before = dot(&n, &normals[0]);
    let last = if closed { faces - 1 } else { faces };
    for corner in ring.iter().take(last + 1).skip(2) {
        let side = dot(&n, &cross(&ring[0], corner));
        margin = margin.min((before - error).max(side.negate() - error));
        before = side;
    }
    let [smallest, greatest] = rounding.sizes;
    margin.min(size - Lanes::splat(smallest)).min(Lanes::splat(greatest) - size)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A strip of a regular grid, two squares wide and `n` long.
    fn sheet(n: u32) -> (Vec<[f32; 4]>, Vec<[u32; 3]>) {
        let mut faces = Vec::new();
        for (i, j) in (0..n).flat_map(|i| (0..2).map(move |j| (i, j))) {
            let v = 3 * i + j;
            faces.extend([[v, v + 1, v + 3], [v + 1, v + 4, v + 3]]);
        }
        let step = 1.0 / n as f32;
        let x = (0..3 * (n + 1)).map(|v| [(v / 3) as f32 * step, (v % 3) as f32 * step, 0.5, 0.0]).collect();
        (x, faces)
    }

    #[test]
    fn every_star_of_a_flat_sheet_is_clear_and_none_of_a_folded_one() {
        let (mut x, faces) = sheet(40);
        let stars = Stars::build(&Primitives { vertices: &[], edges: &[], faces: &faces });
        assert_eq!(stars.clear(&x, Par::Serial), vec![true; x.len()]);
        // The second half lies on the first: stars at the crease turn back.
        x.iter_mut().filter(|x| x[0] > 0.5).for_each(|x| x[0] = 1.0 - x[0]);
        let crease: Vec<bool> = (0..x.len()).map(|v| v / 3 != 20).collect();
        assert_eq!(stars.clear(&x, Par::Serial), crease);
    }

    #[test]
    fn what_is_no_disk_has_no_star() {
        let build = |faces: &[[u32; 3]]| Stars::build(&Primitives { vertices: &[], edges: &[], faces });
        let fans = |faces: &[[u32; 3]], v: u32| build(faces).fans.iter().any(|fans| fans.centres.contains(&v));
        assert!(fans(&[[0, 1, 2], [0, 2, 3]], 0) && fans(&[[2, 0, 1]], 0));
        // Two fans, three faces on an edge, one face twice, a corner twice.
        assert!(!fans(&[[0, 1, 2], [0, 3, 4]], 0));
        assert!(!fans(&[[0, 1, 2], [0, 1, 3], [0, 1, 4]], 0));
        assert!(!fans(&[[0, 1, 2], [2, 1, 0]], 0));
        assert!(!fans(&[[0, 1, 2], [0, 2, 2]], 0));
        // Two closed ones.
        let tetrahedra = [[0, 1, 2], [0, 2, 3], [0, 3, 1], [0, 4, 5], [0, 5, 6], [0, 6, 4]];
        assert!(!fans(&tetrahedra, 0) && fans(&tetrahedra[..3], 0));
    }
}
