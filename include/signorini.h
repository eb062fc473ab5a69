/* Signorini: contact for cloth, shells, soft bodies and rigid bodies, as a plug-in.
 *
 * A host keeps its own world. It pushes start states and unconstrained velocities, asks for a step, and pulls velocities
 * and end states that drive nothing through anything else. See docs/capi.md.
 *
 * Rules for every function:
 * - It returns an SgnResult: 0 success, positive a success with a note, negative an error. Outputs come last and are
 *   written only on success, all or nothing. sgn_context_last_error tells what was wrong with which element.
 * - Structs begin with struct_size: fill them with their init function before use. Ids and views are the exception.
 * - Pointers to memory of the host are read or written during the call only. Optional pointers are said to be so.
 * - Threads: "any" is always safe; "concurrent" may run together with other concurrent calls on the same object;
 *   "exclusive" needs the object alone. Different worlds are independent. A call into a world at work is BUSY.
 * - Units are the host's own, if they are consistent; see docs/units.md. Indices count from 0. Quaternions are x y z w.
 * - The library prints nothing, reads no files or environment, installs no handlers, and ends no process. It sets the
 *   floating-point environment on entry and gives the host's back on return.
 *
 * Generated from src/capi by tests/capi. Do not edit.
 */


#ifndef SIGNORINI_H
#define SIGNORINI_H

#include <stddef.h>
#include <stdint.h>

#if defined(_WIN32) && !defined(SGN_STATIC)
#define SGN_API __declspec(dllimport)
#else
#define SGN_API extern
#endif

/**
 * Done.
 */
#define SGN_OK 0

/**
 * Note: a solve stopped at its work cap; the end state is valid, residuals are in the report.
 */
#define SGN_NOTE_NOT_CONVERGED 1

/**
 * Note: the step was divided.
 */
#define SGN_NOTE_SUBDIVIDED 2

/**
 * Note: zones were projected or moved as rigid bodies, or vertices held.
 */
#define SGN_NOTE_FAIL_SAFE_USED 3

/**
 * Note: pairs of a tangled component passed through each other.
 */
#define SGN_NOTE_TANGLED_PAIRS 4

/**
 * Note: the buffer was too small; as much as fits was written.
 */
#define SGN_NOTE_TRUNCATED 5

/**
 * A pointer that must not be NULL is NULL.
 */
#define SGN_ERROR_NULL_ARGUMENT (-1)

/**
 * A value out of its range.
 */
#define SGN_ERROR_INVALID_ARGUMENT (-2)

/**
 * A null, foreign or garbage id.
 */
#define SGN_ERROR_INVALID_ID (-3)

/**
 * An id of something that has been removed.
 */
#define SGN_ERROR_STALE_ID (-4)

/**
 * A struct whose `struct_size` is none that a version of it ever had: call its init function.
 */
#define SGN_ERROR_BAD_STRUCT (-5)

/**
 * A struct of a newer version with something set that this library does not know.
 */
#define SGN_ERROR_UNSUPPORTED_STRUCT (-6)

/**
 * Not offered: by this version, or for this kind of body.
 */
#define SGN_ERROR_UNSUPPORTED (-7)

/**
 * A view whose format, count, stride or extent does not fit.
 */
#define SGN_ERROR_BUFFER_LAYOUT (-8)

/**
 * NaN or infinity.
 */
#define SGN_ERROR_NON_FINITE_INPUT (-9)

/**
 * Triangles, edges or points that do not fit.
 */
#define SGN_ERROR_BAD_TOPOLOGY (-10)

/**
 * The start state intersects, or was swept through something since the last step; witnesses can be pulled.
 */
#define SGN_ERROR_INTERSECTING_START (-11)

/**
 * Scripted geometry leaves no room. The one error that carries a state: everything stands at the certified fraction
 * of the step, valid for the next call; report and witnesses are written.
 */
#define SGN_ERROR_PINCHED (-12)

/**
 * A system matrix that is not symmetric positive definite.
 */
#define SGN_ERROR_SINGULAR_SYSTEM (-13)

/**
 * A size that the host drives does not fit into memory.
 */
#define SGN_ERROR_OUT_OF_MEMORY (-14)

/**
 * The byte budget does not allow it. Reserved: this version has no budget.
 */
#define SGN_ERROR_BUDGET_EXCEEDED (-15)

/**
 * The step was cancelled by the host; the world is as it was before it.
 */
#define SGN_ERROR_CANCELLED (-16)

/**
 * The world is in use: by a step on another thread, or by the call that this callback comes from.
 */
#define SGN_ERROR_BUSY (-17)

/**
 * The world is poisoned by an earlier `SGN_ERROR_PANIC`: it can be destroyed, or made sound by loading a snapshot.
 */
#define SGN_ERROR_POISONED (-18)

/**
 * Bytes that are no snapshot of this library's format, are damaged, or hold what no world can.
 */
#define SGN_ERROR_SNAPSHOT_MISMATCH (-19)

/**
 * The header and the library do not belong together.
 */
#define SGN_ERROR_ABI_MISMATCH (-20)

/**
 * A defect of the library; the world, if any, is poisoned. Please report it.
 */
#define SGN_ERROR_PANIC (-21)

/**
 * Version of the binary interface; passed into `sgn_context_create`. Changes only when it breaks.
 */
#define SGN_ABI_VERSION 1

/**
 * Bit `1 << n` for every `SGN_EXECUTOR_` constant `n` on offer.
 */
#define SGN_CAPABILITY_EXECUTORS 1

/**
 * Bit `1 << n` for every `SGN_METHOD_` constant `n` on offer.
 */
#define SGN_CAPABILITY_METHODS 2

/**
 * 1: the same inputs give the same bits on any executor.
 */
#define SGN_CAPABILITY_DETERMINISTIC 3

/**
 * Version of the snapshot format that is written and read.
 */
#define SGN_CAPABILITY_SNAPSHOT_FORMAT 4

/**
 * Most workers of a pool.
 */
#define SGN_CAPABILITY_WORKERS_MAX 5

/**
 * No format; only of an empty view.
 */
#define SGN_FORMAT_NONE 0

/**
 * `uint8_t`, a flag: 0 or not.
 */
#define SGN_FORMAT_U8 1

/**
 * `uint32_t`
 */
#define SGN_FORMAT_U32 2

/**
 * `uint64_t`
 */
#define SGN_FORMAT_U64 3

/**
 * `uint32_t[2]`
 */
#define SGN_FORMAT_U32X2 10

/**
 * `uint32_t[3]`
 */
#define SGN_FORMAT_U32X3 11

/**
 * `uint64_t[2]`
 */
#define SGN_FORMAT_U64X2 12

/**
 * `uint64_t[3]`
 */
#define SGN_FORMAT_U64X3 13

/**
 * `uint32_t[4]`
 */
#define SGN_FORMAT_U32X4 14

/**
 * `uint64_t[4]`
 */
#define SGN_FORMAT_U64X4 15

/**
 * `float`
 */
#define SGN_FORMAT_F32 20

/**
 * `double`
 */
#define SGN_FORMAT_F64 21

/**
 * `float[3]`
 */
#define SGN_FORMAT_F32X3 22

/**
 * `double[3]`
 */
#define SGN_FORMAT_F64X3 23

/**
 * `float[4]`: normal and offset of a plane, or four weights
 */
#define SGN_FORMAT_F32X4 24

/**
 * `double[4]`: normal and offset of a plane, or four weights
 */
#define SGN_FORMAT_F64X4 25

/**
 * `float[7]`, a pose: position x y z, unit quaternion x y z w
 */
#define SGN_FORMAT_F32X7 26

/**
 * `double[7]`, a pose: position x y z, unit quaternion x y z w
 */
#define SGN_FORMAT_F64X7 27

/**
 * `float[9]`, a 3x3 block, row after row
 */
#define SGN_FORMAT_F32_3X3_ROWS 30

/**
 * `float[9]`, a 3x3 block, column after column
 */
#define SGN_FORMAT_F32_3X3_COLUMNS 31

/**
 * `double[9]`, a 3x3 block, row after row
 */
#define SGN_FORMAT_F64_3X3_ROWS 32

/**
 * `double[9]`, a 3x3 block, column after column
 */
#define SGN_FORMAT_F64_3X3_COLUMNS 33

/**
 * On the calling thread; spawns nothing. The default.
 */
#define SGN_EXECUTOR_SERIAL 0

/**
 * On a private pool of `workers` threads, joined when the context and its worlds are gone.
 */
#define SGN_EXECUTOR_POOL 1

/**
 * On the host's own threads. Reserved: `SGN_ERROR_UNSUPPORTED` in this version.
 */
#define SGN_EXECUTOR_HOST 2

/**
 * Nothing.
 */
#define SGN_LOG_OFF 0

/**
 * Calls that failed.
 */
#define SGN_LOG_ERROR 1

/**
 * Steps that ended with a note.
 */
#define SGN_LOG_WARNING 2

/**
 * One line per step.
 */
#define SGN_LOG_INFO 3

/**
 * `sqrt(a b)`. The default.
 */
#define SGN_COMBINE_GEOMETRIC_MEAN 0

/**
 * `(a + b)/2`
 */
#define SGN_COMBINE_MEAN 1

/**
 * `min(a, b)`
 */
#define SGN_COMBINE_MINIMUM 2

/**
 * `max(a, b)`
 */
#define SGN_COMBINE_MAXIMUM 3

/**
 * `a b`
 */
#define SGN_COMBINE_PRODUCT 4

/**
 * A ball of `radius`.
 */
#define SGN_SHAPE_SPHERE 1

/**
 * A box of `half_extents`.
 */
#define SGN_SHAPE_BOX 2

/**
 * Points within `radius` of the segment from `-half_height` to `half_height` on the y axis.
 */
#define SGN_SHAPE_CAPSULE 3

/**
 * A cylinder of `radius` and `half_height` about the y axis.
 */
#define SGN_SHAPE_CYLINDER 4

/**
 * The convex hull of `points` (three floats each, in the body frame).
 */
#define SGN_SHAPE_CONVEX_HULL 5

/**
 * A height field over the x-z plane: `points` holds `rows` times `columns` heights (one float each, row after row), rows
 * along z, columns along x, spread over `2 half_extents[0]` by `2 half_extents[2]`. Open, facing up (y).
 */
#define SGN_SHAPE_HEIGHT_FIELD 6

/**
 * `double`. The default.
 */
#define SGN_PRECISION_F64 0

/**
 * `float`
 */
#define SGN_PRECISION_F32 1

/**
 * Flag of a deformable body: it does not collide with itself.
 */
#define SGN_BODY_NO_SELF_COLLISION 1

/**
 * Flag of a rigid body: the inertia is given in world axes at the start pose, not in the body frame.
 */
#define SGN_BODY_INERTIA_IN_WORLD 2

/**
 * Flag of a kinematic mesh: it moves from pose to pose, its vertices are in the body frame. Always so with a shape.
 */
#define SGN_BODY_POSED 4

/**
 * Flag of a rigid body: the library drives it, under gravity and its gyroscopic torque.
 */
#define SGN_BODY_MODEL_DRIVEN 32

/**
 * Nodes: free vertices, a sheet, or a solid of tetrahedra.
 */
#define SGN_BODY_KIND_DEFORMABLE 1

/**
 * Rigid.
 */
#define SGN_BODY_KIND_RIGID 2

/**
 * Prescribed vertex positions.
 */
#define SGN_BODY_KIND_KINEMATIC_MESH 3

/**
 * Prescribed poses.
 */
