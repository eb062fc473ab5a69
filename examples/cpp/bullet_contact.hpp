// Bullet and Signorini: a world in which Bullet integrates its rigid bodies and solves its own contacts, while every
// pair that involves the cloth is handed over.
#ifndef BULLET_CONTACT_HPP
#define BULLET_CONTACT_HPP

#include "host_cloth.h"
#include "host_rotation.h"
#include "signorini_host.h"

#include <btBulletDynamicsCommon.h>

// Collision groups of Bullet: what is deformable, and all else.
enum : int { GROUP_DEFORMABLE = 1 << 8, GROUP_RIGID = btBroadphaseProxy::DefaultFilter };

// Bullet asks this for every pair whose boxes begin to overlap. A pair with a deformable member is not Bullet's: it gets
// no manifold, no contact constraint, and no work is done for it.
struct HandOver : btOverlapFilterCallback {
    mutable unsigned pairs_handed_over = 0;

    bool needBroadphaseCollision(btBroadphaseProxy *a, btBroadphaseProxy *b) const override
    {
        if ((a->m_collisionFilterGroup | b->m_collisionFilterGroup) & GROUP_DEFORMABLE) {
            pairs_handed_over++;
            return false;
        }
        return (a->m_collisionFilterGroup & b->m_collisionFilterMask) && (b->m_collisionFilterGroup & a->m_collisionFilterMask);
    }
};

// Everything that a Bullet world needs, in the order in which it is built and taken down.
struct BulletWorld {
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher{&configuration};
    btDbvtBroadphase broadphase;
    btSequentialImpulseConstraintSolver solver;
    btDiscreteDynamicsWorld world{&dispatcher, &broadphase, &solver, &configuration};
    HandOver hand_over;

    explicit BulletWorld(const btVector3 &gravity)
    {
        world.setGravity(gravity);
        world.getPairCache()->setOverlapFilterCallback(&hand_over);
    }

    // One tick of exactly dt, no interpolation.
    void tick(double dt) { world.stepSimulation(dt, 0); }
};

// The cloth as Bullet sees it: a triangle mesh that shares the host's arrays, there for ray casts and queries.
class BulletCloth {
public:
    BulletCloth(BulletWorld &bullet, HostCloth *cloth)
        : bullet_(bullet),
          mesh_(static_cast<int>(cloth->triangle_count), reinterpret_cast<int *>(cloth->triangles), 3 * sizeof(int),
                static_cast<int>(cloth->vertex_count), cloth->positions, 3 * sizeof(double)),
          shape_(&mesh_, true)
    {
        object_.setCollisionShape(&shape_);
        bullet_.world.addCollisionObject(&object_, GROUP_DEFORMABLE, btBroadphaseProxy::AllFilter);
    }
    ~BulletCloth() { bullet_.world.removeCollisionObject(&object_); }
    BulletCloth(const BulletCloth &) = delete;
    BulletCloth &operator=(const BulletCloth &) = delete;

    // After the cloth has moved.
    void refit()
    {
        btVector3 low, high;
        shape_.getMeshInterface()->calculateAabbBruteForce(low, high);
        shape_.refitTree(low, high);
        shape_.recalcLocalAabb();
    }

private:
    BulletWorld &bullet_;
    btTriangleIndexVertexArray mesh_;
    btBvhTriangleMeshShape shape_;
    btCollisionObject object_;
};

// A rigid body of Bullet's in Signorini. The engine ticks; `push` hands over where the tick wants to take the body;
// after the step `pull` writes back where it may go.
class BulletContact {
public:
    BulletContact(SignoriniHost *host, btRigidBody &body) : host_(host), body_(body)
    {
        body_.setActivationState(DISABLE_DEACTIVATION); // a sleeping body would ignore what the cloth does to it
        start_ = pose();
    }

    // Mass, inertia and pose, for the body's description.
    void describe(SgnRigidDesc &desc) const
    {
        const btVector3 inertia = body_.getLocalInertia(); // Bullet's body frame: centre of mass, principal axes
        desc.mass = 1.0 / body_.getInvMass();
        for (double &entry : desc.inertia)
            entry = 0.0;
        for (int i = 0; i < 3; i++)
            desc.inertia[4 * i] = inertia[i];
        for (int i = 0; i < 3; i++)
            desc.position[i] = start_.values[i];
        for (int i = 0; i < 4; i++)
            desc.orientation[i] = start_.values[3 + i];
    }
    void attach(SgnBodyId id) { id_ = id; }
    SgnBodyId id() const { return id_; }

    // After Bullet's tick: the displacement velocity, from poses, so that whatever moved the body in the tick counts.
    void push(double dt)
    {
        const Pose end = pose();
        for (int i = 0; i < 3; i++)
            linear_[i] = (end.values[i] - start_.values[i]) / dt;
        host_angular_velocity(start_.values + 3, end.values + 3, dt, angular_);
        signorini_host_push_velocity(host_, id_, linear_, angular_);
    }

    // After our step: the pose is authoritative, the end velocity is what the next tick starts from.
    void pull()
    {
        double linear[3], angular[3];
        signorini_host_pull_pose(host_, id_, start_.values);
        signorini_host_pull_end_velocity(host_, id_, linear, angular);
        const btVector3 v(linear[0], linear[1], linear[2]), w(angular[0], angular[1], angular[2]);
        const double *p = start_.values;
        const btTransform transform(btQuaternion(p[3], p[4], p[5], p[6]), btVector3(p[0], p[1], p[2]));
        body_.setCenterOfMassTransform(transform);
        body_.setInterpolationWorldTransform(transform);
        body_.setLinearVelocity(v);
        body_.setAngularVelocity(w);
        body_.setInterpolationLinearVelocity(v);
        body_.setInterpolationAngularVelocity(w);
        if (body_.getMotionState())
            body_.getMotionState()->setWorldTransform(transform);
    }

    const double *displacement_velocity() const { return linear_; }

private:
    struct Pose {
        double values[7]; // x y z, quaternion x y z w
    };
    Pose pose() const
    {
        const btTransform &t = body_.getCenterOfMassTransform();
        const btQuaternion q = t.getRotation();
        const btVector3 &x = t.getOrigin();
        return {{x.x(), x.y(), x.z(), q.x(), q.y(), q.z(), q.w()}};
    }

    SignoriniHost *host_;
    btRigidBody &body_;
    SgnBodyId id_{};
    Pose start_{};
    double linear_[3] = {}, angular_[3] = {};
};

#endif
