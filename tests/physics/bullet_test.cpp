// Tests fields as collision shapes in Bullet.

#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>
#include <BulletSoftBody/btSoftBody.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <cmath>
#include <limits>
#include <random>

#include "hpsdf/build.h"
#include "hpsdf/error.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/physics/world.h"
#include "hpsdf/shapes.h"
#include "reduce_contacts.h"

namespace hpsdf::physics {
namespace bullet_test {

/// A mesh with everything that Bullet needs: field, collider, samples, mass and collision shape.
struct Kind {
  explicit Kind(const std::string& spec, std::size_t count = 2000) : Kind(shapes::mesh(spec), nullptr, count) {}

  /// If `distance` is given, the field approximates it instead of the distance to the mesh.
  Kind(TriangleMesh of, const std::function<double(const Vector3&)>& distance, std::size_t count)
      : mesh(std::move(of)),
        field(distance ? build(distance, domainAround(mesh), {.targetError = 1e-9})
                       : build(ExactDistance(mesh), domainAround(mesh), {.targetError = 1e-7})),
        collider(field),
        samples(sampleSurface(mesh, {.count = count})),
        mass(massProperties(mesh)),
        shape(collider, samples, mass, 0.005) {}

  TriangleMesh mesh;
  Field field;
  FieldCollider collider;
  SurfaceSamples samples;
  MassProperties mass;
  FieldShape shape;
};

/// Returns a spherical hollow of radius 1 around the origin, whose lower half is a smooth bowl.
Kind& hollow() {
  static Kind kind(
      shapes::mesh("box,width=2.4,height=2.4,depth=2.4"), [](const Vector3& x) { return 1 - x.norm(); }, 10);
  return kind;
}

Eigen::Isometry3d at(const Vector3& place) { return Eigen::Isometry3d(Eigen::Translation3d(place)); }

/// Returns a square piece of cloth with side length 2·half and `nodes` nodes along each side.
std::unique_ptr<btSoftBody> flatSheet(World& world, const Vector3& middle, double half, int nodes) {
  const auto corner = [&](double x, double y) { return toBullet(middle + half * Vector3(x, y, 0)); };
  return std::unique_ptr<btSoftBody>(btSoftBodyHelpers::CreatePatch(
      world.softBodyInfo(), corner(-1, -1), corner(1, -1), corner(-1, 1), corner(1, 1), nodes, nodes, 0, true));
}

double energy(const World& world, std::size_t number) {
  const btRigidBody& body = world.body(number);
  const btVector3 v = body.getLinearVelocity(), w = body.getAngularVelocity();
  const btVector3 inertia = body.getLocalInertia();  // a sphere's, equal about all axes
  return 0.5 * body.getMass() * v.length2() + 0.5 * inertia.x() * w.length2() +
         9.81 * body.getMass() * body.getWorldTransform().getOrigin().z();
}

TEST(MassProperties, ofATurnedAndDistantBox) {
  TriangleMesh mesh = shapes::mesh("box,width=2,height=1,depth=0.5");
  const Eigen::Matrix3d turn = Eigen::Quaterniond(0.4, 0.3, -0.7, 0.5).normalized().toRotationMatrix();
  for (Vector3& x : mesh.vertices) x = turn * x + Vector3(1000, 2000, -3000);
  const MassProperties mass = massProperties(mesh);
  EXPECT_NEAR(mass.volume, 1, 1e-9);
  EXPECT_NEAR((mass.meshFromInertia.translation() - Vector3(1000, 2000, -3000)).norm(), 0, 1e-9);
  EXPECT_NEAR((mass.inertia - Vector3(2 * 2 + 1, 2 * 2 + 0.25, 1 + 0.25) / 12).cwiseAbs().maxCoeff(), 0, 1e-9);
  EXPECT_NEAR(mass.meshFromInertia.linear().determinant(), 1, 1e-12);
  EXPECT_NEAR((mass.box.max() - Vector3(0.25, 0.5, 1)).norm(), 0, 1e-9);  // last axis: least inertia
  EXPECT_NEAR((mass.box.min() + Vector3(0.25, 0.5, 1)).norm(), 0, 1e-9);
  EXPECT_THROW(massProperties(TriangleMesh{}), Error);
  mesh.triangles.front()[1] = 1'000'000'000;
  EXPECT_THROW(massProperties(mesh), Error);
}

TEST(ReduceContacts, keepsTheDeepestAndThoseAroundIt) {
  std::vector<BodyContact> contacts;
  for (int x = 0; x < 10; ++x)
    for (int y = 0; y < 10; ++y)
      contacts.push_back({Vector3(x, y, 0), Vector3::UnitZ(), x == 4 && y == 5 ? -0.2 : -0.1});
  reduceContacts(5, 1, contacts);
  ASSERT_EQ(contacts.size(), 5u);
  EXPECT_EQ(contacts[0].onSecond, Vector3(4, 5, 0));
  for (const Vector3& corner : {Vector3(0, 0, 0), Vector3(9, 0, 0), Vector3(0, 9, 0), Vector3(9, 9, 0)})
    EXPECT_TRUE(std::ranges::any_of(contacts, [&](const BodyContact& c) { return c.onSecond == corner; })) << corner;
}

TEST(BulletField, aMarbleInASmoothBowlGainsNoEnergyAndComesToRestInTheMiddle) {
  constexpr double kRadius = 0.05;
  btSphereShape sphere(kRadius);
  World world;
  world.add(hollow().shape, 0, hollow().mass.meshFromInertia);
  const std::size_t marble =
      world.add(sphere, 1, at({(1 - kRadius) * std::sin(0.7), 0, -(1 - kRadius) * std::cos(0.7)}),
                {.friction = 0.5, .linearDamping = 0.5, .angularDamping = 0.5});
  double before = energy(world, marble);
  const double start = before;
  double farthest = 0;
  for (int step = 0; step < 240 * 20; ++step) {
    world.step();
    const double now = energy(world, marble);
    ASSERT_LE(now, before + 1e-4 * 9.81) << "at step " << step;
    before = std::min(before, now);
    if (step > 200) farthest = std::max(farthest, -world.worldFromBody(marble).translation().x());
    EXPECT_LT(world.figures().dispatch.deepest, 0.1 * kRadius);
  }
  EXPECT_GT(farthest, 0.2) << "it rolls up the other side";
  EXPECT_LT(before, start - 1);
  const Vector3 end = world.worldFromBody(marble).translation();
  EXPECT_NEAR(end.x(), 0, 0.01);
  EXPECT_NEAR(end.y(), 0, 0.01);
  EXPECT_NEAR(end.z(), -(1 - kRadius), 0.02 * kRadius);
}

TEST(BulletField, aBodyComesToRestOnAPlaneAndOnAnotherBody) {
  Kind box("box,width=1,height=0.8,depth=0.4"), slab("box,width=4,height=4,depth=0.5");
  btStaticPlaneShape plane(btVector3(0, 0, 1), 0);
  World world;
  world.add(plane, 0, at(Vector3::Zero()));
  world.add(slab.shape, 0, at({10, 0, 0.25}) * slab.mass.meshFromInertia);
  const std::size_t onPlane = world.add(box.shape, 1, at({0, 0, 0.5}) * box.mass.meshFromInertia);
  const std::size_t onSlab = world.add(box.shape, 1, at({10, 0, 1}) * box.mass.meshFromInertia);
  for (int step = 0; step < 720; ++step) world.step();
  EXPECT_NEAR(world.worldFromBody(onPlane).translation().z(), 0.2, 0.005);
  EXPECT_NEAR(world.worldFromBody(onSlab).translation().z(), 0.7, 0.005);
  EXPECT_LT(world.body(onPlane).getLinearVelocity().length(), 0.01);
  EXPECT_LT(world.body(onSlab).getLinearVelocity().length(), 0.01);
}

/// The broad phase uses the box of the mesh, so that few samples suffice.
TEST(BulletField, broadPhaseBoxesHoldTheWholeBody) {
  Kind ball("sphere,radius=0.5", 5);
  btSphereShape marble(0.05);
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {-1, 1}) {
      World world;
      world.add(ball.shape, 0, ball.mass.meshFromInertia);
      world.add(marble, 1, at(side * (0.5 + 0.05 - 0.01) * Vector3::Unit(axis)));
      world.step();
      EXPECT_NEAR(world.figures().dispatch.deepest, 0.01, 1e-3) << axis << ", " << side;
    }
}

/// A body rests at the same height whether it or the ground was added first.
TEST(BulletField, theOrderOfBodiesChangesNothing) {
  Kind box("box,width=1,height=0.8,depth=0.4"), slab("box,width=4,height=4,depth=0.5");
  btSphereShape sphere(0.1);
  btStaticPlaneShape plane(btVector3(0, 0, 1), 0);
  const auto restsAt = [](btCollisionShape& ground, const Eigen::Isometry3d& groundAt, btCollisionShape& body,
                          const Eigen::Isometry3d& bodyAt, bool groundIsFirst) {
    World world;
    if (groundIsFirst) world.add(ground, 0, groundAt);
    const std::size_t number = world.add(body, 1, bodyAt);
    if (!groundIsFirst) world.add(ground, 0, groundAt);
    for (int step = 0; step < 480; ++step) world.step();
    return world.worldFromBody(number).translation().z();
  };
  const Eigen::Isometry3d below = at({0, 0, -0.25}) * slab.mass.meshFromInertia;
  for (const bool first : {true, false}) {
    EXPECT_NEAR(restsAt(slab.shape, below, box.shape, at({0, 0, 0.3}) * box.mass.meshFromInertia, first), 0.2, 1e-3);
    EXPECT_NEAR(restsAt(slab.shape, below, sphere, at({0, 0, 0.2}), first), 0.1, 1e-3);
    EXPECT_NEAR(restsAt(plane, at({0, 0, 0}), box.shape, at({0, 0, 0.3}) * box.mass.meshFromInertia, first), 0.2, 1e-3);
  }
}

TEST(BulletField, aSphereInsideComesOutOnTheNearerSide) {
  Kind slab("box,width=3,height=3,depth=1");
  btSphereShape sphere(0.1);
  for (const double height : {0.3, 0.1, -0.2}) {
    World world({.gravity = {0, 0, 0}});
    world.add(slab.shape, 0, slab.mass.meshFromInertia);
    world.add(sphere, 1, at({0.1, 0.2, height}));
    for (int step = 0; step < 240; ++step) world.step();
    EXPECT_NEAR(world.worldFromBody(1).translation().z(), height > 0 ? 0.6 : -0.6, 0.002) << height;
  }
}

TEST(BulletField, bodiesFallAsleepAndWakeWhenHit) {
  Kind box("box,width=0.6,height=0.6,depth=0.4");
  btStaticPlaneShape plane(btVector3(0, 0, 1), 0);
  btSphereShape sphere(0.1);
  World world;
  world.add(plane, 0, at({0, 0, 0}));
  const std::size_t body = world.add(box.shape, 1, at({0, 0, 0.21}) * box.mass.meshFromInertia);
  for (int step = 0; step < 1000; ++step) world.step();
  EXPECT_FALSE(world.body(body).isActive());
  const Vector3 asleep = world.worldFromBody(body).translation();
  EXPECT_NEAR(asleep.z(), 0.2, 1e-3);
  const std::size_t ball = world.add(sphere, 1, at({-1, 0, 0.3}));
  world.body(ball).setLinearVelocity(btVector3(8, 0, 0));
  for (int step = 0; step < 120; ++step) world.step();
  EXPECT_GT(world.worldFromBody(body).translation().x() - asleep.x(), 0.1);
}

/// A table rises by half a unit as a kinematic body, i.e. moved by the test and not by forces.
TEST(BulletField, aMovingFieldLiftsABodyAndCloth) {
  Kind slab("box,width=3,height=3,depth=0.4"), box("box,width=0.6,height=0.6,depth=0.4");
  World world;
  btRigidBody& table = world.body(world.add(slab.shape, 0, at({0, 0, -0.2}) * slab.mass.meshFromInertia));
  table.setCollisionFlags(table.getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
  table.setActivationState(DISABLE_DEACTIVATION);
  const std::size_t body = world.add(box.shape, 1, at({0.6, 0, 0.2}) * box.mass.meshFromInertia);
  std::unique_ptr<btSoftBody> sheet = flatSheet(world, {-0.6, 0, 0.02}, 0.2, 9);
  sheet->getCollisionShape()->setMargin(0.01);
  sheet->setTotalMass(1, false);
  world.add(std::move(sheet));
  constexpr double kSpeed = 0.5;
  for (int step = 0; step < 480; ++step) {
    const btVector3 velocity(0, 0, step < 240 ? kSpeed : 0);
    btTransform place = table.getWorldTransform();
    place.setOrigin(place.getOrigin() + velocity / 240);
    table.setWorldTransform(place);
    table.setLinearVelocity(velocity);
    world.step();
  }
  EXPECT_NEAR(world.worldFromBody(body).translation().z(), kSpeed + 0.2, 0.002);
  const btSoftBody& cloth = world.softBody(0);
  for (int node = 0; node < cloth.m_nodes.size(); ++node)
    EXPECT_NEAR(cloth.m_nodes[node].m_x.z(), kSpeed + 0.005, 0.006) << node;
}

/// Bullet presents a part of a compound to the collision algorithm as the compound, whose shape is no field.
TEST(BulletField, aFieldWithinACompoundCollidesWithNothing) {
  Kind plate("box,width=1,height=1,depth=0.2");
  btCompoundShape compound;
  compound.addChildShape(toBullet(plate.mass.meshFromInertia), &plate.shape);
  btSphereShape sphere(0.1);
  World world;
  world.add(compound, 0, at({0, 0, 0}));
  world.add(sphere, 1, at({0, 0, 0.3}));
  world.add(plate.shape, 1, at({0, 0, 0.6}) * plate.mass.meshFromInertia);
  world.add(flatSheet(world, {0, 0, 0.15}, 0.4, 5));
  for (int step = 0; step < 120; ++step) world.step();
  EXPECT_LT(world.worldFromBody(1).translation().z(), -0.5);
  EXPECT_LT(world.softBody(0).m_nodes[12].m_x.z(), -0.5);
}

TEST(BulletField, threadsAndRepetitionsChangeNothing) {
  Kind gear("gear"), slab("box,width=6,height=6,depth=0.5");
  const auto end = [&](int threads) {
    tbb::task_arena arena(threads);
    return arena.execute([&] {
      World world;
      world.add(slab.shape, 0, slab.mass.meshFromInertia);
      for (int n = 0; n < 5; ++n)
        world.add(gear.shape, 1, at({0.2 * n, 0.1 * n * n, 1 + 0.7 * n}) * Eigen::AngleAxisd(n, Vector3::UnitX()));
      for (int step = 0; step < 200; ++step) world.step();
      std::vector<double> places;
      for (std::size_t n = 0; n < world.bodies(); ++n) {
        const Eigen::Matrix4d place = world.worldFromBody(n).matrix();
        places.insert(places.end(), place.data(), place.data() + 16);
      }
      EXPECT_GT(world.figures().dispatch.contacts, 3u);
      return places;
    });
  };
  const std::vector<double> once = end(1);
  EXPECT_EQ(once, end(1));
  EXPECT_EQ(once, end(2));
}

/// Bullet's own sphere contacts have no warm start: its few iterations per step cannot carry a column of marbles.
TEST(BulletField, aColumnOfMarblesStands) {
  constexpr double kRadius = 0.05;
  constexpr int kCount = 12;
  Kind slab("box,width=1,height=1,depth=0.2");
  btSphereShape marble(kRadius);
  World world;
  world.add(slab.shape, 0, slab.mass.meshFromInertia);
  std::vector<std::size_t> column;
  for (int n = 0; n < kCount; ++n) {
    column.push_back(world.add(marble, 1, at({0, 0, 0.1 + (2 * n + 1) * kRadius})));
    world.body(column.back()).setLinearFactor({0, 0, 1});  // keeps the column from falling over
  }
  for (int step = 0; step < 480; ++step) world.step();
  double height = 0.1 - kRadius;
  for (const std::size_t number : column) {
    const double z = world.worldFromBody(number).translation().z();
    EXPECT_NEAR(z - height, 2 * kRadius, 0.005 * kRadius) << "marble " << number;
    height = z;
  }
}

TEST(BulletField, aBodyRestsAsDeepAsTheSlop) {
  Kind slab("box,width=1,height=1,depth=0.2");
  btSphereShape marble(0.05);
  World world({.slop = 0.001});
  world.add(slab.shape, 0, slab.mass.meshFromInertia);
  const std::size_t number = world.add(marble, 1, at({0, 0, 0.152}));
  for (int step = 0; step < 480; ++step) world.step();
  EXPECT_NEAR(world.worldFromBody(number).translation().z(), 0.15 - 0.001, 0.0002);
}

TEST(BulletField, aDivergingBodyIsReportedWithPositionAndTime) {
  btSphereShape sphere(0.1);
  World world;
  world.add(hollow().shape, 0, hollow().mass.meshFromInertia);
  world.add(sphere, 1, at(Vector3::Zero()));
  world.step();
  world.body(1).setLinearVelocity(btVector3(std::numeric_limits<double>::quiet_NaN(), 0, 0));
  try {
    world.step();
    ADD_FAILURE() << "a speed that is no number goes on";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("step 2: body 1"));
  }
  EXPECT_THROW(world.add(sphere, -1, at(Vector3::Zero())), Error);
  Eigen::Isometry3d scaled = at(Vector3::Zero());
  scaled.linear() *= 2;
  EXPECT_THROW(world.add(sphere, 1, scaled), Error);
  EXPECT_THROW(World({.step = 0}), Error);
  EXPECT_THROW(World({.slop = -1}), Error);
}

/// Bullet alone would leave the body where it is, without an error.
TEST(BulletField, aBodyThrownOutOfTheWorldCountsAsDiverging) {
  btSphereShape sphere(0.1);
  World world;
  world.add(hollow().shape, 0, hollow().mass.meshFromInertia);
  world.add(sphere, 1, at(Vector3::Zero()));
  world.body(1).setLinearVelocity(btVector3(0, 1e100, 0));
  try {
    world.step();
    ADD_FAILURE() << "it is left where it was: " << world.worldFromBody(1).translation().transpose();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("step 1: body 1"));
  }
}

