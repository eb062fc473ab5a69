//! Push and pull of bodies, by slot.

use super::boundary::{change, look};
use super::status::{
    Failure, SGN_ERROR_BUFFER_LAYOUT, SGN_ERROR_INVALID_ARGUMENT, SGN_ERROR_UNSUPPORTED, SGN_OK, SgnResult,
};
use super::views::{self, Column, SgnView, SgnViewMut};
use super::world::{SgnBodyId, SgnWorld};
use crate::kinematics::Pose;
use crate::model::{HalfSpace, Precision};
use crate::world::{Outcome, World};

/// What of a body is pushed or pulled. `n` is its number of vertices, `m` that of its nodes (`velocities` of
/// `sgn_body_info`): the same, but for a solid that carries a surface. Vectors are F32X3 or F64X3.
pub type SgnSlot = i32;
/// Positions, n vectors. Push: start positions of a deformable body or a kinematic mesh. Pull: where the vertices of any
/// mesh stand; certified after a step, and only in the body's own precision.
pub const SGN_SLOT_POSITION: i32 = 1;
/// Pose of a rigid or posed kinematic body, one F32X7 or F64X7. Pull: in the body's own precision, or F64.
pub const SGN_SLOT_POSE: i32 = 2;
/// Plane of a half-space, one F32X4 or F64X4: unit normal, offset.
pub const SGN_SLOT_HALF_SPACE: i32 = 3;
/// Push: displacement velocity `v* = (x* - x0)/dt`, m vectors of a deformable body, one of a rigid body. It stays until the
/// next push. Of a body that the library drives: the velocity at the start of the next step. Pull: `(x1 - x0)/dt` of the
/// last step.
pub const SGN_SLOT_VELOCITY: i32 = 4;
/// Angular velocity of a rigid body, one vector, world axes, radians per time; push and pull as VELOCITY.
pub const SGN_SLOT_ANGULAR_VELOCITY: i32 = 5;
/// Pull only: velocity at the end of the last step, for the host's next dynamics; differs from VELOCITY when the step was
/// divided.
pub const SGN_SLOT_END_VELOCITY: i32 = 6;
/// Pull only: the same, angular.
pub const SGN_SLOT_END_ANGULAR_VELOCITY: i32 = 7;
/// Pull only: contact impulse over the last step, m vectors or one.
pub const SGN_SLOT_IMPULSE: i32 = 8;
/// Pull only: angular contact impulse of a rigid body about its centre of mass, world axes, one vector.
pub const SGN_SLOT_ANGULAR_IMPULSE: i32 = 9;
/// Push only: where a kinematic mesh ends the next step, n vectors; where the pinned nodes of a body that the library
/// drives do, m vectors, of which only theirs are read. Without a push they stay.
pub const SGN_SLOT_TARGET_POSITION: i32 = 10;
/// Push only: where a posed kinematic body ends the next step, one F32X7 or F64X7. Without a push it stays.
pub const SGN_SLOT_TARGET_POSE: i32 = 11;
/// Push only: where a half-space ends the next step, one F32X4 or F64X4. Without a push it stays.
pub const SGN_SLOT_TARGET_HALF_SPACE: i32 = 12;
/// Push only: lumped masses, m of a deformable body, one of a rigid body, F32 or F64.
pub const SGN_SLOT_MASS: i32 = 13;
/// Push only: pin flags of a deformable body, m U8.
pub const SGN_SLOT_PINNED: i32 = 14;
/// Pull only: rest positions, or positions in the body frame, n vectors.
pub const SGN_SLOT_REST_POSITION: i32 = 15;
/// Pull only: triangles of the surface, U32X3 or U64X3; shapes are tessellated.
pub const SGN_SLOT_TRIANGLES: i32 = 16;
/// Pull only: edges of the surface, U32X2 or U64X2.
pub const SGN_SLOT_EDGES: i32 = 17;

/// Positions of the nodes of a deformable body, m vectors. Push and pull as POSITION, which a solid that carries a surface
/// has for pulling only.
pub const SGN_SLOT_NODE_POSITION: i32 = 18;
/// Push only: where the attachments of a body that the library drives pull at the end of the next step, a vector each. Until
/// the next push they stay.
pub const SGN_SLOT_ATTACHMENT_TARGET: i32 = 19;

/// Flag of a push of POSITION, NODE_POSITION, POSE or HALF_SPACE: the body jumps there. Without it the way from the state that the last
/// step left is checked by the next step, so that nothing passes through anything between steps.
pub const SGN_PUSH_TELEPORT: u64 = 1;

