#include <BulletSoftBody/btSoftBody.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>

#include "console/console.h"
#include "hpsdf/detail/memory.h"
#include "hpsdf/error.h"
#include "hpsdf/shapes.h"
#include "simulate/scene.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

using physics::Material;

Eigen::Isometry3d shift(const Vector3& by) { return Eigen::Isometry3d(Eigen::Translation3d(by)); }

/// Random number generator with the same numbers on every machine, unlike the standard library's distributions.
class Random {
 public:
  explicit Random(std::uint64_t start) : engine_(start) {}

  double within(double lo, double hi) { return lo + (hi - lo) * double(engine_() >> 11) * 0x1p-53; }

  /// Returns a random point of the cube [-most, most]³.
  Vector3 jitter(double most) { return Vector3(within(-most, most), within(-most, most), within(-most, most)); }

  /// Returns a uniformly distributed random rotation (Shoemake 1992).
  Eigen::Quaterniond rotation() {
    const double u = within(0, 1), a = within(0, 2 * std::numbers::pi), b = within(0, 2 * std::numbers::pi);
    const double s = std::sqrt(1 - u), c = std::sqrt(u);
    return {c * std::cos(b), s * std::sin(a), s * std::cos(a), c * std::sin(b)};
  }

 private:
  std::mt19937_64 engine_;
};

/// Returns the centre of a marble of this radius that rests on the field's surface at (x, y). Error messages
/// call the field `name`.
Vector3 restingPosition(const Field& field, const std::string& name, double x, double y, double radius) {
  Vector3 at(x, y, field.domain().max().z() + radius);
  for (int step = 0; step < 10000; ++step) {
    const double gap = field.value(at) - radius;
    if (gap < 1e-4 * radius) break;
    at.z() -= 0.5 * gap;
    if (at.z() < field.domain().min().z())
      throw Error(fmt::format("{}: nothing lies below the marble's start at x = {:g}, y = {:g}", name, x, y));
  }
  return at;
}

/// Throws `Error` unless the size of the ground suits marbles of this radius. Small ground has no room for the
/// marbles; on large ground they become so fast that they pass through the ground within one step.
void requireFitting(const TriangleMesh& ground, const std::string& name, double radius) {
  constexpr double kLeast = 10, kMost = 400;  // least width and greatest extent, in marble radii
  const double width = boundingBox(ground).sizes().head<2>().minCoeff();
  if (width < kLeast * radius || boundingBox(ground).sizes().maxCoeff() > kMost * radius)
    throw Error(
        fmt::format("{}: is {:.3g} wide and {:.3g} high, for marbles of radius {:g}: bring it to {:g} to {:g}; "
                    "2 suits them",
                    name, width, boundingBox(ground).sizes().z(), radius, kLeast * radius, kMost * radius));
}

/// A scene in which marbles fall onto ground that is open at the top.
class MarbleScene : public Scene {
 public:
  MarbleScene(const Console& console, const SceneRequest& request, double radius)
      : Scene(console, request, radius / 300) {
    TriangleMesh mesh = meshOf(request.ground, 0);
    requireFitting(mesh, request.ground, radius);
    addStatic(addKind(std::move(mesh), request.samples, radius / 10), Eigen::Isometry3d::Identity());
    shapes_.push_back(std::make_unique<btSphereShape>(radius));
    bodySize_ = radius;
    floor_ = ground().domain().min().z() - 10 * radius;
  }

 protected:
  const Field& ground() const { return kinds_.front().field; }

  /// Returns the material of marbles in a pile: their motion is damped, and marbles below a certain speed come to
  /// rest.
  Material pileMaterial() const {
    return {.friction = 0.4,
            .rollingFriction = 0.02 * bodySize_,
            .linearDamping = 0.05,
            .angularDamping = 0.1,
            .restSpeed = 0.2};
  }

  /// Returns the material of marbles that roll for a long time.
  Material rollingMaterial() const {
    return {.friction = 0.4,
            .rollingFriction = 0.002 * bodySize_,
            .linearDamping = 0.01,
            .angularDamping = 0.01,
            .restSpeed = 0};
  }