#define SGN_BODY_KIND_KINEMATIC_POSED 4

/**
 * A half-space.
 */
#define SGN_BODY_KIND_HALF_SPACE 5

/**
 * Flag of a sheet: flat at rest, whatever the rest shape.
 */
#define SGN_BODY_FLAT 8

/**
 * Flag of a solid: the host drives its nodes. Of the material only the density is used.
 */
#define SGN_BODY_HOST_DRIVEN 16

/**
 * Constant-strain triangles, and bending at the edges. The default.
 */
#define SGN_SHEET_SHELL 0

/**
 * Springs along the edges and, with `bend_ratio`, across them.
 */
#define SGN_SHEET_MASS_SPRING 1

/**
 * Positions, n vectors. Push: start positions of a deformable body or a kinematic mesh. Pull: where the vertices of any
 * mesh stand; certified after a step, and only in the body's own precision.
 */
#define SGN_SLOT_POSITION 1

/**
 * Pose of a rigid or posed kinematic body, one F32X7 or F64X7. Pull: in the body's own precision, or F64.
 */
#define SGN_SLOT_POSE 2

/**
 * Plane of a half-space, one F32X4 or F64X4: unit normal, offset.
 */
#define SGN_SLOT_HALF_SPACE 3

/**
 * Push: displacement velocity `v* = (x* - x0)/dt`, m vectors of a deformable body, one of a rigid body. It stays until the
 * next push. Of a body that the library drives: the velocity at the start of the next step. Pull: `(x1 - x0)/dt` of the
 * last step.
 */
#define SGN_SLOT_VELOCITY 4

/**
 * Angular velocity of a rigid body, one vector, world axes, radians per time; push and pull as VELOCITY.
 */
#define SGN_SLOT_ANGULAR_VELOCITY 5

/**
 * Pull only: velocity at the end of the last step, for the host's next dynamics; differs from VELOCITY when the step was
 * divided.
 */
#define SGN_SLOT_END_VELOCITY 6

/**
 * Pull only: the same, angular.
 */
#define SGN_SLOT_END_ANGULAR_VELOCITY 7

/**
 * Pull only: contact impulse over the last step, m vectors or one.
 */
#define SGN_SLOT_IMPULSE 8

/**
 * Pull only: angular contact impulse of a rigid body about its centre of mass, world axes, one vector.
 */
#define SGN_SLOT_ANGULAR_IMPULSE 9

/**
 * Push only: where a kinematic mesh ends the next step, n vectors; where the pinned nodes of a body that the library
 * drives do, m vectors, of which only theirs are read. Without a push they stay.
 */
#define SGN_SLOT_TARGET_POSITION 10

/**
 * Push only: where a posed kinematic body ends the next step, one F32X7 or F64X7. Without a push it stays.
 */
#define SGN_SLOT_TARGET_POSE 11

/**
 * Push only: where a half-space ends the next step, one F32X4 or F64X4. Without a push it stays.
 */
#define SGN_SLOT_TARGET_HALF_SPACE 12

/**
 * Push only: lumped masses, m of a deformable body, one of a rigid body, F32 or F64.
 */
#define SGN_SLOT_MASS 13

/**
 * Push only: pin flags of a deformable body, m U8.
 */
#define SGN_SLOT_PINNED 14

/**
 * Pull only: rest positions, or positions in the body frame, n vectors.
 */
#define SGN_SLOT_REST_POSITION 15

/**
 * Pull only: triangles of the surface, U32X3 or U64X3; shapes are tessellated.
 */
#define SGN_SLOT_TRIANGLES 16

/**
 * Pull only: edges of the surface, U32X2 or U64X2.
 */
#define SGN_SLOT_EDGES 17

/**
 * Positions of the nodes of a deformable body, m vectors. Push and pull as POSITION, which a solid that carries a surface
 * has for pulling only.
 */
#define SGN_SLOT_NODE_POSITION 18

/**
 * Push only: where the attachments of a body that the library drives pull at the end of the next step, a vector each. Until
 * the next push they stay.
 */
#define SGN_SLOT_ATTACHMENT_TARGET 19

/**
 * Flag of a push of POSITION, NODE_POSITION, POSE or HALF_SPACE: the body jumps there. Without it the way from the state that the last
 * step left is checked by the next step, so that nothing passes through anything between steps.
 */
#define SGN_PUSH_TELEPORT 1

/**
 * Flag of a system: only blocks on and above the diagonal are given.
 */
#define SGN_SYSTEM_UPPER 1

/**
 * Implicit contact: constraint manifold refinement around iterative constraint anticipation. The default.
 */
#define SGN_METHOD_IMPLICIT 0

/**
 * Velocity filter: repulsions, impulses with restitution, zones. Reads no system values, response is by lumped masses.
 */
#define SGN_METHOD_VELOCITY_FILTER 1

/**
 * Reserved: asynchronous contact. `SGN_ERROR_UNSUPPORTED` in this version.
 */
#define SGN_METHOD_ASYNCHRONOUS 2

/**
 * The fastest that converges, with hand-over on measured stagnation. The default.
 */
#define SGN_SOLVER_AUTOMATIC 0

/**
 * Iterative constraint anticipation as published.
 */
#define SGN_SOLVER_ITERATIVE_ANTICIPATION 1

/**
 * The same with one light pass over the contacts per iteration.
 */
#define SGN_SOLVER_LIGHT_ANTICIPATION 2

/**
 * Accelerated projected relaxation alone.
 */
#define SGN_SOLVER_ACCELERATED_RELAXATION 3

/**
 * Augmented Lagrangian with preconditioned conjugate gradients.
 */
#define SGN_SOLVER_AUGMENTED_LAGRANGIAN 4

/**
 * Full constraint anticipation, a baseline of quadratic cost; beyond 32,768 rows (three per contact with friction)
 * iterative anticipation stands in.
 */
#define SGN_SOLVER_FULL_ANTICIPATION 5

/**
 * Isotropic. The default.
 */
#define SGN_FRICTION_DISC 0

/**
 * Per component, as published.
 */
#define SGN_FRICTION_PYRAMID 1

/**
 * Refuse with INTERSECTING_START or PINCHED, with witnesses. The default.
 */
#define SGN_POLICY_REFUSE 0

/**
 * Pairs that touch the connected tangled component pass until it has separated; everything else keeps the promise.
 */
#define SGN_POLICY_PASS 1

/**
 * The smallest change of velocities after which no collision of the zone is left; impulses push and never pull. The
 * default.
 */
#define SGN_FAIL_SAFE_UNILATERAL_PROJECTION 0

/**
 * The smallest change after which nothing in the zone approaches or separates; impulses may pull.
 */
#define SGN_FAIL_SAFE_INELASTIC_PROJECTION 1

/**
 * The zone moves as one rigid body.
 */
#define SGN_FAIL_SAFE_RIGID_ZONE 2

/**
 * Each contact within its own limit. The default.
 */
#define SGN_ZONE_FRICTION_PER_CONTACT 0

/**
 * One limit for all sliding of the zone.
 */
#define SGN_ZONE_FRICTION_PER_ZONE 1

/**
 * None.
 */
#define SGN_ZONE_FRICTION_NONE 2

/**
 * Unconstrained dynamics of bodies that the library drives.
 */
#define SGN_PHASE_DYNAMICS 0

/**
 * The start state is checked.
 */
#define SGN_PHASE_START 1

/**
 * A round: contacts, constrained dynamics, continuous detection; or a pass of impulses.
 */
#define SGN_PHASE_ROUND 2

/**
 * Zones and held vertices.
 */
#define SGN_PHASE_FAIL_SAFE 3

/**
 * Flag of a step: certify the end state by exact predicates.
 */
#define SGN_STEP_CERTIFY 1

/**
 * Bit of `SgnStepReport.notes`: a solve stopped at its work cap.
 */
#define SGN_STEP_NOT_CONVERGED 1

/**
 * Bit of `SgnStepReport.notes`: the step was divided.
 */
#define SGN_STEP_SUBDIVIDED 2

/**
 * Bit of `SgnStepReport.notes`: zones were projected or moved as rigid bodies, or vertices held.
 */
#define SGN_STEP_FAIL_SAFE_USED 4

/**
 * Bit of `SgnStepReport.notes`: pairs of a tangled component passed.
 */
#define SGN_STEP_TANGLED_PAIRS 8

/**
 * A vertex and a triangle.
 */
#define SGN_PAIR_VERTEX_FACE 0

/**
 * Two edges.
 */
#define SGN_PAIR_EDGE_EDGE 1

/**
 * A vertex and a half-space.
 */
#define SGN_PAIR_VERTEX_HALF_SPACE 2

/**
 * An edge and a triangle: of intersections, not of contacts.
 */
#define SGN_PAIR_EDGE_FACE 3

/**
 * No impulse.
 */
#define SGN_STATE_SEPARATED 0

/**
 * Held by friction.
 */
#define SGN_STATE_STICKING 1

/**
 * At the friction limit.
 */
#define SGN_STATE_SLIPPING 2

/**
 * Values of the ids of the two bodies `a` and `b`, U64X2. `b` is that with the face or the half-space.
 */
#define SGN_CONTACT_BODIES 1

/**
 * Kind, U32 or U64: an `SGN_PAIR_` constant.
 */
#define SGN_CONTACT_KIND 2

/**
 * Feature of each body, U32X2 or U64X2: vertex and triangle, or edge and edge (as in the slot EDGES), or vertex and 0.
 */
#define SGN_CONTACT_FEATURES 3

/**
 * The four signed weights of the stencil, F32X4 or F64X4: of the vertex and the triangle's three, or of the edges' ends.
 */
#define SGN_CONTACT_WEIGHTS 4

/**
 * Contact point on the side of `b`, F32X3 or F64X3.
 */
#define SGN_CONTACT_POINT 5

/**
 * Unit normal from `b` to `a`, F32X3 or F64X3.
 */
#define SGN_CONTACT_NORMAL 6

/**
 * Distance at the end of the step, F32 or F64.
 */
#define SGN_CONTACT_DISTANCE 7

/**
 * Impulse on `a` over the step, F32X3 or F64X3; on `b` it is the opposite.
 */
#define SGN_CONTACT_IMPULSE 8

/**
 * State, U32 or U64: an `SGN_STATE_` constant.
 */
#define SGN_CONTACT_STATE 9

/**
 * Persistent key, U64: the same pair of features keeps it from step to step.
 */
#define SGN_CONTACT_KEY 10

/**
 * Values of the ids of the two bodies, U64X2, in the order of the kind's name.
 */
#define SGN_WITNESS_BODIES 1

/**
 * Feature of each body, U32X2 or U64X2: number of vertex, edge or triangle; 0 for a half-space.
 */
#define SGN_WITNESS_FEATURES 2

/**
 * A point of the intersection, or between the features, F32X3 or F64X3.
 */
#define SGN_WITNESS_POINT 3

/**
 * Kind, U32 or U64: an `SGN_PAIR_` constant.
 */
#define SGN_WITNESS_KIND 4

/**
 * A motion from `x0` to `x1`; where the last call ended does not count.
 */
#define SGN_FILTER_MOTION 0

/**
 * Displacement mode, for recorded trajectories: the positions that the last call ended with move by `x1 - x0`, so that
 * what contact changed stays. The first call starts at `x0`.
 */
#define SGN_FILTER_DISPLACEMENT 1

/**
 * Position mode, for recorded trajectories: the positions that the last call ended with move towards `x1`; `x0` is not
 * read and may be NULL. Needs a call before it that gave a state.
 */
