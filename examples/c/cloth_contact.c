#include "cloth_contact.h"

#include <stdio.h>
#include <stdlib.h>

void cloth_contact_create(ClothContact *contact, SignoriniHost *host, HostCloth *cloth, ClothMetric metric,
                          double half_thickness)
{
    const uint64_t n = cloth->vertex_count;
    SgnDeformableDesc desc;
    SgnSystemDesc pattern;

    contact->host = host;
    contact->cloth = cloth;
    contact->metric = metric;
    contact->impulses = calloc(3 * n, sizeof *contact->impulses);
    if (!contact->impulses) {
        fprintf(stderr, "memory is short\n");
        exit(1);
    }
    sgn_deformable_desc_init(&desc, sizeof desc);
    desc.options.material = host->material;
    desc.options.half_thickness = half_thickness;
    desc.mesh.vertices = signorini_view(SGN_FORMAT_F64X3, cloth->positions, n);
    desc.mesh.triangles = signorini_view(SGN_FORMAT_U32X3, cloth->triangles, cloth->triangle_count);
    desc.masses = signorini_view(SGN_FORMAT_F64, cloth->masses, n);
    desc.pinned = signorini_view(SGN_FORMAT_U8, cloth->pinned, n);
    signorini_host_expect(host, sgn_deformable_create(host->world, &desc, &contact->body), "the cloth");
    if (metric == CLOTH_LUMPED)
        return;

    sgn_system_desc_init(&pattern, sizeof pattern);
    pattern.bodies = &contact->body;
    pattern.body_count = 1;
    pattern.row_offsets = signorini_view(SGN_FORMAT_U64, cloth->row_offsets, n + 1);
    pattern.columns = signorini_view(SGN_FORMAT_U32, cloth->columns, cloth->block_count);
    signorini_host_expect(host, sgn_system_create(host->world, &pattern, &contact->system), "the pattern of A");
}

void cloth_contact_destroy(ClothContact *contact)
{
    free(contact->impulses);
    contact->impulses = NULL;
}

void cloth_contact_push_pins(ClothContact *contact)
{
    SgnView pinned = signorini_view(SGN_FORMAT_U8, contact->cloth->pinned, contact->cloth->vertex_count);
    SgnResult result = sgn_body_push(contact->host->world, contact->body, SGN_SLOT_PINNED, &pinned, 0);
    signorini_host_expect(contact->host, result, "pins");
}

void cloth_contact_push(ClothContact *contact)
{
    const HostCloth *cloth = contact->cloth;
    SgnWorld *world = contact->host->world;
    SgnView view = signorini_view(SGN_FORMAT_F64X3, cloth->free_velocity, cloth->vertex_count);
    SgnResult result = sgn_body_push(world, contact->body, SGN_SLOT_VELOCITY, &view, 0);
    signorini_host_expect(contact->host, result, "v* of the cloth");
    if (contact->metric == CLOTH_LUMPED)
        return;
    view = signorini_view(SGN_FORMAT_F64_3X3_ROWS, cloth->blocks, cloth->block_count);
    signorini_host_expect(contact->host, sgn_system_push(world, contact->system, &view), "the values of A");
}

static void pull(ClothContact *contact, SgnSlot slot, double *array)
{
    SgnViewMut view = signorini_view_mut(SGN_FORMAT_F64X3, array, contact->cloth->vertex_count);
    SgnResult result = sgn_body_pull(contact->host->world, contact->body, slot, &view);
    signorini_host_expect(contact->host, result, "the end state of the cloth");
}

void cloth_contact_pull(ClothContact *contact)
{
    pull(contact, SGN_SLOT_POSITION, contact->cloth->positions);
    pull(contact, SGN_SLOT_END_VELOCITY, contact->cloth->velocities);
    pull(contact, SGN_SLOT_IMPULSE, contact->impulses);
}

void cloth_contact_impulse(const ClothContact *contact, double sum[3])
{
    uint32_t i;

    sum[0] = sum[1] = sum[2] = 0.0;
    for (i = 0; i < 3 * contact->cloth->vertex_count; i++)
        sum[i % 3] += contact->impulses[i];
}