  /// Schedules a glass marble that appears at the position `at` after `seconds`.
  void dropMarble(double seconds, const Vector3& at, const Material& material) {
    constexpr double kDensity = 2500;
    const double mass = kDensity * 4 / 3 * std::numbers::pi * std::pow(bodySize_, 3);
    drop({seconds, shapes_.front().get(), mass, shift(at), material});
  }
};

/// A scene with a bowl into which a layer of marbles falls every 0.2 s.
struct BowlScene final : MarbleScene {
  BowlScene(const Console& console, const SceneRequest& request) : MarbleScene(console, request, 0.03) {
    const Box box = ground().domain();
    const double extent = 0.3 * box.sizes().head<2>().minCoeff(), distance = 2.6 * bodySize_;
    const double height = box.max().z() + 2 * bodySize_;
    Random random(request.seed);
    std::size_t left = request.bodies;
    for (int layer = 0; left > 0; ++layer)
      for (double y = -extent; y <= extent && left > 0; y += distance)
        for (double x = -extent; x <= extent && left > 0; x += distance) {
          if (std::hypot(x, y) > extent) continue;
          dropMarble(0.2 * layer,
                     Vector3(x, y, height) + Vector3(box.center().x(), box.center().y(), 0) +
                         0.2 * bodySize_ * random.jitter(1),
                     pileMaterial());
          --left;
        }
  }
};

struct HelixScene final : MarbleScene {
  HelixScene(const Console& console, const SceneRequest& request) : MarbleScene(console, request, 0.035) {
    // Drop a marble every 2 s into the groove with three turns, at x = 2/3 and y = 0, away from the edge of the bowl.
    for (std::size_t n = 0; n < request.bodies; ++n)
      dropMarble(2.0 * double(n), restingPosition(ground(), request.ground, 2.0 / 3, 0, bodySize_), rollingMaterial());
  }
};

/// A scene in which a marble rolls down a marble run and then into a triangle of standing bodies, as in
/// bowling.
struct RunScene final : MarbleScene {
  RunScene(const Console& console, const SceneRequest& request) : MarbleScene(console, request, 0.045) {
    const double table = boundingBox(kinds_.front().mesh).min().z() - 0.02;
    floor_ = table - 1;
    addLevelGround(table, 0.5);
    dropMarble(0, restingPosition(ground(), request.ground, 0.92, -0.05, bodySize_), rollingMaterial());
    constexpr double kPin = 0.2;
    std::vector<BodyKind*> pins;
    for (const std::string& name : request.meshes)
      pins.push_back(&addKind(meshOf(name, kPin), request.samples, 0.01 * kPin));
    std::size_t left = request.bodies;
    for (int row = 0; left > 0; ++row)
      for (int i = 0; i <= row && left > 0; ++i, --left) {
        BodyKind& pin = *pins[(request.bodies - left) % pins.size()];
        const double stands = table - boundingBox(pin.mesh).min().z();
        drop({0,
              &pin.shape,
              200 * pin.mass.volume,
              shift({0.92 + 1.2 * kPin * (i - 0.5 * row), -0.6 - kPin * row, stands}) * pin.mass.meshFromInertia,
              {.friction = 0.5}});
      }
  }
};

/// A scene in which bodies, whose meshes the request names, fall onto poles, a slope or a table.
class PileScene : public Scene {
 public:
  PileScene(const Console& console, const SceneRequest& request) : Scene(console, request), random_(request.seed) {
    floor_ = -1;
  }

 protected:
  BodyKind& addKind(TriangleMesh mesh, std::size_t samples) {
    const double size = boundingBox(mesh).sizes().minCoeff();
    return Scene::addKind(std::move(mesh), samples, std::min(0.005, 0.02 * size));
  }

  std::vector<BodyKind*> bodyKinds(double size) {
    bodySize_ = size;
    std::vector<BodyKind*> made;
    for (const std::string& name : request_.meshes) made.push_back(&addKind(meshOf(name, size), request_.samples));
    return made;
  }

