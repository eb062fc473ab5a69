//! Runs the nasty scenes and checks after every step what was promised.
//!
//! `SIGNORINI_STRESS=FIRST:COUNT` runs other seeds than the quick selection and prints every finding;
//! `SIGNORINI_ALL=1` runs more of them.

use super::stress_oracle as oracle;
use super::stress_scenes::scene;
use super::stress_world::Scene;
use super::support::clock::thread_seconds;
use signorini::implicit_contact::{Memory, Scratch, advance};
use signorini::math::{Vec3, add, is_finite, norm, scale, sub};
use signorini::model::{Drives, Kind, Precision, StartPolicy, State, StepError, StepReport, StepResult, Watch};
use signorini::parallel::{Par, Pool};
use signorini::step::Step;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// What the runs came to.
#[derive(Default)]
struct Tally {
    steps: usize,
    refused: usize,
    pinched: usize,
    singular: usize,
    bad_input: usize,
    divided: usize,
    zones: usize,
    held: usize,
    not_converged: usize,
    tangled: usize,
    slowest: (f64, u64, usize),
    findings: Vec<String>,
}

struct Runner<'a> {
    scene: &'a Scene,
    state: State,
    memory: Memory,
    scratch: Scratch,
    twin: (State, Memory),
    result: StepResult,
    twin_result: StepResult,
    last: Vec<Vec3>,
    /// The last step ended tangled, or pairs were let through.
    tangled: bool,
}

fn without_times(report: &StepReport) -> StepReport {
    StepReport { times: Default::default(), bytes: 0, ..report.clone() }
}

fn same_outcome(a: &Result<StepReport, StepError>, b: &Result<StepReport, StepError>) -> bool {
    match (a, b) {
        (Ok(x), Ok(y)) => format!("{:?}", without_times(x)) == format!("{:?}", without_times(y)),
        (Err(StepError::Pinched { witnesses: w, report: x }), Err(StepError::Pinched { witnesses: u, report: y })) => {
            w == u && format!("{:?}", without_times(x)) == format!("{:?}", without_times(y))
        }
        (Err(x), Err(y)) => format!("{x:?}") == format!("{y:?}"),
        _ => false,
    }
}

fn bits(state: &State) -> Vec<u64> {
    let mut all: Vec<u64> = state.positions.iter().flatten().map(|c| c.to_bits()).collect();
    all.extend(state.poses.iter().flat_map(|p| p.position.into_iter().chain(p.orientation)).map(f64::to_bits));
    all.extend(state.half_spaces.iter().flat_map(|h| h.normal.into_iter().chain([h.offset])).map(f64::to_bits));
    all
}

