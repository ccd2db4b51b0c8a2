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

namespace hpsdf::physics {
namespace {

constexpr std::size_t kMostContacts = SphereMinima::kMost;  // limit for the contacts of two bodies: 3 manifolds of 4
constexpr int kNodes = 256;                                 // number of a soft body's nodes that one task handles
constexpr int kPieces = 64;                                 // greatest number of points sampled on a node's path

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

/// Samples the path of a soft body's node during one step. Returns the first sample at which the field is less than
/// `near`, or the end of the path if there is none. The samples keep nodes from passing through thin bodies.
Vector3 firstContact(const Field& field, const Vector3& from, const Vector3& to, double near) {
  // Choose the number of pieces of the path. A path whose length is NaN or too great gets the maximum number.
  const int pieces = int(std::min(double(kPieces - 1), (to - from).norm() / near)) + 1;
  if (pieces == 1) return to;
  std::array<Vector3, kPieces> points;
  std::array<double, kPieces> values;
  for (int i = 0; i < pieces; ++i) points[i] = from + (to - from) * (double(i + 1) / pieces);
  field.values({points.data(), std::size_t(pieces)}, {values.data(), std::size_t(pieces)});
  for (int i = 0; i < pieces; ++i)
    if (values[i] < near) return points[i];
  return to;
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
    failure_ = nullptr;
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
  reduceContacts(kMostContacts, size_, contacts_);
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
  if (shape.field().lowerBoundAround(center) > radius + margin) return minima_.forget();
  for (const SphereMinimum& minimum : minima_.find(shape.field().field(), center, radius, margin)) {
    const Vector3 at = center + radius * minimum.direction, normal = -(ofField.linear() * minimum.direction);
    if (sphereIsSecond)
      contacts_.push_back({ofField * at, -normal, minimum.value});
    else
      contacts_.push_back({ofField * Vector3(at + minimum.value * minimum.direction), normal, minimum.value});
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
  // Take the current order of the two bodies: Bullet may have changed it since this algorithm was created.
  const btCollisionObject* one = first.getCollisionObject();
  const btCollisionObject* other = second.getCollisionObject();

  // Store the contacts of the previous step, and make room in the manifolds for the new contacts.
  previous_.clear();
  for (btPersistentManifold* manifold : manifolds_) {
    for (int i = 0; i < manifold->getNumContacts(); ++i) previous_.push_back(manifold->getContactPoint(i));
    manifold->clearManifold();
  }
  while (4 * manifolds_.size() < contacts_.size()) manifolds_.push_back(m_dispatcher->getNewManifold(one, other));

  // Add the new contacts to the manifolds. Each contact starts with the impulse of the nearest previous
  // contact, if that is closer than `near`.
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
    const auto nearest = std::ranges::min_element(
        previous_, {}, [&](const btManifoldPoint& old) { return old.m_localPointB.distance2(point.m_localPointB); });
    if (nearest != previous_.end() && nearest->m_localPointB.distance2(point.m_localPointB) < near * near) {
      point.m_appliedImpulse = nearest->m_appliedImpulse;  // Bullet does not reuse friction impulses
      previous_.erase(nearest);
    }
    manifolds_[i / 4]->addManifoldPoint(point);
  }
}

/// A soft body and a field that may touch in one step. Positions are in the field's coordinates.
struct SoftFieldAlgorithm::Pair {
  Pair(const btSoftBody& body, const btCollisionObject& object)
      : soft(body),
        shape(*fieldOf(object)),
        worldFromField(worldFromMesh(object, shape)),
        fieldFromWorld(worldFromField.inverse()),
        margin(body.getCollisionShape()->getMargin()),
        near(margin / 2) {}

  Vector3 startOf(int node) const { return fieldFromWorld * fromBullet(soft.m_nodes[node].m_q); }
  Vector3 endOf(int node) const { return fieldFromWorld * fromBullet(soft.m_nodes[node].m_x); }

