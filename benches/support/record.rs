//! The contact problem that a host is about to hand to the library, recorded for benches and tests of solvers.

use super::host::Host;
use super::nearby::{Pair, Surfaces, pairs};
use super::problem::{Problem, RowChoice, half_space_pairs};
use signorini::math::{Vec3, dot, scale, sub};
use signorini::model::Kind;
use std::collections::BTreeMap;

/// Contacts of the last step by pair: vertices, the first side's first, and the world impulse on the first side.
type Known = BTreeMap<(u32, [u32; 4]), Vec3>;

/// The problem at the host's present state with pairs nearer than `range`, all distances kept up to the pair thickness.
///
/// The warm start is the last step's impulse by pair and `dv = v0 - v*`. Worlds without rigid bodies only.
pub fn problem(host: &mut Host, range: f64) -> Problem {
    let linear = host.prepare();
    let model = &host.model;
    let n = host.elastic_count();
    assert_eq!(model.block_count, n, "elastic bodies and obstacles only");
    let fixed = |kind: &Kind| !matches!(kind, Kind::Deformable { .. });
    let alone: Vec<bool> =
        model.bodies.iter().map(|b| b.description.self_collision && !fixed(&b.description.kind)).collect();
    let prescribed: Vec<bool> = model.bodies.iter().map(|b| fixed(&b.description.kind)).collect();
    let surfaces = Surfaces {
        faces: &model.faces,
        edges: &model.edges,
        body: &model.vertex_body,
        self_contact: &alone,
        prescribed: &prescribed,
    };
    let x = &host.state.positions;
    let mut close = pairs(x, &surfaces, range);
    for (body, plane) in model.bodies.iter().zip(&host.state.half_spaces) {
        if matches!(body.description.kind, Kind::HalfSpace(_)) {
            close.extend(half_space_pairs(&x[..n], plane.normal, plane.offset, range));
        }
    }
    let choice = RowChoice {
        thickness: 2.0 * model.bodies[0].half_thickness,
        friction: model.materials.list[0].friction_coefficient,
        dt: host.dt,
    };
    let known = last_contacts(host);
    let mut out = Problem::new(linear.matrix, linear.velocities, &close, choice);
    let impulses = close.iter().enumerate().map(|(i, pair)| warm_impulse(pair, &out.rows.frames[i], &known)).collect();
    let dv = (0..n).map(|i| sub(host.velocities[i], out.velocities[i])).collect();
    out.warm = Some((impulses, dv));
    out
}

fn last_contacts(host: &Host) -> Known {
    let model = &host.model;
    let mut known = Known::new();
    for c in &host.result.contacts {
        let body = |side: usize| model.body_index(c.bodies[side]).map(|b| &model.bodies[b]);
        let (Some(a), Some(b)) = (body(0), body(1)) else { continue };
        let [fa, fb] = c.features.map(|f| f as usize);
        let vertices = match c.kind {
            0 => {
                let f = model.faces[b.faces.start + fb];
                [(a.vertices.start + fa) as u32, f[0], f[1], f[2]]
            }
            1 => {
                let (ea, eb) = (model.edges[a.edges.start + fa], model.edges[b.edges.start + fb]);
                [ea[0], ea[1], eb[0], eb[1]]
            }
            _ => [(a.vertices.start + fa) as u32, 0, 0, 0],
        };
        let sum = known.entry((c.kind, vertices)).or_insert([0.0; 3]);
        *sum = signorini::math::add(*sum, c.impulse);
    }
    known
}

fn warm_impulse(pair: &Pair, frame: &[Vec3; 3], known: &Known) -> Vec3 {
    let [a, b, c, d] = pair.vertices;
    let kind = match pair.weights {
        [_, 0.0, 0.0, 0.0] => 2,
        [1.0, ..] => 0,
        _ => 1,
    };
    let swapped = || known.get(&(1, [c, d, a, b])).map(|f| scale(-1.0, *f));
    let impulse = known.get(&(kind, pair.vertices)).copied().or_else(|| if kind == 1 { swapped() } else { None });
    let f = impulse.unwrap_or([0.0; 3]);
    [dot(frame[0], f).max(0.0), dot(frame[1], f), dot(frame[2], f)]
}
