#include "field_algorithms.h"

#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>
#include <BulletSoftBody/btSoftBody.h>
#include <BulletSoftBody/btSoftBodyInternals.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace hpsdf::physics {
namespace {

constexpr std::size_t kMostContacts = 12;  // of two bodies: three of Bullet's manifolds
constexpr int kNodes = 256;                // of a soft body that are looked up together

const FieldShape* fieldOf(const btCollisionObject& object) {
  return dynamic_cast<const FieldShape*>(object.getCollisionShape());
}

Eigen::Isometry3d worldFromMesh(const btCollisionObject& object, const FieldShape& shape) {
  return fromBullet(object.getWorldTransform()) * shape.bodyFromMesh();
}

double sizeOf(const btCollisionObject& object) {
  btVector3 center;
  btScalar radius;
  object.getCollisionShape()->getBoundingSphere(center, radius);
  return radius;
}

constexpr std::size_t kDirections = 128;
constexpr double kOneSide = 0.9;  // cosine between normals

/// Evenly spread, along a spiral: no direction is farther than some 0.2 radians from one of them.
const std::array<Vector3, kDirections>& directionsAllAround() {
  static const std::array<Vector3, kDirections> directions = [] {
    std::array<Vector3, kDirections> made;
    const double turn = std::numbers::pi * (3 - std::sqrt(5.0));
    for (std::size_t i = 0; i < kDirections; ++i) {
      const double z = 1 - (2 * double(i) + 1) / kDirections, r = std::sqrt(1 - z * z);
      made[i] = {r * std::cos(turn * double(i)), r * std::sin(turn * double(i)), z};
    }
    return made;
  }();
  return directions;
}

}  // namespace

void Findings::add(double depth) {
  if (!(depth > 0)) return;
  ++penetrating;
  deepest = std::max(deepest, depth);
}

void FieldAlgorithm::prepare(const btCollisionObject& first, const btCollisionObject& second) noexcept {
  try {
    findings_ = {};
    find(first, second, findings_);
  } catch (...) {
    failure_ = std::current_exception();
  }
  prepared_ = true;
}

void FieldAlgorithm::processCollision(const btCollisionObjectWrapper* first, const btCollisionObjectWrapper* second,
                                      const btDispatcherInfo&, btManifoldResult*) {
  if (!prepared_) prepare(*first->getCollisionObject(), *second->getCollisionObject());
  prepared_ = false;
  if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
  fill(*first, *second);
}

RigidFieldAlgorithm::~RigidFieldAlgorithm() {
  for (btPersistentManifold* manifold : manifolds_) m_dispatcher->releaseManifold(manifold);
}

void RigidFieldAlgorithm::getAllContactManifolds(btManifoldArray& manifolds) {
  for (btPersistentManifold* manifold : manifolds_) manifolds.push_back(manifold);
}

void RigidFieldAlgorithm::find(const btCollisionObject& first, const btCollisionObject& second, Findings& findings) {
  contacts_.clear();
  size_ = std::min(sizeOf(first), sizeOf(second));
  const FieldShape* one = fieldOf(first);
  const FieldShape* other = fieldOf(second);
  const auto is = [](const btCollisionObject& object, int type) {
    return object.getCollisionShape()->getShapeType() == type;
  };
  if (one != nullptr && other != nullptr)
    betweenFields(first, second);
  else if (one != nullptr && is(second, SPHERE_SHAPE_PROXYTYPE))
    withSphere(first, second, true);
  else if (other != nullptr && is(first, SPHERE_SHAPE_PROXYTYPE))
    withSphere(second, first, false);
  else if (one != nullptr && is(second, STATIC_PLANE_PROXYTYPE))
    withPlane(first, second, true);
  else if (other != nullptr && is(first, STATIC_PLANE_PROXYTYPE))
    withPlane(second, first, false);
  for (const BodyContact& contact : contacts_) findings.add(-contact.distance);
  spread(kMostContacts, size_, contacts_);
  findings.contacts = contacts_.size();
}