impl Runner<'_> {
    fn step(&mut self, number: usize, pools: &[Pool], tally: &mut Tally) -> Result<bool, String> {
        let scene = self.scene;
        let mut settings = scene.settings;
        let drives = scene.drives(number, &self.state, &self.last);
        let before = self.state.clone();
        let excused = |p: &[u32; 2]| touches_at_rest(&scene.model, p[0], p[1]);
        let mut start_hits = oracle::piercings(&scene.model, &before.positions);
        start_hits.retain(|p| !excused(p));
        let pinch_passes = scene.seed.is_multiple_of(3);
        if pinch_passes || scene.family == "tangled" {
            settings.start_policy = StartPolicy::Pass;
        }
        let began = thread_seconds();
        let mut outcome = self.advance(&drives, &settings);
        let seconds = thread_seconds() - began;
        if std::env::var("SIGNORINI_STRESS_TRACE").is_ok() {
            println!("step {number}: {seconds:.4} s {outcome:?}");
        }
        if seconds > tally.slowest.0 {
            tally.slowest = (seconds, scene.seed, number);
        }
        if let Err(StepError::IntersectingStart(witnesses)) = &outcome {
            tally.refused += 1;
            if witnesses.is_empty() {
                return Err("refused without witnesses".into());
            }
            if bits(&before) != bits(&self.state) {
                return Err("a refused step changed the state".into());
            }
            if number > 0 && !self.tangled {
                return Err(format!("step refused after a step: {} witnesses {:?}", witnesses.len(), witnesses[0]));
            }
            settings.start_policy = StartPolicy::Pass;
            outcome = self.advance(&drives, &settings);
        } else if !start_hits.is_empty() && settings.start_policy == StartPolicy::Refuse && outcome.is_ok() {
            return Err("an intersecting start was not refused".into());
        }
        // The twin: a pool and an emptied scratch.
        let (twin_state, twin_memory) = &mut self.twin;
        let step = Step {
            model: &scene.model,
            state: twin_state,
            drives: &drives,
            settings: &settings,
            dt: scene.dt,
            result: &mut self.twin_result,
            par: Par::Pool(&pools[number % pools.len()]),
            watch: Watch::default(),
        };
        let twin = advance(step, twin_memory, &mut Scratch::default());
        if bits(twin_state) != bits(&self.state) || !same_outcome(&outcome, &twin) {
            return Err("other bits on a pool with emptied scratch".into());
        }
        if self.twin_result.velocities != self.result.velocities || self.twin_result.contacts != self.result.contacts {
            return Err("another result on a pool with emptied scratch".into());
        }
        let (report, pinched) = match outcome {
            Ok(report) => (report, false),
            Err(StepError::Pinched { witnesses, report }) => {
                tally.pinched += 1;
                if witnesses.is_empty() || !(0.0..1.0).contains(&report.certified_fraction) {
                    return Err(format!("pinched at {} with {} witnesses", report.certified_fraction, witnesses.len()));
                }
                if !scene.parts.iter().enumerate().any(|(i, _)| scripted_moves(scene, i, &before, &drives)) {
                    return Err("pinched though nothing scripted moves".into());
                }
                (*report, true)
            }
            Err(error) => {
                match error {
                    StepError::SingularSystem { .. } if !scene.definite => tally.singular += 1,
                    StepError::BadInput(_) => tally.bad_input += 1,
                    other => return Err(format!("{other:?}")),
                }
                if bits(&before) != bits(&self.state) {
                    return Err("an error changed the state".into());
                }
                return Ok(false);
            }
        };
        tally.steps += 1;
        tally.divided += usize::from(report.parts > 1);
        tally.zones += usize::from(report.zones() > 0);
        tally.held += usize::from(report.held_vertices > 0);
        tally.not_converged += usize::from(report.not_converged);
        tally.tangled += usize::from(report.tangled_pairs > 0);
        self.tangled = report.tangled_pairs > 0;
        let faults = self.check(&before, &drives, &report, pinched, start_hits.is_empty());
        self.last.clone_from(&self.result.end_velocities);
        if faults.is_empty() { Ok(true) } else { Err(faults.join("; ")) }
    }

    fn advance(&mut self, drives: &Drives, settings: &signorini::model::Settings) -> Result<StepReport, StepError> {
        let step = Step {
            model: &self.scene.model,
            state: &mut self.state,
            drives,
            settings,
            dt: self.scene.dt,
            result: &mut self.result,
            par: Par::Serial,
            watch: Watch::default(),
        };
        advance(step, &mut self.memory, &mut self.scratch)
    }

    fn check(
        &self,
        before: &State,
        drives: &Drives,
        report: &StepReport,
        pinched: bool,
        clean_start: bool,
    ) -> Vec<String> {
        let mut faults = Vec::new();
        let (model, result) = (&self.scene.model, &self.result);
        let (x0, x1) = (&before.positions, &self.state.positions);
        let all = x1.iter().chain(&result.velocities).chain(&result.end_velocities).chain(&result.impulses);
        if !all.into_iter().all(|v| is_finite(*v)) {
            return vec!["not finite".into()];
        }
        if !oracle::consistent(model, &self.state) {
            faults.push("positions do not follow from poses, or are off the format's grid".into());
        }
        let reach = 2.0 * model.bodies.iter().fold(0.0, |m, b| f64::max(m, b.half_thickness));
        let clean = clean_start && report.tangled_pairs == 0;
        let pierced = oracle::piercings(model, x1);
        if clean {
            // Pairs that touch at rest are out of the promise, and so is what they let through.
            let excused = |e: u32, f: u32| touches_at_rest(model, e, f);
            if let Some(p) = pierced.iter().find(|p| !excused(p[0], p[1])) {
                faults.push(format!(
                    "INTERSECTS: edge {} face {} ({} in all), report {report:?}",
                    p[0],
                    p[1],
                    pierced.len()
                ));
            }
            if oracle::below_planes(model, &self.state) > oracle::below_planes(model, before) {
                faults.push("below a half-space".into());
            }
            if report.intersections.is_some_and(|n| n > 0) {
                faults.push(format!("own certificate finds {:?}", report.intersections));
            }
            let slack = 1e-13 * oracle::extent(x0).max(oracle::extent(x1));
            // A divided step runs along more than one chord.
            let undivided = report.parts + u32::from(pinched) <= 1;
            let (mut through, mut squeezed) = (0, 0);
            let mut example = String::new();
            for pair in oracle::swept_pairs(model, x0, x1, reach) {
                let Some(delta) = oracle::thickness(model, &pair) else { continue };
                let moved: Vec<Vec3> = pair.0.iter().map(|v| sub(x1[*v as usize], x0[*v as usize])).collect();
                if moved.iter().all(|m| *m == moved[0]) {
                    continue;
                }
                let d0 = oracle::distance(&pair, x0);
                let relative =
                    moved.iter().fold(0.0, |m: f64, a| moved.iter().fold(m, |m, b| m.max(norm(sub(*a, *b)))));
                if d0 > 2.1 * relative + slack {
                    continue;
                }
                let d1 = oracle::distance(&pair, x1);
                if undivided && d0 > 0.0 && oracle::meets(&pair, x0, x1) {
                    through += 1;
                    example = format!("{pair:?} d0 {d0:e} d1 {d1:e} delta {delta:e}");
                }
                let kept = 0.5 * delta.min(d0) * if undivided { 1.0 } else { 0.0 };
                if d1 < kept * (1.0 - 1e-6) - slack {
                    squeezed += 1;
                    example = format!("{pair:?} d0 {d0:e} d1 {d1:e} delta {delta:e}");
                }
            }
            if through > 0 {
                faults.push(format!("TUNNELLED: {through} pairs, {example}, report {report:?}"));
            }
            if squeezed > 0 {
                faults.push(format!("{squeezed} pairs below the minimum separation: {example}"));
            }
        }
        self.check_balances(before, drives, report, pinched, &mut faults);
        faults
    }

    fn check_balances(
        &self,
        before: &State,
        drives: &Drives,
        report: &StepReport,
        pinched: bool,
        faults: &mut Vec<String>,
    ) {
        let (scene, model, result) = (self.scene, &self.scene.model, &self.result);
        let (x0, x1) = (&before.positions, &self.state.positions);
        let mut rounding = 0.0;
        let mut total_mass = 0.0;
        for (index, body) in model.bodies.iter().enumerate() {
            let single = body.description.precision == Precision::Single;
            let grid = if single { 1.2e-7 } else { 4e-16 };
            let size = oracle::extent(&x1[body.vertices.clone()]).max(norm(self.state.poses[index].position));
            match &body.description.kind {
                Kind::Deformable { masses, .. } => {
                    for ((v, b), m) in body.vertices.clone().zip(body.blocks.clone()).zip(masses) {
                        let expected = scale(1.0 / scene.dt, sub(x1[v], x0[v]));
                        if norm(sub(expected, result.velocities[b])) > 1e-12 * norm(expected) {
                            faults.push("velocity is not (x1 - x0)/dt".into());
                            return;
                        }
                        rounding += m * grid * size / scene.dt;
                        total_mass += m;
                    }
                }
                Kind::Rigid { mass, .. } => {
                    rounding += mass * grid * size / scene.dt;
                    total_mass += mass;
                }
                _ => {}
            }
        }
        let fastest = drives.velocities.iter().chain(&result.velocities).fold(0.0, |m: f64, v| m.max(norm(*v)));
        rounding *= 4.0 * f64::from(report.parts.max(1));
        rounding += 1e-12 * total_mass * fastest;
        let (gained, size, given) = oracle::momentum(model, &result.velocities, &drives.velocities, &result.impulses);
        let lumped = drives.systems.is_empty();
        if lumped && !pinched && norm(sub(gained, given)) > 1e-9 * size + rounding {
            faults.push(format!(
                "impulses are not momentum gained: {gained:?} {given:?} size {size:e} parts {} zones {} held {}",
                report.parts,
                report.zones(),
                report.held_vertices
            ));
        }
        let balance = norm(add(given, report.momentum_taken));
        let impulse_size: f64 = result.impulses.iter().map(|f| norm(*f)).sum();
        if lumped && balance > 1e-9 * impulse_size + rounding {
            faults.push(format!(
                "momentum lost: given {given:?} taken {:?} parts {} zones {} held {} pinched {pinched}",
                report.momentum_taken,
                report.parts,
                report.zones(),
                report.held_vertices
            ));
        }
        let still = !scene.parts.iter().enumerate().any(|(i, _)| scripted_moves(scene, i, before, drives))
            && !model.bodies.iter().any(|b| match &b.description.kind {
                Kind::Deformable { pinned, .. } => pinned.iter().any(|p| *p),
                _ => false,
            });
        if still && report.recovery_work == 0.0 && report.parts == 1 && scene.definite && !report.not_converged {
            let free = scene.metric_energy(drives, before, &drives.velocities);
            let after = scene.metric_energy(drives, before, &result.velocities);
            // Where nothing moves the solver's scale of velocities is 1.
            let per_step = if fastest < 1e-3 { 1.0 } else { 0.0 };
            let turning = scene.parts.iter().any(|p| norm(p.spin) > 0.0);
            if after
                > free * (1.0 + if turning { 0.05 } else { 0.02 }) + rounding * fastest + 1e-6 * total_mass * per_step
            {
                faults.push(format!(
                    "ENERGY: {free:e} -> {after:e} zones {} held {}",
                    report.zones(),
                    report.held_vertices
                ));
            }
        }
    }
}

