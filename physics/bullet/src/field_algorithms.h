#pragma once

#include <BulletCollision/BroadphaseCollision/btDispatcher.h>
#include <BulletCollision/CollisionDispatch/btActivatingCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btCollisionCreateFunc.h>

#include <exception>
#include <vector>

#include "hpsdf/physics/bullet.h"
#include "sphere_feet.h"
#include "spread.h"

class btSoftBody;

namespace hpsdf::physics {

struct Findings {
  std::size_t penetrating = 0, contacts = 0;
  double deepest = 0;

  void add(double depth);  ///< of a contact
};

/// An algorithm whose contacts can be found before Bullet asks for them.
class FieldAlgorithm : public btActivatingCollisionAlgorithm {
 public:
  FieldAlgorithm(const btCollisionAlgorithmConstructionInfo& info, const btCollisionObjectWrapper* first,
                 const btCollisionObjectWrapper* second)
      : btActivatingCollisionAlgorithm(info, first, second) {}

  /// Finds the contacts, and touches nothing of Bullet's. What throws is thrown from `processCollision`.
  void prepare(const btCollisionObject& first, const btCollisionObject& second) noexcept;

  /// Fills what Bullet's solvers take: what was prepared, or else is found now.
  void processCollision(const btCollisionObjectWrapper* first, const btCollisionObjectWrapper* second,
                        const btDispatcherInfo& info, btManifoldResult* result) final;

  btScalar calculateTimeOfImpact(btCollisionObject*, btCollisionObject*, const btDispatcherInfo&,
                                 btManifoldResult*) final {
    return 1;
  }

  const Findings& findings() const { return findings_; }

 protected:
  virtual void find(const btCollisionObject& first, const btCollisionObject& second, Findings& findings) = 0;
  virtual void fill(const btCollisionObjectWrapper& first, const btCollisionObjectWrapper& second) = 0;

 private:
  bool prepared_ = false;
  std::exception_ptr failure_;
  Findings findings_;
};

/// A field against another, a sphere or a plane.
class RigidFieldAlgorithm final : public FieldAlgorithm {
 public:
  using FieldAlgorithm::FieldAlgorithm;
  ~RigidFieldAlgorithm() override;
  void getAllContactManifolds(btManifoldArray& manifolds) override;

 private:
  void find(const btCollisionObject& first, const btCollisionObject& second, Findings& findings) override;
  void fill(const btCollisionObjectWrapper& first, const btCollisionObjectWrapper& second) override;

  void betweenFields(const btCollisionObject& first, const btCollisionObject& second);
  void withSphere(const btCollisionObject& field, const btCollisionObject& sphere, bool sphereIsSecond);
  void withPlane(const btCollisionObject& field, const btCollisionObject& plane, bool planeIsSecond);

  ContactQuery query_;
  std::vector<BodyContact> contacts_;
  SphereFeet feet_;  ///< of the sphere, if one is
  double size_ = 0;  ///< of the smaller body
  std::vector<btPersistentManifold*> manifolds_;
  std::vector<btManifoldPoint> before_;
};

/// The nodes of a soft body against a field.
class SoftFieldAlgorithm final : public FieldAlgorithm {
 public:
  using FieldAlgorithm::FieldAlgorithm;
  void getAllContactManifolds(btManifoldArray&) override {}

 private:
  struct Touching {
    int node;
    Vector3 normal;   ///< in the world
    double distance;  ///< at the end of the step, by the plane of where it touches
    double depth;     ///< at the step's start
  };
  struct Meeting;
  struct Candidates;

  void find(const btCollisionObject& first, const btCollisionObject& second, Findings& findings) override;
  void fill(const btCollisionObjectWrapper& first, const btCollisionObjectWrapper& second) override;

  /// Of the nodes from `begin` up to `end`, not with it.
  Candidates candidates(const Meeting& meeting, int begin, int end);
  void keepTouching(const Meeting& meeting, const Candidates& all, std::vector<Touching>& touching);

  std::vector<Vector3> outside_;              ///< where each node was last outside of the field, in its coordinates
  std::vector<std::vector<Touching>> parts_;  ///< of each so many nodes, in their order
};

template <typename Algorithm>
struct CreateAlgorithm final : btCollisionAlgorithmCreateFunc {
  btCollisionAlgorithm* CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                 const btCollisionObjectWrapper* first,
                                                 const btCollisionObjectWrapper* second) override {
    void* room = info.m_dispatcher1->allocateCollisionAlgorithm(sizeof(Algorithm));
    return new (room) Algorithm(info, first, second);
  }
};

}  // namespace hpsdf::physics
