#include "simulate/studio.h"

#include <BulletSoftBody/btSoftBody.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <span>
#include <stdexcept>

#include "hpsdf/shapes.h"
#include "pictures/picture_arguments.h"
#include "simulate/coarse_mesh.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

constexpr render::Color kLevelGround = {224, 226, 230};
constexpr double kLevelGroundSide = 8;  // side length divided by the diagonal of the box around the other bodies

const physics::FieldShape* fieldShape(const btCollisionShape& shape) {
  return dynamic_cast<const physics::FieldShape*>(&shape);
}

const BodyKind& kindOf(const Scene& scene, const physics::FieldShape& shape) {
  return *std::ranges::find(scene.kinds(), &shape, [](const BodyKind& kind) { return &kind.shape; });
}

/// Calls visit(shape, worldFromBody) for every rigid body in the world, and then for every rigid body that is still to
/// be added, with its initial position.
template <typename Visit>
void forEachRigid(const Scene& scene, const Visit& visit) {
  const physics::World& world = scene.world();
  for (std::size_t n = 0; n < world.bodies(); ++n) visit(*world.body(n).getCollisionShape(), world.worldFromBody(n));
  for (const Scene::Drop& drop : scene.drops()) visit(*drop.shape, drop.worldFromBody);
}

std::vector<Vector3> verticesOf(const btSoftBody& body) {
  std::vector<Vector3> vertices;
  for (int n = 0; n < body.m_nodes.size(); ++n) vertices.push_back(physics::fromBullet(body.m_nodes[n].m_x));
  return vertices;
}

TriangleMesh meshOf(const btSoftBody& body) {
  TriangleMesh mesh{.vertices = verticesOf(body), .triangles = {}, .name = "soft body"};
  const auto index = [&](const btSoftBody::Node* node) { return std::uint32_t(node - &body.m_nodes[0]); };
  for (int f = 0; f < body.m_faces.size(); ++f) {
    const auto& corners = body.m_faces[f].m_n;
    mesh.triangles.push_back({index(corners[0]), index(corners[1]), index(corners[2])});
  }
  return mesh;
}

Box boxAround(std::span<const Vector3> points) {
  Box box;
  for (const Vector3& x : points) box.extend(x);
  return box;
}

TriangleMesh sphereMesh(double radius) { return shapes::mesh(fmt::format("sphere,radius={},subdivisions=3", radius)); }

/// Returns the transform from a frame in which the plane is z = 0 and its outside is z > 0. The frame's origin
/// is the perpendicular projection of `point` onto the plane.
Eigen::Isometry3d planeAt(const btStaticPlaneShape& shape, const Vector3& point) {
  const Vector3 normal = physics::fromBullet(shape.getPlaneNormal());
  const Vector3 foot = point - (normal.dot(point) - shape.getPlaneConstant()) * normal;
  return Eigen::Translation3d(foot) * Eigen::Quaterniond::FromTwoVectors(Vector3::UnitZ(), normal);
}

/// Returns a square slab whose upper side lies at z = 0.
TriangleMesh levelGround(double side) {
  TriangleMesh mesh = slabMesh({side, side, 0.01 * side});
  for (Vector3& x : mesh.vertices) x.z() -= 0.005 * side;
  return mesh;
}

/// Returns points that outline a shape, in the body's frame: a camera that sees these points sees the whole body. Level
/// ground has no points.
std::vector<Vector3> outlineOf(const Scene& scene, const btCollisionShape& shape) {
  constexpr double kDetail = 1.0 / 16;  // fraction of the mesh's longest side; fine enough for an outline
  std::vector<Vector3> points;
  if (const auto* field = fieldShape(shape)) {
    const TriangleMesh& mesh = kindOf(scene, *field).mesh;
    points = coarse(mesh, kDetail * boundingBox(mesh).sizes().maxCoeff()).vertices;
    for (Vector3& x : points) x = field->bodyFromMesh() * x;
  } else if (const auto* sphere = dynamic_cast<const btSphereShape*>(&shape)) {
    for (int axis = 0; axis < 3; ++axis)
      for (const double side : {-1, 1}) points.emplace_back(side * sphere->getRadius() * Vector3::Unit(axis));
  }
  return points;
}

/// Enlarges the box, projects its corners onto the plane, and adds them to `points`. The box is enlarged because the
/// bodies in it spread when they land on the plane.
void addFootprint(const btStaticPlaneShape& plane, const Box& box, std::vector<Vector3>& points) {
  constexpr double kSpread = 1.25;
  for (int corner = 0; corner < 8; ++corner) {
    const Vector3 widened = box.center() + kSpread * (box.corner(Box::CornerType(corner)) - box.center());
    points.push_back(planeAt(plane, widened).translation());
  }
}