fn touches_at_rest(model: &signorini::model::Model, edge: u32, face: u32) -> bool {
    let (e, f) = (model.edges[edge as usize], model.faces[face as usize]);
    if model.vertex_body[e[0] as usize] != model.vertex_body[f[0] as usize] {
        return false;
    }
    let pairs = [
        ([e[0], f[0], f[1], f[2]], true),
        ([e[1], f[0], f[1], f[2]], true),
        ([e[0], e[1], f[0], f[1]], false),
        ([e[0], e[1], f[1], f[2]], false),
        ([e[0], e[1], f[2], f[0]], false),
    ];
    pairs.iter().any(|p| oracle::distance(p, &model.rest) == 0.0)
}

fn scripted_moves(scene: &Scene, body: usize, before: &State, drives: &Drives) -> bool {
    let b = &scene.model.bodies[body];
    match &b.description.kind {
        Kind::Kinematic { posed: true } => drives.target_poses[body] != before.poses[body],
        Kind::Kinematic { posed: false } => {
            b.vertices.clone().any(|v| drives.target_positions[v] != before.positions[v])
        }
        Kind::HalfSpace(_) => drives.target_half_spaces[body] != before.half_spaces[body],
        Kind::Deformable { pinned, .. } => {
            b.blocks.clone().zip(pinned).any(|(block, p)| *p && drives.velocities[block] != [0.0; 3])
        }
        Kind::Rigid { mass, .. } => mass.is_infinite(),
    }
}

