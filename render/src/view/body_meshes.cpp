#include "view/body_meshes.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "hpsdf/error.h"
#include "image/color.h"
#include "view/grid_space.h"

namespace hpsdf::render {
namespace {

// A sphere of 80 triangles is smooth by this, the edges of a gear's teeth are not.
constexpr double kCreaseDegrees = 40;

constexpr std::size_t kMostTriangles = std::size_t{1} << 26;
constexpr std::size_t kMostBodies = std::size_t{1} << 24;
constexpr std::size_t kMostPixels = std::size_t{1} << 26;
constexpr double kGreatest = 1e15;  // of a coordinate: squares of areas stay finite
constexpr double kRigid = 1e-6;     // how far products of a rotation's columns may be from 0 and 1
constexpr double kNearest = 1e-5;   // least depth that is seen, of the farthest

bool isPlace(const Vector3& x) { return x.allFinite() && x.cwiseAbs().maxCoeff() <= kGreatest; }

/// A triangle's normal, unit or zero, and the angles at its corners.
struct Face {
  Eigen::Vector3f normal;
  Eigen::Vector3f angles;
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
  const auto wrong = std::ranges::find_if_not(vertices, isPlace);
  if (wrong != vertices.end())
    throw Error(nameOf(mesh) + " has a vertex, " + std::to_string(wrong - vertices.begin()) +
                ", that is not finite or beyond 1e15: scale the mesh to be drawn");
}

void checkMesh(const TriangleMesh& mesh) {
  if (mesh.triangles.empty()) throw Error(nameOf(mesh) + " has no triangles to draw: leave it out");
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    if (std::ranges::max(mesh.triangles[t]) >= mesh.vertices.size())
      throw Error(nameOf(mesh) + " has a triangle, " + std::to_string(t) + ", with a vertex beyond its " +
                  std::to_string(mesh.vertices.size()) + ": give indices of vertices that are there");
  checkVertices(mesh, mesh.vertices);
}

void checkBody(const Body& body, std::size_t index, std::size_t meshes) {
  const auto name = [&] { return "body " + std::to_string(index); };
  if (body.mesh >= meshes)
    throw Error(name() + " is of mesh " + std::to_string(body.mesh) + ", of " + std::to_string(meshes) +
                ": give the index of one that is there");
  const Eigen::Matrix3d rotation = body.worldFromBody.linear();
  if (!rotation.allFinite() || !isPlace(body.worldFromBody.translation()))
    throw Error(name() + " is at a place that is not finite or beyond 1e15: give a finite transform");
  if (!((rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() <= kRigid))
    throw Error(name() + " is scaled or sheared: give a rotation and a translation alone");
}

}  // namespace

Color bodyColor(std::size_t index) {
  // hues from green over blue to pink, far from clay's orange, by the golden section; every third is of one lightness
  constexpr double kFirstHue = 125, kHues = 225, kChroma = 0.11;
  constexpr double kLightness[] = {0.66, 0.78, 0.56};
  const double turns = 0.6180339887498949 * double(index % 1000000);
  return encodeSrgb(fromOklch(kLightness[index % 3], kChroma, kFirstHue + kHues * (turns - std::floor(turns))));
}

BodyMesh::BodyMesh(TriangleMesh mesh) : mesh_(std::move(mesh)) {
  checkMesh(mesh_);
  firstAround_.assign(mesh_.vertices.size() + 1, 0);
  for (const Triangle& triangle : mesh_.triangles)
    for (const std::uint32_t vertex : triangle) ++firstAround_[vertex + 1];
  for (std::size_t v = 1; v < firstAround_.size(); ++v) firstAround_[v] += firstAround_[v - 1];
  aroundVertex_.resize(3 * mesh_.triangles.size());
  std::vector<std::uint32_t> next(firstAround_.begin(), firstAround_.end() - 1);
  for (std::uint32_t corner = 0; corner < aroundVertex_.size(); ++corner)
    aroundVertex_[next[mesh_.triangles[corner / 3][corner % 3]]++] = corner;
  findNormals();
}

void BodyMesh::moveVertices(std::span<const Vector3> vertices) {
  if (vertices.size() != mesh_.vertices.size())
    throw Error(nameOf(mesh_) + " has " + std::to_string(mesh_.vertices.size()) + " vertices, and " +
                std::to_string(vertices.size()) + " new ones are given: give as many");
  checkVertices(mesh_, vertices);
  std::ranges::copy(vertices, mesh_.vertices.begin());
  findNormals();
}

// At a corner the normals of the faces around count that are within the angle of a crease of the corner's own, weighted
// by their angles there (Thürmer and Wüthrich 1998), so that it does not matter how flat parts are triangulated.
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
  const float cosine = static_cast<float>(std::cos(kCreaseDegrees * (3.14159265358979323846 / 180)));
  forTriangles([&](const Face& face) {
    const std::size_t t = &face - faces.data();
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t vertex = mesh_.triangles[t][k];
      Eigen::Vector3f sum = Eigen::Vector3f::Zero();
      for (std::uint32_t i = firstAround_[vertex]; i < firstAround_[vertex + 1]; ++i) {
        const Face& other = faces[aroundVertex_[i] / 3];
        if (other.normal.dot(face.normal) >= cosine) sum += other.angles[aroundVertex_[i] % 3] * other.normal;
      }
      const float length = sum.norm();
      normals_[t][k] = length > 0 ? Eigen::Vector3f(sum / length) : face.normal;
    }
  });
}

