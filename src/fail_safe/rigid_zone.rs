//! A rigid zone: what collides moves as one rigid body, with its own momentum [Harmon10, Algorithm 2].

use super::nodes::Nodes;
use crate::constraint::Metric;
use crate::kinematics::{MassElement, RigidMotion, displacement_fit, momentum_fit};
use crate::math::{Vec3, add, cross, mat_vec, norm, scale, sub};
use crate::model::{Kind, Segment, State};

/// Turn of a zone within a segment at most `[rad]`: chords of a rigid turn shrink distances by `cos(turn/2)`, which
/// must stay well above the half that continuous detection keeps.
const TURN: f64 = 1.0;

/// What moving a zone rigidly came to.
pub(super) struct RigidZone {
    /// The velocity by which scripted members miss the motion `[m/s]`.
    pub misfit: f64,
    /// Angular momentum that the movable nodes gained, about the centre of the motion `[N m s]`.
    pub angular_momentum_change: Vec3,
}

/// Moves the movable nodes of a zone as one rigid body.
///
/// Without scripted members the zone keeps its linear and angular momentum. With some, infinite mass decides: the zone
/// follows the motion that fits theirs best. Where these motions contradict each other, rigid zones break down
/// [Harmon10, §3.1]: no rigid motion follows them all, and what is missed is returned.
pub(super) fn move_zone(
    segment: &Segment,
    metric: &Metric,
    nodes: &Nodes,
    movable: &[usize],
    scripted: &[usize],
    tentative: &[Vec3],
    velocities: &mut [Vec3],
) -> RigidZone {
    let script = (!scripted.is_empty()).then(|| Script::new(segment, nodes, scripted, tentative));
    let motion = match &script {
        Some(script) => script.motion,
        None => free_motion(segment, metric, nodes, movable, tentative),
    };
    let Some(mut motion) = motion else { return RigidZone { misfit: 0.0, angular_momentum_change: [0.0; 3] } };
    let turn = crate::kinematics::turn(motion.angular, segment.dt);
    if turn > TURN {
        motion.angular = scale(TURN / turn, motion.angular);
    }
    for node in movable {
        let first = nodes.first_block(*node);
        let start = match nodes.body(*node) {
            Some(body) => {
                velocities[first + 1] = motion.angular;
                segment.start.poses[body].position
            }
            None => segment.start.positions[*node],
        };
        velocities[first] = scale(1.0 / segment.dt, sub(motion.moved(start, segment.dt), start));
    }
    RigidZone {
        misfit: script.map_or(0.0, |script| script.missed(&motion, segment.dt)),
        angular_momentum_change: angular_momentum_change(segment, metric, nodes, movable, tentative, &motion),
    }
}

/// What a motion has, at its start, less what the nodes had.
fn angular_momentum_change(
    segment: &Segment,
    metric: &Metric,
    nodes: &Nodes,
    movable: &[usize],
    tentative: &[Vec3],
    motion: &RigidMotion,
) -> Vec3 {
    let mut change = [0.0; 3];
    for node in movable {
        let first = nodes.first_block(*node);
        let position = match nodes.body(*node) {
            Some(body) => {
                let turn = sub(motion.angular, tentative[first + 1]);
                change = add(change, mat_vec(&metric.lumped[first + 1], turn));
                segment.start.poses[body].position
            }
            None => segment.start.positions[*node],
        };
        let arm = sub(position, motion.centre);
        let moved = add(motion.linear, cross(motion.angular, arm));
        let gained = mat_vec(&metric.lumped[first], sub(moved, tentative[first]));
        change = add(change, cross(arm, gained));
    }
    change
}

fn free_motion(
    segment: &Segment,
    metric: &Metric,
    nodes: &Nodes,
    zone: &[usize],
    tentative: &[Vec3],
) -> Option<RigidMotion> {
    let element = |node: &usize| {
        let first = nodes.first_block(*node);
        let (position, inertia, angular) = match nodes.body(*node) {
            Some(body) => (segment.start.poses[body].position, metric.lumped[first + 1], tentative[first + 1]),
            None => (segment.start.positions[*node], [[0.0; 3]; 3], [0.0; 3]),
        };
        MassElement { mass: metric.lumped[first][0][0], inertia, position, linear: tentative[first], angular }
    };
    momentum_fit(&zone.iter().map(element).collect::<Vec<_>>())
}

/// The scripted members of a zone.
struct Script {
    /// Start and end of points of them.
    points: Vec<(Vec3, Vec3)>,
    /// The motion of the zone: a single posed body's own, else the best fit to the displacements.
    motion: Option<RigidMotion>,
}

impl Script {
    fn new(segment: &Segment, nodes: &Nodes, scripted: &[usize], tentative: &[Vec3]) -> Script {
        let mut end = State::default();
        segment.end_state(tentative, 1.0, true, &mut end);
        let mut points: Vec<(Vec3, Vec3)> = Vec::new();
        for node in scripted {
            match nodes.body(*node) {
                None => points.push((segment.start.positions[*node], end.positions[*node])),
                Some(body) => match segment.model.bodies[body].description.kind {
                    Kind::HalfSpace(_) => {
                        let (a, b) = (&segment.start.half_spaces[body], &end.half_spaces[body]);
                        let moved = sub(scale(b.offset, b.normal), scale(a.offset, a.normal));
                        let at = scale(a.offset, a.normal);
                        points.push((at, add(at, moved)));
                    }
                    _ => {
                        let vertices = segment.model.bodies[body].vertices.clone();
                        points.extend(vertices.map(|v| (segment.start.positions[v], end.positions[v])));
                    }
                },
            }
        }
        let posed = match scripted {
            [node] => nodes
                .body(*node)
                .filter(|body| !matches!(segment.model.bodies[*body].description.kind, Kind::HalfSpace(_))),
            _ => None,
        };
        let motion = match posed {
            Some(body) => {
                let start = segment.start.poses[body];
                let (linear, angular) = start.velocity_to(&end.poses[body], segment.dt);
                Some(RigidMotion { centre: start.position, linear, angular })
            }
            None => displacement_fit(&points, segment.dt),
        };
        Script { points, motion }
    }

    /// The largest velocity by which a point misses a motion.
    fn missed(&self, motion: &RigidMotion, dt: f64) -> f64 {
        self.points.iter().map(|(a, b)| norm(sub(motion.moved(*a, dt), *b)) / dt).fold(0.0, f64::max)
    }
}
