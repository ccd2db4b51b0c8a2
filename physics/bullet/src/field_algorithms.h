#pragma once
// Bullet collision algorithms for bodies whose shape is a signed distance field.

#include <BulletCollision/BroadphaseCollision/btDispatcher.h>
#include <BulletCollision/CollisionDispatch/btActivatingCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btCollisionCreateFunc.h>
#include <BulletCollision/NarrowPhaseCollision/btManifoldPoint.h>

#include <exception>
#include <vector>

#include "hpsdf/physics/field_shape.h"
#include "reduce_contacts.h"
#include "sphere_minima.h"

class btSoftBody;

namespace hpsdf::physics {

/// Statistics of the contacts of one pair of bodies. The members mean the same as in `DispatchFigures`.
struct Findings {
  std::size_t penetrating = 0, contacts = 0;
  double deepest = 0;

  void add(double depth);  ///< counts a contact of this depth if it penetrates
};

/// A collision algorithm that can find its contacts before Bullet asks for them.
class FieldAlgorithm : public btActivatingCollisionAlgorithm {
 public:
  FieldAlgorithm(const btCollisionAlgorithmConstructionInfo& info, const btCollisionObjectWrapper* first,
                 const btCollisionObjectWrapper* second)
      : btActivatingCollisionAlgorithm(info, first, second) {}

  /// Finds the contacts of two bodies without changing any Bullet object. If an exception occurs, it is
  /// stored, and `processCollision` throws it.
  void prepare(const btCollisionObject& first, const btCollisionObject& second) noexcept;

  /// Passes the contacts to Bullet's solvers. If `prepare` was not called before, finds the contacts first.
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

/// The collision of a field with another field, a sphere or a static plane.
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
  SphereMinima minima_;  ///< minima of the field over the sphere, if one of the bodies is a sphere
  double size_ = 0;      ///< radius of the smaller body's bounding sphere
  std::vector<btPersistentManifold*> manifolds_;
  std::vector<btManifoldPoint> previous_;  ///< the contacts of the previous step
};

/// The collision of a soft body's nodes with a field.
class SoftFieldAlgorithm final : public FieldAlgorithm {
 public:
  using FieldAlgorithm::FieldAlgorithm;
  void getAllContactManifolds(btManifoldArray&) override {}

 private:
  /// A node of the soft body whose distance from the field's surface is less than the margin.
  struct Touching {
    int node;
    Vector3 normal;   ///< unit normal of the contact plane, in the world
    double distance;  ///< distance of the node from the contact plane at the end of the step
    double depth;     ///< penetration at the start of the step
  };
  struct Pair;
  struct Candidates;

  void find(const btCollisionObject& first, const btCollisionObject& second, Findings& findings) override;
  void fill(const btCollisionObjectWrapper& first, const btCollisionObjectWrapper& second) override;

  /// Returns those nodes from `begin` to `end` (exclusive) that may touch the field.
  Candidates candidates(const Pair& pair, int begin, int end);
  /// Replaces `touching` by those candidates that touch the field.
  void keepTouching(const Pair& pair, const Candidates& all, std::vector<Touching>& touching);

  std::vector<Vector3> outside_;              ///< each node's last position outside the body, in field coordinates
  std::vector<std::vector<Touching>> parts_;  ///< touching nodes of each group of `kNodes` nodes
};

/// Creates a collision algorithm in memory of Bullet's dispatcher.
template <typename Algorithm>
struct CreateAlgorithm final : btCollisionAlgorithmCreateFunc {
  btCollisionAlgorithm* CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                 const btCollisionObjectWrapper* first,
                                                 const btCollisionObjectWrapper* second) override {
    void* memory = info.m_dispatcher1->allocateCollisionAlgorithm(sizeof(Algorithm));
    return new (memory) Algorithm(info, first, second);
  }
};

}  // namespace hpsdf::physics
