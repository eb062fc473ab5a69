//! Zones: collisions that share degrees of freedom, grown and answered together until no new collision appears
//! [Harmon10, Algorithm 3].

use super::nodes::Nodes;
use super::rigid_zone::move_zone;
use super::sweep::Sweep;
use super::unilateral_projection::ESCAPE;
use super::zone_projection::{Projected, ZoneResponse, project};
use crate::constraint::{BuiltRows, Linearisation, Metric, build_rows};
use crate::contact_search::{CandidateSearch, Contact, Hit, Pair};
use crate::math::{Vec3, add, cross, mat_vec, norm, sub};
use crate::model::{FailSafe, State};
use std::collections::BTreeMap;

/// Rounds of growing and projecting; then the zones that are still hit move as rigid bodies.
const PROJECTIONS: usize = 12;

/// Rounds at most.
const ROUNDS: usize = 22;

/// Rows that a pair may own in a projected zone. One that is hit once more makes its zone rigid.
const ROWS_OF_PAIR: u32 = 4;

/// Share of their gaps that rows ask for where the whole leaves no solution: above the half that continuous detection
/// keeps.
const SQUEEZED: f64 = 0.6;

/// How often a zone with rigid bodies is projected in a round, each time about the motion found last.
const LINEARISATIONS: usize = 2;

/// What became of one zone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ZoneReport {
    /// Movable nodes: deformable vertices and whole rigid bodies.
    pub nodes: u32,
    /// Scripted nodes that it touches: infinite masses.
    pub scripted: u32,
    /// Collisions, and contacts among its nodes that were near when it was answered again.
    pub collisions: u32,
    /// What answered it in the end.
    pub fail_safe: FailSafe,
    /// [`super::Projection::rank`]; 0 for rigid zones.
    pub rank: u32,
    /// Projections: the largest normal velocity missed. Rigid zones: the velocity by which their scripted members miss
    /// the rigid motion, above 0 where these contradict each other: the breakdown of rigid zones `[m/s]`.
    pub residual: f64,
    /// Whether a projection met its tolerance.
    pub converged: bool,
    /// Change of angular momentum of the movable nodes `[N m s]`; rounding for rigid zones without scripted nodes, unless
    /// these would turn by more than a radian.
    pub angular_momentum_change: Vec3,
}

/// What zones led to.
#[derive(Default)]
pub struct ZoneOutcome {
    /// Velocity per block, zones applied.
    pub velocities: Vec<Vec3>,
    /// End state.
    pub end: State,
    /// Hits left; empty when the zones resolved the segment.
    pub hits: Vec<Hit>,
    /// Zones projected.
    pub projected: u32,
    /// Zones that moved as rigid bodies.
    pub rigid: u32,
    /// Rounds of continuous detection.
    pub rounds: u32,
    /// Each zone that is not hit any more, ordered by its first node.
    pub reports: Vec<ZoneReport>,
}

/// Grows zones from the hits and answers each from the velocities `tentative` until nothing is hit, or nothing more can
/// be done.
///
/// Collisions that share a movable node are in one zone; those that share only a scripted one are not. Projected motion
/// is tested by continuous detection like any other (where thickness leaves no solution, 0.6 of it is asked for): a
/// pair that is hit again owns another row, at its new impact. After 12 rounds, or when a pair is hit a fifth time or a
/// projection finds no solution, its zone moves as a rigid body. A pair of scripted parts ends it at once. Cost: at
/// most 22 rounds, each of continuous detection and of the zones that were hit.
pub fn resolve_zones(
    sweep: &Sweep,
    metric: &Metric,
    tentative: &[Vec3],
    hits: &[Hit],
    candidates: &mut CandidateSearch,
    response: &ZoneResponse,
) -> ZoneOutcome {
    let nodes = Nodes::new(sweep.segment.model, metric);
    let mut zones = Zones::new(nodes.len(), response.fail_safe == FailSafe::RigidZone);
    let mut outcome = ZoneOutcome { velocities: tentative.to_vec(), hits: hits.to_vec(), ..ZoneOutcome::default() };
    let mut reports = BTreeMap::new();
    for round in 0..ROUNDS {
        if !zones.grow(&nodes, &outcome.hits, round >= PROJECTIONS) {
            break;
        }
        if round == 1 && response.fail_safe == FailSafe::UnilateralProjection {
            let mut near = Vec::new();
            sweep.near(&outcome.end, 1.0, candidates, &mut near);
            zones.near = near.into_iter().map(|contact| Near::new(contact, &nodes)).collect();
        }
        zones.take_near();
        let touched = zones.touched(&outcome.hits, &nodes);
        let impulses = &mut zones.impulses;
        answer(sweep, metric, &nodes, response, tentative, &touched, impulses, &mut outcome.velocities, &mut reports);
        // A projection that scripted parts leave no room for is not tried again.
        let failed = |zone: &&Zone| reports.get(&zone.root).is_some_and(|r| r.fail_safe == FailSafe::RigidZone);
        touched.iter().filter(failed).for_each(|zone| zones.rigid[zone.root] = true);
        outcome.rounds += 1;
        let mut end = State::default();
        sweep.segment.end_state(&outcome.velocities, 1.0, true, &mut end);
        outcome.hits = match outcome.rounds {
            1 => sweep.hits(&end, candidates),
            _ => sweep.hits_again(&end, (&outcome.end.positions, &outcome.hits), candidates),
        };
        outcome.end = end;
        if outcome.hits.is_empty() {
            break;
        }
    }
    // Zones that others took in are no zones any more, and those that are still hit have not resolved anything.
    let left: Vec<usize> = zones.touched(&outcome.hits, &nodes).iter().map(|zone| zone.root).collect();
    let mut resolved = |root: usize| zones.root(root) == root && !left.contains(&root);
    outcome.reports = reports.into_iter().filter(|(root, _)| resolved(*root)).map(|(_, r)| r).collect();
    outcome.rigid = outcome.reports.iter().filter(|r| r.fail_safe == FailSafe::RigidZone).count() as u32;
    outcome.projected = outcome.reports.len() as u32 - outcome.rigid;
    outcome
}