  const btSoftBody& soft;
  const FieldShape& shape;
  Eigen::Isometry3d worldFromField, fieldFromWorld;
  double margin;  ///< distance within which nodes count as touching
  double near;    ///< distance from the surface at which a node's path ends
};

/// Nodes that may touch the field.
struct SoftFieldAlgorithm::Candidates {
  std::size_t count = 0;
  std::array<int, kNodes> nodes;
  std::array<Vector3, kNodes> starts, ends;  ///< starts and ends of the nodes' paths
  std::array<Vector3, kNodes> at;            ///< point of contact, if the node touches the field
};

void SoftFieldAlgorithm::find(const btCollisionObject& first, const btCollisionObject& second, Findings& findings) {
  const btCollisionObject& object = fieldOf(first) != nullptr ? first : second;
  if (fieldOf(object) == nullptr) return;  // skips parts of compound shapes
  const Pair pair(*btSoftBody::upcast(&object == &first ? &second : &first), object);
  const int count = pair.soft.m_nodes.size();
  if (int(outside_.size()) != count) {
    outside_.clear();
    for (int node = 0; node < count; ++node) outside_.push_back(pair.startOf(node));
  }
  parts_.resize((count + kNodes - 1) / kNodes);
  tbb::parallel_for(std::size_t{0}, parts_.size(), [&](std::size_t part) {
    const int begin = int(part) * kNodes;
    keepTouching(pair, candidates(pair, begin, std::min(count, begin + kNodes)), parts_[part]);
  });
  for (const std::vector<Touching>& part : parts_) {
    findings.contacts += part.size();
    for (const Touching& node : part) findings.add(node.depth);
  }
}

SoftFieldAlgorithm::Candidates SoftFieldAlgorithm::candidates(const Pair& pair, int begin, int end) {
  const FieldCollider& field = pair.shape.field();
  Candidates found;
  for (int node = begin; node < end; ++node) {
    const Vector3 from = pair.startOf(node), to = pair.endOf(node);
    if (!from.allFinite() || !to.allFinite()) continue;  // the world reports this error at the end of the step
    Vector3& outside = outside_[std::size_t(node)];
    if ((to - outside).norm() > kPieces * pair.near) outside = from;
    if (pair.soft.m_nodes[node].m_battach != 0 || field.lowerBound(to) > pair.margin + (to - outside).norm()) {
      outside = to;
      continue;
    }
    found.nodes[found.count] = node;
    found.starts[found.count] = from;
    found.ends[found.count] = to;
    found.at[found.count] = firstContact(field.field(), outside, to, pair.near);
    ++found.count;
  }
  return found;
}

void SoftFieldAlgorithm::keepTouching(const Pair& pair, const Candidates& all, std::vector<Touching>& touching) {
  const Field& field = pair.shape.field().field();
  std::array<ValueAndGradient, kNodes> answers;
  std::array<double, kNodes> values;
  field.valuesAndGradients({all.at.data(), all.count}, {answers.data(), all.count});
  field.values({all.starts.data(), all.count}, {values.data(), all.count});
  touching.clear();
  for (std::size_t i = 0; i < all.count; ++i) {
    if (answers[i].value >= 0) outside_[std::size_t(all.nodes[i])] = all.at[i];
    const double steepness = answers[i].gradient.norm();
    if (!(steepness > 0)) continue;
    const Vector3 normal = answers[i].gradient / steepness;
    // Beyond the point of contact, the field's surface is approximated by its tangent plane at this point.
    const double distance = answers[i].value + normal.dot(all.ends[i] - all.at[i]);
    if (distance < pair.margin)
      touching.push_back({all.nodes[i], pair.worldFromField.linear() * normal, distance, -values[i]});
  }
}

void SoftFieldAlgorithm::fill(const btCollisionObjectWrapper& first, const btCollisionObjectWrapper& second) {
  if (parts_.empty()) return;
  // Fill in the contact data that the solver of btSoftBody reads for its contacts with rigid bodies.
  const bool fieldIsFirst = fieldOf(*first.getCollisionObject()) != nullptr;
  const btCollisionObject& object = *(fieldIsFirst ? first : second).getCollisionObject();
  // Remove const from the soft body: Bullet passes const objects to algorithms, although it expects
  // algorithms to change them.
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
      contact.t1.setZero();  // t1 and t2 are for multibodies
      contact.t2.setZero();
      contact.m_cti.m_colObj = &object;
      contact.m_cti.m_normal = toBullet(touching.normal);
      // Half of the margin is the thickness of the soft body; subtract it from the node's distance.
      const double height = touching.distance - margin / 2;
      contact.m_cti.m_offset = height - contact.m_cti.m_normal.dot(node.m_x);
      const btVector3 arm = node.m_x - transform.getOrigin();
      const btVector3 bodyMotion = rigid != nullptr ? rigid->getVelocityInLocalPoint(arm) * step : btVector3(0, 0, 0);
      if (height > contact.m_cti.m_normal.dot(bodyMotion)) continue;
      // The solver cancels the node's motion towards the surface since its earlier position m_q. Move m_q onto
      // the surface: the motion is then exactly the penetration, and the correction adds no velocity.
      node.m_q -= (contact.m_cti.m_normal.dot(node.m_q) + contact.m_cti.m_offset) * contact.m_cti.m_normal;
      const btVector3 relative = node.m_x - node.m_q - bodyMotion;
      const btScalar along = relative.dot(contact.m_cti.m_normal);
      const btVector3 sliding = relative - along * contact.m_cti.m_normal;
      contact.m_node = &node;
      contact.m_c0 = ImpulseMatrix(step, node.m_im, inverseMass, inverseInertia, arm);
      contact.m_c1 = arm;
      contact.m_c2 = node.m_im * step;
      contact.m_c3 = sliding.length() < std::abs(along) * friction ? 0 : 1 - friction;
      contact.m_c4 = 0;  // no additional stiffness
      soft.m_rcontacts.push_back(contact);
      if (rigid != nullptr) rigid->activate();
    }
}

}  // namespace hpsdf::physics
