//! Rigid zones: what still collides moves as one rigid body, with its own momentum [Harmon10, Algorithm 2].

use super::nodes::Nodes;
use super::sweep::Sweep;
use crate::constraint::Metric;
use crate::contact_search::{CandidateSearch, Hit};
use crate::kinematics::{MassElement, RigidMotion, displacement_fit, momentum_fit};
use crate::math::{Vec3, add, scale, sub};
use crate::model::{Kind, Segment, State};

/// Rounds of growing zones at most.
const ROUNDS: usize = 10;

/// Turn of a zone within a segment at most `[rad]`: chords of a rigid turn shrink distances by `cos(turn/2)`, which
/// must stay well above the half that continuous detection keeps.
const TURN: f64 = 1.0;

/// What rigid zones led to.
pub struct ZoneOutcome {
    /// Velocity per block, zones applied.
    pub velocities: Vec<Vec3>,
    /// End state.
    pub end: State,
    /// Hits left; empty when the zones resolved the segment.
    pub hits: Vec<Hit>,
    /// Number of zones.
    pub zones: u32,
}

/// Lets the nodes of hit pairs move as rigid zones until nothing is hit or zones no longer grow.
///
/// Zones that share a node merge. A zone with scripted members follows the motion that fits them best; the others keep
/// their linear and angular momentum. Cost: at most 10 rounds of continuous detection.
pub fn rigid_zones(
    sweep: &Sweep,
    metric: &Metric,
    tentative: &[Vec3],
    hits: &[Hit],
    candidates: &mut CandidateSearch,
) -> ZoneOutcome {
    let nodes = Nodes::new(sweep.segment.model, metric);
    let mut zones = Zones::new(nodes.len());
    let mut outcome =
        ZoneOutcome { velocities: tentative.to_vec(), end: State::default(), hits: hits.to_vec(), zones: 0 };
    for _ in 0..ROUNDS {
        let grown = outcome.hits.iter().filter(|hit| zones.join(&nodes.of_pair(&hit.pair))).count();
        if grown == 0 {
            break;
        }
        outcome.velocities = tentative.to_vec();
        let members = zones.members();
        outcome.zones = members.len() as u32;
        for zone in &members {
            move_zone(&sweep.segment, metric, &nodes, zone, tentative, &mut outcome.velocities);
        }
        (outcome.end, outcome.hits) = sweep.test(&outcome.velocities, 1.0, candidates);
        if outcome.hits.is_empty() {
            break;
        }
    }
    outcome
}

/// Disjoint sets of nodes.
struct Zones {
    parent: Vec<usize>,
    in_zone: Vec<bool>,
}

impl Zones {
    fn new(count: usize) -> Zones {
        Zones { parent: (0..count).collect(), in_zone: vec![false; count] }
    }

    fn root(&mut self, mut node: usize) -> usize {
        while self.parent[node] != node {
            self.parent[node] = self.parent[self.parent[node]];
            node = self.parent[node];
        }
        node
    }

    /// Joins the nodes; whether that changed anything.
    fn join(&mut self, nodes: &[usize]) -> bool {
        let mut changed = false;
        for node in nodes {
            changed |= !std::mem::replace(&mut self.in_zone[*node], true);
            let (a, b) = (self.root(nodes[0]), self.root(*node));
            if a != b {
                self.parent[a.max(b)] = a.min(b);
                changed = true;
            }
        }
        changed
    }

    /// Members of every zone, in node order.
    fn members(&mut self) -> Vec<Vec<usize>> {
        let mut slot = vec![usize::MAX; self.parent.len()];
        let mut members: Vec<Vec<usize>> = Vec::new();
        for node in 0..self.parent.len() {
            if !self.in_zone[node] {
                continue;
            }
            let root = self.root(node);
            if slot[root] == usize::MAX {
                slot[root] = members.len();
                members.push(Vec::new());
            }
            members[slot[root]].push(node);
        }
        members
    }
}

fn move_zone(
    segment: &Segment,
    metric: &Metric,
    nodes: &Nodes,
    zone: &[usize],
    tentative: &[Vec3],
    velocities: &mut [Vec3],
) {
    let scripted: Vec<usize> = zone.iter().copied().filter(|n| nodes.is_scripted(*n)).collect();
    let motion = if scripted.is_empty() {
        free_motion(segment, metric, nodes, zone, tentative)
    } else {
        scripted_motion(segment, nodes, &scripted, tentative)
    };
    let Some(mut motion) = motion else { return };
    let turn = crate::kinematics::turn(motion.angular, segment.dt);
    if turn > TURN {
        motion.angular = scale(TURN / turn, motion.angular);
    }
    for node in zone.iter().filter(|n| !nodes.is_scripted(**n)) {
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

/// The motion of what is scripted in a zone: a single posed body's own, else the best fit to the displacements.
fn scripted_motion(segment: &Segment, nodes: &Nodes, scripted: &[usize], tentative: &[Vec3]) -> Option<RigidMotion> {
    let mut end = State::default();
    segment.end_state(tentative, 1.0, true, &mut end);
    if let [node] = scripted
        && let Some(body) = nodes.body(*node)
        && !matches!(segment.model.bodies[body].description.kind, Kind::HalfSpace(_))
    {
        let start = segment.start.poses[body];
        let (linear, angular) = start.velocity_to(&end.poses[body], segment.dt);
        return Some(RigidMotion { centre: start.position, linear, angular });
    }
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
                _ => points.extend(
                    segment.model.bodies[body].vertices.clone().map(|v| (segment.start.positions[v], end.positions[v])),
                ),
            },
        }
    }
    displacement_fit(&points, segment.dt)
}
