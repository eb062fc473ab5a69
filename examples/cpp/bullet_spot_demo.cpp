// The demo: Spot, thrown as a rigid body of Bullet's into a hanging cloth of 2,500 vertices. The cloth wraps around Spot,
// swings, is let go, and both come down on the floor.
//
// Bullet integrates Spot with the mass properties of its mesh; Signorini owns every contact: Spot and cloth, cloth and
// cloth, both with the floor. Every frame is certified. Writes one OBJ a frame for Blender and `sheet.txt`, the frames
// for a picture sheet.
//
//   bullet_spot_demo [--frames FOLDER] [--steps N] [--workers N] [--mesh FILE]
#include "bullet_contact.hpp"
#include "cloth_contact.h"
#include "host_mesh.h"
#include "mass_properties.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

namespace {

const double DT = 1.0 / 120.0, GRAVITY = 9.81;
const double SPOT_MASS = 2.5, SPOT_SIZE = 0.6;
const double RELEASE_TIME = 0.34; // the pins let go [s]
const int STEPS = 150; // 1.25 s
const int PICTURES[6] = {0, 30, 46, 62, 90, STEPS}; // frames on the sheet
const double HALF_THICKNESS = 0.003;

struct Options {
    std::string frames, mesh = "examples/data/spot.obj";
    int steps = STEPS;
    unsigned workers = 2;
};

bool read_options(int argc, char **argv, Options &options)
{
    for (int i = 1; i < argc; i++) {
        const std::string name = argv[i];
        if (i + 1 == argc)
            return false;
        const char *value = argv[++i];
        if (name == "--frames")
            options.frames = value;
        else if (name == "--mesh")
            options.mesh = value;
        else if (name == "--steps" && std::atoi(value) > 0)
            options.steps = std::atoi(value);
        else if (name == "--workers" && std::atoi(value) >= 0)
            options.workers = static_cast<unsigned>(std::atoi(value));
        else
            return false;
    }
    return true;
}

// A curtain of 2 m x 2 m, 50 x 50 vertices, over the floor at y = 0, hung from every seventh vertex of its upper edge.
HostCloth *make_cloth()
{
    HostClothSettings s = {};
    s.columns = s.rows = 50;
    s.origin[0] = -1.0;
    s.origin[1] = 2.3;
    s.along[0] = 2.0;
    s.across[1] = -2.0;
    s.mass = 0.5;
    s.stretch_stiffness = 300.0;
    s.shear_stiffness = 60.0;
    s.bend_stiffness = 0.15;
    s.damping_time = 0.002;
    s.drag = 0.3;
    s.gravity[1] = -GRAVITY;
    s.linear_tolerance = 1e-8;
    HostCloth *cloth = host_cloth_create(&s);
    if (cloth)
        for (std::uint32_t column = 0; column < s.columns; column += 7)
            host_cloth_pin(cloth, host_cloth_vertex(cloth, column, 0));
    return cloth;
}

// Spot about its centre of mass, along its principal axes: Bullet's body frame.
struct Spot {
    std::vector<double> vertices;
    std::vector<std::uint32_t> triangles;
    btVector3 inertia;
    btMatrix3x3 axes; // from the body frame to the mesh's own
};

bool read_spot(const std::string &path, Spot &spot)
{
    double *positions;
    std::uint32_t *triangles, vertex_count, triangle_count;
    if (!host_mesh_read_obj(path.c_str(), &positions, &vertex_count, &triangles, &triangle_count))
        return false;
    spot.vertices.assign(positions, positions + 3 * vertex_count);
    spot.triangles.assign(triangles, triangles + 3 * triangle_count);
    std::free(positions);
    std::free(triangles);
    for (double &x : spot.vertices)
        x *= SPOT_SIZE; // the mesh's longest side is 1
    const MassProperties properties = mass_properties(spot.vertices, spot.triangles);
    spot.inertia = SPOT_MASS * properties.inertia_by_mass;
    spot.axes = properties.axes;
    const btMatrix3x3 to_body = properties.axes.transpose();
    for (std::size_t v = 0; v < spot.vertices.size(); v += 3) {
        const btVector3 x(spot.vertices[v], spot.vertices[v + 1], spot.vertices[v + 2]);
        const btVector3 local = to_body * (x - properties.centre);
        for (int k = 0; k < 3; k++)
            spot.vertices[v + k] = local[k];
    }
    return true;
}

void add_floor(SignoriniHost &host)
{
    SgnHalfSpaceDesc desc;
    SgnBodyId id;
    sgn_half_space_desc_init(&desc, sizeof desc);
    desc.normal[0] = 0.0, desc.normal[1] = 1.0, desc.normal[2] = 0.0;
    desc.options.material = host.material;
    signorini_host_expect(&host, sgn_half_space_create(host.world, &desc, &id), "the floor");
}

bool write_frame(const Options &options, int frame, const HostCloth *cloth, const SignoriniHost &host, SgnBodyId spot)
{
    if (options.frames.empty())
        return true;
    double *positions;
    std::uint32_t *triangles;
    HostMesh meshes[2] = {{"cloth", cloth->positions, cloth->vertex_count, cloth->triangles, cloth->triangle_count}, {}};
    signorini_host_surface(&host, spot, &meshes[1], &positions, &triangles);
    meshes[1].name = "spot";
    char name[32];
    std::snprintf(name, sizeof name, "/frame_%04d.obj", frame);
    const bool good = host_mesh_write_obj((options.frames + name).c_str(), meshes, 2);
    std::free(positions);
    std::free(triangles);
    return good;
}

bool write_sheet(const Options &options)
{
    if (options.frames.empty())
        return true;
    std::FILE *file = std::fopen((options.frames + "/sheet.txt").c_str(), "w");
    if (!file)
        return false;
    for (int frame : PICTURES)
        std::fprintf(file, "frame_%04d.obj\n", std::min(frame, options.steps));
    return std::fclose(file) == 0;
}

int run(const Options &options)
{
    SignoriniHost host;
    signorini_host_create(&host, 0.4, options.workers);
    add_floor(host);
    HostCloth *cloth = make_cloth();
    Spot spot;
    if (!cloth || !read_spot(options.mesh, spot))
        return 1;
    ClothContact cloth_contact;
    cloth_contact_create(&cloth_contact, &host, cloth, CLOTH_MATRIX, HALF_THICKNESS);

    BulletWorld bullet(btVector3(0, -GRAVITY, 0));
    BulletCloth bullet_cloth(bullet, cloth);
    btConvexHullShape hull(spot.vertices.data(), static_cast<int>(spot.vertices.size() / 3), 3 * sizeof(double));
    btRigidBody body(btRigidBody::btRigidBodyConstructionInfo(SPOT_MASS, nullptr, &hull, spot.inertia));
    const btMatrix3x3 facing(btQuaternion(btVector3(0, 1, 0), 0.35)); // Spot looks along z, a little aside
    body.setCenterOfMassTransform(btTransform(facing * spot.axes, btVector3(0.05, 1.1, -1.5)));
    body.setLinearVelocity(btVector3(0.1, 2.4, 6.0));
    body.setAngularVelocity(btVector3(1.5, 0.8, 0.6));
    bullet.world.addRigidBody(&body, GROUP_RIGID, btBroadphaseProxy::AllFilter);

    BulletContact spot_contact(&host, body);
    SgnRigidDesc desc;
    sgn_rigid_desc_init(&desc, sizeof desc);
    desc.mesh.vertices = signorini_view(SGN_FORMAT_F64X3, spot.vertices.data(), spot.vertices.size() / 3);
    desc.mesh.triangles = signorini_view(SGN_FORMAT_U32X3, spot.triangles.data(), spot.triangles.size() / 3);
    desc.options.half_thickness = HALF_THICKNESS;
    spot_contact.describe(desc);
    spot_contact.attach(signorini_host_add_rigid(&host, &desc));

    bool good = write_frame(options, 0, cloth, host, spot_contact.id());
    bool hung = true;
    std::printf("cloth %u vertices, %u triangles; Spot %zu vertices, %zu triangles; dt %.2f ms\n", cloth->vertex_count,
                cloth->triangle_count, spot.vertices.size() / 3, spot.triangles.size() / 3, 1e3 * DT);
    const auto begin = std::chrono::steady_clock::now();
    for (int step = 1; step <= options.steps && good; step++) {
        if (hung && step * DT > RELEASE_TIME) {
            for (std::uint32_t v = 0; v < cloth->vertex_count; v++)
                host_cloth_release(cloth, v);
            cloth_contact_push_pins(&cloth_contact);
            hung = false;
        }
        bullet.tick(DT);
        if (host_cloth_predict(cloth, DT) < 0) {
            std::printf("the cloth's linear solver did not converge\n");
            good = false;
        }
        spot_contact.push(DT);
        cloth_contact_push(&cloth_contact);
        signorini_host_step(&host, DT);
        spot_contact.pull();
        cloth_contact_pull(&cloth_contact);
        bullet_cloth.refit();
        good = write_frame(options, step, cloth, host, spot_contact.id()) && good;

        if (step % 12 == 0 || step == options.steps) {
            const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - begin;
            const btVector3 x = body.getCenterOfMassPosition();
            std::printf("step %3d of %d: Spot at %5.2f %5.2f %5.2f m, %4u contacts, %u rounds, %6.1f ms, %5.1f s so far\n", step,
                        options.steps, x.x(), x.y(), x.z(), host.last.contacts, host.last.rounds,
                        host.last.total_microseconds / 1e3, elapsed.count());
            std::fflush(stdout);
        }
    }
    good = write_sheet(options) && good;
    signorini_host_print_totals(&host);
    good = good && host.intersections == 0 && host.uncertified_steps == 0 && host.contacts > 0;
    std::printf("%s bullet_spot_demo\n", good ? "PASS" : "FAIL");
    bullet.world.removeRigidBody(&body);
    cloth_contact_destroy(&cloth_contact);
    host_cloth_destroy(cloth);
    signorini_host_destroy(&host);
    return good ? 0 : 1;
}

} // namespace

int main(int argc, char **argv)
{
    Options options;
    if (!read_options(argc, argv, options)) {
        std::fprintf(stderr, "usage: bullet_spot_demo [--frames FOLDER] [--steps N] [--workers N] [--mesh FILE]\n");
        return 2;
    }
    return run(options);
}
