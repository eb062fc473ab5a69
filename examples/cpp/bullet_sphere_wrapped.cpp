// A free cloth strikes a free sphere of Bullet's and wraps around it: no gravity, no damping in the host, lumped masses.
//
// Nothing outside acts on the two, so what the cloth loses the sphere must gain. Asserted for every step of every run:
// the impulses on cloth and sphere are equal and opposite to 1e-9, the sphere's momentum changes by the impulse that was
// pulled, the total momentum is kept to 1e-9, and the frame is certified. At the end the cloth reaches around the sphere.
//
//   bullet_sphere_wrapped [RUNS [SEED]] [--frames FOLDER]
#include "bullet_contact.hpp"
#include "cloth_contact.h"
#include "example_run.h"

#include <cmath>
#include <cstdio>

namespace {

const double DT = 0.005, RADIUS = 0.2, SPHERE_MASS = 0.6, SPEED = 4.0;
const int STEPS = 120;
const double EXACT = 1e-9;

// A cloth that flies along z towards the sphere at the origin.
HostCloth *make_cloth(std::uint64_t &random)
{
    HostClothSettings s = {};
    s.columns = s.rows = 25;
    s.origin[0] = -0.6 + 0.05 * host_random(&random);
    s.origin[1] = -0.6 + 0.05 * host_random(&random);
    s.origin[2] = -0.33;
    s.along[0] = s.across[1] = 1.2;
    s.along[2] = 0.1 * host_random(&random); // it does not strike quite flat
    s.across[2] = 0.1 * host_random(&random);
    s.mass = 0.3;
    s.stretch_stiffness = 800.0;
    s.shear_stiffness = 200.0;
    s.bend_stiffness = 0.2;
    s.linear_tolerance = 1e-13;
    HostCloth *cloth = host_cloth_create(&s);
    if (!cloth)
        return nullptr;
    for (std::uint32_t v = 0; v < cloth->vertex_count; v++) {
        cloth->velocities[3 * v + 2] = SPEED;
        for (int k = 0; k < 3; k++)
            cloth->positions[3 * v + k] += 1e-3 * host_random(&random);
    }
    return cloth;
}

double length(const double v[3])
{
    return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

void total_momentum(const HostCloth *cloth, const btRigidBody &body, double total[3])
{
    host_cloth_momentum(cloth, total);
    for (int k = 0; k < 3; k++)
        total[k] += SPHERE_MASS * body.getLinearVelocity()[k];
}

int run(ExampleRun &example)
{
    SignoriniHost host;
    signorini_host_create(&host, 0.3, 0);
    HostCloth *cloth = make_cloth(example.random);
    if (!cloth)
        return example_fail(&example, "no cloth");
    ClothContact cloth_contact;
    cloth_contact_create(&cloth_contact, &host, cloth, CLOTH_LUMPED, 0.004);

    int good = 1;
    {
        BulletWorld bullet(btVector3(0, 0, 0));
        BulletCloth bullet_cloth(bullet, cloth);
        btSphereShape shape(RADIUS);
        btVector3 inertia;
        shape.calculateLocalInertia(SPHERE_MASS, inertia);
        btRigidBody body(btRigidBody::btRigidBodyConstructionInfo(SPHERE_MASS, nullptr, &shape, inertia));
        bullet.world.addRigidBody(&body, GROUP_RIGID, btBroadphaseProxy::AllFilter);

        BulletContact sphere(&host, body);
        SgnShapeDesc ball;
        SgnRigidDesc desc;
        sgn_shape_desc_init(&ball, sizeof ball);
        sgn_rigid_desc_init(&desc, sizeof desc);
        ball.kind = SGN_SHAPE_SPHERE;
        ball.radius = RADIUS;
        desc.shape = &ball;
        desc.half_thickness = 0.004;
        sphere.describe(desc);
        sphere.attach(signorini_host_add_rigid(&host, &desc));

        double before[3], worst_pair = 0.0, worst_change = 0.0, worst_total = 0.0, exchanged[3] = {};
        total_momentum(cloth, body, before);
        for (int step = 0; step < STEPS && good; step++) {
            bullet.tick(DT);
            if (host_cloth_predict(cloth, DT) < 0)
                good = example_fail(&example, "the cloth's linear solver did not converge");
            sphere.push(DT);
            cloth_contact_push(&cloth_contact);
            signorini_host_step(&host, DT);
            sphere.pull();
            cloth_contact_pull(&cloth_contact);
            bullet_cloth.refit();

            // Everything is measured against the momentum that the cloth brought.
            double on_sphere[3], on_cloth[3], velocity[3], total[3], pair[3], change[3], drift[3];
            signorini_host_pull_vector(&host, sphere.id(), SGN_SLOT_IMPULSE, on_sphere);
            signorini_host_pull_vector(&host, sphere.id(), SGN_SLOT_VELOCITY, velocity);
            cloth_contact_impulse(&cloth_contact, on_cloth);
            total_momentum(cloth, body, total);
            for (int k = 0; k < 3; k++) {
                exchanged[k] += on_sphere[k];
                pair[k] = on_sphere[k] + on_cloth[k];
                change[k] = SPHERE_MASS * (velocity[k] - sphere.displacement_velocity()[k]) - on_sphere[k];
                drift[k] = total[k] - before[k];
            }
            worst_pair = std::fmax(worst_pair, length(pair) / length(before));
            worst_change = std::fmax(worst_change, length(change) / length(before));
            worst_total = std::fmax(worst_total, length(drift) / length(before));
            if (!example_write_frame(&example, step, cloth, &host, sphere.id(), "sphere"))
                good = example_fail(&example, "no frame");
        }

        // Wrapped: cloth vertices near the surface, beyond the sphere's middle plane, all around.
        const btVector3 centre = body.getCenterOfMassPosition();
        bool sides[4] = {};
        for (std::uint32_t v = 0; v < cloth->vertex_count; v++) {
            const double *p = &cloth->positions[3 * v];
            const btVector3 d = btVector3(p[0], p[1], p[2]) - centre;
            if (d.z() > 0.0 && d.length() < 2.0 * RADIUS)
                sides[std::fabs(d.x()) > std::fabs(d.y()) ? (d.x() > 0.0 ? 0 : 1) : (d.y() > 0.0 ? 2 : 3)] = true;
        }
        std::printf("run %d: exchanged %.3f of %.3f Ns; action + reaction %.1e, sphere's change - impulse %.1e, "
                    "total momentum %.1e\n",
                    example.index, exchanged[2], before[2], worst_pair, worst_change, worst_total);
        example_expect(&example, &good, worst_pair < EXACT, "impulses are equal and opposite to 1e-9");
        example_expect(&example, &good, worst_change < EXACT, "the sphere changes by the impulse pulled, to 1e-9");
        example_expect(&example, &good, worst_total < EXACT, "total momentum is kept to 1e-9");
        example_expect(&example, &good, exchanged[2] > 0.1 * before[2], "the sphere was struck");
        example_expect(&example, &good, sides[0] && sides[1] && sides[2] && sides[3], "the cloth is wrapped around the sphere");
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
    if (!example_begin(&example, "bullet_sphere_wrapped", argc, argv))
        return 2;
    while (example_next(&example))
        run(example);
    return example_end(&example);
}