fn run(seed: u64, pools: &[Pool], tally: &mut Tally) {
    let scene = scene(seed);
    if std::env::var("SIGNORINI_STRESS_TRACE").is_ok() {
        let thickness: Vec<f64> = scene.model.bodies.iter().map(|b| b.half_thickness).collect();
        println!(
            "{} dt {:e} length {:e} stiffness {:e} {:?}",
            scene.family, scene.dt, scene.length, scene.stiffness, scene.settings
        );
        println!("half thickness {thickness:?}");
    }
    let mut runner = Runner {
        scene: &scene,
        state: scene.state.clone(),
        memory: Memory::default(),
        scratch: Scratch::default(),
        twin: (scene.state.clone(), Memory::default()),
        result: StepResult::default(),
        twin_result: StepResult::default(),
        last: vec![[0.0; 3]; scene.model.block_count],
        tangled: false,
    };
    for number in 0..scene.steps {
        let outcome = catch_unwind(AssertUnwindSafe(|| runner.step(number, pools, tally)));
        let fault = match outcome {
            Ok(Ok(true)) => continue,
            Ok(Ok(false)) => break,
            Ok(Err(fault)) => fault,
            Err(panic) => {
                let text = panic.downcast_ref::<String>().cloned();
                format!("PANIC {}", text.or(panic.downcast_ref::<&str>().map(|s| s.to_string())).unwrap_or_default())
            }
        };
        tally.findings.push(format!("seed {seed} ({}) step {number}: {fault}", scene.family));
        break;
    }
}

fn pools() -> Vec<Pool> {
    vec![Pool::new(2).unwrap(), Pool::new(3).unwrap()]
}

fn report(tally: &Tally, runs: u64) {
    println!(
        "{runs} runs, {} steps: refused {} pinched {} singular {} bad input {} divided {} zones {} held {} not converged {} tangled {}; slowest {:?}",
        tally.steps,
        tally.refused,
        tally.pinched,
        tally.singular,
        tally.bad_input,
        tally.divided,
        tally.zones,
        tally.held,
        tally.not_converged,
        tally.tangled,
        tally.slowest
    );
}

/// Seeds beyond the first that broke a promise once: 604, pairs closer than the rounding of their distance.
const ONCE_BROKEN: [u64; 1] = [604];

#[test]
fn nasty_scenes_keep_the_promise() {
    let range = std::env::var("SIGNORINI_STRESS").ok();
    let all = std::env::var("SIGNORINI_ALL").is_ok_and(|v| v == "1");
    let (first, count) = match &range {
        Some(text) => {
            let mut words = text.split(':').map(|w| w.parse::<u64>().unwrap());
            (words.next().unwrap(), words.next().unwrap_or(1))
        }
        None => (0, if all { 320 } else { 40 }),
    };
    let pools = pools();
    let mut tally = Tally::default();
    let once_broken = ONCE_BROKEN.into_iter().filter(|_| range.is_none());
    for seed in (first..first + count).chain(once_broken) {
        let known = tally.findings.len();
        let began = std::time::Instant::now();
        run(seed, &pools, &mut tally);
        if range.is_some() {
            tally.findings[known..].iter().for_each(|f| println!("{f}"));
            if began.elapsed().as_secs_f64() > 5.0 {
                println!("seed {seed} took {:.1} s", began.elapsed().as_secs_f64());
            }
        }
    }
    report(&tally, count);
    assert!(tally.findings.is_empty(), "{} findings, first: {:#?}", tally.findings.len(), tally.findings.first());
}
