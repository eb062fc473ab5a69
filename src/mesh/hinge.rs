//! Pairs of triangles that share an edge: where shells bend.

/// Vertices `e0 e1 a b` of every hinge: the edge as the first of the two faces runs it, the vertex that completes that
/// face, the one that completes the other.
///
/// Edges of one face have none; where more than two faces meet, every further one bends against the first. Winding need
/// not be consistent. Sorted by edge. Cost: a sort of the edges.
pub fn hinges(faces: &[[u32; 3]]) -> Vec<[u32; 4]> {
    let mut sides: Vec<([u32; 2], usize, usize)> = Vec::with_capacity(3 * faces.len());
    for (number, f) in faces.iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (f[k], f[(k + 1) % 3]);
            sides.push(([a.min(b), a.max(b)], number, k));
        }
    }
    sides.sort_unstable();
    let mut found = Vec::with_capacity(sides.len() / 2);
    let mut first = 0;
    for i in 1..sides.len() {
        if sides[i].0 != sides[first].0 {
            first = i;
            continue;
        }
        let corner = |(_, face, k): ([u32; 2], usize, usize), turn: usize| faces[face][(k + turn) % 3];
        found.push([corner(sides[first], 0), corner(sides[first], 1), corner(sides[first], 2), corner(sides[i], 2)]);
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shared_edges_are_found_once_whatever_the_winding() {
        assert_eq!(hinges(&[[0, 1, 2], [2, 1, 3]]), [[1, 2, 0, 3]]);
        assert_eq!(hinges(&[[0, 1, 2], [1, 2, 3]]), [[1, 2, 0, 3]]);
        assert!(hinges(&[[0, 1, 2], [3, 4, 5]]).is_empty());
        assert!(hinges(&[]).is_empty());
        let tetrahedron = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
        let all = hinges(&tetrahedron);
        assert_eq!(all.len(), 6);
        for h in &all {
            let mut corners = *h;
            corners.sort_unstable();
            assert_eq!(corners, [0, 1, 2, 3]);
        }
    }

    #[test]
    fn three_faces_at_an_edge_bend_against_the_first() {
        assert_eq!(hinges(&[[0, 1, 2], [0, 1, 3], [1, 0, 4]]), [[0, 1, 2, 3], [0, 1, 2, 4]]);
    }
}
