// Contacts of the same two bodies by Bullet's GImpact (triangle against triangle), in double precision as in Debian.

#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletCollision/CollisionDispatch/btCollisionObject.h>
#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionDispatch/btDefaultCollisionConfiguration.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <BulletCollision/CollisionShapes/btTriangleIndexVertexArray.h>
#include <BulletCollision/Gimpact/btGImpactCollisionAlgorithm.h>
#include <BulletCollision/Gimpact/btGImpactShape.h>

#include <cmath>
#include <optional>

#include "contact_places.h"
#include "hpsdf/physics/field_shape.h"
#include "simulate/coarse_mesh.h"

namespace hpsdf::bench {
namespace {

/// A mesh as a GImpact shape with its tree of boxes.
class Body {
 public:
  explicit Body(const TriangleMesh& mesh) {
    btIndexedMesh indexed;
    indexed.m_numTriangles = static_cast<int>(mesh.triangles.size());
    indexed.m_triangleIndexBase = reinterpret_cast<const unsigned char*>(mesh.triangles.data());
    indexed.m_triangleIndexStride = sizeof(mesh.triangles[0]);
    indexed.m_numVertices = static_cast<int>(mesh.vertices.size());
    indexed.m_vertexBase = reinterpret_cast<const unsigned char*>(mesh.vertices.data());
    indexed.m_vertexStride = sizeof(mesh.vertices[0]);
    indexed.m_vertexType = PHY_DOUBLE;
    triangles_.addIndexedMesh(indexed, PHY_INTEGER);
    shape_.emplace(&triangles_);
    shape_->setMargin(0);  // like the field's contact query; a margin would cost more work
    shape_->updateBound();
    object.setCollisionShape(&*shape_);
  }

  btCollisionObject object;

 private:
  btTriangleIndexVertexArray triangles_;
  std::optional<btGImpactMeshShape> shape_;
};

/// Counts all contacts and keeps none; Bullet's manifold would keep up to four, with more work.
class Contacts : public btManifoldResult {
 public:
  using btManifoldResult::btManifoldResult;

  void addContactPoint(const btVector3&, const btVector3&, btScalar distance) override {
    ++found.contacts;
    found.deepest = std::max(found.deepest, -double(distance));
  }

  Touch found;
};

/// Two bodies and their collision algorithm, which is kept between calls as Bullet keeps it between time steps.
class Pair {
 public:
  Pair(const TriangleMesh& first, const TriangleMesh& second) : first_(first), second_(second) {
    btGImpactCollisionAlgorithm::registerAlgorithm(&dispatcher_);
    const Wrapped one(first_), other(second_);
    algorithm_ = dispatcher_.findAlgorithm(&one, &other, nullptr, BT_CONTACT_POINT_ALGORITHMS);
  }

  ~Pair() {
    algorithm_->~btCollisionAlgorithm();
    dispatcher_.freeCollisionAlgorithm(algorithm_);
  }

  Pair(const Pair&) = delete;
  Pair& operator=(const Pair&) = delete;

  Touch find(const Places& where) {
    first_.object.setWorldTransform(physics::toBullet(where.bunny));
    second_.object.setWorldTransform(physics::toBullet(where.armadillo));
    const Wrapped one(first_), other(second_);
    Contacts contacts(&one, &other);
    algorithm_->processCollision(&one, &other, {}, &contacts);
    return contacts.found;
  }

 private:
  struct Wrapped : btCollisionObjectWrapper {
    explicit Wrapped(const Body& body)
        : btCollisionObjectWrapper(nullptr, body.object.getCollisionShape(), &body.object,
                                   body.object.getWorldTransform(), -1, -1) {}
  };

  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  Body first_, second_;
  btCollisionAlgorithm* algorithm_;
};

void full(benchmark::State& state, Nearness nearness) {
  static Pair pair(bunny(), armadillo());
  timeContacts(state, nearness, [](const Places& where) { return pair.find(where); });
  const std::size_t expected = nearness == Nearness::touching ? kPlaces : 0;
  if (state.counters["touching"] != double(expected))
    state.SkipWithError("triangles and samples do not touch in the same places");
}

/// Returns the mesh, coarsened to about `count` vertices.
TriangleMesh withVertices(std::size_t count, const TriangleMesh& mesh) {
  return app::coarse(mesh, std::sqrt(1.2 * surfaceArea(mesh) / double(count)));
}

/// Uses coarse meshes with as many vertices as the field's contact query has samples.
void coarse(benchmark::State& state) {
  static const TriangleMesh first = withVertices(10'000, bunny()), second = withVertices(10'000, armadillo());
  static Pair pair(first, second);
  timeContacts(state, Nearness::touching, [](const Places& where) { return pair.find(where); });
  state.counters["vertices"] = double(first.vertices.size() + second.vertices.size());
}

BENCHMARK_CAPTURE(full, touching, Nearness::touching)->Name("contacts/touching/gimpact");
BENCHMARK(coarse)->Name("contacts/touching/coarse/gimpact");
BENCHMARK_CAPTURE(full, apart, Nearness::apart)->Name("contacts/apart/gimpact");

}  // namespace
}  // namespace hpsdf::bench
