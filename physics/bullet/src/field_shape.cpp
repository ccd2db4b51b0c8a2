#include "hpsdf/physics/field_shape.h"

#include <cmath>

#include "hpsdf/error.h"

namespace hpsdf::physics {

Eigen::Isometry3d fromBullet(const btTransform& transform) {
  Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) result(row, column) = transform.getBasis()[row][column];
  result.translation() = fromBullet(transform.getOrigin());
  return result;
}

btTransform toBullet(const Eigen::Isometry3d& transform) {
  const auto& m = transform.matrix();
  const btMatrix3x3 rotation(m(0, 0), m(0, 1), m(0, 2), m(1, 0), m(1, 1), m(1, 2), m(2, 0), m(2, 1), m(2, 2));
  return btTransform(rotation, toBullet(Vector3(transform.translation())));
}

FieldShape::FieldShape(const FieldCollider& field, const SurfaceSamples& samples, const MassProperties& mass,
                       double margin)
    : field_(&field),
      samples_(&samples),
      bodyFromMesh_(mass.meshFromInertia.inverse()),
      center_(toBullet(Vector3(mass.box.center()))),
      halfSize_(toBullet(Vector3(mass.box.sizes() / 2))),
      inertia_(toBullet(mass.inertia)) {
  if (!(margin > 0) || !std::isfinite(margin)) throw Error("field shape: the margin must be a number above 0");
  // Use FAST_CONCAVE_MESH_PROXYTYPE, because CUSTOM_CONCAVE_SHAPE_TYPE is taken: Bullet uses it for its own
  // grids.
  m_shapeType = FAST_CONCAVE_MESH_PROXYTYPE;
  m_collisionMargin = margin;
}

void FieldShape::getAabb(const btTransform& worldFromBody, btVector3& lo, btVector3& hi) const {
  const btVector3 center = worldFromBody * center_;
  const btMatrix3x3 absolute = worldFromBody.getBasis().absolute();
  const btVector3 half = absolute * halfSize_ + btVector3(m_collisionMargin, m_collisionMargin, m_collisionMargin);
  lo = center - half;
  hi = center + half;
}

void FieldShape::calculateLocalInertia(btScalar mass, btVector3& inertia) const { inertia = mass * inertia_; }

}  // namespace hpsdf::physics