/// Returns the outlines of all bodies of a scene, in world coordinates.
std::vector<Vector3> outlineOf(const Scene& scene) {
  std::map<const btCollisionShape*, std::vector<Vector3>> outlines;
  std::vector<Vector3> points;
  forEachRigid(scene, [&](const btCollisionShape& shape, const Eigen::Isometry3d& worldFromBody) {
    const auto [outline, first] = outlines.try_emplace(&shape);
    if (first) outline->second = outlineOf(scene, shape);
    for (const Vector3& x : outline->second) points.push_back(worldFromBody * x);
  });
  for (std::size_t n = 0; n < scene.world().softBodies(); ++n)
    std::ranges::copy(verticesOf(scene.world().softBody(n)), std::back_inserter(points));
  const Box box = boxAround(points);
  forEachRigid(scene, [&](const btCollisionShape& shape, const Eigen::Isometry3d&) {
    if (const auto* plane = dynamic_cast<const btStaticPlaneShape*>(&shape)) addFootprint(*plane, box, points);
  });
  return points;
}

render::Camera cameraOf(const render::SurfacePicture& look, const Box& domain) {
  const render::ViewSize size = render::viewSize(look);
  return render::cameraOf(look.camera, domain, size.width, size.height);
}

/// Aims the camera of `look` at the points. If the camera has no target, the target becomes the middle of the points.
/// On input, `look.camera.distance` is relative to the distance at which all points are just in view. On output, it is
/// relative to the domain's diagonal.
///
/// For the picture's width, and likewise for its height, each point has coordinates (s, z): s along the width, divided
/// by half the view's width at distance 1, and z towards the eye. The eye at (s_eye, z_eye) sees the point if
/// |s - s_eye| ≤ z_eye - z, or, with parallel rays, if |s - s_eye| ≤ distance.
void aim(render::SurfacePicture& look, std::span<const Vector3> points, const Box& domain) {
  constexpr double kBorder = 1.04;
  const bool parallel = look.camera.projection == render::Projection::orthographic;
  render::SurfacePicture wide = look;
  wide.camera.distance = 1;
  wide.camera.projection = render::Projection::perspective;  // this view's extent at distance 1 defines the unit of s
  const render::Camera camera = cameraOf(wide, domain);
  const Vector3 middle = look.camera.target.value_or(boxAround(points).center());
  Vector3 target = middle;
  double distance = 0;
  for (const Vector3& half : {camera.right, camera.up}) {
    double right = -std::numeric_limits<double>::infinity(), left = right;
    for (const Vector3& point : points) {
      const double s = (point - middle).dot(half) / half.squaredNorm();
      const double z = parallel ? 0 : -(point - middle).dot(camera.forward);
      right = std::max(right, z + s);
      left = std::max(left, z - s);
    }
    distance = std::max(distance, look.camera.target ? std::max(left, right) : 0.5 * (left + right));
    if (!look.camera.target) target += 0.5 * (right - left) * half;
  }
  look.camera.target = target;
  look.camera.distance *= kBorder * distance / domain.diagonal().norm();
}

/// Returns the extent of a pixel, in world units, at the point of `box` that is nearest to the eye. Returns 0
/// if the eye is in the box.
double finestDetail(const render::SurfacePicture& look, const Box& box, const Box& domain) {
  const render::Camera camera = cameraOf(look, domain);
  double nearest = std::numeric_limits<double>::infinity();
  for (int corner = 0; corner < 8; ++corner)
    nearest = std::min(nearest, (box.corner(Box::CornerType(corner)) - camera.eye).dot(camera.forward));
  return render::pixelSize(camera, std::max(0.0, nearest), render::viewSize(look).height);
}

}  // namespace

Studio::Studio(const Scene& scene, std::string name, render::SurfacePicture look, const Backend& backend)
    : scene_(scene),
      name_(std::move(name)),
      look_(std::move(look)),
      ground_(groundOf(scene)),
      rigid_(scene.moving() + scene.drops().size()) {
  look_.camera.up = render::UpAxis::z;
  look_.caption.emplace();
  std::vector<TriangleMesh> meshes = makeModels();
  renderer_ =
      backend.cpu ? render::makeCpuRenderer(*ground_.field) : render::makeGlRenderer(*ground_.field, backend.gl);
  bodyRenderer_ = makeBodyRenderer(std::move(meshes), backend);
  description_ = renderer_->description();
}