  /// Schedules a body that appears at the position `at` after `seconds`, with a random orientation.
  void dropBody(BodyKind& kind, double seconds, const Vector3& at) {
    constexpr double kDensity = 1000;
    drop({seconds,
          &kind.shape,
          kDensity * kind.mass.volume,
          shift(at) * Eigen::Isometry3d(random_.rotation()),
          {.friction = 0.5, .linearDamping = 0.02, .angularDamping = 0.05}});
  }

  Random random_;
};

struct PolesScene final : PileScene {
  PolesScene(const Console& console, const SceneRequest& request) : PileScene(console, request) {
    constexpr int kSide = 8;
    constexpr double kDistance = 1.3, kHeight = 4, kWave = 1.2;
    const auto kinds = bodyKinds(1);
    BodyKind& pole = addKind(poleMesh(0.12, kHeight), 2000);
    addLevelGround(0, 0.6);
    const auto position = [](int i) { return kDistance * (i - 0.5 * (kSide - 1)); };
    for (int x = 0; x < kSide; ++x)
      for (int y = 0; y < kSide; ++y) addStatic(pole, shift({position(x), position(y), kHeight / 2}));
    for (std::size_t n = 0; n < request.bodies; ++n) {
      const int x = int(n % kSide), y = int(n / kSide % kSide);
      const std::size_t wave = n / (kSide * kSide);
      dropBody(*kinds[n % kinds.size()], kWave * double(wave),
               Vector3(position(x), position(y), kHeight + 2.5) + random_.jitter(0.1));
    }
  }
};

/// Makes Bullet solve the contacts of a soft body after the links between its nodes. In Bullet's own order the links
/// pull nodes into the bodies on which they rest.
void solveContactsLast(btSoftBody& body) {
  btAlignedObjectArray<btSoftBody::ePSolver::_>& sequence = body.m_cfg.m_psequence;
  sequence.resize(0);
  for (const auto solver : {btSoftBody::ePSolver::Linear, btSoftBody::ePSolver::Anchors,
                            btSoftBody::ePSolver::SContacts, btSoftBody::ePSolver::RContacts})
    sequence.push_back(solver);
}

std::unique_ptr<btSoftBody> softTorus(btSoftBodyWorldInfo& info, const Vector3& at, double size) {
  const TriangleMesh mesh = shapes::mesh("torus,major=0.7,minor=0.3,segments=24,sides=12");
  std::vector<btScalar> coordinates;
  for (const Vector3& x : mesh.vertices)
    for (int axis = 0; axis < 3; ++axis) coordinates.push_back(at[axis] + size / 2 * x[axis]);
  std::vector<int> corners;
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t vertex : triangle) corners.push_back(int(vertex));
  std::unique_ptr<btSoftBody> body(btSoftBodyHelpers::CreateFromTriMesh(info, coordinates.data(), corners.data(),
                                                                        int(mesh.triangles.size()), false));
  body->generateBendingConstraints(2);
  solveContactsLast(*body);
  body->m_cfg.piterations = 4;
  body->m_cfg.kMT = 0.05;  // pulls the nodes towards the initial shape
  body->m_cfg.kDF = 0.3;
  body->m_cfg.kDP = 0.01;
  body->getCollisionShape()->setMargin(0.02);
  body->setTotalMass(20, true);
  body->setPose(false, true);
  return body;
}

