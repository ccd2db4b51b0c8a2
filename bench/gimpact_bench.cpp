// Bullet's triangle against triangle on the same bodies: GImpact in double precision, as Debian builds it.

#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletCollision/CollisionDispatch/btCollisionObject.h>
#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionDispatch/btDefaultCollisionConfiguration.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <BulletCollision/CollisionShapes/btTriangleIndexVertexArray.h>
#include <BulletCollision/Gimpact/btGImpactCollisionAlgorithm.h>
#include <BulletCollision/Gimpact/btGImpactShape.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>

#include "contact_places.h"
#include "hpsdf/physics/bullet.h"

namespace hpsdf::bench {
namespace {

/// About `count` vertices, each the mean of those in one cube, and the triangles that are left.
TriangleMesh clustered(const TriangleMesh& mesh, std::size_t count) {
  const double side = std::sqrt(1.2 * surfaceArea(mesh) / double(count));
  std::map<std::array<std::int64_t, 3>, std::uint32_t> cells;
  std::vector<std::uint32_t> cellOf;
  std::vector<int> counts;
  TriangleMesh coarse;
  for (const Vector3& x : mesh.vertices) {
    const auto place = [&](int axis) { return static_cast<std::int64_t>(std::floor(x[axis] / side)); };
    const auto [cell, isNew] =
        cells.try_emplace({place(0), place(1), place(2)}, static_cast<std::uint32_t>(cells.size()));
    if (isNew) {
      coarse.vertices.push_back(Vector3::Zero());
      counts.push_back(0);
    }
    cellOf.push_back(cell->second);
    coarse.vertices[cell->second] += x;
    ++counts[cell->second];
  }
  for (std::size_t i = 0; i < counts.size(); ++i) coarse.vertices[i] /= counts[i];
  for (const auto& [a, b, c] : mesh.triangles)
    if (cellOf[a] != cellOf[b] && cellOf[b] != cellOf[c] && cellOf[c] != cellOf[a])
      coarse.triangles.push_back({cellOf[a], cellOf[b], cellOf[c]});
  return coarse;
}

/// A mesh as GImpact takes it, with its tree of boxes.
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
    shape_->setMargin(0);  // as ours: less work than with some
    shape_->updateBound();
    object.setCollisionShape(&*shape_);
  }

  btCollisionObject object;

 private:
  btTriangleIndexVertexArray triangles_;
  std::optional<btGImpactMeshShape> shape_;
};

/// All contacts, where Bullet would keep the four of a manifold: less work, and as many as ours.
class Contacts : public btManifoldResult {
 public:
  using btManifoldResult::btManifoldResult;

  void addContactPoint(const btVector3&, const btVector3&, btScalar distance) override {
    ++found.contacts;
    found.deepest = std::max(found.deepest, -double(distance));
  }

  Touch found;
};

/// Keeps the algorithm of the two, as Bullet does from step to step.
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

/// As many vertices as ours has samples.
void coarse(benchmark::State& state) {
  static const TriangleMesh first = clustered(bunny(), 10'000), second = clustered(armadillo(), 10'000);
  static Pair pair(first, second);
  timeContacts(state, Nearness::touching, [](const Places& where) { return pair.find(where); });
  state.counters["vertices"] = double(first.vertices.size() + second.vertices.size());
}

BENCHMARK_CAPTURE(full, touching, Nearness::touching)->Name("contacts/touching/gimpact");
BENCHMARK(coarse)->Name("contacts/touching/coarse/gimpact");
BENCHMARK_CAPTURE(full, apart, Nearness::apart)->Name("contacts/apart/gimpact");

}  // namespace
}  // namespace hpsdf::bench