void RigidFieldAlgorithm::betweenFields(const btCollisionObject& first, const btCollisionObject& second) {
  const FieldShape &one = *fieldOf(first), &other = *fieldOf(second);
  const Eigen::Isometry3d ofOne = worldFromMesh(first, one), ofOther = worldFromMesh(second, other);
  const ContactOptions options{.margin = std::min(one.getMargin(), other.getMargin())};
  for (const Contact& contact : query_.find({&one.samples(), ofOne, &other.field(), ofOther}, options))
    contacts_.push_back({contact.position + contact.depth * contact.normal, contact.normal, -contact.depth});
  for (const Contact& contact : query_.find({&other.samples(), ofOther, &one.field(), ofOne}, options))
    contacts_.push_back({contact.position, -contact.normal, -contact.depth});
}

void RigidFieldAlgorithm::withSphere(const btCollisionObject& field, const btCollisionObject& sphere,
                                     bool sphereIsSecond) {
  const FieldShape& shape = *fieldOf(field);
  const double radius = static_cast<const btSphereShape*>(sphere.getCollisionShape())->getRadius();
  const Eigen::Isometry3d ofField = worldFromMesh(field, shape);
  const Vector3 center = ofField.inverse() * fromBullet(sphere.getWorldTransform().getOrigin());
  const double margin = std::min(shape.getMargin(), 0.1 * radius);
  if (shape.field().lowerBoundAround(center) > radius + margin) return;
  // the nearest point of the field's surface, and what is near the sphere elsewhere, as the other side of a groove
  std::array<Vector3, kDirections + 1> points;
  std::array<ValueAndGradient, kDirections + 1> answers;
  const std::array<Vector3, kDirections>& directions = directionsAllAround();
  for (std::size_t i = 0; i < kDirections; ++i) points[i] = center + radius * directions[i];
  points[kDirections] = center;
  shape.field().field().valuesAndGradients(points, answers);
  answers[kDirections].value -= radius;
  touching_.clear();
  for (const ValueAndGradient& answer : answers) {
    const double steepness = answer.gradient.norm();
    // between directions the sphere reaches up to a tenth of its radius farther
    if (answer.value < margin + 0.1 * radius && steepness > 0)
      touching_.push_back({Vector3::Zero(), answer.gradient / steepness, answer.value});
  }
  // those of one side tell the same
  std::ranges::stable_sort(touching_, {}, &BodyContact::distance);
  std::size_t kept = 0;
  for (const BodyContact& candidate : touching_) {
    const auto end = touching_.begin() + std::ptrdiff_t(kept);
    if (kept == kMostContacts || std::any_of(touching_.begin(), end, [&](const BodyContact& other) {
          return other.normal.dot(candidate.normal) > kOneSide;
        }))
      continue;
    touching_[kept++] = candidate;
  }
  for (std::size_t i = 0; i < kept; ++i) {
    const Vector3 outwards = touching_[i].normal, foot = center - radius * outwards;
    const double value = shape.field().field().value(foot);
    if (value > margin) continue;
    const Vector3 normal = ofField.linear() * outwards;
    if (sphereIsSecond)
      contacts_.push_back({ofField * foot, -normal, value});
    else
      contacts_.push_back({ofField * Vector3(foot - value * outwards), normal, value});
  }
}

