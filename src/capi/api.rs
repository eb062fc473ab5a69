//! The table of all functions, for hosts that load the library themselves.

use super::boundary::call;
use super::status::{Failure, SGN_ERROR_ABI_MISMATCH, SGN_OK};
use super::structs::{self, Growing};
use super::version::SGN_ABI_VERSION;
use super::{
    SgnBodyId, SgnBodyInfo, SgnCapability, SgnCheckReport, SgnContactAttribute, SgnContext, SgnContextDesc,
    SgnDeformableDesc, SgnErrorInfo, SgnFilter, SgnFilterDesc, SgnFilterMode, SgnHalfSpaceDesc, SgnKinematicDesc,
    SgnMaterialDesc, SgnMaterialId, SgnResult, SgnRigidDesc, SgnShapeDesc, SgnSheetDesc, SgnSlot, SgnSolidDesc,
    SgnStepDesc, SgnStepReport, SgnSystemDesc, SgnSystemId, SgnVersion, SgnView, SgnViewMut, SgnWitnessAttribute,
    SgnWorld, SgnWorldDesc,
};
use std::ffi::{c_char, c_void};

/// Every function of this header, in one table: a host that loads the library itself needs one symbol, `sgn_get_api`.
/// Fill with `sgn_api_init`. Functions keep their places; new ones are added at the end.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SgnApi {
    /// Set by the init function.
    pub struct_size: u32,
    /// 0.
    pub reserved: u32,
    /// See `sgn_version_init`.
    pub version_init: Option<unsafe extern "C" fn(version: *mut SgnVersion, size: usize) -> SgnResult>,
    /// See `sgn_version`.
    pub version: Option<unsafe extern "C" fn(version: *mut SgnVersion) -> SgnResult>,
    /// See `sgn_query`.
    pub query: Option<unsafe extern "C" fn(capability: SgnCapability, out: *mut i64) -> SgnResult>,
    /// See `sgn_result_name`.
    pub result_name: Option<unsafe extern "C" fn(code: SgnResult, out: *mut *const c_char) -> SgnResult>,
    /// See `sgn_context_desc_init`.
    pub context_desc_init: Option<unsafe extern "C" fn(desc: *mut SgnContextDesc, size: usize) -> SgnResult>,
    /// See `sgn_error_info_init`.
    pub error_info_init: Option<unsafe extern "C" fn(info: *mut SgnErrorInfo, size: usize) -> SgnResult>,
    /// See `sgn_context_create`.
    pub context_create: Option<
        unsafe extern "C" fn(
            abi: u32,
            desc: *const SgnContextDesc,
            message: *mut c_char,
            message_capacity: usize,
            out: *mut *mut SgnContext,
        ) -> SgnResult,
    >,
    /// See `sgn_context_destroy`.
    pub context_destroy: Option<unsafe extern "C" fn(context: *mut SgnContext) -> SgnResult>,
    /// See `sgn_context_last_error`.
    pub context_last_error:
        Option<unsafe extern "C" fn(context: *const SgnContext, info: *mut SgnErrorInfo) -> SgnResult>,
    /// See `sgn_world_desc_init`.
    pub world_desc_init: Option<unsafe extern "C" fn(desc: *mut SgnWorldDesc, size: usize) -> SgnResult>,
    /// See `sgn_world_create`.
    pub world_create: Option<
        unsafe extern "C" fn(context: *mut SgnContext, desc: *const SgnWorldDesc, out: *mut *mut SgnWorld) -> SgnResult,
    >,
    /// See `sgn_world_destroy`.
    pub world_destroy: Option<unsafe extern "C" fn(world: *mut SgnWorld) -> SgnResult>,
    /// See `sgn_world_state_hash`.
    pub world_state_hash: Option<unsafe extern "C" fn(world: *const SgnWorld, out: *mut u64) -> SgnResult>,
    /// See `sgn_material_desc_init`.
    pub material_desc_init: Option<unsafe extern "C" fn(desc: *mut SgnMaterialDesc, size: usize) -> SgnResult>,
    /// See `sgn_material_create`.
    pub material_create: Option<
        unsafe extern "C" fn(world: *mut SgnWorld, desc: *const SgnMaterialDesc, out: *mut SgnMaterialId) -> SgnResult,
    >,
    /// See `sgn_material_set`.
    pub material_set: Option<
        unsafe extern "C" fn(world: *mut SgnWorld, material: SgnMaterialId, desc: *const SgnMaterialDesc) -> SgnResult,
    >,
    /// See `sgn_material_set_pair`.
    pub material_set_pair: Option<
        unsafe extern "C" fn(world: *mut SgnWorld, a: SgnMaterialId, b: SgnMaterialId, friction: f64) -> SgnResult,
    >,
    /// See `sgn_shape_desc_init`.
    pub shape_desc_init: Option<unsafe extern "C" fn(desc: *mut SgnShapeDesc, size: usize) -> SgnResult>,
    /// See `sgn_deformable_desc_init`.
    pub deformable_desc_init: Option<unsafe extern "C" fn(desc: *mut SgnDeformableDesc, size: usize) -> SgnResult>,
    /// See `sgn_rigid_desc_init`.
    pub rigid_desc_init: Option<unsafe extern "C" fn(desc: *mut SgnRigidDesc, size: usize) -> SgnResult>,
    /// See `sgn_kinematic_desc_init`.
    pub kinematic_desc_init: Option<unsafe extern "C" fn(desc: *mut SgnKinematicDesc, size: usize) -> SgnResult>,
    /// See `sgn_half_space_desc_init`.
    pub half_space_desc_init: Option<unsafe extern "C" fn(desc: *mut SgnHalfSpaceDesc, size: usize) -> SgnResult>,
    /// See `sgn_body_info_init`.
    pub body_info_init: Option<unsafe extern "C" fn(info: *mut SgnBodyInfo, size: usize) -> SgnResult>,
    /// See `sgn_deformable_create`.
    pub deformable_create: Option<
        unsafe extern "C" fn(world: *mut SgnWorld, desc: *const SgnDeformableDesc, out: *mut SgnBodyId) -> SgnResult,
    >,
    /// See `sgn_rigid_create`.
    pub rigid_create:
        Option<unsafe extern "C" fn(world: *mut SgnWorld, desc: *const SgnRigidDesc, out: *mut SgnBodyId) -> SgnResult>,
    /// See `sgn_kinematic_create`.
    pub kinematic_create: Option<
        unsafe extern "C" fn(world: *mut SgnWorld, desc: *const SgnKinematicDesc, out: *mut SgnBodyId) -> SgnResult,
    >,
    /// See `sgn_half_space_create`.
    pub half_space_create: Option<
        unsafe extern "C" fn(world: *mut SgnWorld, desc: *const SgnHalfSpaceDesc, out: *mut SgnBodyId) -> SgnResult,
    >,
    /// See `sgn_body_destroy`.
    pub body_destroy: Option<unsafe extern "C" fn(world: *mut SgnWorld, body: SgnBodyId) -> SgnResult>,
    /// See `sgn_body_set_filter`.
    pub body_set_filter:
        Option<unsafe extern "C" fn(world: *mut SgnWorld, body: SgnBodyId, groups: u64, mask: u64) -> SgnResult>,
    /// See `sgn_body_set_material`.
    pub body_set_material:
        Option<unsafe extern "C" fn(world: *mut SgnWorld, body: SgnBodyId, material: SgnMaterialId) -> SgnResult>,
    /// See `sgn_body_info`.
    pub body_info:
        Option<unsafe extern "C" fn(world: *const SgnWorld, body: SgnBodyId, info: *mut SgnBodyInfo) -> SgnResult>,
    /// See `sgn_body_push`.
    pub body_push: Option<
        unsafe extern "C" fn(
            world: *mut SgnWorld,
            body: SgnBodyId,
            slot: SgnSlot,
            view: *const SgnView,
            flags: u64,
        ) -> SgnResult,
    >,
    /// See `sgn_body_pull`.
    pub body_pull: Option<
        unsafe extern "C" fn(
            world: *const SgnWorld,
            body: SgnBodyId,
            slot: SgnSlot,
            view: *const SgnViewMut,
        ) -> SgnResult,
    >,
    /// See `sgn_system_desc_init`.
    pub system_desc_init: Option<unsafe extern "C" fn(desc: *mut SgnSystemDesc, size: usize) -> SgnResult>,
    /// See `sgn_system_create`.
    pub system_create: Option<
        unsafe extern "C" fn(world: *mut SgnWorld, desc: *const SgnSystemDesc, out: *mut SgnSystemId) -> SgnResult,
    >,
    /// See `sgn_system_push`.
    pub system_push:
        Option<unsafe extern "C" fn(world: *mut SgnWorld, system: SgnSystemId, blocks: *const SgnView) -> SgnResult>,
    /// See `sgn_system_destroy`.
    pub system_destroy: Option<unsafe extern "C" fn(world: *mut SgnWorld, system: SgnSystemId) -> SgnResult>,
    /// See `sgn_step_desc_init`.
    pub step_desc_init: Option<unsafe extern "C" fn(desc: *mut SgnStepDesc, size: usize) -> SgnResult>,
    /// See `sgn_step_report_init`.
    pub step_report_init: Option<unsafe extern "C" fn(report: *mut SgnStepReport, size: usize) -> SgnResult>,
    /// See `sgn_world_step`.
    pub world_step: Option<
        unsafe extern "C" fn(world: *mut SgnWorld, desc: *const SgnStepDesc, report: *mut SgnStepReport) -> SgnResult,
    >,
    /// See `sgn_world_pull_contacts`.
    pub world_pull_contacts: Option<
        unsafe extern "C" fn(
            world: *const SgnWorld,
            attribute: SgnContactAttribute,
            view: *const SgnViewMut,
            count: *mut u64,
        ) -> SgnResult,
    >,
    /// See `sgn_check_report_init`.
    pub check_report_init: Option<unsafe extern "C" fn(report: *mut SgnCheckReport, size: usize) -> SgnResult>,
    /// See `sgn_world_check`.
    pub world_check: Option<unsafe extern "C" fn(world: *mut SgnWorld, report: *mut SgnCheckReport) -> SgnResult>,
    /// See `sgn_world_pull_witnesses`.
    pub world_pull_witnesses: Option<
        unsafe extern "C" fn(
            world: *const SgnWorld,
            attribute: SgnWitnessAttribute,
            view: *const SgnViewMut,
            count: *mut u64,
        ) -> SgnResult,
    >,
    /// See `sgn_world_snapshot_size`.
    pub world_snapshot_size: Option<unsafe extern "C" fn(world: *const SgnWorld, out: *mut u64) -> SgnResult>,
    /// See `sgn_world_snapshot_save`.
    pub world_snapshot_save: Option<
        unsafe extern "C" fn(
            world: *const SgnWorld,
            buffer: *mut c_void,
            capacity: u64,
            written: *mut u64,
        ) -> SgnResult,
    >,
    /// See `sgn_world_cancel`.
    pub world_cancel: Option<unsafe extern "C" fn(world: *mut SgnWorld) -> SgnResult>,
    /// See `sgn_world_snapshot_load`.
    pub world_snapshot_load:
        Option<unsafe extern "C" fn(world: *mut SgnWorld, buffer: *const c_void, size: u64) -> SgnResult>,
    /// See `sgn_sheet_desc_init`.
    pub sheet_desc_init: Option<unsafe extern "C" fn(desc: *mut SgnSheetDesc, size: usize) -> SgnResult>,
    /// See `sgn_solid_desc_init`.
    pub solid_desc_init: Option<unsafe extern "C" fn(desc: *mut SgnSolidDesc, size: usize) -> SgnResult>,
    /// See `sgn_sheet_create`.
    pub sheet_create:
        Option<unsafe extern "C" fn(world: *mut SgnWorld, desc: *const SgnSheetDesc, out: *mut SgnBodyId) -> SgnResult>,
    /// See `sgn_solid_create`.
    pub solid_create:
        Option<unsafe extern "C" fn(world: *mut SgnWorld, desc: *const SgnSolidDesc, out: *mut SgnBodyId) -> SgnResult>,
    /// See `sgn_world_set_gravity`.
    pub world_set_gravity: Option<unsafe extern "C" fn(world: *mut SgnWorld, gravity: *const f64) -> SgnResult>,
    /// See `sgn_world_set_wind`.
    pub world_set_wind: Option<unsafe extern "C" fn(world: *mut SgnWorld, wind: *const f64) -> SgnResult>,
    /// See `sgn_filter_desc_init`.
    pub filter_desc_init: Option<unsafe extern "C" fn(desc: *mut SgnFilterDesc, size: usize) -> SgnResult>,
    /// See `sgn_filter_create`.
    pub filter_create: Option<
        unsafe extern "C" fn(
            context: *mut SgnContext,
            desc: *const SgnFilterDesc,
            out: *mut *mut SgnFilter,
        ) -> SgnResult,
    >,
    /// See `sgn_filter_destroy`.
    pub filter_destroy: Option<unsafe extern "C" fn(filter: *mut SgnFilter) -> SgnResult>,
    /// See `sgn_filter_run`.
    pub filter_run: Option<
        unsafe extern "C" fn(
            filter: *mut SgnFilter,
            mode: SgnFilterMode,
            x0: *const SgnView,
            x1: *const SgnView,
            desc: *const SgnStepDesc,
            positions: *const SgnViewMut,
            velocities: *const SgnViewMut,
            report: *mut SgnStepReport,
        ) -> SgnResult,
    >,
    /// See `sgn_filter_restart`.
    pub filter_restart: Option<unsafe extern "C" fn(filter: *mut SgnFilter) -> SgnResult>,
    /// See `sgn_filter_pull_witnesses`.
    pub filter_pull_witnesses: Option<
        unsafe extern "C" fn(
            filter: *mut SgnFilter,
            attribute: SgnWitnessAttribute,
            view: *const SgnViewMut,
            count: *mut u64,
        ) -> SgnResult,
    >,
}

