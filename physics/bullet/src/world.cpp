#include "hpsdf/physics/world.h"

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolver.h>
#include <BulletSoftBody/btSoftBody.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>

#include <chrono>
#include <cmath>
#include <string>

#include "hpsdf/error.h"
#include "rigid_transform.h"

namespace hpsdf::physics {
namespace {

using Clock = std::chrono::steady_clock;

double secondsSince(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

constexpr double kFarthest = 1e6;  // units per step; Bullet silently skips longer motions

bool finite(const btVector3& v) { return std::isfinite(v.x() + v.y() + v.z()); }
bool isPossible(const btVector3& velocity, double step) { return velocity.length() * step < kFarthest; }

}  // namespace

struct World::Parts {
  /// Bullet's constraint solver, extended to measure how long it takes.
  class TimedSolver final : public btSequentialImpulseConstraintSolver {
   public:
    btScalar solveGroup(btCollisionObject** bodies, int bodyCount, btPersistentManifold** manifolds, int manifoldCount,
                        btTypedConstraint** constraints, int constraintCount, const btContactSolverInfo& info,
                        btIDebugDraw* drawer, btDispatcher* dispatcher) override {
      const auto start = Clock::now();
      const btScalar left = btSequentialImpulseConstraintSolver::solveGroup(
          bodies, bodyCount, manifolds, manifoldCount, constraints, constraintCount, info, drawer, dispatcher);
      seconds += secondsSince(start);
      return left;
    }

    double seconds = 0;
  };

  btSoftBodyRigidBodyCollisionConfiguration configuration;
  FieldDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  TimedSolver solver;
  btSoftRigidDynamicsWorld world{&dispatcher, &broadphase, &solver, &configuration};
};

World::World(const WorldOptions& options) : options_(options) {
  if (!(options.step > 0) || !std::isfinite(options.step)) throw Error("world: the step must be a number above 0");
  if (!options.gravity.allFinite()) throw Error("world: gravity must be finite");
  if (options.solverIterations < 1) throw Error("world: the solver needs 1 iteration or more");
  if (!(options.slop >= 0) || !std::isfinite(options.slop)) throw Error("world: slop must be a number, 0 or more");
  parts_ = std::make_unique<Parts>();
  btSoftRigidDynamicsWorld& world = parts_->world;
  world.setGravity(toBullet(options.gravity));
  btContactSolverInfo& info = world.getSolverInfo();
  info.m_numIterations = options.solverIterations;
  // Separate penetrating bodies without adding to their velocities.
  info.m_splitImpulse = 1;
  info.m_splitImpulsePenetrationThreshold = 0;
  info.m_erp2 = 0.5;
  info.m_linearSlop = options.slop;
  btSoftBodyWorldInfo& soft = world.getWorldInfo();
  soft.m_gravity = toBullet(options.gravity);
  soft.m_broadphase = &parts_->broadphase;
  soft.m_dispatcher = &parts_->dispatcher;
  soft.m_sparsesdf.Initialize();
}

World::~World() {
  for (const auto& soft : softBodies_) parts_->world.removeSoftBody(soft.get());
  for (const auto& body : bodies_) parts_->world.removeRigidBody(body.get());
}

std::size_t World::add(btCollisionShape& shape, double mass, const Eigen::Isometry3d& worldFromBody,
                       const Material& material) {
  if (!(mass >= 0) || !std::isfinite(mass)) throw Error("world: a body's mass must be a number, 0 or more");
  if (const char* fault = transformFault(worldFromBody)) throw Error(std::string("world: a body's ") + fault);
  btVector3 inertia(0, 0, 0);
  if (mass > 0) shape.calculateLocalInertia(mass, inertia);
  btRigidBody::btRigidBodyConstructionInfo info(mass, nullptr, &shape, inertia);
  info.m_startWorldTransform = toBullet(worldFromBody);
  info.m_friction = material.friction;
  info.m_restitution = material.restitution;
  info.m_rollingFriction = material.rollingFriction;
  info.m_linearDamping = material.linearDamping;
  info.m_angularDamping = material.angularDamping;
  if (material.restSpeed >= 0) {
    btVector3 center;
    btScalar radius;
    shape.getBoundingSphere(center, radius);
    info.m_linearSleepingThreshold = material.restSpeed;
    info.m_angularSleepingThreshold = material.restSpeed / radius;
  }
  bodies_.push_back(std::make_unique<btRigidBody>(info));
  bodies_.back()->setUserIndex(int(bodies_.size()) - 1);
  parts_->world.addRigidBody(bodies_.back().get());
  return bodies_.size() - 1;
}

btSoftBodyWorldInfo& World::softBodyInfo() { return parts_->world.getWorldInfo(); }

std::size_t World::add(std::unique_ptr<btSoftBody> body) {
  softBodies_.push_back(std::move(body));
  parts_->world.addSoftBody(softBodies_.back().get());
  return softBodies_.size() - 1;
}

void World::step() {
  const auto start = Clock::now();
  parts_->solver.seconds = 0;
  parts_->world.stepSimulation(options_.step, 0);
  ++steps_;
  figures_ = {parts_->dispatcher.figures(), secondsSince(start), parts_->solver.seconds};
  checkFinite();
}

void World::checkFinite() const {
  const auto fail = [&](const std::string& what) {
    throw Error("step " + std::to_string(steps_) + ": " + what +
                " is no longer anywhere: take shorter steps, or stiffness and speeds that are less");
  };
  for (std::size_t n = 0; n < bodies_.size(); ++n) {
    const btTransform& at = bodies_[n]->getWorldTransform();
    if (!finite(at.getOrigin()) || !finite(at.getBasis()[0] + at.getBasis()[1] + at.getBasis()[2]) ||
        !isPossible(bodies_[n]->getLinearVelocity(), options_.step) || !finite(bodies_[n]->getAngularVelocity()))
      fail("body " + std::to_string(n));
  }
  for (std::size_t n = 0; n < softBodies_.size(); ++n)
    for (int node = 0; node < softBodies_[n]->m_nodes.size(); ++node)
      if (!finite(softBodies_[n]->m_nodes[node].m_x) || !isPossible(softBodies_[n]->m_nodes[node].m_v, options_.step))
        fail("node " + std::to_string(node) + " of soft body " + std::to_string(n));
}

Eigen::Isometry3d World::worldFromBody(std::size_t number) const {
  return fromBullet(bodies_[number]->getWorldTransform());
}

btSoftRigidDynamicsWorld& World::bullet() { return parts_->world; }

}  // namespace hpsdf::physics