void RigidFieldAlgorithm::withPlane(const btCollisionObject& field, const btCollisionObject& plane,
                                    bool planeIsSecond) {
  const FieldShape& shape = *fieldOf(field);
  const auto& flat = *static_cast<const btStaticPlaneShape*>(plane.getCollisionShape());
  const Eigen::Isometry3d worldFromSamples = worldFromMesh(field, shape);
  const Eigen::Isometry3d worldFromPlane = fromBullet(plane.getWorldTransform());
  const Vector3 normal = worldFromPlane.linear() * fromBullet(flat.getPlaneNormal());
  const double offset = flat.getPlaneConstant() + normal.dot(worldFromPlane.translation());
  const std::span<const Sphere> spheres = shape.samples().spheres();
  for (std::uint32_t node = 0; node < spheres.size();) {
    const Sphere& sphere = spheres[node];
    if (normal.dot(worldFromSamples * sphere.center) - offset > sphere.radius * (1 + 1e-9) + shape.getMargin()) {
      node = sphere.next;
      continue;
    }
    if (++node < sphere.next) continue;
    for (std::uint32_t i = sphere.begin; i < sphere.end; ++i) {
      const Vector3 x = worldFromSamples * shape.samples().points()[i];
      const double distance = normal.dot(x) - offset;
      if (distance > shape.getMargin()) continue;
      if (planeIsSecond)
        contacts_.push_back({x - distance * normal, normal, distance});
      else
        contacts_.push_back({x, -normal, distance});
    }
  }
}

void RigidFieldAlgorithm::fill(const btCollisionObjectWrapper& first, const btCollisionObjectWrapper& second) {
  // in Bullet's order of the bodies, which may have been the other way round when this was made
  const btCollisionObject* one = first.getCollisionObject();
  const btCollisionObject* other = second.getCollisionObject();
  before_.clear();
  for (btPersistentManifold* manifold : manifolds_) {
    for (int i = 0; i < manifold->getNumContacts(); ++i) before_.push_back(manifold->getContactPoint(i));
    manifold->clearManifold();
  }
  while (4 * manifolds_.size() < contacts_.size()) manifolds_.push_back(m_dispatcher->getNewManifold(one, other));
  const double near = 0.1 * size_;
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    const BodyContact& contact = contacts_[i];
    const btVector3 onSecond = toBullet(contact.onSecond), normal = toBullet(contact.normal);
    const btVector3 onFirst = onSecond + contact.distance * normal;
    btManifoldPoint point(one->getWorldTransform().invXform(onFirst), other->getWorldTransform().invXform(onSecond),
                          normal, contact.distance);
    point.m_positionWorldOnA = onFirst;
    point.m_positionWorldOnB = onSecond;
    point.m_combinedFriction = btManifoldResult::calculateCombinedFriction(one, other);
    point.m_combinedRestitution = btManifoldResult::calculateCombinedRestitution(one, other);
    point.m_combinedRollingFriction = btManifoldResult::calculateCombinedRollingFriction(one, other);
    point.m_combinedSpinningFriction = btManifoldResult::calculateCombinedSpinningFriction(one, other);
    // the solver starts from what it found for the nearest one in the step before
    const auto nearest = std::ranges::min_element(
        before_, {}, [&](const btManifoldPoint& old) { return old.m_localPointB.distance2(point.m_localPointB); });
    if (nearest != before_.end() && nearest->m_localPointB.distance2(point.m_localPointB) < near * near) {
      point.m_appliedImpulse = nearest->m_appliedImpulse;
      point.m_appliedImpulseLateral1 = nearest->m_appliedImpulseLateral1;
      point.m_appliedImpulseLateral2 = nearest->m_appliedImpulseLateral2;
      before_.erase(nearest);
    }
    manifolds_[i / 4]->addManifoldPoint(point);
  }
}