// SAFETY: repr(C) without padding; numbers and nullable function pointers.
unsafe impl Growing for SgnApi {
    const NAME: &'static str = "SgnApi";
    const FIRST_SIZE: usize = 488;
    fn defaults() -> Self {
        // SAFETY: all zero is a valid table of no functions.
        unsafe { std::mem::zeroed() }
    }
}

/// Fills `api` with zeros and its size; `size` is `sizeof(SgnApi)`.
///
/// Thread: any. Errors: NULL_ARGUMENT, BAD_STRUCT.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_api_init(api: *mut SgnApi, size: usize) -> SgnResult {
    // SAFETY: the caller vouches for `size` bytes.
    call(|| unsafe { structs::init(api, size) })
}

/// Fills the table. `api->struct_size` says how much of it the caller knows; `sgn_api_init` need not be called if the
/// caller sets it to `sizeof(SgnApi)`. Pass `SGN_ABI_VERSION` as `abi`.
///
/// Thread: any. Errors: ABI_MISMATCH, NULL_ARGUMENT, BAD_STRUCT.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_get_api(abi: u32, api: *mut SgnApi) -> SgnResult {
    // SAFETY: the caller vouches for the pointer.
    call(|| unsafe {
        if abi != SGN_ABI_VERSION {
            return Err(Failure::new(SGN_ERROR_ABI_MISMATCH, "the header and the library do not belong together"));
        }
        let size = structs::checked_size(api)?;
        structs::write(api, size, &TABLE);
        Ok(SGN_OK)
    })
}