#define SGN_FILTER_POSITION 2

/**
 * Vertices of the first feature of a witness of a filter, U32X3 or U64X3; shorter features repeat their last vertex.
 */
#define SGN_WITNESS_FIRST_VERTICES 5

/**
 * Vertices of the second feature, in the same way.
 */
#define SGN_WITNESS_SECOND_VERTICES 6

/**
 * Log, last error and executor of a host. Any number per process; nothing else is shared between them.
 */
typedef struct SgnContext SgnContext;

/**
 * A mesh with its search tree and the positions that its last call ended with. Keep it from step to step.
 */
typedef struct SgnFilter SgnFilter;

/**
 * Bodies, materials, systems and filters of a host, and what the contact method remembers of them.
 */
typedef struct SgnWorld SgnWorld;

/**
 * Result of every function: 0 is success, positive a success with a note, negative an error. Numbers are never reused.
 */
typedef int32_t SgnResult;

/**
 * Version of the library. Fill with `sgn_version_init`.
 */
typedef struct SgnVersion {
  /**
   * Set by the init function.
   */
  uint32_t struct_size;
  /**
   * `SGN_ABI_VERSION` of the library.
   */
  uint32_t abi;
  /**
   * Major version.
   */
  uint32_t major;
  /**
   * Minor version.
   */
  uint32_t minor;
  /**
   * Patch version.
   */
  uint32_t patch;
  /**
   * 0.
   */
  uint32_t reserved;
} SgnVersion;

/**
 * What `sgn_query` tells.
 */
typedef int32_t SgnCapability;

/**
 * Where work runs.
 */
typedef int32_t SgnExecutor;

/**
 * Level of a log message; a level includes those below it.
 */
typedef int32_t SgnLogLevel;

/**
 * Receives log messages, on the thread whose call they are about. `message` is UTF-8, `length` bytes, not terminated,
 * and gone after the return. Calls into the world at work return `SGN_ERROR_BUSY`. Must not throw.
 */
typedef void (*SgnLogCallback)(void *user, SgnLogLevel level, const char *message, uint64_t length);

/**
 * What a context is made of. Fill with `sgn_context_desc_init`.
 */
typedef struct SgnContextDesc {
  /**
   * Set by the init function.
   */
  uint32_t struct_size;
  /**
   * An `SGN_EXECUTOR_` constant. Default: serial.
   */
  SgnExecutor executor;
  /**
   * Workers of the pool, 1 to 1024. Default: 1.
   */
  uint32_t workers;
  /**
   * The most talkative level to report. Default: `SGN_LOG_WARNING`.
   */
  SgnLogLevel log_level;
  /**
   * Receives log messages; NULL: none. Default: NULL.
   */
  SgnLogCallback log_callback;
  /**
   * Handed to the callback.
   */
  void *log_user;
  /**
   * Must be 0.
   */
  uint64_t flags;
} SgnContextDesc;

/**
 * The last failure of the calling thread. Fill with `sgn_error_info_init`, then set `message` and `message_capacity`.
 */
typedef struct SgnErrorInfo {
  /**
   * Set by the init function.
   */
  uint32_t struct_size;
  /**
   * The code that was returned; 0: this thread had no failure.
   */
  SgnResult code;
  /**
   * Value of the id at fault, or 0.
   */
  uint64_t object;
  /**
   * Array index at fault, or UINT64_MAX.
   */
  uint64_t index;
  /**
   * Value at fault, or NaN.
   */
  double value;
  /**
   * In: the caller's buffer, or NULL. Filled with UTF-8, terminated by a zero byte.
   */
  char *message;
  /**
   * In: bytes of the buffer.
   */
  uint64_t message_capacity;
  /**
   * Out: bytes of the whole message without the zero byte.
   */
  uint64_t message_length;
} SgnErrorInfo;

/**
 * What a world is made of. Fill with `sgn_world_desc_init`.
 */
typedef struct SgnWorldDesc {
  /**
   * Set by the init function.
   */
  uint32_t struct_size;
  /**
   * Must be 0.
   */
  uint32_t reserved;
  /**
   * Must be 0.
   */
  uint64_t flags;
} SgnWorldDesc;

/**
 * How the friction coefficients `a` and `b` of two materials make that of a pair. Of two materials with different
 * rules the one with the larger number wins.
 */
typedef int32_t SgnCombine;

/**
 * A surface material. Fill with `sgn_material_desc_init`.
 */
typedef struct SgnMaterialDesc {
  /**
   * Set by the init function.
   */
  uint32_t struct_size;
  /**
   * An `SGN_COMBINE_` constant. Default: geometric mean.
   */
  SgnCombine combine;
  /**
   * Coulomb friction coefficient, at least 0. Default: 0.
   */
  double friction;
  /**
   * Coefficient of restitution, 0 to 1: the share of its normal velocity with which a collision parts. A pair has the
   * greatest of its two materials' and of that of `SgnStepDesc`. Read by the velocity filter; the implicit method's
   * impacts are inelastic. Default: 0.
   */
  double restitution;
} SgnMaterialDesc;

/**
 * Id of a material. All zero: the frictionless material that bodies have by default.
 */
typedef struct SgnMaterialId {
  /**
   * Opaque.
   */
  uint64_t value;
} SgnMaterialId;

/**
 * Kind of a shape. All are centred at the origin of the body frame; axes of capsules and cylinders are y.
 */
typedef int32_t SgnShape;

/**
 * Format of the elements of a view.
 */
typedef int32_t SgnFormat;

/**
 * Memory of the host that is read: `count` elements, the first at `ptr + byte_offset`, each `byte_stride` after the one
 * before; stride 0 means tightly packed. No alignment is needed, nothing after the last element is touched, and
 * nothing is kept after the call. All zero is the empty view. This struct will not change.
 */
typedef struct SgnView {
  /**
   * An `SGN_FORMAT_` constant.
   */
  SgnFormat format;
  /**
   * Must be 0.
   */
  uint32_t reserved;
  /**
   * Start of the memory.
   */
  const void *ptr;
  /**
   * From there to the first element.
   */
  uint64_t byte_offset;
  /**
   * From one element to the next; 0: their size.
   */
  uint64_t byte_stride;
  /**
   * Number of elements.
   */
  uint64_t count;
} SgnView;

/**
 * A shape. Fill with `sgn_shape_desc_init`. Fields that a kind does not name are not read.
 */
typedef struct SgnShapeDesc {
  /**
   * Set by the init function.
   */
  uint32_t struct_size;
  /**
   * An `SGN_SHAPE_` constant. Default: sphere.
   */
  SgnShape kind;
  /**
   * Half sizes along x, y, z. Default: 0.
   */
  double half_extents[3];
  /**
   * Radius. Default: 0.
   */
  double radius;
  /**
   * Half of the straight part of a capsule, or of a cylinder. Default: 0.
   */
  double half_height;
  /**
   * Largest distance between the shape and its tessellation, as a fraction of the radius. Default: 0.01.
   */
  double tolerance;
  /**
   * Points of a hull, or heights.
   */
  struct SgnView points;
  /**
   * Rows of a height field, at least 2.
   */
  uint32_t rows;
  /**
   * Columns of a height field, at least 2.
   */
  uint32_t columns;
} SgnShapeDesc;

/**
 * Number format in which a host takes the end state of a body. The state is certified after rounding to it, and
 * positions and poses are pulled in it.
 */
typedef int32_t SgnPrecision;

/**
 * What all bodies have in common. Frozen, like `SgnView`: it stands in the middle of other structs.
 */
typedef struct SgnBodyOptions {
  /**
   * `SGN_BODY_` flags. Default: 0.
   */
  uint64_t flags;
  /**
   * Half of the thickness of a pair, in the host's unit of length: two bodies keep the sum of their halves apart.
   * Negative: a tenth of the mean edge length, for a half-space 0. Default: -1.
   */
  double half_thickness;
  /**
   * Material; null: frictionless. Default: null.
   */
  struct SgnMaterialId material;
  /**
   * Groups that the body belongs to, a bit each. Default: 1.
   */
  uint64_t groups;
  /**
   * Groups that it collides with; two bodies collide when each has a group of the other in its mask. Default: all.
   */
  uint64_t mask;
  /**
   * A number of the host's, handed back by `sgn_body_info`. Default: 0.
   */
  uint64_t user_key;
} SgnBodyOptions;

/**
 * Vertices and what of them collides. Frozen, like `SgnView`. Edges of triangles need not be given. Triangles, edges and
 * points all empty: every vertex is a point.
 */
typedef struct SgnMesh {
  /**
   * Vertices, F32X3 or F64X3. They say how many there are.
   */
  struct SgnView vertices;
  /**
   * Triangles, U32X3 or U64X3, either winding.
   */
  struct SgnView triangles;
  /**
   * Edges besides those of triangles, U32X2 or U64X2.
   */
  struct SgnView edges;
  /**
   * Points besides the vertices of triangles and edges, U32 or U64.
   */
  struct SgnView points;
} SgnMesh;

/**
 * A body of free vertices whose dynamics are the host's. Fill with `sgn_deformable_desc_init`.
 */
typedef struct SgnDeformableDesc {
  /**
   * Set by the init function.
   */
  uint32_t struct_size;
  /**
   * An `SGN_PRECISION_` constant. Default: F64.
   */
  SgnPrecision precision;
  /**
   * What all bodies have in common.
   */
  struct SgnBodyOptions options;
  /**
   * The mesh at its start positions.
   */
  struct SgnMesh mesh;
  /**
   * Rest positions, as many as vertices; empty: the start positions.
   */
  struct SgnView rest_positions;
  /**
   * Lumped masses, F32 or F64, one per vertex, positive.
   */
  struct SgnView masses;
  /**
   * U8 per vertex: not 0 where the vertex follows its displacement velocity exactly. Empty: none does.
   */
  struct SgnView pinned;
} SgnDeformableDesc;

/**
 * A rigid body, a mesh or a shape, driven by the host or, with `SGN_BODY_MODEL_DRIVEN`, by the library. Fill with `sgn_rigid_desc_init`.
 */
typedef struct SgnRigidDesc {
  /**
   * Set by the init function.
   */
  uint32_t struct_size;
  /**
   * An `SGN_PRECISION_` constant. Default: F64.
   */
  SgnPrecision precision;
  /**
   * What all bodies have in common.
   */
  struct SgnBodyOptions options;
  /**
   * A shape, or NULL for a mesh; read during the call.
   */
  const struct SgnShapeDesc *shape;
  /**
   * A mesh in the body frame, about the centre of mass.
   */
  struct SgnMesh mesh;
  /**
   * Mass, positive. Default: 1.
   */
  double mass;
  /**
   * Inertia about the centre of mass, 3x3, symmetric, positive definite. Default: the identity.
   */
  double inertia[9];
  /**
   * Centre of mass at the start. Default: the origin.
   */
  double position[3];
  /**
   * Orientation at the start, quaternion x y z w; made a unit one. Default: 0 0 0 1.
   */
  double orientation[4];
  /**
   * Displacement velocity of the centre of mass; the velocity at the start if the library drives it. Default: 0.
   */
  double velocity[3];
  /**
   * Angular displacement velocity, world axes, radians per time; likewise. Default: 0.
   */
  double angular_velocity[3];
  /**
   * Rate at which the velocity decays; read with MODEL_DRIVEN. Default: 0.
   */
  double linear_damping;
  /**
   * Rate at which the angular velocity decays; read with MODEL_DRIVEN. Default: 0.
   */
  double angular_damping;
} SgnRigidDesc;

