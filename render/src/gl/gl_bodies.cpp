// OpenGL finds the body and the triangle that each pixel shows. The CPU computes distances and normals in double
// precision.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "gl/egl_context.h"
#include "gl/gl_objects.h"
#include "gl/render_target.h"
#include "hpsdf/render/bodies.h"
#include "scene/body_meshes.h"
#include "scene/body_view.h"

namespace hpsdf::render {
namespace {

/// The locations of the vertex attributes in shaders/bodies.vert.
enum : GLuint { kPosition = 0, kTargetFromMesh = 1, kIndex = 5 };
/// The binding points of the buffers that contain the vertex attributes.
enum : GLuint { kVertexBinding = 0, kInstanceBinding = 1 };

/// The indices of the body and the triangle that a pixel shows.
using BodyTriangle = std::array<std::uint32_t, 2>;

/// The data of a body, in the layout of the vertex shader's attributes.
struct Instance {
  std::array<float, 16> targetFromMesh;  ///< column-major
  std::uint32_t body;
};

/// Returns the transform from points relative to the eye to a tile's clip space. Pixel rows run downwards, and nearer
/// points have greater clip-space depths. In perspective, the clip-space depth of a point is the least visible depth
/// divided by the point's depth, because floats represent this ratio near and far with the same relative precision. For
/// parallel rays, the clip-space depth falls linearly with the distance.
Eigen::Matrix4d targetFromEye(const Camera& camera, const Tile& tile, int width, int height, double farthest) {
  const bool parallel = camera.projection == Projection::orthographic;
  const Eigen::RowVector4d right =
      (Eigen::RowVector4d() << camera.right.transpose() / camera.right.squaredNorm(), 0).finished();
  const Eigen::RowVector4d up = (Eigen::RowVector4d() << camera.up.transpose() / camera.up.squaredNorm(), 0).finished();
  const Eigen::RowVector4d depth = (Eigen::RowVector4d() << camera.forward.transpose(), 0).finished();
  const Eigen::RowVector4d one = Eigen::RowVector4d::Unit(3);
  constexpr double kMargin = 1.001;  // gives the farthest point a clip-space depth above 0
  Eigen::Matrix4d result;
  result.row(3) = parallel ? one : depth;
  result.row(2) = parallel ? Eigen::RowVector4d(one - depth / (kMargin * farthest))
                           : Eigen::RowVector4d(leastDepth(camera, farthest) * one);
  const auto middle = [](int whole, int first, int part) { return double(whole - 2 * first) / part - 1; };
  result.row(0) = double(width) / tile.width * right + middle(width, tile.left, tile.width) * result.row(3);
  result.row(1) = -double(height) / tile.height * up + middle(height, tile.top, tile.height) * result.row(3);
  return result;
}

/// A bounding sphere of a mesh, in the mesh's frame.
struct Ball {
  Vector3 center;
  double radius;
};

Ball ballAround(const BodyMesh& mesh) {
  Ball ball{mesh.box().center(), 0};
  for (const Vector3& vertex : mesh.vertices()) ball.radius = std::max(ball.radius, (vertex - ball.center).norm());
  return ball;
}

/// Returns false if a ball lies wholly beyond one of the left, right, lower, upper and far planes of the frustum.
/// `center` is relative to the eye.
bool mayBeVisible(const Eigen::Matrix4d& targetFromEye, const Vector3& center, double radius) {
  constexpr double kRounding = 1e-6;
  for (const auto& [axis, sign] : {std::pair(0, 1), {0, -1}, {1, 1}, {1, -1}, {2, -1}}) {
    const Eigen::RowVector4d plane = targetFromEye.row(3) + sign * targetFromEye.row(axis);
    const double inside = plane.head<3>().dot(center) + plane[3];
    if (inside < -(1 + kRounding) * radius * plane.head<3>().norm()) return false;
  }
  return true;
}

struct MeshUpload {
  explicit MeshUpload(const BodyMesh& mesh) {
    glNamedBufferStorage(vertices.name(), GLsizeiptr(mesh.vertices().size() * sizeof(Eigen::Vector3f)), nullptr,
                         GL_DYNAMIC_STORAGE_BIT);
    glNamedBufferStorage(triangles.name(), GLsizeiptr(mesh.triangles().size() * sizeof(Triangle)),
                         mesh.triangles().data(), 0);
    upload(mesh);
  }