void SoftFieldAlgorithm::find(const btCollisionObject& first, const btCollisionObject& second, Findings& findings) {
  const btCollisionObject& object = fieldOf(first) != nullptr ? first : second;
  const btCollisionObject& softObject = &object == &first ? second : first;
  const FieldShape& shape = *fieldOf(object);
  const btSoftBody& soft = *btSoftBody::upcast(&softObject);
  const Eigen::Isometry3d ofField = worldFromMesh(object, shape), fromWorld = ofField.inverse();
  const double margin = soft.getCollisionShape()->getMargin();
  const int count = soft.m_nodes.size();
  parts_.resize((count + kNodes - 1) / kNodes);
  tbb::parallel_for(std::size_t{0}, parts_.size(), [&](std::size_t part) {
    std::vector<Touching>& touching = parts_[part];
    touching.clear();
    std::array<Vector3, kNodes> points;
    std::array<ValueAndGradient, kNodes> answers;
    const int begin = int(part) * kNodes, end = std::min(count, begin + kNodes);
    for (int node = begin; node < end; ++node) {
      const Vector3 x = fromWorld * fromBullet(soft.m_nodes[node].m_x);
      if (soft.m_nodes[node].m_battach != 0 || shape.field().lowerBound(x) > margin) continue;
      points[touching.size()] = x;
      touching.push_back({.node = node});
    }
    shape.field().field().valuesAndGradients({points.data(), touching.size()}, {answers.data(), touching.size()});
    std::size_t kept = 0;
    for (std::size_t i = 0; i < touching.size(); ++i) {
      const double steepness = answers[i].gradient.norm();
      if (!(answers[i].value < margin && steepness > 0)) continue;
      touching[kept++] = {touching[i].node, ofField.linear() * (answers[i].gradient / steepness), answers[i].value};
    }
    touching.resize(kept);
  });
  for (const std::vector<Touching>& part : parts_) {
    findings.contacts += part.size();
    for (const Touching& node : part) findings.add(-node.distance);
  }
}

void SoftFieldAlgorithm::fill(const btCollisionObjectWrapper& first, const btCollisionObjectWrapper& second) {
  // what btSoftBody's solver of rigid contacts asks for
  const bool fieldIsFirst = fieldOf(*first.getCollisionObject()) != nullptr;
  const btCollisionObject& object = *(fieldIsFirst ? first : second).getCollisionObject();
  // Bullet hands const objects to algorithms that are there to change them
  btSoftBody& soft = *const_cast<btSoftBody*>(btSoftBody::upcast((fieldIsFirst ? second : first).getCollisionObject()));
  btRigidBody* rigid = const_cast<btRigidBody*>(btRigidBody::upcast(&object));
  const double step = soft.m_sst.sdt, margin = soft.getCollisionShape()->getMargin();
  const btTransform& transform = object.getWorldTransform();
  const btScalar inverseMass = rigid != nullptr ? rigid->getInvMass() : 0;
  const btMatrix3x3 inverseInertia =
      rigid != nullptr ? rigid->getInvInertiaTensorWorld() : btMatrix3x3(0, 0, 0, 0, 0, 0, 0, 0, 0);
  const btScalar friction = soft.m_cfg.kDF * object.getFriction();
  for (const std::vector<Touching>& part : parts_)
    for (const Touching& touching : part) {
      btSoftBody::Node& node = soft.m_nodes[touching.node];
      if (!(node.m_im + inverseMass > 0)) continue;
      btSoftBody::RContact contact;
      contact.t1.setZero();  // of multibodies, as t2
      contact.t2.setZero();
      contact.m_cti.m_colObj = &object;
      contact.m_cti.m_normal = toBullet(touching.normal);
      // half of the margin is the body's thickness
      contact.m_cti.m_offset = touching.distance - margin / 2 - contact.m_cti.m_normal.dot(node.m_x);
      const btVector3 arm = node.m_x - transform.getOrigin();
      const btVector3 ofBody = rigid != nullptr ? rigid->getVelocityInLocalPoint(arm) * step : btVector3(0, 0, 0);
      const btVector3 relative = node.m_x - node.m_q - ofBody;
      const btScalar along = relative.dot(contact.m_cti.m_normal);
      const btVector3 sliding = relative - along * contact.m_cti.m_normal;
      contact.m_node = &node;
      contact.m_c0 = ImpulseMatrix(step, node.m_im, inverseMass, inverseInertia, arm);
      contact.m_c1 = arm;
      contact.m_c2 = node.m_im * step;
      contact.m_c3 = sliding.length() < std::abs(along) * friction ? 0 : 1 - friction;
      contact.m_c4 = object.isStaticOrKinematicObject() ? soft.m_cfg.kKHR : soft.m_cfg.kCHR;
      soft.m_rcontacts.push_back(contact);
      if (rigid != nullptr) rigid->activate();
    }
}

}  // namespace hpsdf::physics
