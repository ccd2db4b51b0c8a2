#pragma once

#include <BulletCollision/CollisionDispatch/btSphereSphereCollisionAlgorithm.h>

namespace hpsdf::physics {

/// Two spheres, by Bullet's algorithm for them. That one forgets its contact in each step, so that the solver starts
/// from nothing, and a pile of spheres never comes to rest. Here the contact keeps its impulse.
class SpherePairAlgorithm final : public btSphereSphereCollisionAlgorithm {
 public:
  SpherePairAlgorithm(const btCollisionAlgorithmConstructionInfo& info, const btCollisionObjectWrapper* first,
                      const btCollisionObjectWrapper* second)
      : btSphereSphereCollisionAlgorithm(nullptr, info, first, second) {}

  void processCollision(const btCollisionObjectWrapper* first, const btCollisionObjectWrapper* second,
                        const btDispatcherInfo& info, btManifoldResult* result) override;

 private:
  btManifoldArray manifolds_;  ///< room that is used again
};

}  // namespace hpsdf::physics
