#include "signorini_host.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void signorini_host_expect(const SignoriniHost *host, SgnResult result, const char *what)
{
    char message[512] = "";
    SgnErrorInfo info;

    if (result >= 0)
        return;
    sgn_error_info_init(&info, sizeof info);
    info.message = message;
    info.message_capacity = sizeof message;
    if (host->context)
        sgn_context_last_error(host->context, &info);
    fprintf(stderr, "%s: result %d: %s (index %llu, value %g)\n", what, (int)result, message,
            (unsigned long long)info.index, info.value);
    exit(1);
}

SgnView signorini_view(SgnFormat format, const void *array, uint64_t count)
{
    SgnView view;
    memset(&view, 0, sizeof view);
    view.format = format;
    view.ptr = array;
    view.count = count;
    return view;
}

SgnViewMut signorini_view_mut(SgnFormat format, void *array, uint64_t count)
{
    SgnViewMut view;
    memset(&view, 0, sizeof view);
    view.format = format;
    view.ptr = array;
    view.count = count;
    return view;
}

void signorini_host_create(SignoriniHost *host, double friction, uint32_t workers)
{
    SgnContextDesc desc;
    SgnMaterialDesc material;
    char message[512] = "";

    memset(host, 0, sizeof *host);
    sgn_context_desc_init(&desc, sizeof desc);
    if (workers) {
        desc.executor = SGN_EXECUTOR_POOL;
        desc.workers = workers;
    }
    if (sgn_context_create(SGN_ABI_VERSION, &desc, message, sizeof message, &host->context) < 0) {
        fprintf(stderr, "no context: %s\n", message);
        exit(1);
    }
    signorini_host_expect(host, sgn_world_create(host->context, NULL, &host->world), "the world");
    sgn_material_desc_init(&material, sizeof material);
    material.friction = friction;
    signorini_host_expect(host, sgn_material_create(host->world, &material, &host->material), "the material");
}

void signorini_host_destroy(SignoriniHost *host)
{
    sgn_world_destroy(host->world);
    sgn_context_destroy(host->context);
    host->world = NULL;
    host->context = NULL;
}

SgnBodyId signorini_host_add_rigid(SignoriniHost *host, SgnRigidDesc *desc)
{
    SgnBodyId id;
    desc->options.material = host->material;
    signorini_host_expect(host, sgn_rigid_create(host->world, desc, &id), "the rigid body");
    return id;
}

void signorini_host_push_velocity(SignoriniHost *host, SgnBodyId body, const double linear[3], const double angular[3])
{
    SgnView view = signorini_view(SGN_FORMAT_F64X3, linear, 1);
    signorini_host_expect(host, sgn_body_push(host->world, body, SGN_SLOT_VELOCITY, &view, 0), "v* of a body");
    view.ptr = angular;
    signorini_host_expect(host, sgn_body_push(host->world, body, SGN_SLOT_ANGULAR_VELOCITY, &view, 0), "its turning");
}

void signorini_host_pull_pose(const SignoriniHost *host, SgnBodyId body, double pose[7])
{
    SgnViewMut view = signorini_view_mut(SGN_FORMAT_F64X7, pose, 1);
    signorini_host_expect(host, sgn_body_pull(host->world, body, SGN_SLOT_POSE, &view), "the pose of a body");
}

void signorini_host_pull_vector(const SignoriniHost *host, SgnBodyId body, SgnSlot slot, double vector[3])
{
    SgnViewMut view = signorini_view_mut(SGN_FORMAT_F64X3, vector, 1);
    signorini_host_expect(host, sgn_body_pull(host->world, body, slot, &view), "a vector of a body");
}

void signorini_host_pull_end_velocity(const SignoriniHost *host, SgnBodyId body, double linear[3], double angular[3])
{
    signorini_host_pull_vector(host, body, SGN_SLOT_END_VELOCITY, linear);
    signorini_host_pull_vector(host, body, SGN_SLOT_END_ANGULAR_VELOCITY, angular);
}

SgnResult signorini_host_step(SignoriniHost *host, double dt)
{
    SgnStepDesc desc;
    SgnStepReport *report = &host->last;
    SgnCheckReport check;
    SgnResult result;
    int k;

    sgn_step_desc_init(&desc, sizeof desc);
    sgn_step_report_init(report, sizeof *report);
    sgn_check_report_init(&check, sizeof check);
    desc.dt = dt;
    desc.flags = SGN_STEP_CERTIFY;
    result = sgn_world_step(host->world, &desc, report);
    signorini_host_expect(host, result, "the step");
    signorini_host_expect(host, sgn_world_check(host->world, &check), "the check");

    host->steps++;
    host->contacts += report->contacts;
    if (report->contacts > host->most_contacts)
        host->most_contacts = report->contacts;
    host->rounds += report->rounds;
    if (report->rounds > host->most_rounds)
        host->most_rounds = report->rounds;
    host->iterations += report->iterations;
    host->divided_steps += (report->notes & SGN_STEP_SUBDIVIDED) != 0;
    host->fail_safe_steps += (report->notes & SGN_STEP_FAIL_SAFE_USED) != 0;
    host->unconverged_steps += (report->notes & SGN_STEP_NOT_CONVERGED) != 0;
    host->uncertified_steps += !report->certified;
    host->intersections += report->intersections + check.intersections;
    host->worst_complementarity = fmax(host->worst_complementarity, report->complementarity_residual);
    host->worst_friction = fmax(host->worst_friction, report->friction_residual);
    host->worst_dynamics = fmax(host->worst_dynamics, report->dynamics_residual);
    for (k = 0; k < 3; k++)
        host->momentum_taken[k] += report->momentum_taken[k];
    host->microseconds += report->total_microseconds;
    host->stage_microseconds[0] += report->search_microseconds;
    host->stage_microseconds[1] += report->rows_microseconds;
    host->stage_microseconds[2] += report->solve_microseconds;
    host->stage_microseconds[3] += report->detection_microseconds + report->fail_safe_microseconds;
    host->stage_microseconds[4] += report->certificate_microseconds;
    host->worst_microseconds = fmax(host->worst_microseconds, report->total_microseconds);
    return result;
}

