#pragma once
// Fields as collision shapes of stock Bullet (3.24, double precision).
//
// Bodies whose shape is a `FieldShape` collide with each other, with spheres, with static planes, and with soft bodies.
// Two fields collide by the samples of each in the other's field. Bullet keeps its solver, integrator and soft bodies:
// what is found here goes into its manifolds and its soft bodies' contacts.

#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletCollision/CollisionShapes/btConcaveShape.h>

#include <cstddef>

#include "hpsdf/physics/contacts.h"
#include "hpsdf/physics/mass.h"

namespace hpsdf::physics {

Eigen::Isometry3d fromBullet(const btTransform& transform);
btTransform toBullet(const Eigen::Isometry3d& transform);
inline Vector3 fromBullet(const btVector3& v) { return {v.x(), v.y(), v.z()}; }
inline btVector3 toBullet(const Vector3& v) { return {v.x(), v.y(), v.z()}; }

/// A field, and the samples that stand for its surface in other fields, as the shape of any number of bodies. Refers to
/// both, which must outlive it. A body's frame is that of `MassProperties`: its origin the centre of mass. Not a part
/// for compounds, in which it collides with nothing.
class FieldShape final : public btConcaveShape {
 public:
  /// The samples are those of the field's own mesh, in its units, which are the world's. `margin`: of what is outside
  /// by no more contacts are made as well, so that bodies at rest keep theirs; some hundredth of the body's size.
  /// Throws `Error` for a margin that is not above 0.
  FieldShape(const FieldCollider& field, const SurfaceSamples& samples, const MassProperties& mass, double margin);

  const FieldCollider& field() const { return *field_; }
  const SurfaceSamples& samples() const { return *samples_; }
  const Eigen::Isometry3d& bodyFromMesh() const { return bodyFromMesh_; }

  void getAabb(const btTransform& worldFromBody, btVector3& lo, btVector3& hi) const override;
  void calculateLocalInertia(btScalar mass, btVector3& inertia) const override;
  void setLocalScaling(const btVector3&) override {}  ///< a field is not scaled: another mesh is another field
  const btVector3& getLocalScaling() const override { return scaling_; }
  void processAllTriangles(btTriangleCallback*, const btVector3&, const btVector3&) const override {}  ///< has none
  const char* getName() const override { return "Field"; }

 private:
  const FieldCollider* field_;
  const SurfaceSamples* samples_;
  Eigen::Isometry3d bodyFromMesh_;
  btVector3 center_, halfSize_;  ///< of the mesh's box, in the body's frame
  btVector3 inertia_;            ///< of mass 1
  btVector3 scaling_{1, 1, 1};
};

/// What one step's dispatch took and found; of bodies that sleep, what was found last.
struct DispatchFigures {
  double querySeconds = 0;      ///< of looking samples up in fields
  std::size_t pairs = 0;        ///< with a field, of which boxes overlap
  std::size_t penetrating = 0;  ///< samples, spheres and nodes of soft bodies
  std::size_t contacts = 0;     ///< for the solver: at most 12 of two bodies, and nodes that are within the margin
  double deepest = 0;           ///< penetration, world units
};

/// Bullet's dispatcher, which asks for all contacts of fields first, in parallel by the threads of the caller's TBB
/// arena, and then fills the manifolds one after another: the result does not depend on the number of threads. Two
/// spheres keep the impulse of their contact from step to step, as Bullet's own do not: piles of them come to rest.
class FieldDispatcher final : public btCollisionDispatcher {
 public:
  /// Registers the algorithms too.
  explicit FieldDispatcher(btCollisionConfiguration* configuration);
  ~FieldDispatcher() override;
  FieldDispatcher(const FieldDispatcher&) = delete;
  FieldDispatcher& operator=(const FieldDispatcher&) = delete;

  void dispatchAllCollisionPairs(btOverlappingPairCache* pairs, const btDispatcherInfo& info,
                                 btDispatcher* dispatcher) override;

  /// Of the last dispatch.
  const DispatchFigures& figures() const { return figures_; }

 private:
  struct Algorithms;
  Algorithms* algorithms_;
  DispatchFigures figures_;
};

}  // namespace hpsdf::physics