/**
 * A body of prescribed motion and infinite mass: a mesh or a shape. Fill with `sgn_kinematic_desc_init`.
 */
typedef struct SgnKinematicDesc {
  /**
   * Set by the init function.
   */
  uint32_t struct_size;
  /**
   * An `SGN_PRECISION_` constant. Default: F64.
   */
  SgnPrecision precision;
  /**
   * What all bodies have in common.
   */
  struct SgnBodyOptions options;
  /**
   * A shape, or NULL for a mesh; read during the call.
   */
  const struct SgnShapeDesc *shape;
  /**
   * A mesh at its start positions, or with `SGN_BODY_POSED` in the body frame.
   */
  struct SgnMesh mesh;
  /**
   * Origin of the body frame at the start; read with `SGN_BODY_POSED` or a shape. Default: the origin.
   */
  double position[3];
  /**
   * Orientation at the start, likewise; quaternion x y z w. Default: 0 0 0 1.
   */
  double orientation[4];
} SgnKinematicDesc;

/**
 * A half-space of infinite mass: points with `normal . x >= offset` are free. Fill with `sgn_half_space_desc_init`.
 * Deformable and rigid bodies collide with it; kinematic ones do not.
 */
typedef struct SgnHalfSpaceDesc {
  /**
   * Set by the init function.
   */
  uint32_t struct_size;
  /**
   * An `SGN_PRECISION_` constant. Default: F64.
   */
  SgnPrecision precision;
  /**
   * What all bodies have in common.
   */
  struct SgnBodyOptions options;
  /**
   * Towards the free side; made a unit vector. Default: 0 0 1.
   */
  double normal[3];
  /**
   * Distance of the plane from the origin along the unit normal. Default: 0.
   */
  double offset;
} SgnHalfSpaceDesc;

/**
 * Kind of a body.
 */
typedef int32_t SgnBodyKind;

/**
 * What a body consists of. Fill with `sgn_body_info_init`.
 */
typedef struct SgnBodyInfo {
  /**
   * Set by the init function.
   */
  uint32_t struct_size;
  /**
   * An `SGN_BODY_` kind.
   */
  SgnBodyKind kind;
  /**
   * Number of vertices: of a solid that carries a surface, those of the surface.
   */
  uint64_t vertices;
  /**
   * Number of edges, those of triangles included.
   */
  uint64_t edges;
  /**
   * Number of triangles.
   */
  uint64_t triangles;
  /**
   * Entries of its velocities and impulses: its nodes (its vertices, or those of the tetrahedra that carry them), or 1
   * for a rigid body, or 0.
   */
  uint64_t velocities;
  /**
   * Half thickness in use.
   */
  double half_thickness;
  /**
   * The host's number.
   */
  uint64_t user_key;
} SgnBodyInfo;

/**
 * Id of a body. All zero is null. Ids of removed bodies, of other worlds and garbage give a status, nothing worse.
 */
typedef struct SgnBodyId {
  /**
   * Opaque.
   */
  uint64_t value;
} SgnBodyId;

/**
 * How a sheet resists stretch and shear.
 */
typedef int32_t SgnSheetModel;

/**
 * What acts on the nodes of a body that the library drives, besides its material. Frozen, like `SgnView`.
 */
typedef struct SgnNodeForces {
  /**
   * Velocities at the start, F32X3 or F64X3, one per node; empty: zero.
   */
  struct SgnView velocities;
  /**
   * U8 per node: not 0 where the node goes to its TARGET_POSITION and nowhere else. Empty: none does.
   */
  struct SgnView pinned;
  /**
   * Springs between nodes besides those of the material, U32X2 or U64X2; at rest at their rest distance.
   */
  struct SgnView springs;
  /**
   * Their stiffnesses, F32 or F64, in force per length.
   */
  struct SgnView spring_stiffness;
  /**
   * Nodes that a spring pulls to a target, U32 or U64; each target starts where its node starts.
   */
  struct SgnView attachments;
  /**
   * Their stiffnesses, F32 or F64.
   */
  struct SgnView attachment_stiffness;
  /**
   * Their damping, F32 or F64, in force per velocity; empty: none.
   */
  struct SgnView attachment_damping;
  /**
   * Drag of the faces in the wind: density of the air times drag coefficient over 2. Default: 0.
   */
  double drag;
  /**
   * Rate at which every velocity decays. Default: 0.
   */
  double mass_damping;
  /**
   * Time that multiplies the stiffness of stretch, shear and volume as damping. Default: 0.
   */
  double stretch_damping_time;
  /**
   * Time that multiplies the stiffness of bending as damping. Default: 0.
   */
  double bending_damping_time;
} SgnNodeForces;

/**
 * Cloth or a shell that the library drives. Fill with `sgn_sheet_desc_init`.
 */
typedef struct SgnSheetDesc {
  /**
   * Set by the init function.
   */
  uint32_t struct_size;
  /**
   * An `SGN_PRECISION_` constant. Default: F64.
   */
  SgnPrecision precision;
  /**
   * What all bodies have in common. Flags: NO_SELF_COLLISION, FLAT.
   */
  struct SgnBodyOptions options;
  /**
   * The mesh at its start positions; its triangles are the sheet. Every vertex is a node.
   */
  struct SgnMesh mesh;
  /**
   * Rest positions, as many as vertices; empty: the start positions.
   */
  struct SgnView rest_positions;
  /**
   * An `SGN_SHEET_` constant. Default: SHELL.
   */
  SgnSheetModel model;
  /**
   * Must be 0.
   */
  uint32_t reserved;
  /**
   * Mass per volume, positive. Default: 200.
   */
  double density;
  /**
   * Thickness of the material, positive; not that of contact, which is in the options. Default: 0.001.
   */
  double thickness;
  /**
   * Young's modulus, positive. Default: 1e6.
   */
  double young_modulus;
  /**
   * Poisson's ratio, at least 0 and below 0.5; springs have none. Default: 0.3.
   */
  double poisson_ratio;
  /**
   * Bending stiffness, a torque; negative: that of a plate for a shell, none for springs. Default: -1.
   */
  double bending_stiffness;
  /**
   * Stiffness of a spring across an edge over that of the edge's own; springs only. Default: 0.01.
   */
  double bend_ratio;
  /**
   * Rest lengths over those of the rest shape, positive. Default: 1.
   */
  double rest_scale;
  /**
   * What else acts on it.
   */
  struct SgnNodeForces forces;
} SgnSheetDesc;

/**
 * A solid of tetrahedra, with its own boundary or with a surface that it carries. Fill with `sgn_solid_desc_init`.
 */
typedef struct SgnSolidDesc {
  /**
   * Set by the init function.
   */
  uint32_t struct_size;
  /**
   * An `SGN_PRECISION_` constant. Default: F64.
   */
  SgnPrecision precision;
  /**
   * What all bodies have in common. Flags: NO_SELF_COLLISION, HOST_DRIVEN.
   */
  struct SgnBodyOptions options;
  /**
   * Start positions of the nodes, F32X3 or F64X3.
   */
  struct SgnView nodes;
  /**
   * Rest positions of the nodes, as many; empty: the start positions.
   */
  struct SgnView rest_positions;
  /**
   * Tetrahedra, U32X4 or U64X4, either orientation. Every node belongs to one.
   */
  struct SgnView tetrahedra;
  /**
   * A mesh in the rest shape that the tetrahedra carry and that collides for them: each vertex moves with the element
   * that holds it, or the nearest. Empty: the boundary of the tetrahedra collides.
   */
  struct SgnMesh surface;
  /**
   * Mass per volume, positive. Default: 1000.
   */
  double density;
  /**
   * Young's modulus, positive. Default: 1e6.
   */
  double young_modulus;
  /**
   * Poisson's ratio, at least 0 and below 0.5. Default: 0.3.
   */
  double poisson_ratio;
  /**
   * Rest lengths over those of the rest shape, positive. Default: 1.
   */
  double rest_scale;
  /**
   * What else acts on it. With HOST_DRIVEN: velocities are displacement velocities, pins follow them, the rest must be
   * empty.
   */
  struct SgnNodeForces forces;
} SgnSolidDesc;

/**
 * What of a body is pushed or pulled. `n` is its number of vertices, `m` that of its nodes (`velocities` of
 * `sgn_body_info`): the same, but for a solid that carries a surface. Vectors are F32X3 or F64X3.
 */
typedef int32_t SgnSlot;

/**
 * Memory of the host that is written; laid out as `SgnView`. Elements must not overlap; what lies between them is left
 * as it is. This struct will not change.
 */
typedef struct SgnViewMut {
  /**
   * An `SGN_FORMAT_` constant.
   */
  SgnFormat format;
  /**
   * Must be 0.
   */
  uint32_t reserved;
  /**
   * Start of the memory.
   */
  void *ptr;
  /**
   * From there to the first element.
   */
  uint64_t byte_offset;
  /**
   * From one element to the next; 0: their size.
   */
  uint64_t byte_stride;
  /**
   * Number of elements.
   */
  uint64_t count;
} SgnViewMut;

/**
 * Pattern of a system. Fill with `sgn_system_desc_init`.
 *
 * Rows are 3x3 blocks: for each body in turn one per vertex of a deformable body, two (linear, then angular about the
 * centre of mass in world axes) for a rigid body. Symmetric positive definite. Rows and columns of pinned vertices must
 * be present and are not used.
 */
typedef struct SgnSystemDesc {
  /**
   * Set by the init function.
   */
  uint32_t struct_size;
  /**
   * Must be 0.
   */
  uint32_t reserved;
  /**
   * `SGN_SYSTEM_` flags. Default: 0, full rows.
   */
  uint64_t flags;
  /**
   * Bodies in the order of rows, each in no other system.
   */
  const struct SgnBodyId *bodies;
  /**
   * Number of bodies.
   */
  uint64_t body_count;
  /**
   * Start of each block row in `columns`, U32 or U64; one more than rows.
   */
  struct SgnView row_offsets;
  /**
   * Block columns, U32 or U64, ascending within a row, the diagonal present.
   */
  struct SgnView columns;
} SgnSystemDesc;

/**
 * Id of a system.
 */
typedef struct SgnSystemId {
  /**
   * Opaque.
   */
  uint64_t value;
} SgnSystemId;

/**
 * Contact method.
 */
typedef int32_t SgnMethod;

/**
 * Solver of the constrained dynamics.
 */
typedef int32_t SgnSolver;

/**
 * Shape of the friction limit.
 */
typedef int32_t SgnFrictionCone;

/**
 * What to do with start states that intersect, and with scripted motion that leaves no room.
 */
typedef int32_t SgnPolicy;

/**
 * Phase of a step.
 */
typedef int32_t SgnPhase;

/**
 * Told before each phase of a step, on the thread that steps, with the fraction of the step that is done. Returns 0 to
 * cancel. Calls into the world return `SGN_ERROR_BUSY`. Must not throw.
 */
typedef int32_t (*SgnProgressCallback)(void *user, SgnPhase phase, double fraction);

/**
 * What answers a zone of collisions that the method's own iterations left, before it moves as a rigid body and before
 * it is held.
 */
typedef int32_t SgnFailSafe;

/**
 * Friction within a projected zone.
 */
typedef int32_t SgnZoneFriction;

/**
 * A step to be made. Fill with `sgn_step_desc_init`, then set `dt`. All tolerances are relative, all caps are counters.
 */