  /// Uploads the vertices relative to the centre of the mesh's bounding sphere, so that single precision suffices.
  void upload(const BodyMesh& mesh) {
    ball = ballAround(mesh);
    std::vector<Eigen::Vector3f> positions;
    positions.reserve(mesh.vertices().size());
    for (const Vector3& vertex : mesh.vertices()) positions.push_back((vertex - ball.center).cast<float>());
    glNamedBufferSubData(vertices.name(), 0, GLsizeiptr(positions.size() * sizeof(Eigen::Vector3f)), positions.data());
  }

  GlBuffer vertices, triangles;
  Ball ball;
};

/// The OpenGL objects of a body renderer. Their context must be current when they are created and destroyed.
struct BodyResources {
  explicit BodyResources(const BodyMeshes& bodyMeshes) : program(linkedProgram({"bodies.vert"}, {"bodies.frag"})) {
    for (std::size_t i = 0; i < bodyMeshes.size(); ++i) {
      meshes.emplace_back(bodyMeshes[i]);
      checkGl("take the meshes of bodies");
    }
    const auto attribute = [&](GLuint location, GLuint binding) {
      glEnableVertexArrayAttrib(vertexArray.name(), location);
      glVertexArrayAttribBinding(vertexArray.name(), location, binding);
    };
    attribute(kPosition, kVertexBinding);
    glVertexArrayAttribFormat(vertexArray.name(), kPosition, 3, GL_FLOAT, GL_FALSE, 0);
    for (GLuint column = 0; column < 4; ++column) {
      attribute(kTargetFromMesh + column, kInstanceBinding);
      glVertexArrayAttribFormat(vertexArray.name(), kTargetFromMesh + column, 4, GL_FLOAT, GL_FALSE,
                                GLuint(4 * column * sizeof(float)));
    }
    attribute(kIndex, kInstanceBinding);
    glVertexArrayAttribIFormat(vertexArray.name(), kIndex, 1, GL_UNSIGNED_INT, offsetof(Instance, body));
    glVertexArrayBindingDivisor(vertexArray.name(), kInstanceBinding, 1);
    glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_GREATER);
  }

  GlProgram program;
  GlVertexArray vertexArray;
  std::vector<MeshUpload> meshes;
};

/// The point where a pixel's ray meets a triangle, in the mesh's frame. OpenGL rounds the coordinates of corners, so
/// that the ray may pass slightly beside the triangle. The ray's intersection with the triangle's plane is then moved
/// into the triangle.
BodyPoint pointOn(const std::array<Vector3, 3>& corners, const Vector3& start, const Vector3& direction,
                  const BodyTriangle& seen) {
  const Vector3 toB = corners[1] - corners[0], toC = corners[2] - corners[0];
  const Vector3 normal = toB.cross(toC);
  const double towards = normal.dot(direction);
  const Vector3 inPlane = start + normal.dot(corners[0] - start) / towards * direction - corners[0];
  const double ofB = normal.dot(inPlane.cross(toC)) / normal.squaredNorm();
  const double ofC = normal.dot(toB.cross(inPlane)) / normal.squaredNorm();
  Vector3 barycentric = Vector3(1 - ofB - ofC, ofB, ofC);
  // A ray in the triangle's plane has no intersection; use the triangle's centroid.
  barycentric = barycentric.allFinite() ? Vector3(barycentric.cwiseMax(0)) : Vector3::Ones();
  barycentric /= barycentric.sum();
  const Vector3 point = barycentric[0] * corners[0] + barycentric[1] * corners[1] + barycentric[2] * corners[2];
  return {seen[0], seen[1], (point - start).dot(direction), barycentric, towards > 0};
}

class GlBodyRenderer final : public BodyRenderer {
 public:
  GlBodyRenderer(std::vector<TriangleMesh> meshes, GlChoice choice) : meshes_(std::move(meshes)), context_(choice) {
    const EglContext::Current current(context_);
    resources_ = std::make_unique<BodyResources>(meshes_);
  }

  ~GlBodyRenderer() override { deleteObjects(context_, resources_); }

  BodyBuffers view(const Camera& camera, std::span<const Body> bodies, int width, int height) override {
    checkBodyView(camera, width, height);
    const double farthest = farthestDepth(camera, meshes_.bounds(bodies));
    BodyBuffers buffers = emptyBodyBuffers(width, height);
    const EglContext::Current current(context_);
    const Tile whole{0, 0, width, height};
    const RenderTarget target(whole, GL_RG32UI, GL_DEPTH_COMPONENT32F);
    target.bindForDrawing();
    std::vector<BodyTriangle> pixels;
    for (const Tile& tile : tiles(whole)) {
      glViewport(0, 0, tile.width, tile.height);
      target.clear(tile);
      drawAll(targetFromEye(camera, tile, width, height, farthest), camera.eye, bodies);
      target.read(tile, pixels);
      checkGl("draw bodies");
      forEachPixel(tile, [&](std::size_t i, int x, int y) {
        if (pixels[i][0] != kNoBody) show(camera, bodies, pixels[i], x, y, buffers);
      });
    }
    return buffers;
  }

