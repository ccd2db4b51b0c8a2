#include "scene/body_meshes.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <string>
#include <utility>

#include "hpsdf/error.h"

namespace hpsdf::render {
namespace {

// Greatest angle between the normals of adjacent faces that are shaded as one smooth surface. The angles in a sphere of
// 80 triangles are smaller, the angles at the edges of a gear's teeth are larger.
constexpr double kCreaseDegrees = 40;

constexpr std::size_t kMostTriangles = std::size_t{1} << 26;
constexpr std::size_t kMostBodies = std::size_t{1} << 24;
constexpr double kGreatest = 1e15;        // greatest coordinate, so that squares of triangle areas stay finite
constexpr double kRigidTolerance = 1e-6;  // a matrix R counts as rigid if no entry of RᵀR − identity is greater

bool isInRange(const Vector3& point) { return point.allFinite() && point.cwiseAbs().maxCoeff() <= kGreatest; }

struct Face {
  Eigen::Vector3f normal;  ///< unit vector, or zero for a degenerate triangle
  Eigen::Vector3f angles;  ///< interior angles at the three corners, radians
};

Face faceOf(const std::vector<Vector3>& vertices, const Triangle& triangle) {
  const std::array<Vector3, 3> corners = {vertices[triangle[0]], vertices[triangle[1]], vertices[triangle[2]]};
  Face face{(corners[1] - corners[0]).cross(corners[2] - corners[0]).stableNormalized().cast<float>(), {}};
  if (!face.normal.allFinite()) face.normal.setZero();
  for (int k = 0; k < 3; ++k) {
    const Vector3 a = corners[(k + 1) % 3] - corners[k], b = corners[(k + 2) % 3] - corners[k];
    face.angles[k] = static_cast<float>(std::atan2(a.cross(b).norm(), a.dot(b)));
  }
  return face;
}

std::string nameOf(const TriangleMesh& mesh) {
  return mesh.name.empty() ? "an unnamed mesh" : "the mesh \"" + mesh.name + "\"";
}

void checkVertices(const TriangleMesh& mesh, std::span<const Vector3> vertices) {
  const auto wrong = std::ranges::find_if_not(vertices, isInRange);
  if (wrong != vertices.end())
    throw Error(nameOf(mesh) + " has a vertex, " + std::to_string(wrong - vertices.begin()) +
                ", that is not finite or beyond 1e15: scale the mesh to be drawn");
}

void checkMesh(const TriangleMesh& mesh) {
  if (mesh.triangles.empty()) throw Error(nameOf(mesh) + " has no triangles to draw: leave it out");
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    if (std::ranges::max(mesh.triangles[t]) >= mesh.vertices.size())
      throw Error(nameOf(mesh) + " has a triangle, " + std::to_string(t) + ", with a vertex index beyond its " +
                  std::to_string(mesh.vertices.size()) + " vertices: give indices below that number");
  checkVertices(mesh, mesh.vertices);
}

void checkBody(const Body& body, std::size_t index, std::size_t meshes) {
  const auto name = [&] { return "body " + std::to_string(index); };
  if (body.mesh >= meshes)
    throw Error(name() + " has mesh " + std::to_string(body.mesh) + " of " + std::to_string(meshes) +
                " meshes: give the index of a mesh");
  const Eigen::Matrix3d rotation = body.worldFromBody.linear();
  if (!rotation.allFinite() || !isInRange(body.worldFromBody.translation()))
    throw Error(name() + " has a transform that is not finite or beyond 1e15: give a finite transform");
  if (!((rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() <= kRigidTolerance))
    throw Error(name() + " is scaled or sheared: give a rotation and a translation alone");
}

}  // namespace

BodyMesh::BodyMesh(TriangleMesh mesh) : mesh_(std::move(mesh)) {
  checkMesh(mesh_);
  firstCorner_.assign(mesh_.vertices.size() + 1, 0);
  for (const Triangle& triangle : mesh_.triangles)
    for (const std::uint32_t vertex : triangle) ++firstCorner_[vertex + 1];
  std::partial_sum(firstCorner_.begin(), firstCorner_.end(), firstCorner_.begin());
  corners_.resize(3 * mesh_.triangles.size());
  std::vector<std::uint32_t> next(firstCorner_.begin(), firstCorner_.end() - 1);
  for (std::uint32_t corner = 0; corner < corners_.size(); ++corner)
    corners_[next[mesh_.triangles[corner / 3][corner % 3]]++] = corner;
  findNormals();
}

void BodyMesh::moveVertices(std::span<const Vector3> vertices) {
  if (vertices.size() != mesh_.vertices.size())
    throw Error(nameOf(mesh_) + " has " + std::to_string(mesh_.vertices.size()) + " vertices, and " +
                std::to_string(vertices.size()) + " new ones: give one position for each vertex");
  checkVertices(mesh_, vertices);
  std::ranges::copy(vertices, mesh_.vertices.begin());
  findNormals();
}

// The normal at a corner of a face is a weighted mean of face normals at the vertex. Only normals within the
// crease angle of the face's own normal count. The weight of a face is its angle at the vertex (Thürmer and
// Wüthrich 1998), so that the result does not depend on how flat parts are triangulated.
void BodyMesh::findNormals() {
  box_ = boundingBox(mesh_);
  const std::size_t count = mesh_.triangles.size();
  std::vector<Face> faces(count);
  const auto forTriangles = [&](const auto& f) {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, 1024), [&](const auto& part) {
      std::for_each(faces.begin() + part.begin(), faces.begin() + part.end(), f);
    });
  };
  forTriangles([&](Face& face) { face = faceOf(mesh_.vertices, mesh_.triangles[&face - faces.data()]); });
  normals_.resize(count);
  const float cosine = static_cast<float>(std::cos(kCreaseDegrees * (std::numbers::pi / 180)));
  forTriangles([&](const Face& face) {
    const std::size_t t = &face - faces.data();
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t vertex = mesh_.triangles[t][k];
      Eigen::Vector3f sum = Eigen::Vector3f::Zero();
      for (std::uint32_t i = firstCorner_[vertex]; i < firstCorner_[vertex + 1]; ++i) {
        const Face& other = faces[corners_[i] / 3];
        if (other.normal.dot(face.normal) >= cosine) sum += other.angles[corners_[i] % 3] * other.normal;
      }
      const float length = sum.norm();
      normals_[t][k] = length > 0 ? Eigen::Vector3f(sum / length) : face.normal;
    }
  });
}