TEST(BulletField, aDivergingClothNodeIsReportedWithPositionAndTime) {
  World world;
  world.add(hollow().shape, 0, hollow().mass.meshFromInertia);
  world.add(flatSheet(world, {0, 0, 0}, 0.2, 4));
  world.step();
  world.softBody(0).m_nodes[5].m_x.setX(std::numeric_limits<double>::quiet_NaN());
  try {
    world.step();
    ADD_FAILURE() << "a place that is no number goes on";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("of soft body 0"));
    EXPECT_THAT(error.what(), testing::HasSubstr("step 2"));
  }
}

TEST(BulletField, aMarbleAtRestFallsAsleepAndStaysInTheFigures) {
  Kind slab("box,width=1,height=1,depth=0.2");
  btSphereShape marble(0.05);
  World world;
  world.add(slab.shape, 0, slab.mass.meshFromInertia);
  const std::size_t number =
      world.add(marble, 1, Eigen::Isometry3d(Eigen::Translation3d(0, 0, 0.152)), {.restSpeed = 0.1});
  world.step();
  EXPECT_TRUE(world.body(number).isActive());
  for (int step = 0; step < 720; ++step) world.step();
  ASSERT_FALSE(world.body(number).isActive());
  EXPECT_EQ(world.figures().dispatch.pairs, 0u) << "nothing is looked up";
  EXPECT_EQ(world.figures().dispatch.contacts, 1u);
}