typedef struct SgnStepDesc {
  /**
   * Set by the init function.
   */
  uint32_t struct_size;
  /**
   * An `SGN_METHOD_` constant.
   */
  SgnMethod method;
  /**
   * Duration, positive. Default: 0, which is refused.
   */
  double dt;
  /**
   * `SGN_STEP_` flags. Default: 0.
   */
  uint64_t flags;
  /**
   * An `SGN_SOLVER_` constant.
   */
  SgnSolver solver;
  /**
   * An `SGN_FRICTION_` constant.
   */
  SgnFrictionCone friction_cone;
  /**
   * An `SGN_POLICY_` constant.
   */
  SgnPolicy policy;
  /**
   * Outer iterations of a step at most: each solve may use half of what is left, and always a fiftieth.
   */
  uint32_t iterations_max;
  /**
   * Rounds of constraint manifold refinement before the step is divided.
   */
  uint32_t rounds_max;
  /**
   * Halvings of the step before the fail-safes, 0 to 20.
   */
  uint32_t halvings_max;
  /**
   * Bound of the complementarity and friction residuals, relative to the largest velocity.
   */
  double contact_tolerance;
  /**
   * Bound of the estimated relative velocity error.
   */
  double velocity_tolerance;
  /**
   * Thickness regained in a step at most, as a fraction of the pair thickness, 0 to 1.
   */
  double recovery_fraction;
  /**
   * Range of the proximity search, as a multiple of the pair thickness, at least 1.
   */
  double proximity_factor;
  /**
   * A part that turns by more than this angle is subdivided in time, in radians, positive.
   */
  double turn_max;
  /**
   * Told before each phase, may cancel; NULL: none. Default: NULL.
   */
  SgnProgressCallback progress_callback;
  /**
   * Handed to the callback.
   */
  void *progress_user;
  /**
   * An `SGN_FAIL_SAFE_` constant.
   */
  SgnFailSafe fail_safe;
  /**
   * An `SGN_ZONE_FRICTION_` constant.
   */
  SgnZoneFriction zone_friction;
  /**
   * Velocity filter: coefficient of restitution that collisions have at least, whatever their materials', 0 to 1.
   * Default: 0.
   */
  double restitution;
  /**
   * Velocity filter: stiffness of the springs between what is closer than its thickness, in units of effective mass over
   * `dt^2`, 0 to 1e6; 1 makes up for the whole overlap in a step, but for the cap of `recovery_fraction`. 0: no springs.
   * Default: 10.
   */
  double repulsion_stiffness;
  /**
   * Velocity filter: passes of impulses and continuous detection before the fail-safes, at most 1e6.
   */
  uint32_t passes_max;
  /**
   * Must be 0.
   */
  uint32_t reserved;
} SgnStepDesc;

/**
 * What a step did. Fill with `sgn_step_report_init`.
 */
typedef struct SgnStepReport {
  /**
   * Set by the init function.
   */
  uint32_t struct_size;
  /**
   * Contacts in the last solve.
   */
  uint32_t contacts;
  /**
   * Contacts with an impulse.
   */
  uint32_t active_contacts;
  /**
   * Rounds of constraint manifold refinement, or passes of the velocity filter, summed over the parts of the step.
   */
  uint32_t rounds;
  /**
   * Outer solver iterations, or impulses of the velocity filter, summed.
   */
  uint32_t iterations;
  /**
   * Parts that the step was divided into; 1 when it was not.
   */
  uint32_t parts;
  /**
   * Zones that moved as rigid bodies.
   */
  uint32_t rigid_zones;
  /**
   * Vertices held.
   */
  uint32_t held_vertices;
  /**
   * Pairs that passed because they touch a tangled component.
   */
  uint32_t tangled_pairs;
  /**
   * 1 if `intersections` was certified, else 0.
   */
  uint32_t certified;
  /**
   * Intersections that the certificate found; 0 without SGN_STEP_CERTIFY.
   */
  uint64_t intersections;
  /**
   * All notes of the step, a bit each.
   */
  uint64_t notes;
  /**
   * Complementarity residual, relative; worst of the step.
   */
  double complementarity_residual;
  /**
   * Friction residual, relative; worst of the step.
   */
  double friction_residual;
  /**
   * Dynamics residual, relative; worst of the step.
   */
  double dynamics_residual;
  /**
   * Work done by thickness recovery; by springs of the velocity filter at most.
   */
  double recovery_work;
  /**
   * Momentum taken by held zones and infinite masses.
   */
  double momentum_taken[3];
  /**
   * Error in angular momentum from normals at impact.
   */
  double angular_momentum_error;
  /**
   * Fraction of the step that the state stands at; below 1 only with PINCHED.
   */
  double certified_fraction;
  /**
   * Microseconds of proximity and candidate search.
   */
  double search_microseconds;
  /**
   * Microseconds of rows and frames.
   */
  double rows_microseconds;
  /**
   * Microseconds of constrained dynamics.
   */
  double solve_microseconds;
  /**
   * Microseconds of continuous detection.
   */
  double detection_microseconds;
  /**
   * Microseconds of the fail-safes.
   */
  double fail_safe_microseconds;
  /**
   * Microseconds of the certificate.
   */
  double certificate_microseconds;
  /**
   * Microseconds of the whole step.
   */
  double total_microseconds;
  /**
   * Bytes held by the method's memory and buffers.
   */
  uint64_t bytes;
  /**
   * Microseconds of the metric, and of assembly and unconstrained solve of the bodies that the library drives.
   */
  double dynamics_microseconds;
  /**
   * Zones whose velocities were projected.
   */
  uint64_t projected_zones;
} SgnStepReport;

/**
 * What of the contacts of the last step is pulled. All attributes have the same order, which does not depend on the
 * executor.
 */
typedef int32_t SgnContactAttribute;

/**
 * Outcome of a check. Fill with `sgn_check_report_init`.
 */
typedef struct SgnCheckReport {
  /**
   * Set by the init function.
   */
  uint32_t struct_size;
  /**
   * Must be 0.
   */
  uint32_t reserved;
  /**
   * Pairs of features that intersect; their witnesses can be pulled.
   */
  uint64_t intersections;
} SgnCheckReport;

/**
 * What of the witnesses is pulled: two features that intersect, that leave no room, or that a pushed start was swept
 * through.
 */
typedef int32_t SgnWitnessAttribute;

/**
 * A mesh whose motion is filtered. Fill with `sgn_filter_desc_init`.
 */
typedef struct SgnFilterDesc {
  /**
   * Set by the init function.
   */
  uint32_t struct_size;
  /**
   * An `SGN_PRECISION_` constant: positions are certified after rounding to it. Default: F64.
   */
  SgnPrecision precision;
  /**
   * 0 or `SGN_BODY_NO_SELF_COLLISION`: no group collides with itself. Default: 0.
   */
  uint64_t flags;
  /**
   * Half of the thickness of a pair. Negative: a tenth of the mean edge length of each group. Default: -1.
   */
  double half_thickness;
  /**
   * Friction coefficient of everything, at least 0. Default: 0.
   */
  double friction;
  /**
   * The mesh at rest: parts of one group that rest closer than their thickness keep a fraction of that distance only.
   */
  struct SgnMesh mesh;
  /**
   * Masses, F32 or F64, one per vertex; 0 or infinite: scripted, the vertex goes where it is sent.
   */
  struct SgnView masses;
  /**
   * Group of each vertex, U32 or U64 below 2^32: a body. Empty: all are one. No triangle or edge spans two.
   */
  struct SgnView groups;
} SgnFilterDesc;

/**
 * What the two positions of a call to `sgn_filter_run` are.
 */
typedef int32_t SgnFilterMode;

/**
 * Every function of this header, in one table: a host that loads the library itself needs one symbol, `sgn_get_api`.
 * Fill with `sgn_api_init`. Functions keep their places; new ones are added at the end.
 */