Vector3 BodyMesh::normal(std::uint32_t triangle, const Vector3& barycentric) const {
  const CornerNormals& corners = normals_[triangle];
  const Vector3 sum = barycentric[0] * corners[0].cast<double>() + barycentric[1] * corners[1].cast<double>() +
                      barycentric[2] * corners[2].cast<double>();
  return sum.normalized();
}

void checkTriangleCount(std::size_t triangles) {
  if (triangles > kMostTriangles)
    throw Error("the meshes of bodies have " + std::to_string(triangles) +
                " triangles, more than the 67108864 that can be drawn: give coarser meshes");
}

BodyMeshes::BodyMeshes(std::vector<TriangleMesh> meshes) {
  std::size_t triangles = 0;
  for (const TriangleMesh& mesh : meshes) triangles += mesh.triangles.size();
  checkTriangleCount(triangles);
  meshes_.reserve(meshes.size());
  for (TriangleMesh& mesh : meshes) meshes_.emplace_back(std::move(mesh));
}

void BodyMeshes::moveVertices(std::size_t mesh, std::span<const Vector3> vertices) {
  if (mesh >= meshes_.size())
    throw Error("vertices arrive for mesh " + std::to_string(mesh) + " of " + std::to_string(meshes_.size()) +
                " meshes: give the index of a mesh");
  meshes_[mesh].moveVertices(vertices);
}

Box BodyMeshes::bounds(std::span<const Body> bodies) const {
  if (bodies.size() > kMostBodies)
    throw Error(std::to_string(bodies.size()) + " bodies are more than the 16777216 that can be drawn: give fewer");
  Box result;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    checkBody(bodies[i], i, size());
    const Box& box = meshes_[bodies[i].mesh].box();
    const Vector3 center = bodies[i].worldFromBody * box.center();
    const Vector3 half = bodies[i].worldFromBody.linear().cwiseAbs() * (0.5 * box.sizes());
    result.extend(Box(center - half, center + half));
  }
  return result;
}

}  // namespace hpsdf::render
