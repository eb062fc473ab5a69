//! Whole-mesh steps with the complete list of their collisions.

use crate::mesh_file::read_ply;
use signorini::detection::ccd;
use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;

type Point = [f64; 3];
type Pair = [u32; 4];

/// Lines of four indices and a time; keyed by the vertices in canonical order.
fn read_hits(path: &Path, canonical: fn(Pair) -> Pair) -> Result<BTreeMap<Pair, f64>, String> {
    let text = std::fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
    let mut hits = BTreeMap::new();
    let mut offset = 0;
    for line in text.split_inclusive('\n') {
        let fields: Vec<f64> = line.trim().split(',').filter_map(|f| f.parse().ok()).collect();
        let [a, b, c, d, toi] = fields[..] else {
            return Err(format!("{}: at byte {offset}: not four indices and a time", path.display()));
        };
        hits.insert(canonical([a, b, c, d].map(|v| v as u32)), toi);
        offset += line.len();
    }
    Ok(hits)
}

fn canonical_vertex_face([v, a, b, c]: Pair) -> Pair {
    let mut f = [a, b, c];
    f.sort_unstable();
    [v, f[0], f[1], f[2]]
}

fn canonical_edge_edge([a, b, c, d]: Pair) -> Pair {
    let (e, f) = ([a.min(b), a.max(b)], [c.min(d), c.max(d)]);
    let (e, f) = if e <= f { (e, f) } else { (f, e) };
    [e[0], e[1], f[0], f[1]]
}

#[derive(Clone, Copy)]
struct SweptBox {
    low: Point,
    high: Point,
}

fn swept_box(x0: &[Point], x1: &[Point], vertices: &[u32]) -> SweptBox {
    let mut b = SweptBox { low: [f64::INFINITY; 3], high: [f64::NEG_INFINITY; 3] };
    for v in vertices {
        for p in [x0[*v as usize], x1[*v as usize]] {
            for (c, x) in p.into_iter().enumerate() {
                b.low[c] = b.low[c].min(x);
                b.high[c] = b.high[c].max(x);
            }
        }
    }
    b
}

/// Sorts both lists along x and visits every pair of overlapping boxes.
fn sweep(a: &[SweptBox], b: &[SweptBox], mut visit: impl FnMut(usize, usize)) {
    let sorted = |boxes: &[SweptBox]| {
        let mut order: Vec<usize> = (0..boxes.len()).collect();
        order.sort_by(|i, j| boxes[*i].low[0].total_cmp(&boxes[*j].low[0]).then(i.cmp(j)));
        order
    };
    let overlap = |p: &SweptBox, q: &SweptBox| (0..3).all(|c| p.low[c] <= q.high[c] && q.low[c] <= p.high[c]);
    let (order_a, order_b) = (sorted(a), sorted(b));
    let (mut i, mut j) = (0, 0);
    // The box that begins first meets those of the other list that begin before it ends.
    while i < order_a.len() && j < order_b.len() {
        let (p, q) = (&a[order_a[i]], &b[order_b[j]]);
        if p.low[0] <= q.low[0] {
            for k in order_b[j..].iter().take_while(|k| b[**k].low[0] <= p.high[0]) {
                if overlap(p, &b[*k]) {
                    visit(order_a[i], *k);
                }
            }
            i += 1;
        } else {
            for k in order_a[i..].iter().take_while(|k| a[**k].low[0] <= q.high[0]) {
                if overlap(&a[*k], q) {
                    visit(*k, order_b[j]);
                }
            }
            j += 1;
        }
    }
}

type Detector = fn(&[Point; 4], &[Point; 4], f64) -> Option<f64>;

struct Step {
    x0: Vec<Point>,
    x1: Vec<Point>,
}