  void moveVertices(std::size_t mesh, std::span<const Vector3> vertices) override {
    meshes_.moveVertices(mesh, vertices);
    const EglContext::Current current(context_);
    resources_->meshes[mesh].upload(meshes_[mesh]);
    checkGl("take the vertices of a mesh");
  }

  Box bounds(std::span<const Body> bodies) const override { return meshes_.bounds(bodies); }

  std::string description() const override { return context_.renderer(); }

 private:
  /// Draws the bodies that may be visible, with one instanced draw call per mesh.
  void drawAll(const Eigen::Matrix4d& targetFromEye, const Vector3& eye, std::span<const Body> bodies) const {
    std::vector<std::vector<Instance>> instances(meshes_.size());
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      const Ball& ball = resources_->meshes[bodies[i].mesh].ball;
      const Vector3 center = bodies[i].worldFromBody * ball.center - eye;
      if (!mayBeVisible(targetFromEye, center, ball.radius)) continue;
      Eigen::Matrix4d eyeFromMesh = bodies[i].worldFromBody.matrix();
      eyeFromMesh.block<3, 1>(0, 3) = center;
      Instance instance{.targetFromMesh = {}, .body = static_cast<std::uint32_t>(i)};
      Eigen::Map<Eigen::Matrix4f>(instance.targetFromMesh.data()) = (targetFromEye * eyeFromMesh).cast<float>();
      instances[bodies[i].mesh].push_back(instance);
    }
    glUseProgram(resources_->program.name());
    glBindVertexArray(resources_->vertexArray.name());
    for (std::size_t mesh = 0; mesh < instances.size(); ++mesh)
      if (!instances[mesh].empty()) drawMesh(mesh, instances[mesh]);
  }

  void drawMesh(std::size_t mesh, const std::vector<Instance>& instances) const {
    const GLuint vertexArray = resources_->vertexArray.name();
    const GlBuffer buffer;
    glNamedBufferStorage(buffer.name(), GLsizeiptr(instances.size() * sizeof(Instance)), instances.data(), 0);
    glVertexArrayVertexBuffer(vertexArray, kVertexBinding, resources_->meshes[mesh].vertices.name(), 0,
                              sizeof(Eigen::Vector3f));
    glVertexArrayVertexBuffer(vertexArray, kInstanceBinding, buffer.name(), 0, sizeof(Instance));
    glVertexArrayElementBuffer(vertexArray, resources_->meshes[mesh].triangles.name());
    glDrawElementsInstanced(GL_TRIANGLES, static_cast<GLsizei>(3 * meshes_[mesh].triangles().size()), GL_UNSIGNED_INT,
                            nullptr, static_cast<GLsizei>(instances.size()));
  }

  /// Writes the body, triangle, normal and distance of the point that pixel (x, y) shows to the buffers.
  void show(const Camera& camera, std::span<const Body> bodies, const BodyTriangle& seen, int x, int y,
            BodyBuffers& buffers) const {
    const Body& body = bodies[seen[0]];
    const BodyMesh& mesh = meshes_[body.mesh];
    const Triangle& triangle = mesh.triangles()[seen[1]];
    const Eigen::Isometry3d bodyFromWorld = body.worldFromBody.inverse();
    const Vector3 start = bodyFromWorld * pixelEye(camera, x, y, buffers.width, buffers.height);
    const Vector3 direction = bodyFromWorld.linear() * pixelRay(camera, x, y, buffers.width, buffers.height);
    const std::vector<Vector3>& vertices = mesh.vertices();
    const BodyPoint point =
        pointOn({vertices[triangle[0]], vertices[triangle[1]], vertices[triangle[2]]}, start, direction, seen);
    showBody(meshes_, bodies, point, std::size_t(y) * buffers.width + x, buffers);
  }

  BodyMeshes meshes_;
  EglContext context_;
  std::unique_ptr<BodyResources> resources_;
};

}  // namespace

std::unique_ptr<BodyRenderer> makeGlBodyRenderer(std::vector<TriangleMesh> meshes, GlChoice choice) {
  return std::make_unique<GlBodyRenderer>(std::move(meshes), choice);
}

}  // namespace hpsdf::render
