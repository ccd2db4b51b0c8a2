#pragma once
// The collision of two spheres.

#include <BulletCollision/CollisionDispatch/btSphereSphereCollisionAlgorithm.h>

namespace hpsdf::physics {

/// Bullet's algorithm for two spheres, with a contact that keeps its impulse. Bullet's own discards it in each step, so
/// that the solver starts from zero and a pile of spheres never comes to rest.
class SpherePairAlgorithm final : public btSphereSphereCollisionAlgorithm {
 public:
  SpherePairAlgorithm(const btCollisionAlgorithmConstructionInfo& info, const btCollisionObjectWrapper* first,
                      const btCollisionObjectWrapper* second)
      : btSphereSphereCollisionAlgorithm(nullptr, info, first, second) {}

  void processCollision(const btCollisionObjectWrapper* first, const btCollisionObjectWrapper* second,
                        const btDispatcherInfo& info, btManifoldResult* result) override;

 private:
  btManifoldArray manifolds_;  ///< temporary; a member so that its memory is reused
};

}  // namespace hpsdf::physics
