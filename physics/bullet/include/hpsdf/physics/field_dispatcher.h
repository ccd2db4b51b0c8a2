#pragma once
// A collision dispatcher with which signed distance fields collide in unmodified Bullet.

#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>

#include <cstddef>
#include <memory>

namespace hpsdf::physics {

/// Statistics of the dispatch of one step. A pair of sleeping bodies contributes its contacts of the last step in
/// which the bodies were awake.
struct DispatchFigures {
  double querySeconds = 0;      ///< time to find the contacts of fields
  std::size_t pairs = 0;        ///< pairs whose contacts were searched: one body is a field, and the boxes overlap
  std::size_t penetrating = 0;  ///< samples, spheres and nodes of soft bodies that lie in a field
  std::size_t contacts = 0;     ///< contacts for the solver: up to 12 per pair, or soft-body nodes within the margin
  double deepest = 0;           ///< greatest penetration, world units
};

/// Bullet's collision dispatcher, extended by signed distance fields. It first finds the contacts of all
/// fields in parallel, with the threads of the caller's TBB arena. Then it fills Bullet's contact manifolds
/// one after another, so that the result does not depend on the number of threads. Bullet's solver,
/// integrator and soft bodies use these contacts unchanged. Unlike in unmodified Bullet, the contact of two
/// spheres keeps its impulse from step to step, so that piles of spheres come to rest.
class FieldDispatcher final : public btCollisionDispatcher {
 public:
  /// Registers the collision algorithms of fields and spheres with the dispatcher.
  explicit FieldDispatcher(btCollisionConfiguration* configuration);
  ~FieldDispatcher() override;
  FieldDispatcher(const FieldDispatcher&) = delete;
  FieldDispatcher& operator=(const FieldDispatcher&) = delete;

  void dispatchAllCollisionPairs(btOverlappingPairCache* pairs, const btDispatcherInfo& info,
                                 btDispatcher* dispatcher) override;

  /// Returns the statistics of the last dispatch.
  const DispatchFigures& figures() const { return figures_; }

 private:
  struct Algorithms;
  std::unique_ptr<Algorithms> algorithms_;
  DispatchFigures figures_;
};

}  // namespace hpsdf::physics
