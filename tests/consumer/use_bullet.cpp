#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <hpsdf/physics/world.h>
#include <hpsdf/shapes.h>

#include <cmath>
#include <cstdio>

#include "torus_field.h"

namespace physics = hpsdf::physics;

// A ball falls into the hole of a fixed torus and must come to rest there.
int main() {
  const hpsdf::Field field = torusField();
  const hpsdf::TriangleMesh mesh = hpsdf::shapes::mesh("torus,major=0.7,minor=0.3");
  const physics::FieldCollider collider(field);
  const physics::SurfaceSamples samples = physics::sampleSurface(mesh, {.count = 1000});
  const physics::MassProperties mass = physics::massProperties(mesh);
  physics::FieldShape torus(collider, samples, mass, 0.005);
  btSphereShape ball(0.5);

  physics::World world;
  world.add(torus, 0, mass.meshFromInertia);
  const std::size_t number = world.add(ball, 1, Eigen::Isometry3d(Eigen::Translation3d(0.02, 0, 0.8)),
                                       {.friction = 0.3, .linearDamping = 0.2, .angularDamping = 0.2});
  for (int step = 0; step < 720; ++step) world.step();

  // The ball's centre has the distance 0.5 + kMinorRadius from the centre circle of the torus's tube.
  const hpsdf::Vector3 at = world.worldFromBody(number).translation();
  const double high = std::sqrt(std::pow(0.5 + kMinorRadius, 2) - kMajorRadius * kMajorRadius);
  if (std::hypot(at.x(), at.y()) < 0.03 && std::abs(at.z() - high) < 0.01) return 0;
  std::fprintf(stderr, "the ball is at %g %g %g rather than %g high\n", at.x(), at.y(), at.z(), high);
  return 1;
}