Vector3 BodyMesh::normal(std::uint32_t triangle, const Vector3& weights) const {
  const CornerNormals& corners = normals_[triangle];
  const Vector3 sum = weights[0] * corners[0].cast<double>() + weights[1] * corners[1].cast<double>() +
                      weights[2] * corners[2].cast<double>();
  return sum.normalized();
}

void checkTriangleCount(std::size_t triangles) {
  if (triangles > kMostTriangles)
    throw Error("the meshes of bodies have " + std::to_string(triangles) +
                " triangles, more than the 67108864 that are drawn: give coarser ones");
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
    throw Error("vertices are given for mesh " + std::to_string(mesh) + ", of " + std::to_string(meshes_.size()) +
                ": give the index of one that is there");
  meshes_[mesh].moveVertices(vertices);
}

Box BodyMeshes::bounds(std::span<const Body> bodies) const {
  if (bodies.size() > kMostBodies)
    throw Error(std::to_string(bodies.size()) + " bodies are more than the 16777216 that are drawn: give fewer");
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

void checkBodyView(const Camera& camera, int width, int height) {
  checkCamera(camera, width, height);
  if (std::size_t(width) * std::size_t(height) > kMostPixels)
    throw Error("a view of " + std::to_string(width) + "x" + std::to_string(height) +
                " pixels is more than the 64 million that bodies are drawn in: give a smaller one");
  if (camera.right.isZero(0) || camera.up.isZero(0))
    throw Error("a camera's right or up vector is zero: give half the view's width and height");
}

double farthestDepth(const Camera& camera, const Box& box) {
  double farthest = 0;
  for (int i = 0; i < 8; ++i)
    farthest = std::max(farthest, (box.corner(Box::CornerType(i)) - camera.eye).dot(camera.forward));
  return farthest > 0 ? farthest : 1;
}

double leastDepth(const Camera& camera, double farthest) {
  return camera.projection == Projection::perspective ? kNearest * farthest : 0;
}

BodyBuffers emptyBodyBuffers(int width, int height) {
  const std::size_t pixels = std::size_t(width) * std::size_t(height);
  BodyBuffers buffers{.width = width, .height = height, .body = {}, .triangle = {}, .normal = {}, .distance = {}};
  buffers.body.assign(pixels, kNoBody);
  buffers.triangle.assign(pixels, 0);
  buffers.normal.assign(pixels, Eigen::Vector3f::Zero());
  buffers.distance.assign(pixels, 0);
  return buffers;
}

void addBodies(const BodyBuffers& bodies, ViewBuffers& buffers) {
  buffers.body.assign(buffers.cell.size(), kNoBody);
  for (std::size_t i = 0; i < buffers.cell.size(); ++i) {
    if (!bodies.hit(i) || (buffers.hit(i) && buffers.distance[i] <= bodies.distance[i])) continue;
    buffers.cell[i] = kNoCell;
    buffers.degree[i] = buffers.depth[i] = buffers.crack[i] = 0;
    buffers.value[i] = 0;
    buffers.body[i] = bodies.body[i];
    buffers.normal[i] = bodies.normal[i];
    buffers.distance[i] = bodies.distance[i];
  }
}

Camera startingBefore(const Box& box, const Camera& camera) {
  if (camera.projection == Projection::perspective || box.isEmpty()) return camera;
  constexpr double kBefore = 0.01;  // of the box's diagonal
  const double half = 0.5 * box.sizes().dot(camera.forward.cwiseAbs());
  const double nearest = (box.center() - camera.eye).dot(camera.forward) - half - kBefore * box.diagonal().norm();
  Camera moved = camera;
  if (nearest < 0) moved.eye += nearest * camera.forward;
  return moved;
}

}  // namespace hpsdf::render