/// One zone as it stands.
struct Zone {
    root: usize,
    rigid: bool,
    /// Movable nodes, ascending.
    movable: Vec<usize>,
    /// Scripted nodes of its collisions, ascending.
    scripted: Vec<usize>,
    contacts: Vec<Contact>,
    /// Numbers of its collisions.
    collisions: Vec<usize>,
}

/// The projection of one zone.
struct Task<'a> {
    zone: &'a Zone,
    /// Its rows.
    of: Vec<usize>,
    /// Guess of their normal impulses.
    guess: Vec<f64>,
    projected: Option<Projected>,
}

impl Task<'_> {
    fn run(&mut self, built: &BuiltRows, gaps: &[f64], metric: &Metric, response: &ZoneResponse, dt: f64) {
        let rows = &built.rows;
        let mut targets: Vec<f64> = self.of.iter().map(|row| rows.normal_targets[*row]).collect();
        let mut projected = project(rows, &self.of, &targets, &self.guess, metric, response);
        if !projected.result.converged && response.fail_safe == FailSafe::UnilateralProjection {
            // Thickness gives way first.
            for (target, row) in targets.iter_mut().zip(&self.of) {
                *target -= (1.0 - SQUEEZED) * gaps[built.contact[*row] as usize] / dt;
            }
            projected = project(rows, &self.of, &targets, &projected.result.normal_impulses, metric, response);
        }
        self.projected = Some(projected);
    }
}

