#pragma once
// A signed distance field as a collision shape of unmodified Bullet (3.24, double precision).

#include <BulletCollision/CollisionShapes/btConcaveShape.h>

#include "hpsdf/physics/contacts.h"
#include "hpsdf/physics/mass.h"

namespace hpsdf::physics {

Eigen::Isometry3d fromBullet(const btTransform& transform);
btTransform toBullet(const Eigen::Isometry3d& transform);
inline Vector3 fromBullet(const btVector3& v) { return {v.x(), v.y(), v.z()}; }
inline btVector3 toBullet(const Vector3& v) { return {v.x(), v.y(), v.z()}; }

/// A collision shape that any number of bodies may share. It consists of a signed distance field, and of
/// samples of the shape's surface that are evaluated in the fields of other bodies. Bodies of this shape
/// collide with each other, with spheres, with static planes and with soft bodies, if a `FieldDispatcher`
/// dispatches them. When two fields collide, the samples of each one are evaluated in the field of the
/// other.
///
/// The shape refers to the field and the samples, which must outlive the shape. The frame of a body with this shape is
/// the frame of inertia in `MassProperties`, with its origin at the centre of mass. As a part of a compound shape this
/// shape collides with nothing.
class FieldShape final : public btConcaveShape {
 public:
  /// `samples` must be samples of the mesh from which `field` was built; mesh and world have the same unit.
  /// Contacts are made up to a distance of `margin` (about 1/100 of the body's size), so that bodies at rest
  /// keep their contacts. Throws `Error` if the margin is not finite or not above 0.
  FieldShape(const FieldCollider& field, const SurfaceSamples& samples, const MassProperties& mass, double margin);

  const FieldCollider& field() const { return *field_; }
  const SurfaceSamples& samples() const { return *samples_; }
  const Eigen::Isometry3d& bodyFromMesh() const { return bodyFromMesh_; }

  void getAabb(const btTransform& worldFromBody, btVector3& lo, btVector3& hi) const override;
  void calculateLocalInertia(btScalar mass, btVector3& inertia) const override;
  void setLocalScaling(const btVector3&) override {}  ///< does nothing: a field cannot be scaled
  const btVector3& getLocalScaling() const override { return scaling_; }
  void processAllTriangles(btTriangleCallback*, const btVector3&, const btVector3&) const override {}  ///< no triangles
  const char* getName() const override { return "Field"; }

 private:
  const FieldCollider* field_;
  const SurfaceSamples* samples_;
  Eigen::Isometry3d bodyFromMesh_;
  btVector3 center_, halfSize_;  ///< centre and half size of the mesh's bounding box, in the body's frame
  btVector3 inertia_;            ///< principal moments of inertia for mass 1
  btVector3 scaling_{1, 1, 1};
};

}  // namespace hpsdf::physics