struct SlopeScene final : PileScene {
  SlopeScene(const Console& console, const SceneRequest& request) : PileScene(console, request) {
    constexpr double kLength = 8, kWidth = 4.4, kThick = 0.4, kSize = 0.6, kRail = 0.7;
    const auto kinds = bodyKinds(kSize);
    BodyKind& slab = addKind(slabMesh({kLength, kWidth, kThick}), 4000);
    BodyKind& table = addKind(slabMesh({kLength, 2 * kWidth, kThick}), 4000);
    BodyKind& rail = addKind(slabMesh({kLength, kThick, kRail}), 1000);
    BodyKind& pole = addKind(poleMesh(0.12, 0.8), 1000);
    floor_ = -4;
    const Material smooth{.friction = 0.3};
    const Eigen::Isometry3d ramp =
        shift({0, 0, 2}) * Eigen::Isometry3d(Eigen::AngleAxisd(0.55, Vector3::UnitY()));  // descends towards +x
    addStatic(slab, ramp, smooth);
    for (const double side : {-0.5, 0.5})
      addStatic(rail, ramp * shift({0, side * (kWidth + kThick), (kRail - kThick) / 2}), smooth);
    addStatic(table, shift({0.75 * kLength, 0, -0.3}));
    for (int row = 0; row < 3; ++row)
      for (int i = 0; i < 2 + row % 2; ++i)
        addStatic(pole, ramp * shift({-1.0 + 1.6 * row, 1.4 * (i - 0.5 * (1 + row % 2)), 0.4 + kThick / 2}), smooth);
    for (std::size_t n = 0; n < request.bodies; ++n) {
      const Vector3 jitter(random_.within(-0.1, 0.1), random_.within(-0.1, 0.1), 0);
      const Vector3 at = ramp * Vector3(-3.2, 1.0 * (double(n % 3) - 1), 0.9) + jitter;
      if (n % 4 == 3)
        world_.add(softTorus(world_.softBodyInfo(), at + Vector3(0.8, 0, 0.4 + 0.3 * double(n / 4)), kSize));
      else
        dropBody(*kinds[n % kinds.size()], 0.5 * double(n / 3), at);
    }
  }
};

struct ClothScene final : PileScene {
  ClothScene(const Console& console, const SceneRequest& request) : PileScene(console, request) {
    constexpr double kMargin = 0.01, kSide = 1.6, kBytesANode = 2000;
    requireMemory("a cloth of " + grouped(request.nodes) + " nodes", kBytesANode * double(request.nodes),
                  "take fewer nodes");
    const TriangleMesh mesh = meshOf(request.ground, 1);
    const double stands = -boundingBox(mesh).min().z();
    const double top = boundingBox(mesh).sizes().z();
    BodyKind& body = addKind(mesh, request.samples);
    BodyKind& table = addKind(slabMesh({3, 3, 0.2}), 1000);
    const Material rough{.friction = 1};  // keeps nodes on sharp tips, which would otherwise pierce the cloth
    addStatic(body, shift({0, 0, stands}), rough);
    addStatic(table, shift({0, 0, -0.1}), rough);
    const int side = std::max(2, int(std::ceil(std::sqrt(double(request.nodes)))));
    const auto corner = [&](double x, double y) { return btVector3(x * kSide / 2, y * kSide / 2, top + 0.05); };
    std::unique_ptr<btSoftBody> sheet(btSoftBodyHelpers::CreatePatch(
        world_.softBodyInfo(), corner(-1, -1), corner(1, -1), corner(-1, 1), corner(1, 1), side, side, 0, true));
    solveContactsLast(*sheet);
    sheet->m_cfg.piterations = 8;
    sheet->m_cfg.kDF = 1;
    sheet->m_cfg.kDP = 0.05;
    sheet->getCollisionShape()->setMargin(kMargin);
    sheet->setTotalMass(1, false);
    bodySize_ = kMargin;
    world_.add(std::move(sheet));
  }
};

template <typename Kind>
std::unique_ptr<Scene> madeAs(const Console& console, const SceneRequest& request) {
  return std::make_unique<Kind>(console, request);
}

}  // namespace

std::unique_ptr<Scene> makeScene(const Console& console, const std::string& name, const SceneRequest& request) {
  using Maker = std::unique_ptr<Scene> (*)(const Console&, const SceneRequest&);
  static const std::map<std::string, Maker> makers = {{"bowl", madeAs<BowlScene>},   {"helix", madeAs<HelixScene>},
                                                      {"run", madeAs<RunScene>},     {"poles", madeAs<PolesScene>},
                                                      {"slope", madeAs<SlopeScene>}, {"cloth", madeAs<ClothScene>}};
  return makers.at(name)(console, request);
}

}  // namespace hpsdf::app
