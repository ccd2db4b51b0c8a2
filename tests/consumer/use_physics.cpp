#include <hpsdf/physics/contacts.h>
#include <hpsdf/shapes.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "torus_field.h"

namespace physics = hpsdf::physics;

// A ball touches the top of a torus and penetrates it by 0.01.
int main() {
  const hpsdf::Field field = torusField();
  const physics::FieldCollider collider(field);
  const physics::SurfaceSamples samples =
      physics::sampleSurface(hpsdf::shapes::mesh("sphere,radius=0.2"), {.count = 2000});

  physics::BodyPair pair{&samples, Eigen::Isometry3d::Identity(), &collider, Eigen::Isometry3d::Identity()};
  pair.worldFromSamples.translate(hpsdf::Vector3(kMajorRadius, 0, kMinorRadius + 0.2 - 0.01));

  physics::ContactQuery query;
  double deepest = 0;
  for (const physics::Contact& contact : query.find(pair)) {
    deepest = std::max(deepest, contact.depth);
    if (contact.normal.z() < 0.9) return 1;
  }
  if (std::abs(deepest - 0.01) < 2e-3) return 0;
  std::fprintf(stderr, "%g deep\n", deepest);
  return 1;
}