const TABLE: SgnApi = SgnApi {
    struct_size: 0,
    reserved: 0,
    version_init: Some(super::sgn_version_init),
    version: Some(super::sgn_version),
    query: Some(super::sgn_query),
    result_name: Some(super::sgn_result_name),
    context_desc_init: Some(super::sgn_context_desc_init),
    error_info_init: Some(super::sgn_error_info_init),
    context_create: Some(super::sgn_context_create),
    context_destroy: Some(super::sgn_context_destroy),
    context_last_error: Some(super::sgn_context_last_error),
    world_desc_init: Some(super::sgn_world_desc_init),
    world_create: Some(super::sgn_world_create),
    world_destroy: Some(super::sgn_world_destroy),
    world_state_hash: Some(super::sgn_world_state_hash),
    material_desc_init: Some(super::sgn_material_desc_init),
    material_create: Some(super::sgn_material_create),
    material_set: Some(super::sgn_material_set),
    material_set_pair: Some(super::sgn_material_set_pair),
    shape_desc_init: Some(super::sgn_shape_desc_init),
    deformable_desc_init: Some(super::sgn_deformable_desc_init),
    rigid_desc_init: Some(super::sgn_rigid_desc_init),
    kinematic_desc_init: Some(super::sgn_kinematic_desc_init),
    half_space_desc_init: Some(super::sgn_half_space_desc_init),
    body_info_init: Some(super::sgn_body_info_init),
    deformable_create: Some(super::sgn_deformable_create),
    rigid_create: Some(super::sgn_rigid_create),
    kinematic_create: Some(super::sgn_kinematic_create),
    half_space_create: Some(super::sgn_half_space_create),
    body_destroy: Some(super::sgn_body_destroy),
    body_set_filter: Some(super::sgn_body_set_filter),
    body_set_material: Some(super::sgn_body_set_material),
    body_info: Some(super::sgn_body_info),
    body_push: Some(super::sgn_body_push),
    body_pull: Some(super::sgn_body_pull),
    system_desc_init: Some(super::sgn_system_desc_init),
    system_create: Some(super::sgn_system_create),
    system_push: Some(super::sgn_system_push),
    system_destroy: Some(super::sgn_system_destroy),
    step_desc_init: Some(super::sgn_step_desc_init),
    step_report_init: Some(super::sgn_step_report_init),
    world_step: Some(super::sgn_world_step),
    world_pull_contacts: Some(super::sgn_world_pull_contacts),
    check_report_init: Some(super::sgn_check_report_init),
    world_check: Some(super::sgn_world_check),
    world_pull_witnesses: Some(super::sgn_world_pull_witnesses),
    world_snapshot_size: Some(super::sgn_world_snapshot_size),
    world_snapshot_save: Some(super::sgn_world_snapshot_save),
    world_cancel: Some(super::sgn_world_cancel),
    world_snapshot_load: Some(super::sgn_world_snapshot_load),
    sheet_desc_init: Some(super::sgn_sheet_desc_init),
    solid_desc_init: Some(super::sgn_solid_desc_init),
    sheet_create: Some(super::sgn_sheet_create),
    solid_create: Some(super::sgn_solid_create),
    world_set_gravity: Some(super::sgn_world_set_gravity),
    world_set_wind: Some(super::sgn_world_set_wind),
    filter_desc_init: Some(super::sgn_filter_desc_init),
    filter_create: Some(super::sgn_filter_create),
    filter_destroy: Some(super::sgn_filter_destroy),
    filter_run: Some(super::sgn_filter_run),
    filter_restart: Some(super::sgn_filter_restart),
    filter_pull_witnesses: Some(super::sgn_filter_pull_witnesses),
};
