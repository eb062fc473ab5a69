/* The host's cloth in Signorini: HOST drive. The cloth solver finds v*; this hands it over, with A if wanted, and takes
 * the end state back. */
#ifndef CLOTH_CONTACT_H
#define CLOTH_CONTACT_H

#include "host_cloth.h"
#include "signorini_host.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum ClothMetric {
    CLOTH_LUMPED, /* contacts see the masses alone: cheap, impulses stay where they act */
    CLOTH_MATRIX  /* contacts see A: the whole cloth answers within the step, as implicit dynamics do */
} ClothMetric;

typedef struct ClothContact {
    SignoriniHost *host;
    HostCloth *cloth;
    ClothMetric metric;
    SgnBodyId body;
    SgnSystemId system;
    double *impulses; /* of the last step, 3 per vertex [N s] */
} ClothContact;

/* Adds the cloth as it is, pins included. Negative half thickness: a tenth of the mean edge length. */
void cloth_contact_create(ClothContact *contact, SignoriniHost *host, HostCloth *cloth, ClothMetric metric,
                          double half_thickness);
void cloth_contact_destroy(ClothContact *contact);

/* After pins were set or released. */
void cloth_contact_push_pins(ClothContact *contact);

/* After host_cloth_predict: v*, and the values of A. */
void cloth_contact_push(ClothContact *contact);

/* After the step: positions, velocities for the next step's dynamics, impulses. */
void cloth_contact_pull(ClothContact *contact);

/* Sum of the impulses that contacts gave the cloth in the last step [N s]. */
void cloth_contact_impulse(const ClothContact *contact, double sum[3]);

#ifdef __cplusplus
}
#endif

#endif
