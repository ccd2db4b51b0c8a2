#pragma once
// Bullet's rigid and soft bodies with fields as colliders, a step at a time.

#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "hpsdf/physics/bullet.h"

namespace hpsdf::physics {

struct WorldOptions {
  Vector3 gravity = {0, 0, -9.81};  ///< units a second²
  double step = 1.0 / 240;          ///< seconds
  int solverIterations = 20;
  /// So deep bodies may rest in each other, in units: some hundredth of their size or less. Contacts then do not come
  /// and go from step to step, and piles are calmer.
  double slop = 0;
};

struct Material {
  double friction = 0.5;
  double restitution = 0;
  double rollingFriction = 0;
  double linearDamping = 0, angularDamping = 0;
  /// A body that for two seconds moves slower than this, and turns slower than this over its radius, may fall asleep,
  /// if all do that it touches; units a second. Below 0 what Bullet has for bodies of size 1: 0.8, and 1 radian.
  double restSpeed = -1;
};

/// Of one step.
struct StepFigures {
  DispatchFigures dispatch;
  double seconds = 0;        ///< in all
  double solverSeconds = 0;  ///< of the rigid bodies' constraints
};

/// Bullet's world for rigid and soft bodies. Deterministic: the same bodies, added in the same order, move the same,
/// for any number of threads.
class World {
 public:
  /// Throws `Error` unless the step is above 0 and finite, gravity finite, there is one iteration at least, and slop is
  /// 0 or above and finite.
  explicit World(const WorldOptions& options = {});
  ~World();
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  /// A rigid body, static where its mass is 0. Refers to the shape, which must outlive the world. Its frame is the
  /// shape's (of a `FieldShape` that of its inertia). Returns its number, from 0 in the order in which bodies were
  /// added. Throws `Error` for a mass below 0 or not finite and for a transform that is not finite or not rigid.
  std::size_t add(btCollisionShape& shape, double mass, const Eigen::Isometry3d& worldFromBody,
                  const Material& material = {});

  /// For `btSoftBody`'s constructors.
  btSoftBodyWorldInfo& softBodyInfo();
  /// Takes a soft body over. Returns its number, by itself from 0.
  std::size_t add(std::unique_ptr<btSoftBody> body);

  /// Throws `Error` where a body's place or speed is no longer finite, or where it would go a million units in a step
  /// (Bullet leaves such a body where it was, without a word), naming step and body; the world is of no use then.
  void step();

  std::uint64_t steps() const { return steps_; }
  double seconds() const { return double(steps_) * options_.step; }  ///< simulated
  const StepFigures& figures() const { return figures_; }            ///< of the last step

  std::size_t bodies() const { return bodies_.size(); }
  btRigidBody& body(std::size_t number) { return *bodies_[number]; }
  const btRigidBody& body(std::size_t number) const { return *bodies_[number]; }
  Eigen::Isometry3d worldFromBody(std::size_t number) const;
  std::size_t softBodies() const { return softBodies_.size(); }
  btSoftBody& softBody(std::size_t number) { return *softBodies_[number]; }
  const btSoftBody& softBody(std::size_t number) const { return *softBodies_[number]; }

  btSoftRigidDynamicsWorld& bullet();

 private:
  struct Parts;
  void checkFinite() const;

  WorldOptions options_;
  std::unique_ptr<Parts> parts_;
  std::vector<std::unique_ptr<btRigidBody>> bodies_;
  std::vector<std::unique_ptr<btSoftBody>> softBodies_;
  std::uint64_t steps_ = 0;
  StepFigures figures_;
};

}  // namespace hpsdf::physics
