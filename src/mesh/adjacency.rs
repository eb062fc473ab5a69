//! What hangs together at rest.

/// Whether two primitives have a vertex in common. Such pairs are neighbours at rest and never collide.
#[inline(always)]
pub fn share_vertex<const N: usize, const M: usize>(a: &[u32; N], b: &[u32; M]) -> bool {
    a.iter().any(|v| b.contains(v))
}

/// The primitives at each vertex.
#[derive(Clone, Debug, Default)]
pub struct Incidence {
    offsets: Vec<u32>,
    primitives: Vec<u32>,
}

impl Incidence {
    /// Of primitives over `count` vertices; indices in range. Cost: linear.
    pub fn new<const N: usize>(count: usize, primitives: &[[u32; N]]) -> Incidence {
        let mut offsets = vec![0_u32; count + 2];
        for v in primitives.iter().flatten() {
            offsets[*v as usize + 2] += 1;
        }
        for i in 2..offsets.len() {
            offsets[i] += offsets[i - 1];
        }
        let mut out = vec![0; primitives.len() * N];
        for (number, primitive) in primitives.iter().enumerate() {
            for v in primitive {
                let place = &mut offsets[*v as usize + 1];
                out[*place as usize] = number as u32;
                *place += 1;
            }
        }
        offsets.pop();
        Incidence { offsets, primitives: out }
    }

    /// Numbers of the primitives that have vertex `v`, ascending.
    pub fn at(&self, v: u32) -> &[u32] {
        &self.primitives[self.offsets[v as usize] as usize..self.offsets[v as usize + 1] as usize]
    }
}

/// The directed edges of the faces that are not matched by exactly one opposite edge; sorted.
///
/// None means: the faces bound a volume, consistently wound. Cost: `n log n`.
pub fn open_half_edges(faces: &[[u32; 3]]) -> Vec<[u32; 2]> {
    let mut all: Vec<[u32; 2]> = faces.iter().flat_map(|f| [[f[0], f[1]], [f[1], f[2]], [f[2], f[0]]]).collect();
    all.sort_unstable();
    let times = |e: [u32; 2]| all.partition_point(|x| *x <= e) - all.partition_point(|x| *x < e);
    all.iter().copied().filter(|e| times(*e) != 1 || times([e[1], e[0]]) != 1).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tetrahedron_is_closed_until_a_face_is_missing_or_turned() {
        let faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
        assert!(open_half_edges(&faces).is_empty());
        assert_eq!(open_half_edges(&faces[1..]).len(), 3);
        let turned = [[0, 1, 2], faces[1], faces[2], faces[3]];
        assert!(!open_half_edges(&turned).is_empty());
        let incidence = Incidence::new(5, &faces);
        assert_eq!((incidence.at(3), incidence.at(4)), ([1, 2, 3].as_slice(), [].as_slice()));
        assert!(share_vertex(&[7], &[1, 7, 3]) && !share_vertex(&[7, 8], &[1, 2, 3]));
    }
}