/// Answers the zones given, each from `tentative`, in `velocities`; `impulses` per collision are guesses before and found
/// after.
fn answer(
    sweep: &Sweep,
    metric: &Metric,
    nodes: &Nodes,
    response: &ZoneResponse,
    tentative: &[Vec3],
    zones: &[Zone],
    impulses: &mut [f64],
    velocities: &mut [Vec3],
    reports: &mut BTreeMap<usize, ZoneReport>,
) {
    let segment = &sweep.segment;
    let make_rigid = |zone: &Zone, velocities: &mut [Vec3]| {
        let moved = move_zone(segment, metric, nodes, &zone.movable, &zone.scripted, tentative, velocities);
        let mut report = report_of(zone, FailSafe::RigidZone);
        report.residual = moved.misfit;
        report.angular_momentum_change = moved.angular_momentum_change;
        report
    };
    for zone in zones {
        reset(nodes, zone, tentative, velocities);
        if zone.rigid {
            reports.insert(zone.root, make_rigid(zone, velocities));
        }
    }
    let projected: Vec<&Zone> = zones.iter().filter(|zone| !zone.rigid).collect();
    let turning = projected.iter().any(|zone| zone.movable.iter().any(|n| nodes.body(*n).is_some()));
    let contacts: Vec<Contact> = projected.iter().flat_map(|zone| zone.contacts.iter().copied()).collect();
    let gap = |contact: &Contact| match response.fail_safe {
        FailSafe::InelasticProjection => contact.start_gap,
        _ => contact.required_gap(0.0),
    };
    let gaps: Vec<f64> = contacts.iter().map(gap).collect();
    let frames = vec![None; contacts.len()];
    let mut end = State::default();
    // The fastest that a row of each asks for.
    let mut asked = vec![0.0_f64; projected.len()];
    for _ in 0..if turning { LINEARISATIONS } else { 1 } {
        if projected.is_empty() {
            break;
        }
        segment.end_state(velocities, 1.0, false, &mut end);
        let (start, dt) = (segment.start, segment.dt);
        let about = Linearisation { start, end: &end, velocities, unconstrained: tentative, dt };
        let built = build_rows(segment.model, metric, &contacts, &gaps, &frames, &about);
        let (mut first, mut tasks) = (0, Vec::with_capacity(projected.len()));
        for (zone, asked) in projected.iter().zip(&mut asked) {
            let last = first + zone.contacts.len() as u32;
            let row = |contact: u32| built.contact.partition_point(|c| *c < contact);
            let of: Vec<usize> = (row(first)..row(last)).collect();
            let collision = |row: &usize| zone.collisions[(built.contact[*row] - first) as usize];
            *asked = of.iter().fold(*asked, |most, row| most.max(built.rows.normal_targets[*row].abs()));
            let guess = of.iter().map(|row| impulses[collision(row)]).collect();
            first = last;
            tasks.push(Task { zone, of, guess, projected: None });
        }
        sweep.par.for_each_task(&mut tasks, |task| task.run(&built, &gaps, metric, response, dt));
        let mut first = 0;
        for Task { zone, of, projected, .. } in tasks {
            let Some(projected) = projected else { continue };
            reset(nodes, zone, tentative, velocities);
            projected.add_to(velocities);
            let projection = projected.result;
            for (row, impulse) in of.iter().zip(&projection.normal_impulses) {
                impulses[zone.collisions[(built.contact[*row] - first) as usize]] = *impulse;
            }
            first += zone.contacts.len() as u32;
            let mut report = report_of(zone, response.fail_safe);
            report.rank = projection.rank as u32;
            (report.residual, report.converged) = (projection.residual, projection.converged);
            reports.insert(zone.root, report);
        }
    }
    for (zone, asked) in projected.into_iter().zip(asked) {
        let Some(report) = reports.get_mut(&zone.root) else { continue };
        let change = |n: &usize| norm(sub(velocities[nodes.first_block(*n)], tentative[nodes.first_block(*n)]));
        let slips = !zone.scripted.is_empty() && zone.movable.iter().any(|n| change(n) > ESCAPE * asked);
        if slips || !report.converged {
            reset(nodes, zone, tentative, velocities);
            *report = make_rigid(zone, velocities);
        } else {
            report.angular_momentum_change = angular_momentum_change(sweep, metric, nodes, zone, tentative, velocities);
        }
    }
}

/// Puts the zone's velocities back to those before any response.
fn reset(nodes: &Nodes, zone: &Zone, tentative: &[Vec3], velocities: &mut [Vec3]) {
    for node in &zone.movable {
        let blocks = nodes.blocks(*node);
        velocities[blocks.clone()].copy_from_slice(&tentative[blocks]);
    }
}

fn report_of(zone: &Zone, fail_safe: FailSafe) -> ZoneReport {
    ZoneReport {
        nodes: zone.movable.len() as u32,
        scripted: zone.scripted.len() as u32,
        collisions: zone.contacts.len() as u32,
        fail_safe,
        rank: 0,
        residual: 0.0,
        converged: true,
        angular_momentum_change: [0.0; 3],
    }
}

fn angular_momentum_change(
    sweep: &Sweep,
    metric: &Metric,
    nodes: &Nodes,
    zone: &Zone,
    old: &[Vec3],
    new: &[Vec3],
) -> Vec3 {
    let start = sweep.segment.start;
    let position = |node: usize| match nodes.body(node) {
        Some(body) => start.poses[body].position,
        None => start.positions[node],
    };
    let centre = zone.movable.first().map_or([0.0; 3], |n| position(*n));
    let mut change = [0.0; 3];
    for node in &zone.movable {
        let first = nodes.first_block(*node);
        let gained = |block: usize| mat_vec(&metric.lumped[block], sub(new[block], old[block]));
        change = add(change, cross(sub(position(*node), centre), gained(first)));
        if nodes.body(*node).is_some() {
            change = add(change, gained(first + 1));
        }
    }
    change
}

/// A collision within a zone.
struct Collision {
    contact: Contact,
    /// One of its movable nodes.
    node: usize,
    scripted: Vec<usize>,
}

/// A contact that is close at the start.
struct Near {
    contact: Contact,
    movable: Vec<usize>,
    taken: bool,
}

impl Near {
    fn new(contact: Contact, nodes: &Nodes) -> Near {
        let movable = nodes.of_pair(&contact.pair).into_iter().filter(|n| !nodes.is_scripted(*n)).collect();
        Near { contact, movable, taken: false }
    }
}

/// Disjoint sets of movable nodes, and the collisions that made them.
struct Zones {
    parent: Vec<usize>,
    in_zone: Vec<bool>,
    /// By root.
    rigid: Vec<bool>,
    /// Nodes in zones, in the order of joining.
    joined: Vec<usize>,
    collisions: Vec<Collision>,
    /// Normal impulse of each collision as projected last `[N s]`.
    impulses: Vec<f64>,
    near: Vec<Near>,
    rows_of_pair: BTreeMap<Pair, u32>,
}