void signorini_host_surface(const SignoriniHost *host, SgnBodyId body, HostMesh *mesh, double **positions,
                            uint32_t **triangles)
{
    SgnBodyInfo info;
    SgnViewMut view;

    sgn_body_info_init(&info, sizeof info);
    signorini_host_expect(host, sgn_body_info(host->world, body, &info), "a body");
    *positions = calloc(3 * info.vertices, sizeof **positions);
    *triangles = calloc(3 * info.triangles, sizeof **triangles);
    if (!*positions || !*triangles) {
        fprintf(stderr, "memory is short\n");
        exit(1);
    }
    view = signorini_view_mut(SGN_FORMAT_F64X3, *positions, info.vertices);
    signorini_host_expect(host, sgn_body_pull(host->world, body, SGN_SLOT_POSITION, &view), "its vertices");
    view = signorini_view_mut(SGN_FORMAT_U32X3, *triangles, info.triangles);
    signorini_host_expect(host, sgn_body_pull(host->world, body, SGN_SLOT_TRIANGLES, &view), "its triangles");
    mesh->positions = *positions;
    mesh->vertex_count = (uint32_t)info.vertices;
    mesh->triangles = *triangles;
    mesh->triangle_count = (uint32_t)info.triangles;
}

void signorini_host_add_totals(SignoriniHost *host, const SignoriniHost *other)
{
    int k;

    host->steps += other->steps;
    host->contacts += other->contacts;
    if (other->most_contacts > host->most_contacts)
        host->most_contacts = other->most_contacts;
    host->rounds += other->rounds;
    if (other->most_rounds > host->most_rounds)
        host->most_rounds = other->most_rounds;
    host->iterations += other->iterations;
    host->divided_steps += other->divided_steps;
    host->fail_safe_steps += other->fail_safe_steps;
    host->unconverged_steps += other->unconverged_steps;
    host->uncertified_steps += other->uncertified_steps;
    host->intersections += other->intersections;
    host->worst_complementarity = fmax(host->worst_complementarity, other->worst_complementarity);
    host->worst_friction = fmax(host->worst_friction, other->worst_friction);
    host->worst_dynamics = fmax(host->worst_dynamics, other->worst_dynamics);
    for (k = 0; k < 3; k++)
        host->momentum_taken[k] += other->momentum_taken[k];
    host->microseconds += other->microseconds;
    for (k = 0; k < 5; k++)
        host->stage_microseconds[k] += other->stage_microseconds[k];
    host->worst_microseconds = fmax(host->worst_microseconds, other->worst_microseconds);
}

void signorini_host_print_totals(const SignoriniHost *host)
{
    double steps = host->steps ? (double)host->steps : 1.0;

    printf("steps             %llu, all certified: %s, intersections = %llu\n", (unsigned long long)host->steps,
           host->uncertified_steps ? "no" : "yes", (unsigned long long)host->intersections);
    printf("contacts          %.1f a step, at most %llu\n", (double)host->contacts / steps,
           (unsigned long long)host->most_contacts);
    printf("rounds (CMR)      %.2f a step, at most %llu; %.1f solver iterations a step\n", (double)host->rounds / steps,
           (unsigned long long)host->most_rounds, (double)host->iterations / steps);
    printf("divided steps     %llu; fail-safes in %llu, work cap reached in %llu\n",
           (unsigned long long)host->divided_steps, (unsigned long long)host->fail_safe_steps,
           (unsigned long long)host->unconverged_steps);
    printf("worst residual    complementarity %.1e, friction %.1e, dynamics %.1e\n", host->worst_complementarity,
           host->worst_friction, host->worst_dynamics);
    printf("ms per step       %.2f mean, %.2f worst: search %.2f, rows %.2f, solve %.2f, detection %.2f, certificate %.2f\n",
           host->microseconds / steps / 1e3, host->worst_microseconds / 1e3, host->stage_microseconds[0] / steps / 1e3,
           host->stage_microseconds[1] / steps / 1e3, host->stage_microseconds[2] / steps / 1e3,
           host->stage_microseconds[3] / steps / 1e3, host->stage_microseconds[4] / steps / 1e3);
}