typedef struct SgnApi {
  /**
   * Set by the init function.
   */
  uint32_t struct_size;
  /**
   * 0.
   */
  uint32_t reserved;
  /**
   * See `sgn_version_init`.
   */
  SgnResult (*version_init)(struct SgnVersion *version, size_t size);
  /**
   * See `sgn_version`.
   */
  SgnResult (*version)(struct SgnVersion *version);
  /**
   * See `sgn_query`.
   */
  SgnResult (*query)(SgnCapability capability, int64_t *out);
  /**
   * See `sgn_result_name`.
   */
  SgnResult (*result_name)(SgnResult code, const char **out);
  /**
   * See `sgn_context_desc_init`.
   */
  SgnResult (*context_desc_init)(struct SgnContextDesc *desc, size_t size);
  /**
   * See `sgn_error_info_init`.
   */
  SgnResult (*error_info_init)(struct SgnErrorInfo *info, size_t size);
  /**
   * See `sgn_context_create`.
   */
  SgnResult (*context_create)(uint32_t abi,
                              const struct SgnContextDesc *desc,
                              char *message,
                              size_t message_capacity,
                              struct SgnContext **out);
  /**
   * See `sgn_context_destroy`.
   */
  SgnResult (*context_destroy)(struct SgnContext *context);
  /**
   * See `sgn_context_last_error`.
   */
  SgnResult (*context_last_error)(const struct SgnContext *context, struct SgnErrorInfo *info);
  /**
   * See `sgn_world_desc_init`.
   */
  SgnResult (*world_desc_init)(struct SgnWorldDesc *desc, size_t size);
  /**
   * See `sgn_world_create`.
   */
  SgnResult (*world_create)(struct SgnContext *context, const struct SgnWorldDesc *desc, struct SgnWorld **out);
  /**
   * See `sgn_world_destroy`.
   */
  SgnResult (*world_destroy)(struct SgnWorld *world);
  /**
   * See `sgn_world_state_hash`.
   */
  SgnResult (*world_state_hash)(const struct SgnWorld *world, uint64_t *out);
  /**
   * See `sgn_material_desc_init`.
   */
  SgnResult (*material_desc_init)(struct SgnMaterialDesc *desc, size_t size);
  /**
   * See `sgn_material_create`.
   */
  SgnResult (*material_create)(struct SgnWorld *world,
                               const struct SgnMaterialDesc *desc,
                               struct SgnMaterialId *out);
  /**
   * See `sgn_material_set`.
   */
  SgnResult (*material_set)(struct SgnWorld *world,
                            struct SgnMaterialId material,
                            const struct SgnMaterialDesc *desc);
  /**
   * See `sgn_material_set_pair`.
   */
  SgnResult (*material_set_pair)(struct SgnWorld *world,
                                 struct SgnMaterialId a,
                                 struct SgnMaterialId b,
                                 double friction);
  /**
   * See `sgn_shape_desc_init`.
   */
  SgnResult (*shape_desc_init)(struct SgnShapeDesc *desc, size_t size);
  /**
   * See `sgn_deformable_desc_init`.
   */
  SgnResult (*deformable_desc_init)(struct SgnDeformableDesc *desc, size_t size);
  /**
   * See `sgn_rigid_desc_init`.
   */
  SgnResult (*rigid_desc_init)(struct SgnRigidDesc *desc, size_t size);
  /**
   * See `sgn_kinematic_desc_init`.
   */
  SgnResult (*kinematic_desc_init)(struct SgnKinematicDesc *desc, size_t size);
  /**
   * See `sgn_half_space_desc_init`.
   */
  SgnResult (*half_space_desc_init)(struct SgnHalfSpaceDesc *desc, size_t size);
  /**
   * See `sgn_body_info_init`.
   */
  SgnResult (*body_info_init)(struct SgnBodyInfo *info, size_t size);
  /**
   * See `sgn_deformable_create`.
   */
  SgnResult (*deformable_create)(struct SgnWorld *world,
                                 const struct SgnDeformableDesc *desc,
                                 struct SgnBodyId *out);
  /**
   * See `sgn_rigid_create`.
   */
  SgnResult (*rigid_create)(struct SgnWorld *world, const struct SgnRigidDesc *desc, struct SgnBodyId *out);
  /**
   * See `sgn_kinematic_create`.
   */
  SgnResult (*kinematic_create)(struct SgnWorld *world,
                                const struct SgnKinematicDesc *desc,
                                struct SgnBodyId *out);
  /**
   * See `sgn_half_space_create`.
   */
  SgnResult (*half_space_create)(struct SgnWorld *world,
                                 const struct SgnHalfSpaceDesc *desc,
                                 struct SgnBodyId *out);
  /**
   * See `sgn_body_destroy`.
   */
  SgnResult (*body_destroy)(struct SgnWorld *world, struct SgnBodyId body);
  /**
   * See `sgn_body_set_filter`.
   */
  SgnResult (*body_set_filter)(struct SgnWorld *world, struct SgnBodyId body, uint64_t groups, uint64_t mask);
  /**
   * See `sgn_body_set_material`.
   */
  SgnResult (*body_set_material)(struct SgnWorld *world, struct SgnBodyId body, struct SgnMaterialId material);
  /**
   * See `sgn_body_info`.
   */
  SgnResult (*body_info)(const struct SgnWorld *world, struct SgnBodyId body, struct SgnBodyInfo *info);
  /**
   * See `sgn_body_push`.
   */
  SgnResult (*body_push)(struct SgnWorld *world,
                         struct SgnBodyId body,
                         SgnSlot slot,
                         const struct SgnView *view,
                         uint64_t flags);
  /**
   * See `sgn_body_pull`.
   */
  SgnResult (*body_pull)(const struct SgnWorld *world,
                         struct SgnBodyId body,
                         SgnSlot slot,
                         const struct SgnViewMut *view);
  /**
   * See `sgn_system_desc_init`.
   */
  SgnResult (*system_desc_init)(struct SgnSystemDesc *desc, size_t size);
  /**
   * See `sgn_system_create`.
   */
  SgnResult (*system_create)(struct SgnWorld *world, const struct SgnSystemDesc *desc, struct SgnSystemId *out);
  /**
   * See `sgn_system_push`.
   */
  SgnResult (*system_push)(struct SgnWorld *world, struct SgnSystemId system, const struct SgnView *blocks);
  /**
   * See `sgn_system_destroy`.
   */
  SgnResult (*system_destroy)(struct SgnWorld *world, struct SgnSystemId system);
  /**
   * See `sgn_step_desc_init`.
   */
  SgnResult (*step_desc_init)(struct SgnStepDesc *desc, size_t size);
  /**
   * See `sgn_step_report_init`.
   */
  SgnResult (*step_report_init)(struct SgnStepReport *report, size_t size);
  /**
   * See `sgn_world_step`.
   */
  SgnResult (*world_step)(struct SgnWorld *world, const struct SgnStepDesc *desc, struct SgnStepReport *report);
  /**
   * See `sgn_world_pull_contacts`.
   */
  SgnResult (*world_pull_contacts)(const struct SgnWorld *world,
                                   SgnContactAttribute attribute,
                                   const struct SgnViewMut *view,
                                   uint64_t *count);
  /**
   * See `sgn_check_report_init`.
   */
  SgnResult (*check_report_init)(struct SgnCheckReport *report, size_t size);
  /**
   * See `sgn_world_check`.
   */
  SgnResult (*world_check)(struct SgnWorld *world, struct SgnCheckReport *report);
  /**
   * See `sgn_world_pull_witnesses`.
   */
  SgnResult (*world_pull_witnesses)(const struct SgnWorld *world,
                                    SgnWitnessAttribute attribute,
                                    const struct SgnViewMut *view,
                                    uint64_t *count);
  /**
   * See `sgn_world_snapshot_size`.
   */
  SgnResult (*world_snapshot_size)(const struct SgnWorld *world, uint64_t *out);
  /**
   * See `sgn_world_snapshot_save`.
   */
  SgnResult (*world_snapshot_save)(const struct SgnWorld *world,
                                   void *buffer,
                                   uint64_t capacity,
                                   uint64_t *written);
  /**
   * See `sgn_world_cancel`.
   */
  SgnResult (*world_cancel)(struct SgnWorld *world);
  /**
   * See `sgn_world_snapshot_load`.
   */
  SgnResult (*world_snapshot_load)(struct SgnWorld *world, const void *buffer, uint64_t size);
  /**
   * See `sgn_sheet_desc_init`.
   */
  SgnResult (*sheet_desc_init)(struct SgnSheetDesc *desc, size_t size);
  /**
   * See `sgn_solid_desc_init`.
   */
  SgnResult (*solid_desc_init)(struct SgnSolidDesc *desc, size_t size);
  /**
   * See `sgn_sheet_create`.
   */
  SgnResult (*sheet_create)(struct SgnWorld *world, const struct SgnSheetDesc *desc, struct SgnBodyId *out);
  /**
   * See `sgn_solid_create`.
   */
  SgnResult (*solid_create)(struct SgnWorld *world, const struct SgnSolidDesc *desc, struct SgnBodyId *out);
  /**
   * See `sgn_world_set_gravity`.
   */
  SgnResult (*world_set_gravity)(struct SgnWorld *world, const double *gravity);
  /**
   * See `sgn_world_set_wind`.
   */
  SgnResult (*world_set_wind)(struct SgnWorld *world, const double *wind);
  /**
   * See `sgn_filter_desc_init`.
   */
  SgnResult (*filter_desc_init)(struct SgnFilterDesc *desc, size_t size);
  /**
   * See `sgn_filter_create`.
   */
  SgnResult (*filter_create)(struct SgnContext *context,
                             const struct SgnFilterDesc *desc,
                             struct SgnFilter **out);
  /**
   * See `sgn_filter_destroy`.
   */
  SgnResult (*filter_destroy)(struct SgnFilter *filter);
  /**
   * See `sgn_filter_run`.
   */
  SgnResult (*filter_run)(struct SgnFilter *filter,
                          SgnFilterMode mode,
                          const struct SgnView *x0,
                          const struct SgnView *x1,
                          const struct SgnStepDesc *desc,
                          const struct SgnViewMut *positions,
                          const struct SgnViewMut *velocities,
                          struct SgnStepReport *report);
  /**
   * See `sgn_filter_restart`.
   */
  SgnResult (*filter_restart)(struct SgnFilter *filter);
  /**
   * See `sgn_filter_pull_witnesses`.
   */
  SgnResult (*filter_pull_witnesses)(struct SgnFilter *filter,
                                     SgnWitnessAttribute attribute,
                                     const struct SgnViewMut *view,
                                     uint64_t *count);
} SgnApi;

/**
 * Kind of a pair of features.
 */
typedef int32_t SgnPairKind;

/**
 * State of a contact.
 */
typedef int32_t SgnContactState;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/**
 * Fills `version` with zeros and its size; `size` is `sizeof(SgnVersion)`.
 *
 * Thread: any. Errors: NULL_ARGUMENT, BAD_STRUCT.
 */
SGN_API SgnResult sgn_version_init(struct SgnVersion *version, size_t size);

/**
 * Version of the library that is linked or loaded.
 *
 * Thread: any. Errors: NULL_ARGUMENT, BAD_STRUCT.
 */
SGN_API SgnResult sgn_version(struct SgnVersion *version);

/**
 * Tells a capability.
 *
 * Thread: any. Errors: NULL_ARGUMENT; UNSUPPORTED for capabilities that this version does not know.
 */
SGN_API SgnResult sgn_query(SgnCapability capability, int64_t *out);

/**
 * Name of a result code, as `"SGN_ERROR_BUSY"`.
 *
 * Ownership: the text is the library's and stays. Thread: any. Errors: NULL_ARGUMENT; UNSUPPORTED for unknown codes.
 */
SGN_API
SgnResult sgn_result_name(SgnResult code,
                          const char **out);

/**
 * Fills `desc` with defaults; `size` is `sizeof(SgnContextDesc)`.
 *
 * Thread: any. Errors: NULL_ARGUMENT, BAD_STRUCT.
 */
SGN_API SgnResult sgn_context_desc_init(struct SgnContextDesc *desc, size_t size);

/**
 * Fills `info` with defaults; `size` is `sizeof(SgnErrorInfo)`.
 *
 * Thread: any. Errors: NULL_ARGUMENT, BAD_STRUCT.
 */
SGN_API SgnResult sgn_error_info_init(struct SgnErrorInfo *info, size_t size);

/**
 * Creates a context. Pass `SGN_ABI_VERSION` as `abi`; `desc` may be NULL for the defaults. `message`, if not NULL, takes
 * the reason of a failure, terminated by a zero byte and cut to `message_capacity` bytes: there is no context yet to ask.
 *
 * Ownership: the caller destroys `*out` with `sgn_context_destroy`. Thread: any.
 * Errors: ABI_MISMATCH, NULL_ARGUMENT, BAD_STRUCT, UNSUPPORTED_STRUCT, INVALID_ARGUMENT, UNSUPPORTED, OUT_OF_MEMORY.
 */
SGN_API
SgnResult sgn_context_create(uint32_t abi,
                             const struct SgnContextDesc *desc,
                             char *message,
                             size_t message_capacity,
                             struct SgnContext **out);

/**
 * Destroys a context; NULL is allowed. Its worlds stay usable and keep what they need of it; the pool is joined when the
 * last of them is gone.
 *
 * Thread: exclusive. Errors: none.
 */
SGN_API
SgnResult sgn_context_destroy(struct SgnContext *context);

/**
 * The last failure of the calling thread in this context. `info->message` is filled as far as its capacity reaches; a
 * message that does not fit gives the note TRUNCATED.
 *
 * Ownership: nothing is kept. Thread: concurrent. Errors: NULL_ARGUMENT, BAD_STRUCT, UNSUPPORTED_STRUCT.
 */
SGN_API
SgnResult sgn_context_last_error(const struct SgnContext *context,
                                 struct SgnErrorInfo *info);

/**
 * Fills `desc` with defaults; `size` is `sizeof(SgnWorldDesc)`.
 *
 * Thread: any. Errors: NULL_ARGUMENT, BAD_STRUCT.
 */
SGN_API SgnResult sgn_world_desc_init(struct SgnWorldDesc *desc, size_t size);

/**
 * Creates an empty world; `desc` may be NULL for the defaults.
 *
 * Ownership: the caller destroys `*out` with `sgn_world_destroy`; the world keeps what it needs of the context.
 * Thread: concurrent. Errors: NULL_ARGUMENT, BAD_STRUCT, UNSUPPORTED_STRUCT, INVALID_ARGUMENT.
 */
SGN_API
SgnResult sgn_world_create(struct SgnContext *context,
                           const struct SgnWorldDesc *desc,
                           struct SgnWorld **out);

/**
 * Destroys a world and all that is in it; NULL is allowed. Poisoned worlds too.
 *
 * Thread: exclusive. Errors: BUSY while another call is in the world (it then lives on).
 */
SGN_API SgnResult sgn_world_destroy(struct SgnWorld *world);

/**
 * A 64-bit hash over everything that has been pushed and the last step has left: equal for worlds with the same history
 * on one build of the library, whatever the executor.
 *
 * Thread: concurrent. Errors: NULL_ARGUMENT, BUSY, POISONED, PANIC.
 */
