// The C++ wrapper: a box falls on a cloth of floats that is pinned at its corners, step by step through moved handles.
#include "check.h"
#include "signorini.hpp"

using Vector = std::array<float, 3>;

static void hammock() {
  constexpr int side = 9;
  std::string message;
  signorini::Context context;
  CHECK(context.create(nullptr, &message) == SGN_OK);
  auto wrong = signorini::make<SgnContextDesc>();
  wrong.executor = 17;
  CHECK(context.create(&wrong, &message) == SGN_ERROR_INVALID_ARGUMENT && message.find("executor 17") != std::string::npos);
  CHECK(context);

  signorini::World first;
  CHECK(first.create(context) == SGN_OK);
  signorini::World world = std::move(first);
  CHECK(world && !first);

  std::vector<Vector> x, v(side * side, Vector{});
  std::vector<float> mass(side * side, 0.01f);
  std::vector<std::uint8_t> pinned(side * side, 0);
  std::vector<std::array<std::uint32_t, 3>> triangles;
  for (unsigned j = 0; j < side; j++) {
    for (unsigned i = 0; i < side; i++) {
      x.push_back({0.1f * static_cast<float>(i), 0.1f * static_cast<float>(j), 0});
      if (i + 1 < side && j + 1 < side) {
        const unsigned a = side * j + i;
        triangles.push_back({a, a + 1, a + side + 1});
        triangles.push_back({a, a + side + 1, a + side});
      }
    }
  }
  for (int corner : {0, side - 1, side * (side - 1), side * side - 1}) pinned[static_cast<std::size_t>(corner)] = 1;

  auto cloth = signorini::make<SgnDeformableDesc>();
  cloth.precision = SGN_PRECISION_F32;
  cloth.mesh.vertices = signorini::view(x);
  cloth.mesh.triangles = signorini::view(triangles);
  cloth.masses = signorini::view(mass);
  cloth.pinned = signorini::view(pinned);
  SgnBodyId cloth_id{}, box_id{};
  CHECK(world.add(cloth, cloth_id) == SGN_OK);

  auto shape = signorini::make<SgnShapeDesc>();
  shape.kind = SGN_SHAPE_BOX;
  shape.half_extents[0] = shape.half_extents[1] = shape.half_extents[2] = 0.1;
  auto box = signorini::make<SgnRigidDesc>();
  box.shape = &shape;
  box.mass = 0.1;
  box.options.half_thickness = 0.005;
  box.position[0] = box.position[1] = 0.4;
  box.position[2] = 0.2;
  CHECK(world.add(box, box_id) == SGN_OK);

  auto step = signorini::make<SgnStepDesc>();
  step.dt = 0.01;
  auto report = signorini::make<SgnStepReport>();
  std::array<double, 3> fall{};
  std::array<double, 7> pose{};
  bool touched = false;
  for (int frame = 0; frame < 20; frame++) {
    fall[2] -= 0.0981;
    CHECK(world.push(box_id, SGN_SLOT_VELOCITY, fall) == SGN_OK);
    CHECK(world.push(cloth_id, SGN_SLOT_VELOCITY, v) == SGN_OK);
    CHECK(!signorini::failed(world.step(step, &report)));
    CHECK(world.pull(cloth_id, SGN_SLOT_VELOCITY, v) == SGN_OK);
    CHECK(world.pull(cloth_id, SGN_SLOT_POSITION, x) == SGN_OK);
    CHECK(world.pull(box_id, SGN_SLOT_VELOCITY, fall) == SGN_OK);
    CHECK(world.pull(box_id, SGN_SLOT_POSE, pose) == SGN_OK);
    CHECK(x[0] == Vector{}); // pinned
    std::vector<std::array<std::uint64_t, 2>> bodies;
    CHECK(world.pull_contacts(SGN_CONTACT_BODIES, bodies) == SGN_OK);
    CHECK(bodies.size() == report.contacts);
    touched |= report.active_contacts > 0;
    CHECK(static_cast<double>(x[40][2]) < pose[2] - 0.1);
  }
  CHECK(touched && x[40][2] < 0);
  CHECK(world.remove(box_id) == SGN_OK);
  CHECK(world.remove(box_id) == SGN_ERROR_STALE_ID);
  CHECK(context.last_error().find("sgn_body_destroy") == 0);
  CHECK(std::string(signorini::name(SGN_ERROR_STALE_ID)) == "SGN_ERROR_STALE_ID");
}

int main() {
  hammock();
  return finish();
}
