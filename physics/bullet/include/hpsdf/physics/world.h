#pragma once
// Bullet's world of rigid and soft bodies, with signed distance fields as collision shapes.

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
  /// The penetration depth that the solver tolerates, in world units. It should be at most about 1/100 of the
  /// bodies' size. With a value above 0 the contacts of bodies at rest persist from step to step, so that
  /// piles are calmer.
  double slop = 0;
};

struct Material {
  double friction = 0.5;
  double restitution = 0;
  double rollingFriction = 0;
  double linearDamping = 0, angularDamping = 0;
  /// The speed in units per second below which a body counts as resting. A body may sleep once its centre and the
  /// points at its radius have been slower for two seconds, if all bodies that it touches may sleep too. A negative
  /// value selects Bullet's thresholds, which suit bodies of size 1: 0.8 units and 1 radian per second.
  double restSpeed = -1;
};

/// Statistics of one step.
struct StepFigures {
  DispatchFigures dispatch;
  double seconds = 0;        ///< total time
  double solverSeconds = 0;  ///< time of the constraint solver of rigid bodies
};

/// Bullet's world for rigid and soft bodies. It is deterministic: the same bodies, added in the same order, move in the
/// same way for any number of threads.
class World {
 public:
  /// Throws `Error` if an option is invalid. The step must be finite and above 0, gravity finite, the number
  /// of iterations at least 1, and slop finite and not negative.
  explicit World(const WorldOptions& options = {});
  ~World();
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  /// Adds a rigid body and returns its number: 0, 1, … in the order of addition. A body of mass 0 is static. The world
  /// refers to the shape, which must outlive the world. The body's frame is the frame of the shape; a `FieldShape` has
  /// the frame of inertia. Throws `Error` if the mass is negative or not finite, or if the transform is not finite or
  /// not rigid.
  std::size_t add(btCollisionShape& shape, double mass, const Eigen::Isometry3d& worldFromBody,
                  const Material& material = {});

  /// Returns the world info that the constructors of `btSoftBody` take as an argument.
  btSoftBodyWorldInfo& softBodyInfo();
  /// Adds a soft body and returns its number. Soft bodies are numbered 0, 1, …, independently of the rigid
  /// bodies.
  std::size_t add(std::unique_ptr<btSoftBody> body);

  /// Simulates one step. Throws `Error` if a position or velocity is no longer finite, or if a body moves more than a
  /// million units in the step; Bullet would silently skip such a motion. The error names the step and the body. The
  /// world cannot be used after an error.
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
