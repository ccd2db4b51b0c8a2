#pragma once
// Bullet's world of rigid and soft bodies with fields as colliders.

#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "hpsdf/physics/field_dispatcher.h"
#include "hpsdf/physics/field_shape.h"

namespace hpsdf::physics {

struct WorldOptions {
  Vector3 gravity = {0, 0, -9.81};  ///< units per second²
  double step = 1.0 / 240;          ///< seconds
  int solverIterations = 20;
  /// The penetration that the solver tolerates, in units, at most about 1/100 of the bodies' size. A value above 0
  /// makes contacts at rest persist from step to step, so that piles are calmer.
  double slop = 0;
};

struct Material {
  double friction = 0.5;
  double restitution = 0;
  double rollingFriction = 0;
  double linearDamping = 0, angularDamping = 0;
  /// Speed in units per second below which a body comes to rest: after two seconds of slower motion (of its centre, and
  /// of points at its radius) it may sleep, if all bodies that it touches may. A negative value stands for Bullet's
  /// thresholds for bodies of size 1: 0.8 units and 1 radian per second.
  double restSpeed = -1;
};

/// Figures of one step.
struct StepFigures {
  DispatchFigures dispatch;
  double seconds = 0;        ///< total time
  double solverSeconds = 0;  ///< time of the constraint solver of rigid bodies
};

/// Bullet's world for rigid and soft bodies. It is deterministic: the same bodies, added in the same order, move in the
/// same way for any number of threads.
class World {
 public:
  /// Throws `Error` unless the step is above 0 and finite, gravity is finite, there is at least one iteration, and slop
  /// is finite and not negative.
  explicit World(const WorldOptions& options = {});
  ~World();
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  /// Adds a rigid body, which is static if its mass is 0, and returns its number: 0, 1, … in the order of addition.
  /// The world refers to the shape, which must outlive it. The body's frame is that of the shape (for a `FieldShape`
  /// the frame of inertia). Throws `Error` for a mass that is negative or not finite and for a transform that is not
  /// finite or not rigid.
  std::size_t add(btCollisionShape& shape, double mass, const Eigen::Isometry3d& worldFromBody,
                  const Material& material = {});

  /// The argument of `btSoftBody`'s constructors.
  btSoftBodyWorldInfo& softBodyInfo();
  /// Adds a soft body and returns its number; soft bodies have their own numbers 0, 1, ….
  std::size_t add(std::unique_ptr<btSoftBody> body);

  /// Throws `Error`, which names the step and the body, if a position or velocity is no longer finite, or if a body
  /// moves a million units in one step: Bullet silently skips such motions. The world cannot be used afterwards.
  void step();

  std::uint64_t steps() const { return steps_; }
  double seconds() const { return double(steps_) * options_.step; }  ///< simulated time
  const StepFigures& figures() const { return figures_; }            ///< figures of the last step

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
