#pragma once
// The dispatcher that lets fields collide in stock Bullet.

#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>

#include <cstddef>
#include <memory>

namespace hpsdf::physics {

/// Figures of one step's dispatch. For sleeping bodies they are those of the last step in which the bodies were
/// awake.
struct DispatchFigures {
  double querySeconds = 0;      ///< time of the queries of samples in fields
  std::size_t pairs = 0;        ///< pairs with a field whose bounding boxes overlap
  std::size_t penetrating = 0;  ///< samples, spheres and nodes of soft bodies that lie in a field
  std::size_t contacts = 0;     ///< for the solver: at most 12 per pair of bodies, and nodes within the margin
  double deepest = 0;           ///< greatest penetration, world units
};

/// Bullet's dispatcher with fields. It first finds the contacts of all fields in parallel, with the threads of the
/// caller's TBB arena, and then fills the manifolds one after another, so that the result does not depend on the number
/// of threads. Bullet's solver, integrator and soft bodies use these contacts unchanged. The contact of two spheres
/// keeps its impulse from step to step, unlike in stock Bullet, so that piles of spheres come to rest.
class FieldDispatcher final : public btCollisionDispatcher {
 public:
  /// Registers the algorithms of fields and spheres.
  explicit FieldDispatcher(btCollisionConfiguration* configuration);
  ~FieldDispatcher() override;
  FieldDispatcher(const FieldDispatcher&) = delete;
  FieldDispatcher& operator=(const FieldDispatcher&) = delete;

  void dispatchAllCollisionPairs(btOverlappingPairCache* pairs, const btDispatcherInfo& info,
                                 btDispatcher* dispatcher) override;

  /// Figures of the last dispatch.
  const DispatchFigures& figures() const { return figures_; }

 private:
  struct Algorithms;
  std::unique_ptr<Algorithms> algorithms_;
  DispatchFigures figures_;
};

}  // namespace hpsdf::physics