fn pose([px, py, pz, x, y, z, w]: [f64; 7]) -> Pose {
    Pose { position: [px, py, pz], orientation: [x, y, z, w] }
}

fn plane([x, y, z, offset]: [f64; 4]) -> HalfSpace {
    HalfSpace { normal: [x, y, z], offset }
}

unsafe fn push(world: &mut World, id: u64, slot: SgnSlot, view: &SgnView, teleport: bool) -> Result<(), Failure> {
    // The id first: its error says more than a count that does not fit.
    world.body_info(id)?;
    // SAFETY: the caller vouches for the view.
    unsafe {
        match slot {
            SGN_SLOT_POSITION => world.push_positions(id, views::floats::<3>(view, "position")?, teleport)?,
            SGN_SLOT_NODE_POSITION => {
                world.push_node_positions(id, views::floats::<3>(view, "node position")?, teleport)?;
            }
            SGN_SLOT_ATTACHMENT_TARGET => {
                world.push_attachment_targets(id, views::floats::<3>(view, "attachment target")?)?;
            }
            SGN_SLOT_POSE => world.push_pose(id, pose(views::one::<7>(view, "pose")?), teleport)?,
            SGN_SLOT_HALF_SPACE => {
                world.push_half_space(id, plane(views::one::<4>(view, "half-space")?), teleport)?;
            }
            SGN_SLOT_VELOCITY => world.push_velocities(id, views::floats::<3>(view, "velocity")?)?,
            SGN_SLOT_ANGULAR_VELOCITY => {
                world.push_angular_velocity(id, views::one::<3>(view, "angular velocity")?)?;
            }
            SGN_SLOT_TARGET_POSITION => {
                world.push_target_positions(id, views::floats::<3>(view, "target position")?)?;
            }
            SGN_SLOT_TARGET_POSE => world.push_target_pose(id, pose(views::one::<7>(view, "target pose")?))?,
            SGN_SLOT_TARGET_HALF_SPACE => {
                world.push_target_half_space(id, plane(views::one::<4>(view, "target half-space")?))?;
            }
            SGN_SLOT_MASS => world.push_masses(id, views::scalars(view, "mass")?)?,
            SGN_SLOT_PINNED => world.push_pinned(id, views::flags(view, "pinned")?)?,
            SGN_SLOT_END_VELOCITY..=SGN_SLOT_ANGULAR_IMPULSE | SGN_SLOT_REST_POSITION..=SGN_SLOT_EDGES => {
                return Err(Failure::new(SGN_ERROR_UNSUPPORTED, format!("slot {slot} can only be pulled")));
            }
            _ => return Err(unknown(slot)),
        }
    }
    Ok(())
}

fn unknown(slot: SgnSlot) -> Failure {
    Failure::new(SGN_ERROR_INVALID_ARGUMENT, format!("slot {slot} is out of range")).value(f64::from(slot))
}

/// Pushes a slot of a body from the host's memory.
///
/// Ownership: copied. Thread: exclusive. Errors (the body is then as it was): NULL_ARGUMENT, INVALID_ID, STALE_ID,
/// INVALID_ARGUMENT, UNSUPPORTED, BUFFER_LAYOUT, NON_FINITE_INPUT, OUT_OF_MEMORY, BUSY, POISONED, PANIC.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_body_push(
    world: *mut SgnWorld,
    body: SgnBodyId,
    slot: SgnSlot,
    view: *const SgnView,
    flags: u64,
) -> SgnResult {
    // SAFETY: the caller vouches for the pointers and the view.
    unsafe {
        change(world, "sgn_body_push", |world, _| {
            let view = views::given(view, "view")?;
            let jumps =
                matches!(slot, SGN_SLOT_POSITION | SGN_SLOT_NODE_POSITION | SGN_SLOT_POSE | SGN_SLOT_HALF_SPACE);
            if flags & !(if jumps { SGN_PUSH_TELEPORT } else { 0 }) != 0 {
                let message = format!("flags {flags:#x} are out of range for slot {slot}");
                return Err(Failure::new(SGN_ERROR_INVALID_ARGUMENT, message).object(body.value));
            }
            push(world, body.value, slot, &view, flags & SGN_PUSH_TELEPORT != 0)
                .map_err(|failure| if failure.object == 0 { failure.object(body.value) } else { failure })?;
            Ok(SGN_OK)
        })
    }
}