SGN_API
SgnResult sgn_world_state_hash(const struct SgnWorld *world,
                               uint64_t *out);

/**
 * Fills `desc` with defaults; `size` is `sizeof(SgnMaterialDesc)`.
 *
 * Thread: any. Errors: NULL_ARGUMENT, BAD_STRUCT.
 */
SGN_API SgnResult sgn_material_desc_init(struct SgnMaterialDesc *desc, size_t size);

/**
 * Adds a material.
 *
 * Thread: exclusive. Errors: NULL_ARGUMENT, BAD_STRUCT, UNSUPPORTED_STRUCT, INVALID_ARGUMENT, NON_FINITE_INPUT,
 * OUT_OF_MEMORY, BUSY, POISONED, PANIC.
 */
SGN_API
SgnResult sgn_material_create(struct SgnWorld *world,
                              const struct SgnMaterialDesc *desc,
                              struct SgnMaterialId *out);

/**
 * Changes a material; bodies that have it follow.
 *
 * Thread: exclusive. Errors: as sgn_material_create, and INVALID_ID.
 */
SGN_API
SgnResult sgn_material_set(struct SgnWorld *world,
                           struct SgnMaterialId material,
                           const struct SgnMaterialDesc *desc);

/**
 * Sets the friction coefficient of a pair of materials, whatever their combine rules say. A null id stands for the
 * frictionless default.
 *
 * Thread: exclusive. Errors: NULL_ARGUMENT, INVALID_ID, INVALID_ARGUMENT, NON_FINITE_INPUT, BUSY, POISONED, PANIC.
 */
SGN_API
SgnResult sgn_material_set_pair(struct SgnWorld *world,
                                struct SgnMaterialId a,
                                struct SgnMaterialId b,
                                double friction);

/**
 * Fills `desc` with defaults; `size` is `sizeof(SgnShapeDesc)`.
 *
 * Thread: any. Errors: NULL_ARGUMENT, BAD_STRUCT.
 */
SGN_API SgnResult sgn_shape_desc_init(struct SgnShapeDesc *desc, size_t size);

/**
 * Fills `desc` with defaults; `size` is `sizeof(SgnDeformableDesc)`.
 *
 * Thread: any. Errors: NULL_ARGUMENT, BAD_STRUCT.
 */
SGN_API SgnResult sgn_deformable_desc_init(struct SgnDeformableDesc *desc, size_t size);

/**
 * Fills `desc` with defaults; `size` is `sizeof(SgnRigidDesc)`.
 *
 * Thread: any. Errors: NULL_ARGUMENT, BAD_STRUCT.
 */
SGN_API SgnResult sgn_rigid_desc_init(struct SgnRigidDesc *desc, size_t size);

/**
 * Fills `desc` with defaults; `size` is `sizeof(SgnKinematicDesc)`.
 *
 * Thread: any. Errors: NULL_ARGUMENT, BAD_STRUCT.
 */
SGN_API SgnResult sgn_kinematic_desc_init(struct SgnKinematicDesc *desc, size_t size);

/**
 * Fills `desc` with defaults; `size` is `sizeof(SgnHalfSpaceDesc)`.
 *
 * Thread: any. Errors: NULL_ARGUMENT, BAD_STRUCT.
 */
SGN_API SgnResult sgn_half_space_desc_init(struct SgnHalfSpaceDesc *desc, size_t size);

/**
 * Fills `info` with zeros and its size; `size` is `sizeof(SgnBodyInfo)`.
 *
 * Thread: any. Errors: NULL_ARGUMENT, BAD_STRUCT.
 */
SGN_API SgnResult sgn_body_info_init(struct SgnBodyInfo *info, size_t size);

/**
 * Adds a deformable body.
 *
 * Ownership: everything is copied; no pointer is kept. Thread: exclusive.
 * Errors (the world is then as it was): NULL_ARGUMENT, BAD_STRUCT, UNSUPPORTED_STRUCT, INVALID_ARGUMENT, INVALID_ID,
 * BUFFER_LAYOUT, NON_FINITE_INPUT, BAD_TOPOLOGY, OUT_OF_MEMORY, BUSY, POISONED, PANIC.
 */
SGN_API
SgnResult sgn_deformable_create(struct SgnWorld *world,
                                const struct SgnDeformableDesc *desc,
                                struct SgnBodyId *out);

/**
 * Adds a rigid body.
 *
 * Ownership, thread, errors: as sgn_deformable_create, and UNSUPPORTED.
 */
SGN_API
SgnResult sgn_rigid_create(struct SgnWorld *world,
                           const struct SgnRigidDesc *desc,
                           struct SgnBodyId *out);

/**
 * Adds a kinematic body. It stays where it is until targets are pushed.
 *
 * Ownership, thread, errors: as sgn_deformable_create, and UNSUPPORTED.
 */
SGN_API
SgnResult sgn_kinematic_create(struct SgnWorld *world,
                               const struct SgnKinematicDesc *desc,
                               struct SgnBodyId *out);

/**
 * Adds a half-space. It stays where it is until a target is pushed.
 *
 * Thread, errors: as sgn_deformable_create.
 */
SGN_API
SgnResult sgn_half_space_create(struct SgnWorld *world,
                                const struct SgnHalfSpaceDesc *desc,
                                struct SgnBodyId *out);

/**
 * Removes a body, and the systems that name it. Their ids are stale from now on.
 *
 * Thread: exclusive. Errors: NULL_ARGUMENT, INVALID_ID, STALE_ID, BUSY, POISONED, PANIC.
 */
SGN_API SgnResult sgn_body_destroy(struct SgnWorld *world, struct SgnBodyId body);

/**
 * Sets groups and mask of a body.
 *
 * Thread: exclusive. Errors: NULL_ARGUMENT, INVALID_ID, STALE_ID, BUSY, POISONED, PANIC.
 */
SGN_API
SgnResult sgn_body_set_filter(struct SgnWorld *world,
                              struct SgnBodyId body,
                              uint64_t groups,
                              uint64_t mask);

/**
 * Sets the material of a body; null: frictionless.
 *
 * Thread: exclusive. Errors: NULL_ARGUMENT, INVALID_ID, STALE_ID, BUSY, POISONED, PANIC.
 */
SGN_API
SgnResult sgn_body_set_material(struct SgnWorld *world,
                                struct SgnBodyId body,
                                struct SgnMaterialId material);

/**
 * What a body consists of; also tells whether an id is valid.
 *
 * Thread: concurrent. Errors: NULL_ARGUMENT, BAD_STRUCT, INVALID_ID, STALE_ID, BUSY, POISONED, PANIC.
 */
SGN_API
SgnResult sgn_body_info(const struct SgnWorld *world,
                        struct SgnBodyId body,
                        struct SgnBodyInfo *info);

/**
 * Fills `desc` with defaults; `size` is `sizeof(SgnSheetDesc)`.
 *
 * Thread: any. Errors: NULL_ARGUMENT, BAD_STRUCT.
 */
SGN_API SgnResult sgn_sheet_desc_init(struct SgnSheetDesc *desc, size_t size);

/**
 * Fills `desc` with defaults; `size` is `sizeof(SgnSolidDesc)`.
 *
 * Thread: any. Errors: NULL_ARGUMENT, BAD_STRUCT.
 */
SGN_API SgnResult sgn_solid_desc_init(struct SgnSolidDesc *desc, size_t size);

/**
 * Adds cloth or a shell that the library drives: a deformable body with dynamics of its own.
 *
 * Ownership, thread, errors: as sgn_deformable_create.
 */
SGN_API
SgnResult sgn_sheet_create(struct SgnWorld *world,
                           const struct SgnSheetDesc *desc,
                           struct SgnBodyId *out);

/**
 * Adds a solid of tetrahedra: a deformable body, driven by the library or, with HOST_DRIVEN, by the host, whose
 * velocities, impulses and system rows are those of the nodes.
 *
 * Ownership, thread, errors: as sgn_deformable_create.
 */
SGN_API
SgnResult sgn_solid_create(struct SgnWorld *world,
                           const struct SgnSolidDesc *desc,
                           struct SgnBodyId *out);

/**
 * Sets the acceleration of gravity on the bodies that the library drives: three doubles. Zero at first.
 *
 * Thread: exclusive. Errors (it then stays): NULL_ARGUMENT, NON_FINITE_INPUT, BUSY, POISONED, PANIC.
 */
SGN_API SgnResult sgn_world_set_gravity(struct SgnWorld *world, const double *gravity);

/**
 * Sets the velocity of the air around the bodies that the library drives: three doubles. Zero at first.
 *
 * Thread: exclusive. Errors (it then stays): NULL_ARGUMENT, NON_FINITE_INPUT, BUSY, POISONED, PANIC.
 */
SGN_API SgnResult sgn_world_set_wind(struct SgnWorld *world, const double *wind);

/**
 * Pushes a slot of a body from the host's memory.
 *
 * Ownership: copied. Thread: exclusive. Errors (the body is then as it was): NULL_ARGUMENT, INVALID_ID, STALE_ID,
 * INVALID_ARGUMENT, UNSUPPORTED, BUFFER_LAYOUT, NON_FINITE_INPUT, OUT_OF_MEMORY, BUSY, POISONED, PANIC.
 */
SGN_API
SgnResult sgn_body_push(struct SgnWorld *world,
                        struct SgnBodyId body,
                        SgnSlot slot,
                        const struct SgnView *view,
                        uint64_t flags);

/**
 * Pulls a slot of a body into the host's memory. The view has exactly as many elements as the slot, see `sgn_body_info`.
 *
 * Thread: concurrent; the view's memory is exclusive. Errors (nothing is then written): NULL_ARGUMENT, INVALID_ID,
 * STALE_ID, INVALID_ARGUMENT, UNSUPPORTED, BUFFER_LAYOUT, BUSY, POISONED, PANIC.
 */
SGN_API
SgnResult sgn_body_pull(const struct SgnWorld *world,
                        struct SgnBodyId body,
                        SgnSlot slot,
                        const struct SgnViewMut *view);

/**
 * Fills `desc` with defaults; `size` is `sizeof(SgnSystemDesc)`.
 *
 * Thread: any. Errors: NULL_ARGUMENT, BAD_STRUCT.
 */
SGN_API SgnResult sgn_system_desc_init(struct SgnSystemDesc *desc, size_t size);

/**
 * Adds a system over one or more bodies; its values are pushed with `sgn_system_push`, before the next step.
 *
 * Ownership: everything is copied. Thread: exclusive. Errors (the world is then as it was): NULL_ARGUMENT, BAD_STRUCT,
 * UNSUPPORTED_STRUCT, INVALID_ARGUMENT, INVALID_ID, STALE_ID, BUFFER_LAYOUT, OUT_OF_MEMORY, BUSY, POISONED, PANIC.
 */
SGN_API
SgnResult sgn_system_create(struct SgnWorld *world,
                            const struct SgnSystemDesc *desc,
                            struct SgnSystemId *out);

/**
 * Sets the values of a system: one 3x3 block per entry of its columns. They stay until the next push.
 *
 * Symmetry is checked: the two blocks of a pair may differ by 1e-10 (doubles) or 1e-5 (floats) of the larger diagonal
 * entry, and their mean is used.
 * Ownership: copied. Thread: exclusive. Errors (the old values then stay): NULL_ARGUMENT, INVALID_ID, STALE_ID,
 * INVALID_ARGUMENT, BUFFER_LAYOUT, NON_FINITE_INPUT, SINGULAR_SYSTEM, OUT_OF_MEMORY, BUSY, POISONED, PANIC.
 */
