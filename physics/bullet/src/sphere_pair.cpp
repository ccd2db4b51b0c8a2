#include "sphere_pair.h"

namespace hpsdf::physics {

void SpherePairAlgorithm::processCollision(const btCollisionObjectWrapper* first,
                                           const btCollisionObjectWrapper* second, const btDispatcherInfo& info,
                                           btManifoldResult* result) {
  manifolds_.resize(0);
  getAllContactManifolds(manifolds_);
  btPersistentManifold& manifold = *manifolds_[0];  // with at most one contact
  const btScalar impulse = manifold.getNumContacts() > 0 ? manifold.getContactPoint(0).m_appliedImpulse : 0;
  btSphereSphereCollisionAlgorithm::processCollision(first, second, info, result);
  if (manifold.getNumContacts() > 0) manifold.getContactPoint(0).m_appliedImpulse = impulse;
}

}  // namespace hpsdf::physics