TEST(BulletField, depthOfAMarbleOnReliefIsExact) {
  Kind bowl("structured-bowl,bumps=4,cells=24");
  constexpr double kRadius = 0.06;
  btSphereShape marble(kRadius);
  std::mt19937 random(3);
  const auto within = [&](double lo, double hi) { return lo + (hi - lo) * double(random()) * 0x1p-32; };
  double deepest = 0;
  for (int trial = 0; trial < 15; ++trial) {
    Vector3 center(within(-0.5, 0.5), within(-0.5, 0.5), 0.5);
    while (bowl.field.value(center) > 0.95 * kRadius) center.z() -= 0.002;
    constexpr int kAllAround = 8000;
    std::vector<Vector3> points;
    for (int i = 0; i < kAllAround; ++i) {
      const double z = 1 - (2.0 * i + 1) / kAllAround, r = std::sqrt(1 - z * z), turn = 2.399963229728653 * i;
      points.push_back(center + kRadius * Vector3(r * std::cos(turn), r * std::sin(turn), z));
    }
    std::vector<double> values(points.size());
    bowl.field.values(points, values);
    const double least = std::ranges::min(values);
    World world;
    world.add(bowl.shape, 0, bowl.mass.meshFromInertia);
    world.add(marble, 1, Eigen::Isometry3d(Eigen::Translation3d(center)));
    world.step();
    EXPECT_NEAR(world.figures().dispatch.deepest, -least, 0.01 * kRadius) << center.transpose();
    deepest = std::max(deepest, -least);
  }
  EXPECT_GT(deepest, 0.04 * kRadius);
}

