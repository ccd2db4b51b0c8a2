#include "simulate/scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "building.h"
#include "hpsdf/build.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/field_file.h"
#include "hpsdf/mesh_import.h"
#include "hpsdf/shapes.h"
#include "long_work.h"

namespace hpsdf::app {

BodyKind::BodyKind(TriangleMesh bodyMesh, Field bodyField, std::size_t samples, double margin)
    : mesh(std::move(bodyMesh)),
      field(std::move(bodyField)),
      collider(field),
      surface(physics::sampleSurface(mesh, {.count = samples})),
      mass(physics::massProperties(mesh)),
      shape(collider, surface, mass, margin) {}

void Scene::stand(const BodyKind& kind, const Eigen::Isometry3d& worldFromMesh, const physics::Material& material) {
  world_.add(const_cast<physics::FieldShape&>(kind.shape), 0, worldFromMesh * kind.mass.meshFromInertia, material);
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
  return count;
}

std::size_t Scene::moving() const {
  std::size_t count = 0;
  for (std::size_t n = 0; n < world_.bodies(); ++n) count += !world_.body(n).isStaticObject();
  return count;
}

TriangleMesh sceneMesh(const std::string& name, bool fileIsYUp, double size) {
  TriangleMesh mesh = loadMesh(name);
  const bool turns = fileIsYUp && !isShape(name);
  if (turns)
    for (Vector3& x : mesh.vertices) x = Vector3(x.x(), -x.z(), x.y());
  if (size == 0) return mesh;
  const Box box = boundingBox(mesh);
  const double scale = size / box.sizes().maxCoeff();
  for (Vector3& x : mesh.vertices) x = scale * (x - box.center());
  return mesh;
}

Field sceneField(const Console& console, const TriangleMesh& mesh, const SceneRequest& request) {
  const std::uint64_t print = fingerprint(mesh);
  std::filesystem::path file;
  if (request.cache) {
    std::filesystem::create_directories(*request.cache);
    file = *request.cache / fmt::format("{:016x}-{:g}.hpsdf", print, request.targetError);
    if (std::filesystem::exists(file)) {
      Field field = load(file);
      if (field.metadata().source.fingerprint == print) return field;
      throw Error(file.string() + ": is the field of another mesh: remove it");
    }
  }
  Field field = withProgress(console, [&](const Progress& progress) {
    const ExactDistance distance(mesh);
    return build(distance, domainAround(mesh), {.targetError = request.targetError}, progress);
  });
  if (request.cache) save(field, file);
  return field;
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
