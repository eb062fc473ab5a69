// A cloth held at its corners catches a box of Bullet's.
//
// The cloth is the host's own (host_cloth.h), the box is Bullet's: Bullet integrates it, knows nothing of what catches it,
// and takes its end state from Signorini. Asserted for every run: all frames certified, the box above the cloth, at rest
// at the end, and the impulses that the contacts gave it adding up to its weight times the time.
//
//   bullet_cloth_catches_box [RUNS [SEED]] [--frames FOLDER]
#include "bullet_contact.hpp"
#include "cloth_contact.h"
#include "example_run.h"

#include <cmath>
#include <cstdio>

namespace {

const double DT = 0.01, GRAVITY = 9.81, BOX_MASS = 1.5;
const int STEPS = 380, LAST = 100; // the last second is measured
const btVector3 HALF_EXTENTS(0.14, 0.1, 0.12);

HostCloth *make_cloth(std::uint64_t &random)
{
    HostClothSettings s = {};
    s.columns = s.rows = 17;
    s.origin[0] = s.origin[2] = -0.6;
    s.along[0] = s.across[2] = 1.2;
    s.mass = 0.25;
    s.stretch_stiffness = 1200.0;
    s.shear_stiffness = 400.0;
    s.bend_stiffness = 0.5;
    s.damping_time = 0.03;
    s.drag = 2.0;
    s.gravity[1] = -GRAVITY;
    s.linear_tolerance = 1e-9;
    HostCloth *cloth = host_cloth_create(&s);
    if (!cloth)
        return nullptr;
    for (std::uint32_t v = 0; v < cloth->vertex_count; v++)
        for (int k = 0; k < 3; k++)
            cloth->positions[3 * v + k] += 1e-3 * host_random(&random);
    for (std::uint32_t column : {0u, s.columns - 1})
        for (std::uint32_t row : {0u, s.rows - 1})
            host_cloth_pin(cloth, host_cloth_vertex(cloth, column, row));
    return cloth;
}

int run(ExampleRun &example)
{
    SignoriniHost host;
    signorini_host_create(&host, 0.5, 0);
    HostCloth *cloth = make_cloth(example.random);
    if (!cloth)
        return example_fail(&example, "no cloth");
    ClothContact cloth_contact;
    cloth_contact_create(&cloth_contact, &host, cloth, CLOTH_MATRIX, 0.004);

    int good = 1;
    {
        BulletWorld bullet(btVector3(0, -GRAVITY, 0));
        BulletCloth bullet_cloth(bullet, cloth);
        btBoxShape shape(HALF_EXTENTS);
        btVector3 inertia;
        shape.calculateLocalInertia(BOX_MASS, inertia);
        btRigidBody body(btRigidBody::btRigidBodyConstructionInfo(BOX_MASS, nullptr, &shape, inertia));
        const btVector3 axis(host_random(&example.random), 2.0, host_random(&example.random));
        const btVector3 place(0.05 * host_random(&example.random), 0.35, 0.05 * host_random(&example.random));
        body.setCenterOfMassTransform(btTransform(btQuaternion(axis.normalized(), host_random(&example.random)), place));
        bullet.world.addRigidBody(&body, GROUP_RIGID, btBroadphaseProxy::AllFilter);

        BulletContact box(&host, body);
        SgnShapeDesc box_shape;
        SgnRigidDesc desc;
        sgn_shape_desc_init(&box_shape, sizeof box_shape);
        sgn_rigid_desc_init(&desc, sizeof desc);
        box_shape.kind = SGN_SHAPE_BOX;
        for (int i = 0; i < 3; i++)
            box_shape.half_extents[i] = HALF_EXTENTS[i];
        desc.shape = &box_shape;
        desc.half_thickness = 0.004;
        box.describe(desc);
        box.attach(signorini_host_add_rigid(&host, &desc));
        double lifted[3] = {}, pressed[3] = {};
        for (int step = 0; step < STEPS && good; step++) {
            // The host loop: the engines tick, push what they want, our step, write back what they get.
            bullet.tick(DT);
            if (host_cloth_predict(cloth, DT) < 0)
                good = example_fail(&example, "the cloth's linear solver did not converge");
            box.push(DT);
            cloth_contact_push(&cloth_contact);
            signorini_host_step(&host, DT);
            box.pull();
            cloth_contact_pull(&cloth_contact);
            bullet_cloth.refit();

            const btVector3 centre = body.getCenterOfMassPosition();
            const double down[3] = {0, -1, 0}, point[3] = {centre.x(), centre.y(), centre.z()};
            if (host_cloth_crossings(cloth, point, down) % 2 != 1)
                good = example_fail(&example, "the box is not above the cloth");
            if (step >= STEPS - LAST) {
                double on_box[3], on_cloth[3];
                signorini_host_pull_vector(&host, box.id(), SGN_SLOT_IMPULSE, on_box);
                cloth_contact_impulse(&cloth_contact, on_cloth);
                for (int i = 0; i < 3; i++) {
                    lifted[i] += on_box[i];
                    pressed[i] += on_cloth[i];
                }
            }
            if (!example_write_frame(&example, step, cloth, &host, box.id(), "box"))
                good = example_fail(&example, "no frame");
        }
        const double weight = BOX_MASS * GRAVITY * DT * LAST;
        const double speed = body.getLinearVelocity().length(), turning = body.getAngularVelocity().length();
        const double sideways = std::hypot(lifted[0], lifted[2]);
        const double third_law = std::sqrt(std::pow(lifted[0] + pressed[0], 2) + std::pow(lifted[1] + pressed[1], 2) +
                                           std::pow(lifted[2] + pressed[2], 2));
        std::printf("run %d: speed %.2e m/s, turning %.2e rad/s, impulse/weight %.5f, sideways %.1e, pairs handed over %u\n",
                    example.index, speed, turning, lifted[1] / weight, sideways / weight,
                    bullet.hand_over.pairs_handed_over);
        example_expect(&example, &good, speed < 0.02, "the box is at rest");
        example_expect(&example, &good, turning < 0.1, "the box does not turn");
        example_expect(&example, &good, std::fabs(lifted[1] / weight - 1.0) < 0.01, "the impulses carry the weight within 1 %");
        example_expect(&example, &good, sideways / weight < 0.01, "the impulses point up within 1 %");
        example_expect(&example, &good, third_law < 1e-9 * weight, "what the box gets the cloth gives");
        example_expect(&example, &good, bullet.dispatcher.getNumManifolds() == 0, "Bullet made no contact of its own");
        example_expect(&example, &good, bullet.hand_over.pairs_handed_over > 0, "Bullet handed the pair over");
        bullet.world.removeRigidBody(&body);
    }
    example_expect(&example, &good, host.intersections == 0 && host.uncertified_steps == 0, "every frame is certified");
    signorini_host_add_totals(&example.totals, &host);
    cloth_contact_destroy(&cloth_contact);
    host_cloth_destroy(cloth);
    signorini_host_destroy(&host);
    return good;
}

} // namespace

int main(int argc, char **argv)
{
    ExampleRun example;
    if (!example_begin(&example, "bullet_cloth_catches_box", argc, argv))
        return 2;
    while (example_next(&example))
        run(example);
    return example_end(&example);
}