SGN_API
SgnResult sgn_system_push(struct SgnWorld *world,
                          struct SgnSystemId system,
                          const struct SgnView *blocks);

/**
 * Removes a system; its bodies have their lumped masses from then on.
 *
 * Thread: exclusive. Errors: NULL_ARGUMENT, INVALID_ID, STALE_ID, BUSY, POISONED, PANIC.
 */
SGN_API SgnResult sgn_system_destroy(struct SgnWorld *world, struct SgnSystemId system);

/**
 * Fills `desc` with defaults; `size` is `sizeof(SgnStepDesc)`.
 *
 * Thread: any. Errors: NULL_ARGUMENT, BAD_STRUCT.
 */
SGN_API SgnResult sgn_step_desc_init(struct SgnStepDesc *desc, size_t size);

/**
 * Fills `report` with zeros and its size; `size` is `sizeof(SgnStepReport)`.
 *
 * Thread: any. Errors: NULL_ARGUMENT, BAD_STRUCT.
 */
SGN_API SgnResult sgn_step_report_init(struct SgnStepReport *report, size_t size);

/**
 * Advances all bodies by `desc->dt` with what has been pushed. `report` may be NULL.
 *
 * Afterwards the end state is the start state of the next step, pushed displacement velocities and system values stay,
 * targets are used up.
 * Thread: exclusive; log callbacks come on this thread. Notes (the gravest is returned, all are in the report):
 * TANGLED_PAIRS, FAIL_SAFE_USED, NOT_CONVERGED, SUBDIVIDED. Errors (the world is then as it was, PINCHED excepted):
 * NULL_ARGUMENT, BAD_STRUCT, UNSUPPORTED_STRUCT, INVALID_ARGUMENT, NON_FINITE_INPUT, UNSUPPORTED, INTERSECTING_START,
 * PINCHED, SINGULAR_SYSTEM, OUT_OF_MEMORY, CANCELLED, BUSY, POISONED, PANIC.
 */
SGN_API
SgnResult sgn_world_step(struct SgnWorld *world,
                         const struct SgnStepDesc *desc,
                         struct SgnStepReport *report);

/**
 * Cancels the step that is running in the world: it returns CANCELLED before its next phase, and the world is as it was
 * before it. Without a running step it does nothing.
 *
 * Thread: any, also while the world is at work, and in its callbacks. Errors: NULL_ARGUMENT.
 */
SGN_API
SgnResult sgn_world_cancel(struct SgnWorld *world);

/**
 * Pulls an attribute of the contacts of the last step. With `view` NULL only their number is written, for the caller to
 * allocate; with a view that is too small the first ones are written, with the note TRUNCATED; elements beyond the last
 * contact are left as they are. `count` (may be NULL with a view) takes the number of contacts.
 *
 * Thread: concurrent; the view's memory is exclusive. Errors (nothing is then written): NULL_ARGUMENT,
 * INVALID_ARGUMENT, BUFFER_LAYOUT, BUSY, POISONED, PANIC.
 */
SGN_API
SgnResult sgn_world_pull_contacts(const struct SgnWorld *world,
                                  SgnContactAttribute attribute,
                                  const struct SgnViewMut *view,
                                  uint64_t *count);

/**
 * Fills `report` with zeros and its size; `size` is `sizeof(SgnCheckReport)`.
 *
 * Thread: any. Errors: NULL_ARGUMENT, BAD_STRUCT.
 */
SGN_API SgnResult sgn_check_report_init(struct SgnCheckReport *report, size_t size);

/**
 * Looks for intersections of the present state (pushed starts included) by exact predicates; usable without any step.
 * Groups and masks count. Witnesses can be pulled until the next check or step.
 *
 * Thread: exclusive. Errors: NULL_ARGUMENT, BAD_STRUCT, UNSUPPORTED_STRUCT, INVALID_ARGUMENT, BUSY, POISONED, PANIC.
 */
SGN_API
SgnResult sgn_world_check(struct SgnWorld *world,
                          struct SgnCheckReport *report);

/**
 * Pulls an attribute of the witnesses of the last check, or of the last step that was refused or pinched; `view` and
 * `count` as in sgn_world_pull_contacts.
 *
 * Thread: concurrent; the view's memory is exclusive. Errors (nothing is then written): NULL_ARGUMENT,
 * INVALID_ARGUMENT, BUFFER_LAYOUT, BUSY, POISONED, PANIC.
 */
SGN_API
SgnResult sgn_world_pull_witnesses(const struct SgnWorld *world,
                                   SgnWitnessAttribute attribute,
                                   const struct SgnViewMut *view,
                                   uint64_t *count);

/**
 * Bytes that a snapshot of the world's present state takes.
 *
 * Thread: concurrent. Errors: NULL_ARGUMENT, BUSY, POISONED, PANIC.
 */
SGN_API SgnResult sgn_world_snapshot_size(const struct SgnWorld *world, uint64_t *out);

/**
 * Saves everything that the next steps depend on - bodies, materials, systems, filters, what was pushed, what the method
 * remembers - into `buffer`, and the bytes written into `written` (may be NULL). The bytes depend on no machine.
 *
 * Thread: concurrent. Errors: NULL_ARGUMENT, BUFFER_LAYOUT (a `capacity` below `sgn_world_snapshot_size`; nothing is
 * written, the value at fault is that size), BUSY, POISONED, PANIC.
 */
SGN_API
SgnResult sgn_world_snapshot_save(const struct SgnWorld *world,
                                  void *buffer,
                                  uint64_t capacity,
                                  uint64_t *written);

/**
 * Makes the world what it was when the snapshot was saved, by this or another world of this or another process. Ids that
 * were valid then are valid again (another world that was built by the same calls keeps its own ids), ids given out since
 * are stale. The same calls from there on give the same bits on one build of the library. Works on a poisoned
 * world, which is sound afterwards. The bytes may come from anywhere: nothing in them is trusted.
 *
 * Thread: exclusive. Errors (the world is then as it was): NULL_ARGUMENT, SNAPSHOT_MISMATCH (the index at fault is the
 * byte), OUT_OF_MEMORY, BUSY, PANIC.
 */
SGN_API
SgnResult sgn_world_snapshot_load(struct SgnWorld *world,
                                  const void *buffer,
                                  uint64_t size);

/**
 * Fills `desc` with defaults; `size` is `sizeof(SgnFilterDesc)`.
 *
 * Thread: any. Errors: NULL_ARGUMENT, BAD_STRUCT.
 */
SGN_API SgnResult sgn_filter_desc_init(struct SgnFilterDesc *desc, size_t size);

/**
 * Creates the filter of a mesh, for any simulation: it needs no world.
 *
 * Ownership: the caller destroys `*out` with `sgn_filter_destroy`; the filter keeps what it needs of the context.
 * Thread: concurrent. Errors: NULL_ARGUMENT, BAD_STRUCT, UNSUPPORTED_STRUCT, INVALID_ARGUMENT, NON_FINITE_INPUT,
 * BAD_TOPOLOGY, BUFFER_LAYOUT, OUT_OF_MEMORY, PANIC.
 */
SGN_API
SgnResult sgn_filter_create(struct SgnContext *context,
                            const struct SgnFilterDesc *desc,
                            struct SgnFilter **out);

/**
 * Destroys a filter; NULL is allowed.
 *
 * Thread: exclusive. Errors: BUSY while another call is in the filter (it then lives on).
 */
SGN_API SgnResult sgn_filter_destroy(struct SgnFilter *filter);

/**
 * Filters a motion: positions at the end without any collision, and their mean velocities. What collides with nothing
 * arrives at `x1`, to rounding. The start is checked first, unless it is where the last call ended; `desc` is that of a
 * step, of which `method`, `solver` and what belongs to the implicit method are not read. With `SGN_STEP_CERTIFY` the
 * end is certified by exact predicates. PINCHED carries a state, too: the outputs are then written.
 *
 * `x0`, `x1`: F32X3 or F64X3, one per vertex. `positions`, `velocities` (NULL: not wanted) take as many; velocities are
 * `(positions - start)/dt`. Positions in F32X3 need the precision F32. `report` may be NULL.
 *
 * Thread: exclusive. Notes: TANGLED_PAIRS, FAIL_SAFE_USED. Errors (nothing is written and the state stays, PINCHED
 * excepted): NULL_ARGUMENT, BAD_STRUCT, UNSUPPORTED_STRUCT, INVALID_ARGUMENT, NON_FINITE_INPUT, BUFFER_LAYOUT,
 * INTERSECTING_START, PINCHED, OUT_OF_MEMORY, CANCELLED, BUSY, POISONED, PANIC.
 */
SGN_API
SgnResult sgn_filter_run(struct SgnFilter *filter,
                         SgnFilterMode mode,
                         const struct SgnView *x0,
                         const struct SgnView *x1,
                         const struct SgnStepDesc *desc,
                         const struct SgnViewMut *positions,
                         const struct SgnViewMut *velocities,
                         struct SgnStepReport *report);

/**
 * Forgets where the last call ended: the next one starts a trajectory of its own. The search tree stays.
 *
 * Thread: exclusive. Errors: NULL_ARGUMENT, BUSY, POISONED, PANIC.
 */
SGN_API SgnResult sgn_filter_restart(struct SgnFilter *filter);

/**
 * Pulls an attribute of the witnesses of the last call, if it was refused or pinched: SGN_WITNESS_BODIES (here groups),
 * SGN_WITNESS_KIND, SGN_WITNESS_POINT, SGN_WITNESS_FIRST_VERTICES, SGN_WITNESS_SECOND_VERTICES. `view` and `count` as in
 * sgn_world_pull_contacts.
 *
 * Thread: exclusive; so is the view's memory. Errors (nothing is then written): NULL_ARGUMENT, INVALID_ARGUMENT,
 * BUFFER_LAYOUT, BUSY, POISONED, PANIC.
 */
SGN_API
SgnResult sgn_filter_pull_witnesses(struct SgnFilter *filter,
                                    SgnWitnessAttribute attribute,
                                    const struct SgnViewMut *view,
                                    uint64_t *count);

/**
 * Fills `api` with zeros and its size; `size` is `sizeof(SgnApi)`.
 *
 * Thread: any. Errors: NULL_ARGUMENT, BAD_STRUCT.
 */
SGN_API SgnResult sgn_api_init(struct SgnApi *api, size_t size);

/**
 * Fills the table. `api->struct_size` says how much of it the caller knows; `sgn_api_init` need not be called if the
 * caller sets it to `sizeof(SgnApi)`. Pass `SGN_ABI_VERSION` as `abi`.
 *
 * Thread: any. Errors: ABI_MISMATCH, NULL_ARGUMENT, BAD_STRUCT.
 */
SGN_API
SgnResult sgn_get_api(uint32_t abi,
                      struct SgnApi *api);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

/* Views of packed memory, for short. */
static inline SgnView sgn_view(SgnFormat format, const void *ptr, uint64_t count) {
  SgnView view = {SGN_FORMAT_NONE, 0, NULL, 0, 0, 0};
  view.format = format;
  view.ptr = ptr;
  view.count = count;
  return view;
}
static inline SgnViewMut sgn_view_mut(SgnFormat format, void *ptr, uint64_t count) {
  SgnViewMut view = {SGN_FORMAT_NONE, 0, NULL, 0, 0, 0};
  view.format = format;
  view.ptr = ptr;
  view.count = count;
  return view;
}

#endif  /* SIGNORINI_H */