TEST(BulletField, fastClothDoesNotPassAThinPlate) {
  Kind plate("box,width=1,height=1,depth=0.02");
  World world;
  world.add(plate.shape, 0, plate.mass.meshFromInertia);
  std::unique_ptr<btSoftBody> sheet = flatSheet(world, {0, 0, 0.3}, 0.25, 15);
  sheet->getCollisionShape()->setMargin(0.01);
  sheet->setTotalMass(1, false);
  sheet->setVelocity(btVector3(0, 0, -20));  // four plate thicknesses per step
  world.add(std::move(sheet));
  for (int step = 0; step < 60; ++step) world.step();
  const btSoftBody& cloth = world.softBody(0);
  for (int node = 0; node < cloth.m_nodes.size(); ++node) EXPECT_GT(cloth.m_nodes[node].m_x.z(), 0.01 - 0.005) << node;
  EXPECT_LT(world.figures().dispatch.deepest, 0.005);
}

TEST(BulletField, clothRestsOnABody) {
  Kind ball("sphere,radius=0.5");
  World world;
  world.add(ball.shape, 0, ball.mass.meshFromInertia);
  std::unique_ptr<btSoftBody> sheet = flatSheet(world, {0, 0, 0.55}, 0.6, 31);
  constexpr double kMargin = 0.02;
  sheet->m_cfg.piterations = 8;
  sheet->m_cfg.kDF = 1;
  sheet->m_cfg.kDP = 0.05;
  sheet->getCollisionShape()->setMargin(kMargin);
  sheet->setTotalMass(1, false);
  world.add(std::move(sheet));
  for (int step = 0; step < 480; ++step) world.step();
  EXPECT_GT(world.figures().dispatch.contacts, 100u);
  EXPECT_LT(world.figures().dispatch.deepest, kMargin / 2);
  const btSoftBody& cloth = world.softBody(0);
  const auto middle = cloth.m_nodes[31 * 15 + 15].m_x;
  EXPECT_NEAR(middle.z(), 0.5, kMargin);
  EXPECT_LT(cloth.m_nodes[0].m_x.z(), 0.3) << "corners hang";
  double speed = 0;
  for (int node = 0; node < cloth.m_nodes.size(); ++node)
    speed += cloth.m_nodes[node].m_v.length() / cloth.m_nodes.size();
  EXPECT_LT(speed, 0.05);
}

}  // namespace bullet_test
}  // namespace hpsdf::physics