/// Numbers of a slot, one after the other: floats per element and the floats, or integers.
enum Pulled {
    Floats(usize, Vec<f64>),
    Integers(usize, Vec<u64>),
}

fn vectors(list: &[crate::math::Vec3]) -> Pulled {
    Pulled::Floats(3, views::flat(list).to_vec())
}

fn pull(world: &World, id: u64, slot: SgnSlot, single: bool) -> Result<Pulled, Failure> {
    let certified_only = |what: &str| {
        let info = world.precision(id)?;
        if single && info == Precision::Double {
            let message = format!("the {what} of this body is certified in F64: pull it so, or create the body as F32");
            return Err(Failure::new(SGN_ERROR_BUFFER_LAYOUT, message));
        }
        Ok(())
    };
    Ok(match slot {
        SGN_SLOT_POSITION => {
            certified_only("position")?;
            vectors(world.positions(id)?)
        }
        SGN_SLOT_NODE_POSITION => {
            certified_only("position")?;
            vectors(world.node_positions(id)?)
        }
        SGN_SLOT_POSE => {
            certified_only("pose")?;
            let Pose { position: [px, py, pz], orientation: [x, y, z, w] } = world.pose(id)?;
            Pulled::Floats(7, vec![px, py, pz, x, y, z, w])
        }
        SGN_SLOT_HALF_SPACE => {
            certified_only("plane")?;
            let HalfSpace { normal: [x, y, z], offset } = world.half_space(id)?;
            Pulled::Floats(4, vec![x, y, z, offset])
        }
        SGN_SLOT_VELOCITY => vectors(&world.outcome(id, Outcome::Velocity)?),
        SGN_SLOT_END_VELOCITY => vectors(&world.outcome(id, Outcome::EndVelocity)?),
        SGN_SLOT_IMPULSE => vectors(&world.outcome(id, Outcome::Impulse)?),
        SGN_SLOT_ANGULAR_VELOCITY => vectors(&[world.angular_outcome(id, Outcome::Velocity)?]),
        SGN_SLOT_END_ANGULAR_VELOCITY => vectors(&[world.angular_outcome(id, Outcome::EndVelocity)?]),
        SGN_SLOT_ANGULAR_IMPULSE => vectors(&[world.angular_outcome(id, Outcome::Impulse)?]),
        SGN_SLOT_REST_POSITION => vectors(&world.surface(id)?.rest[..world.body_info(id)?.vertices]),
        SGN_SLOT_TRIANGLES => {
            let surface = world.surface(id)?;
            Pulled::Integers(3, surface.faces.iter().flatten().map(|vertex| u64::from(*vertex)).collect())
        }
        SGN_SLOT_EDGES => {
            let surface = world.surface(id)?;
            Pulled::Integers(2, surface.edges.iter().flatten().map(|vertex| u64::from(*vertex)).collect())
        }
        SGN_SLOT_TARGET_POSITION..=SGN_SLOT_PINNED | SGN_SLOT_ATTACHMENT_TARGET => {
            return Err(Failure::new(SGN_ERROR_UNSUPPORTED, format!("slot {slot} can only be pushed")));
        }
        _ => return Err(unknown(slot)),
    })
}

/// Pulls a slot of a body into the host's memory. The view has exactly as many elements as the slot, see `sgn_body_info`.
///
/// Thread: concurrent; the view's memory is exclusive. Errors (nothing is then written): NULL_ARGUMENT, INVALID_ID,
/// STALE_ID, INVALID_ARGUMENT, UNSUPPORTED, BUFFER_LAYOUT, BUSY, POISONED, PANIC.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_body_pull(
    world: *const SgnWorld,
    body: SgnBodyId,
    slot: SgnSlot,
    view: *const SgnViewMut,
) -> SgnResult {
    // SAFETY: the caller vouches for the pointers and the view.
    unsafe {
        look(world, "sgn_body_pull", |world| {
            let view = views::given_mut(view, "view")?;
            let named = |failure: Failure| if failure.object == 0 { failure.object(body.value) } else { failure };
            let single = views::is_single(view.format);
            let pulled = pull(world, body.value, slot, single).map_err(named)?;
            let column = match &pulled {
                Pulled::Floats(lanes, data) => Column::Floats(*lanes, data),
                Pulled::Integers(lanes, data) => Column::Integers(*lanes, data),
            };
            views::write_all(&view, "view", &column).map_err(named)?;
            Ok(SGN_OK)
        })
    }
}