impl Zones {
    fn new(count: usize, always_rigid: bool) -> Zones {
        Zones {
            parent: (0..count).collect(),
            in_zone: vec![false; count],
            rigid: vec![always_rigid; count],
            joined: Vec::new(),
            collisions: Vec::new(),
            impulses: Vec::new(),
            near: Vec::new(),
            rows_of_pair: BTreeMap::new(),
        }
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
            if !std::mem::replace(&mut self.in_zone[*node], true) {
                self.joined.push(*node);
                changed = true;
            }
            let (a, b) = (self.root(nodes[0]), self.root(*node));
            if a != b {
                self.parent[a.max(b)] = a.min(b);
                self.rigid[a.min(b)] |= self.rigid[a.max(b)];
                changed = true;
            }
        }
        changed
    }

    /// Takes the hits in; `false` where that can change nothing: a pair of scripted parts, or rigid zones alone that have
    /// all their hits' nodes.
    fn grow(&mut self, nodes: &Nodes, hits: &[Hit], make_rigid: bool) -> bool {
        let parts: Vec<(Vec<usize>, Vec<usize>)> =
            hits.iter().map(|hit| nodes.of_pair(&hit.pair).into_iter().partition(|n| !nodes.is_scripted(*n))).collect();
        if parts.iter().any(|(movable, _)| movable.is_empty()) {
            return false;
        }
        let mut progress = false;
        for (hit, (movable, scripted)) in hits.iter().zip(parts) {
            let merged = self.join(&movable);
            let root = self.root(movable[0]);
            let rows = self.rows_of_pair.entry(hit.pair).or_insert(0);
            let contact = Contact { ordinal: *rows, ..hit.contact };
            *rows += 1;
            // A rigid zone changes with its nodes, scripted ones too, and with nothing else.
            let rigid = self.rigid[root];
            progress |= merged || !rigid || scripted.iter().any(|node| !self.touches(root, *node));
            self.rigid[root] |= make_rigid || contact.ordinal >= ROWS_OF_PAIR;
            self.push(Collision { contact, node: movable[0], scripted });
        }
        progress
    }

    fn push(&mut self, collision: Collision) {
        self.collisions.push(collision);
        self.impulses.push(0.0);
    }

    /// Takes in what is near and lies within one zone: what is pushed there would hit it next.
    fn take_near(&mut self) {
        for k in 0..self.near.len() {
            let Near { contact, ref movable, taken } = self.near[k];
            let Some(node) = movable.first().copied().filter(|_| !taken) else { continue };
            if movable.iter().any(|n| !self.in_zone[*n]) {
                continue;
            }
            let movable = movable.clone();
            let root = self.root(node);
            if movable.iter().all(|n| self.root(*n) == root) {
                self.near[k].taken = true;
                self.push(Collision { contact, node, scripted: Vec::new() });
            }
        }
    }

    /// Whether a zone has a collision with a scripted node.
    fn touches(&mut self, root: usize, scripted: usize) -> bool {
        (0..self.collisions.len())
            .any(|k| self.collisions[k].scripted.contains(&scripted) && self.root(self.collisions[k].node) == root)
    }

    /// The zones of the hits, ordered by their first node.
    fn touched(&mut self, hits: &[Hit], nodes: &Nodes) -> Vec<Zone> {
        let mut zones: BTreeMap<usize, Zone> = BTreeMap::new();
        for hit in hits {
            let Some(node) = nodes.of_pair(&hit.pair).into_iter().find(|n| !nodes.is_scripted(*n)) else { continue };
            let (root, movable) = (self.root(node), Vec::new());
            let rigid = self.rigid[root];
            let (scripted, contacts) = (Vec::new(), Vec::new());
            let zone = Zone { root, rigid, movable, scripted, contacts, collisions: Vec::new() };
            zones.entry(root).or_insert(zone);
        }
        for k in 0..self.joined.len() {
            let root = self.root(self.joined[k]);
            if let Some(zone) = zones.get_mut(&root) {
                zone.movable.push(self.joined[k]);
            }
        }
        for k in 0..self.collisions.len() {
            let root = self.root(self.collisions[k].node);
            if let Some(zone) = zones.get_mut(&root) {
                zone.contacts.push(self.collisions[k].contact);
                zone.collisions.push(k);
                zone.scripted.extend_from_slice(&self.collisions[k].scripted);
            }
        }
        let mut zones: Vec<Zone> = zones.into_values().collect();
        for zone in &mut zones {
            zone.movable.sort_unstable();
            zone.scripted.sort_unstable();
            zone.scripted.dedup();
        }
        zones
    }
}
