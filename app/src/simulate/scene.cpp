#include "simulate/scene.h"

#include <BulletSoftBody/btSoftBody.h>
#include <fmt/format.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "console/console.h"
#include "console/long_work.h"
#include "construction/surface.h"
#include "hpsdf/build.h"
#include "hpsdf/detail/output_file.h"
#include "hpsdf/error.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/field_file.h"
#include "hpsdf/mesh_report.h"
#include "hpsdf/shapes.h"
#include "session/field_summary.h"

namespace hpsdf::app {
namespace {

/// Creates the cache folder if it does not exist, and returns it. Throws `Error` if it cannot be created.
const std::filesystem::path& cacheFolder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error)
    throw Error(fmt::format("{}: cannot be made a folder for fields ({}); give another folder", folder.string(),
                            error.message()));
  return folder;
}

/// Returns the name of the file in which the cache keeps the field of the mesh whose fingerprint is `print`.
std::string cacheName(std::uint64_t print, const SceneRequest& request) {
  const std::string strategy = request.strategy == Strategy::automatic ? "" : "-" + strategyName(request.strategy);
  return fmt::format("{:016x}-{}{}.hpsdf", print, request.targetError, strategy);
}

/// Loads a field from a file of the cache. Throws `Error` unless the field has the target error and the strategy of the
/// request and was made from the mesh whose fingerprint is `print`.
Field cachedField(const std::filesystem::path& file, std::uint64_t print, const SceneRequest& request) {
  try {
    Field field = load(file);
    const FieldMetadata& metadata = field.metadata();
    const bool hasStrategy = request.strategy == Strategy::automatic || metadata.settings.strategy == request.strategy;
    const bool isSame = metadata.source.fingerprint == print && hasStrategy &&
                        metadata.settings.estimator == BuildOptions().estimator &&
                        metadata.settings.targetError.weighted() == request.targetError;
    if (isSame) return field;
    throw Error(file.string() + ": is the field of another mesh, or of another target error, strategy or estimator");
  } catch (const Error& error) {
    throw Error(fmt::format("{}; remove the file to build the field again", error.what()));
  }
}

Field sceneField(const Console& console, const TriangleMesh& mesh, const SceneRequest& request) {
  const std::uint64_t print = fingerprint(mesh);
  std::filesystem::path file;
  if (request.cache) {
    file = cacheFolder(*request.cache) / cacheName(print, request);
    std::error_code unknown;
    if (std::filesystem::exists(file, unknown)) return cachedField(file, print, request);
    checkWritable(file);  // fails now, not after the long construction
  }
  const int threads = tbb::this_task_arena::max_concurrency();
  Field field = withProgress(console, [&](const Progress& progress) {
    const ExactDistance distance(mesh, {.threads = threads});
    return build(distance, domainAround(mesh),
                 {.targetError = request.targetError, .strategy = request.strategy, .threads = threads}, progress);
  });
  if (request.cache) save(field, file);
  return field;
}

}  // namespace

BodyKind::BodyKind(TriangleMesh bodyMesh, Field bodyField, std::size_t samples, double margin)
    : mesh(std::move(bodyMesh)),
      field(std::move(bodyField)),
      collider(field),
      surface(physics::sampleSurface(mesh, {.count = samples})),
      mass(physics::massProperties(mesh)),
      shape(collider, surface, mass, margin) {}

BodyKind& Scene::addKind(TriangleMesh mesh, std::size_t samples, double margin) {
  Field field = sceneField(console_, mesh, request_);
  return kinds_.emplace_back(std::move(mesh), std::move(field), samples, margin);
}

void Scene::addStatic(BodyKind& kind, const Eigen::Isometry3d& worldFromMesh, const physics::Material& material) {
  world_.add(kind.shape, 0, worldFromMesh * kind.mass.meshFromInertia, material);
}

void Scene::addLevelGround(double height, double friction) {
  shapes_.push_back(std::make_unique<btStaticPlaneShape>(btVector3(0, 0, 1), height));
  world_.add(*shapes_.back(), 0, Eigen::Isometry3d::Identity(), {.friction = friction});
}

void Scene::admit() {
  while (!drops_.empty() && drops_.front().seconds <= world_.seconds()) {
    const Drop& next = drops_.front();
    world_.add(*next.shape, next.mass, next.worldFromBody, next.material);
    drops_.pop_front();
  }
}

std::size_t Scene::lost() const {
  std::size_t count = 0;
  for (std::size_t n = 0; n < world_.bodies(); ++n) {
    const btRigidBody& body = world_.body(n);
    count += !body.isStaticObject() && body.getWorldTransform().getOrigin().z() < floor_;
  }
  for (std::size_t n = 0; n < world_.softBodies(); ++n) {
    const btSoftBody::tNodeArray& nodes = world_.softBody(n).m_nodes;
    count += std::any_of(&nodes[0], &nodes[0] + nodes.size(),
                         [&](const btSoftBody::Node& node) { return node.m_x.z() < floor_; });
  }
  return count;
}

std::size_t Scene::moving() const {
  std::size_t count = 0;
  for (std::size_t n = 0; n < world_.bodies(); ++n) count += !world_.body(n).isStaticObject();
  return count;
}

TriangleMesh Scene::meshOf(const std::string& name, double size) const {
  TriangleMesh mesh = importSurface(console_, name).mesh;
  try {
    physics::massProperties(mesh);
  } catch (const Error& error) {
    throw Error(name + ": " + error.what());
  }
  if (!inspect(mesh).closed())
    warn(console_, name + " is not closed: near its holes bodies may pass through it, or be pushed inside");
  if (request_.filesAreYUp && !isShape(name))
    for (Vector3& x : mesh.vertices) x = Vector3(x.x(), -x.z(), x.y());
  if (size == 0) return mesh;
  const Box box = boundingBox(mesh);
  const double scale = size / box.sizes().maxCoeff();
  for (Vector3& x : mesh.vertices) x = scale * (x - box.center());
  return mesh;
}

TriangleMesh poleMesh(double radius, double height) {
  constexpr std::uint32_t kSides = 24;
  TriangleMesh mesh;
  mesh.name = "pole";
  for (const double z : {-height / 2, height / 2})
    for (std::uint32_t i = 0; i < kSides; ++i) {
      const double angle = 2 * std::numbers::pi * i / kSides;
      mesh.vertices.emplace_back(radius * std::cos(angle), radius * std::sin(angle), z);
    }
  mesh.vertices.emplace_back(0, 0, -height / 2);
  mesh.vertices.emplace_back(0, 0, height / 2);
  for (std::uint32_t i = 0; i < kSides; ++i) {
    const std::uint32_t next = (i + 1) % kSides;
    mesh.triangles.push_back({i, next, kSides + next});
    mesh.triangles.push_back({i, kSides + next, kSides + i});
    mesh.triangles.push_back({2 * kSides, next, i});
    mesh.triangles.push_back({2 * kSides + 1, kSides + i, kSides + next});
  }
  return mesh;
}

TriangleMesh slabMesh(const Vector3& size) {
  return shapes::mesh(fmt::format("box,width={},height={},depth={}", size.x(), size.y(), size.z()));
}

}  // namespace hpsdf::app
