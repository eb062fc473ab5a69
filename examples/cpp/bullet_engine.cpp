// Bullet as the engine of an example scene.
#include "bullet_contact.hpp"
#include "example_engine.h"

#include <memory>
#include <new>

struct Engine {
    BulletWorld bullet;
    BulletCloth cloth;
    std::unique_ptr<btConvexShape> shape;
    std::unique_ptr<btRigidBody> body;
    std::unique_ptr<BulletContact> contact;

    Engine(const btVector3 &gravity, const EngineBody &settings, HostCloth *host_cloth) : bullet(gravity), cloth(bullet, host_cloth)
    {
        const double *h = settings.half_extents, *x = settings.position, *q = settings.orientation;
        if (settings.shape == SGN_SHAPE_BOX)
            shape.reset(new btBoxShape(btVector3(h[0], h[1], h[2])));
        else
            shape.reset(new btSphereShape(settings.radius));
        btVector3 inertia;
        shape->calculateLocalInertia(settings.mass, inertia);
        body.reset(new btRigidBody(settings.mass, nullptr, shape.get(), inertia));
        const btQuaternion turn = btQuaternion(q[0], q[1], q[2], q[3]).normalized();
        body->setCenterOfMassTransform(btTransform(turn, btVector3(x[0], x[1], x[2])));
        body->setLinearVelocity(btVector3(settings.velocity[0], settings.velocity[1], settings.velocity[2]));
        bullet.world.addRigidBody(body.get(), GROUP_RIGID, btBroadphaseProxy::AllFilter);
    }
    ~Engine() { bullet.world.removeRigidBody(body.get()); }
    Engine(const Engine &) = delete;
    Engine &operator=(const Engine &) = delete;
};

const char *engine_name(void) { return "bullet"; }

Engine *engine_create(const double gravity[3], const EngineBody *body, SgnRigidDesc *desc, SignoriniHost *host, HostCloth *cloth)
{
    try {
        std::unique_ptr<Engine> engine(new Engine(btVector3(gravity[0], gravity[1], gravity[2]), *body, cloth));
        engine->contact.reset(new BulletContact(host, *engine->body));
        engine->contact->describe(*desc);
        engine->contact->attach(signorini_host_add_rigid(host, desc));
        return engine.release();
    } catch (const std::bad_alloc &) {
        return nullptr;
    }
}

void engine_destroy(Engine *engine) { delete engine; }

void engine_tick(Engine *engine, double dt) { engine->bullet.tick(dt); }

void engine_push(Engine *engine, double dt) { engine->contact->push(dt); }

void engine_pull(Engine *engine)
{
    engine->contact->pull();
    engine->cloth.refit();
}

void engine_state(const Engine *engine, EngineState *state)
{
    const btRigidBody &body = *engine->body;
    state->id = engine->contact->id();
    for (int k = 0; k < 3; k++) {
        state->position[k] = body.getCenterOfMassPosition()[k];
        state->velocity[k] = body.getLinearVelocity()[k];
        state->angular_velocity[k] = body.getAngularVelocity()[k];
        state->displacement_velocity[k] = engine->contact->displacement_velocity()[k];
    }
    state->own_contacts = static_cast<unsigned>(engine->bullet.dispatcher.getNumManifolds());
    state->pairs_handed_over = engine->bullet.hand_over.pairs_handed_over;
}