impl Step {
    /// Tests the pairs, compares with the list, prints a line; whether nothing was missed or late.
    fn compare(
        &self,
        name: &str,
        pairs: &[Pair],
        detect: Detector,
        canonical: fn(Pair) -> Pair,
        list: &BTreeMap<Pair, f64>,
    ) -> bool {
        let start = Instant::now();
        let found: Vec<Option<f64>> = pairs
            .iter()
            .map(|pair| detect(&pair.map(|v| self.x0[v as usize]), &pair.map(|v| self.x1[v as usize]), 1.0))
            .collect();
        let seconds = start.elapsed().as_secs_f64();
        let (mut hits, mut alarms, mut late, mut early) = (0, 0, 0, 0);
        for (pair, time) in pairs.iter().zip(&found) {
            let Some(t) = time else { continue };
            match list.get(&canonical(*pair)) {
                None => alarms += 1,
                Some(toi) => {
                    hits += 1;
                    late += usize::from(t > toi);
                    early += usize::from(*t < toi - 1e-6);
                }
            }
        }
        let missed = list.len() - hits;
        println!(
            "{name:32} {:8} {:7} {missed:9} {alarms:9} {late:6} {early:6} {:9.3}",
            pairs.len(),
            list.len(),
            seconds * 1e6 / pairs.len().max(1) as f64
        );
        missed == 0 && late == 0
    }
}

fn edges_of(faces: &[[u32; 3]]) -> Vec<[u32; 2]> {
    let mut edges: Vec<[u32; 2]> =
        faces.iter().flat_map(|[a, b, c]| [[a, b], [b, c], [c, a]].map(|[p, q]| [*p.min(q), *p.max(q)])).collect();
    edges.sort_unstable();
    edges.dedup();
    edges
}

/// All pairs of one step against its complete lists of hits.
pub fn check(dir: &Path, name: &str) -> Result<bool, String> {
    let (start, end) = (read_ply(&dir.join(format!("{name}-t0.ply")))?, read_ply(&dir.join(format!("{name}-t1.ply")))?);
    if start.faces != end.faces || start.points.len() != end.points.len() {
        return Err(format!("{name}: the two frames are different meshes"));
    }
    let step = Step { x0: start.points, x1: end.points };
    let boxes = |elements: &mut dyn Iterator<Item = Vec<u32>>| -> Vec<SweptBox> {
        elements.map(|e| swept_box(&step.x0, &step.x1, &e)).collect()
    };
    let vertex_boxes = boxes(&mut (0..step.x0.len() as u32).map(|v| vec![v]));
    let face_boxes = boxes(&mut start.faces.iter().map(|f| f.to_vec()));
    let edges = edges_of(&start.faces);
    let edge_boxes = boxes(&mut edges.iter().map(|e| e.to_vec()));
    let (mut vertex_face, mut edge_edge) = (Vec::new(), Vec::new());
    sweep(&vertex_boxes, &face_boxes, |v, f| {
        let [a, b, c] = start.faces[f];
        if ![a, b, c].contains(&(v as u32)) {
            vertex_face.push([v as u32, a, b, c]);
        }
    });
    sweep(&edge_boxes, &edge_boxes, |i, j| {
        let ([a, b], [c, d]) = (edges[i], edges[j]);
        if i < j && a != c && a != d && b != c && b != d {
            edge_edge.push([a, b, c, d]);
        }
    });
    let vertex_face_hits = read_hits(&dir.join(format!("{name}-vf-hits.csv")), canonical_vertex_face)?;
    let edge_edge_hits = read_hits(&dir.join(format!("{name}-ee-hits.csv")), canonical_edge_edge)?;
    let detect = ccd::point_triangle::time_of_impact;
    let label = format!("{name} step, vf");
    let clean = step.compare(&label, &vertex_face, detect, canonical_vertex_face, &vertex_face_hits);
    let label = format!("{name} step, ee");
    let detect = ccd::edge_edge::time_of_impact;
    Ok(step.compare(&label, &edge_edge, detect, canonical_edge_edge, &edge_edge_hits) && clean)
}