Studio::Ground Studio::groundOf(const Scene& scene) {
  const physics::World& world = scene.world();
  for (std::size_t n = 0; n < world.bodies(); ++n) {
    const auto* shape = fieldShape(*world.body(n).getCollisionShape());
    if (shape == nullptr || !world.body(n).isStaticObject()) continue;
    const Eigen::Isometry3d worldFromMesh = world.worldFromBody(n) * shape->bodyFromMesh();
    if (worldFromMesh.linear().isIdentity(1e-9))
      return {n, &kindOf(scene, *shape).field, Eigen::Isometry3d(Eigen::Translation3d(-worldFromMesh.translation()))};
  }
  throw std::logic_error("the scene has no static body whose field can be traced");
}

/// Aims the camera and makes the meshes of the bodies. The detail of the meshes depends on the camera.
std::vector<TriangleMesh> Studio::makeModels() {
  std::vector<Vector3> outline = outlineOf(scene_);
  const Box extent = boxAround(outline);
  for (Vector3& x : outline) x = ground_.fieldFromWorld * x;
  if (look_.camera.target) look_.camera.target = Vector3(ground_.fieldFromWorld * *look_.camera.target);
  aim(look_, outline, ground_.field->domain());
  const double detail = finestDetail(look_, boxAround(outline), ground_.field->domain());

  std::vector<TriangleMesh> meshes;
  const auto add = [&](const btCollisionShape& shape, TriangleMesh mesh, const Eigen::Isometry3d& bodyFromMesh) {
    models_.emplace(&shape, Model{std::uint32_t(meshes.size()), bodyFromMesh});
    meshes.push_back(std::move(mesh));
  };
  forEachRigid(scene_, [&](const btCollisionShape& shape, const Eigen::Isometry3d&) {
    if (models_.contains(&shape)) return;
    if (const auto* field = fieldShape(shape))
      add(shape, coarse(kindOf(scene_, *field).mesh, detail), field->bodyFromMesh());
    else if (const auto* sphere = dynamic_cast<const btSphereShape*>(&shape))
      add(shape, coarse(sphereMesh(sphere->getRadius()), detail), Eigen::Isometry3d::Identity());
    else if (const auto* plane = dynamic_cast<const btStaticPlaneShape*>(&shape))
      add(shape, levelGround(kLevelGroundSide * extent.diagonal().norm()), planeAt(*plane, extent.center()));
  });
  firstSoft_ = std::uint32_t(meshes.size());
  for (std::size_t n = 0; n < scene_.world().softBodies(); ++n) meshes.push_back(meshOf(scene_.world().softBody(n)));
  return meshes;
}

void Studio::moveSoftBodies() {
  const physics::World& world = scene_.world();
  for (std::size_t n = 0; n < world.softBodies(); ++n)
    bodyRenderer_->moveVertices(firstSoft_ + n, verticesOf(world.softBody(n)));
}

std::vector<render::Body> Studio::bodies() const {
  const physics::World& world = scene_.world();
  std::vector<render::Body> result;
  std::size_t moving = 0;
  for (std::size_t n = 0; n < world.bodies(); ++n) {
    if (n == ground_.body) continue;
    const btRigidBody& body = world.body(n);
    const Model& model = models_.at(body.getCollisionShape());
    const bool isGround = body.getCollisionShape()->getShapeType() == STATIC_PLANE_PROXYTYPE;
    const render::Color color = isGround                ? kLevelGround
                                : body.isStaticObject() ? render::surfaceColor()
                                                        : render::bodyColor(moving++);
    result.push_back({model.mesh, ground_.fieldFromWorld * world.worldFromBody(n) * model.bodyFromMesh, color});
  }
  for (std::size_t n = 0; n < world.softBodies(); ++n)
    result.push_back({std::uint32_t(firstSoft_ + n), ground_.fieldFromWorld, render::bodyColor(rigid_ + n)});
  return result;
}

render::Caption Studio::caption() const {
  const physics::World& world = scene_.world();
  render::Caption caption{name_, {fmt::format("t = {:.2f} s", world.seconds())}};
  if (rigid_ > 0) caption.details.push_back(countOf(scene_.moving(), "body", "bodies"));
  if (world.softBodies() > 0) caption.details.push_back(countOf(world.softBodies(), "soft body", "soft bodies"));
  caption.details.push_back(countOf(world.figures().dispatch.penetrating, "contact", "contacts"));
  caption.details.push_back(
      fmt::format("camera {:g}°, {:g}°", look_.camera.azimuthDegrees, look_.camera.elevationDegrees));
  return caption;
}

SimulationShot Studio::shot() {
  moveSoftBodies();
  const std::vector<render::Body> shown = bodies();
  look_.bodies = {bodyRenderer_.get(), shown};
  look_.caption = caption();
  return {render::drawSurface(*renderer_, *ground_.field, look_), *ground_.field, description_,
          scene_.world().seconds(), scene_.world().figures().dispatch.penetrating};
}

}  // namespace hpsdf::app
