// Tests that pictures of simulations show the bodies at their positions.

#include "simulate/studio.h"

#include <BulletSoftBody/btSoftBody.h>
#include <gtest/gtest.h>

#include <limits>
#include <set>
#include <sstream>

#include "hpsdf/shapes.h"
#include "simulate/coarse_mesh.h"

namespace hpsdf::app {
namespace studio_test {

constexpr double kFieldsAreGood = 1e-5;  // target error τ

SceneRequest inSmall(const std::string& name) {
  SceneRequest request = std::ranges::find(scenes(), name, &SceneKind::name)->defaults;
  request.samples = 500;
  request.targetError = kFieldsAreGood;
  if (request.bodies > 5) request.bodies = 5;
  if (name == "cloth") request.nodes = 400;
  if (name == "bowl") request.ground = "builtin:structured-bowl,cells=24,bumps=4";
  if (name == "helix") request.ground = "builtin:helix-bowl,cells=32";
  if (name == "run") request.ground = "builtin:marble-run,steps=32,sides=6,turns=1,height=0.4,thickness=0.04";
  return request;
}

struct Quiet {
  std::istringstream in;
  std::ostringstream out, err;
  Console console{in, out, err};
};

std::unique_ptr<Scene> sceneAfter(const std::string& name, int steps) {
  Quiet quiet;
  std::unique_ptr<Scene> scene = makeScene(quiet.console, name, inSmall(name));
  for (int step = 0; step < steps; ++step) {
    scene->admit();
    scene->world().step();
  }
  return scene;
}

const physics::FieldShape* fieldShape(const btRigidBody& body) {
  return dynamic_cast<const physics::FieldShape*>(body.getCollisionShape());
}

Eigen::Isometry3d meshFromWorld(const Scene& scene, std::size_t body) {
  const Eigen::Isometry3d bodyFromWorld = scene.world().worldFromBody(body).inverse();
  const auto* shape = fieldShape(scene.world().body(body));
  return shape != nullptr ? shape->bodyFromMesh().inverse() * bodyFromWorld : bodyFromWorld;
}

/// Returns the distance of a point in world coordinates from the surface of a rigid body's collision shape.
double distanceTo(const Scene& scene, std::size_t n, const Vector3& x) {
  const btRigidBody& body = scene.world().body(n);
  if (const auto* shape = fieldShape(body)) return std::abs(shape->field().field().value(meshFromWorld(scene, n) * x));
  if (const auto* sphere = dynamic_cast<const btSphereShape*>(body.getCollisionShape()))
    return std::abs((meshFromWorld(scene, n) * x).norm() - sphere->getRadius());
  const auto& plane = dynamic_cast<const btStaticPlaneShape&>(*body.getCollisionShape());
  return std::abs(physics::fromBullet(plane.getPlaneNormal()).dot(x) - plane.getPlaneConstant());
}

double distanceToNodes(const btSoftBody& body, const Vector3& x) {
  double nearest = std::numeric_limits<double>::infinity();
  for (int n = 0; n < body.m_nodes.size(); ++n)
    nearest = std::min(nearest, (physics::fromBullet(body.m_nodes[n].m_x) - x).norm());
  return nearest;
}

struct Seen {
  std::set<std::size_t> bodies = {};       // indices of the rigid bodies, followed by those of the soft bodies
  double ground = 0, rigid = 0, soft = 0;  // greatest distance of a pixel's point from its body
};

/// Draws `scene` and measures how far the pixels' points are from the surfaces of the bodies in `truth`.
Seen look(const Scene& scene, const Scene& truth) {
  render::SurfacePicture picture{.camera = {}, .width = 320, .height = 240};
  picture.camera.elevationDegrees = 50;
  picture.camera.distance = 1;
  Studio studio(scene, "scene", picture, {.cpu = true});
  const SimulationShot shot = studio.shot();
  const physics::World& world = truth.world();
  std::size_t ground = 0;  // index of the body whose field the picture traces
  while (fieldShape(scene.world().body(ground)) == nullptr ||
         &fieldShape(scene.world().body(ground))->field().field() != &shot.field ||
         !(meshFromWorld(scene, ground).linear().isIdentity(1e-9)))
    ++ground;
  const Eigen::Isometry3d worldFromField = meshFromWorld(scene, ground).inverse();
  const auto& view = std::get<render::SurfaceView>(shot.drawn.view);
  const render::ViewBuffers& buffers = shot.drawn.buffers;
  Seen seen;
  for (int y = 0; y < buffers.height; ++y)
    for (int x = 0; x < buffers.width; ++x) {
      const std::size_t pixel = std::size_t(y) * buffers.width + x;
      if (!buffers.covered(pixel) || buffers.crack[pixel] != 0) continue;  // pixels at jumps of the field are skipped
      const Vector3 point = worldFromField * (render::pixelEye(view.camera, x, y, buffers.width, buffers.height) +
                                              double(buffers.distance[pixel]) *
                                                  render::pixelRay(view.camera, x, y, buffers.width, buffers.height));
      if (buffers.hit(pixel)) {
        seen.ground = std::max(seen.ground, distanceTo(truth, ground, point));
        continue;
      }
      const std::size_t body = buffers.body[pixel] + (buffers.body[pixel] >= ground ? 1 : 0);
      seen.bodies.insert(body);
      if (body < world.bodies())
        seen.rigid = std::max(seen.rigid, distanceTo(truth, body, point));
      else
        seen.soft = std::max(seen.soft, distanceToNodes(truth.world().softBody(body - world.bodies()), point));
    }
  return seen;
}

TEST(Studio, everyPixelShowsTheBodyAtItsPoint) {
  for (const SceneKind& kind : scenes()) {
    const std::unique_ptr<Scene> scene = sceneAfter(kind.name, 100);
    const physics::World& world = scene->world();
    const Seen seen = look(*scene, *scene);
    const double pixel = kind.name == "poles" || kind.name == "slope" ? 0.08 : 0.03;
    EXPECT_LT(seen.ground, 5e-3) << kind.name;  // about the size of the fields' jumps
    EXPECT_LT(seen.rigid, pixel) << kind.name;
    EXPECT_LT(seen.soft, 0.15) << kind.name;
    for (std::size_t n = 0; n < world.bodies(); ++n)
      EXPECT_TRUE(world.body(n).isStaticObject() || seen.bodies.contains(n)) << kind.name << ": body " << n;
    for (std::size_t n = 0; n < world.softBodies(); ++n)
      EXPECT_TRUE(seen.bodies.contains(world.bodies() + n)) << kind.name << ": soft body " << n;
  }
}

TEST(Studio, aMovedBodyIsNoticed) {
  const std::unique_ptr<Scene> then = sceneAfter("poles", 60), now = sceneAfter("poles", 100);
  EXPECT_GT(look(*then, *now).rigid, 0.3);
  const std::unique_ptr<Scene> flat = sceneAfter("cloth", 5), fallen = sceneAfter("cloth", 100);
  EXPECT_GT(look(*flat, *fallen).soft, 0.2);
}

TEST(Studio, waitingBodiesAreNotShown) {
  const std::unique_ptr<Scene> scene = sceneAfter("slope", 1);
  EXPECT_FALSE(scene->drops().empty());
  const Seen seen = look(*scene, *scene);
  for (const std::size_t body : seen.bodies) EXPECT_LT(body, scene->world().bodies() + scene->world().softBodies());
}

TEST(CoarseMesh, removesSmallDetailOnly) {
  const TriangleMesh fine = shapes::mesh("sphere,subdivisions=5");
  for (const double size : {0.05, 0.2}) {
    const TriangleMesh less = coarse(fine, size);
    EXPECT_LT(less.triangles.size(), fine.triangles.size());
    EXPECT_GT(less.triangles.size(), 0.5 / (size * size));
    for (const Vector3& x : less.vertices) EXPECT_NEAR(x.norm(), 1, size * size) << "on the chords of a cube";
    EXPECT_NEAR(signedVolume(less), signedVolume(fine), 6 * size * size);
    for (const auto& [a, b, c] : less.triangles) EXPECT_TRUE(a != b && b != c && c != a);
  }
  const TriangleMesh box = shapes::mesh("box");
  for (const double size : {0.0, 0.5, 100.0}) {  // no size may remove all of a box's triangles
    const TriangleMesh same = coarse(box, size);
    EXPECT_EQ(same.triangles.size(), box.triangles.size()) << size;
    EXPECT_EQ(signedVolume(same), signedVolume(box)) << size;
  }
}

}  // namespace studio_test
}  // namespace hpsdf::app
