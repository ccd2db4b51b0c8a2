#include "hpsdf/physics/field_dispatcher.h"

#include <BulletCollision/BroadphaseCollision/btOverlappingPairCache.h>
#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionDispatch/btSphereSphereCollisionAlgorithm.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <chrono>
#include <vector>

#include "field_algorithms.h"

namespace hpsdf::physics {

/// Bullet's algorithm for two spheres, except that the contact keeps its impulse. Bullet's own algorithm
/// discards the contact in each step, so that the solver starts from zero and a pile of spheres never comes
/// to rest.
class SpherePairAlgorithm final : public btSphereSphereCollisionAlgorithm {
 public:
  SpherePairAlgorithm(const btCollisionAlgorithmConstructionInfo& info, const btCollisionObjectWrapper* first,
                      const btCollisionObjectWrapper* second)
      : btSphereSphereCollisionAlgorithm(nullptr, info, first, second) {}

  void processCollision(const btCollisionObjectWrapper* first, const btCollisionObjectWrapper* second,
                        const btDispatcherInfo& info, btManifoldResult* result) override {
    manifolds_.resize(0);
    getAllContactManifolds(manifolds_);
    btPersistentManifold& manifold = *manifolds_[0];  // this manifold has at most one contact
    const btScalar impulse = manifold.getNumContacts() > 0 ? manifold.getContactPoint(0).m_appliedImpulse : 0;
    btSphereSphereCollisionAlgorithm::processCollision(first, second, info, result);
    if (manifold.getNumContacts() > 0) manifold.getContactPoint(0).m_appliedImpulse = impulse;
  }

 private:
  btManifoldArray manifolds_;  ///< temporary; a member so that its memory is reused
};

struct FieldDispatcher::Algorithms {
  /// A pair of bodies whose contacts are found before Bullet asks for them.
  struct Prepared {
    FieldAlgorithm* algorithm;
    const btCollisionObject *first, *second;
  };

  CreateAlgorithm<RigidFieldAlgorithm> rigid;
  CreateAlgorithm<SoftFieldAlgorithm> soft;
  CreateAlgorithm<SpherePairAlgorithm> spheres;
  std::vector<Prepared> prepared;  ///< temporary; a member so that its memory is reused
};

FieldDispatcher::FieldDispatcher(btCollisionConfiguration* configuration)
    : btCollisionDispatcher(configuration), algorithms_(std::make_unique<Algorithms>()) {
  const auto both = [this](int other, btCollisionAlgorithmCreateFunc& create) {
    registerCollisionCreateFunc(FAST_CONCAVE_MESH_PROXYTYPE, other, &create);
    registerCollisionCreateFunc(other, FAST_CONCAVE_MESH_PROXYTYPE, &create);
  };
  for (const int other : {FAST_CONCAVE_MESH_PROXYTYPE, SPHERE_SHAPE_PROXYTYPE, STATIC_PLANE_PROXYTYPE})
    both(other, algorithms_->rigid);
  both(SOFTBODY_SHAPE_PROXYTYPE, algorithms_->soft);
  registerCollisionCreateFunc(SPHERE_SHAPE_PROXYTYPE, SPHERE_SHAPE_PROXYTYPE, &algorithms_->spheres);
}

FieldDispatcher::~FieldDispatcher() = default;

void FieldDispatcher::dispatchAllCollisionPairs(btOverlappingPairCache* pairs, const btDispatcherInfo& info,
                                                btDispatcher* dispatcher) {
  const auto start = std::chrono::steady_clock::now();
  figures_ = {};
  auto& prepared = algorithms_->prepared;
  prepared.clear();
  const auto count = [this](const FieldAlgorithm& algorithm) {
    const Findings& found = algorithm.findings();
    figures_.penetrating += found.penetrating;
    figures_.contacts += found.contacts;
    figures_.deepest = std::max(figures_.deepest, found.deepest);
  };
  const auto mayBeField = [](const btCollisionObject& object) {
    return object.getCollisionShape()->getShapeType() == FAST_CONCAVE_MESH_PROXYTYPE;
  };

  // Collect the pairs of bodies of which at least one is a field, and create algorithms for new pairs.
  btBroadphasePairArray& array = pairs->getOverlappingPairArray();
  for (int i = 0; i < array.size(); ++i) {
    btBroadphasePair& pair = array[i];
    const auto* first = static_cast<btCollisionObject*>(pair.m_pProxy0->m_clientObject);
    const auto* second = static_cast<btCollisionObject*>(pair.m_pProxy1->m_clientObject);
    if (!mayBeField(*first) && !mayBeField(*second)) continue;
    if (!needsCollision(first, second)) {  // sleeping bodies keep their contacts
      if (const auto* algorithm = dynamic_cast<FieldAlgorithm*>(pair.m_algorithm)) count(*algorithm);
      continue;
    }
    if (pair.m_algorithm == nullptr) {
      const btCollisionObjectWrapper one(nullptr, first->getCollisionShape(), first, first->getWorldTransform(), -1,
                                         -1);
      const btCollisionObjectWrapper other(nullptr, second->getCollisionShape(), second, second->getWorldTransform(),
                                           -1, -1);
      pair.m_algorithm = findAlgorithm(&one, &other, nullptr, BT_CONTACT_POINT_ALGORITHMS);
    }
    if (auto* algorithm = dynamic_cast<FieldAlgorithm*>(pair.m_algorithm))
      prepared.push_back({algorithm, first, second});
  }

  // Find the contacts of all collected pairs in parallel, then let Bullet fill the manifolds.
  tbb::parallel_for(std::size_t{0}, prepared.size(),
                    [&](std::size_t i) { prepared[i].algorithm->prepare(*prepared[i].first, *prepared[i].second); });
  figures_.querySeconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  figures_.pairs = prepared.size();
  for (const auto& one : prepared) count(*one.algorithm);
  btCollisionDispatcher::dispatchAllCollisionPairs(pairs, info, dispatcher);
}

}  // namespace hpsdf::physics
