#include "hpsdf/shapes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "hpsdf/detail/nearest_name.h"
#include "hpsdf/error.h"
#include "hpsdf/mesh_file.h"

namespace hpsdf {
namespace shapes_test {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr double kPi = std::numbers::pi;

std::string errorOf(const std::string& spec, bool analytic = false) {
  try {
    if (analytic)
      shapes::analytic(spec);
    else
      shapes::mesh(spec);
  } catch (const Error& e) {
    return e.what();
  }
  return "no error";
}

std::vector<std::string> shapeNames() {
  std::vector<std::string> names;
  for (const auto& shape : shapes::catalogue()) names.push_back(shape.name);
  return names;
}

/// Returns the root mean square distance between the mesh's surface and the smooth shape.
double surfaceDeviation(const TriangleMesh& mesh, const DistanceFunction& smooth) {
  constexpr int kSteps = 8;  // Each triangle is sampled at the centroids of 64 parts.
  std::vector<Vector3> points;
  double sum = 0, total = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vector3& p = mesh.vertices[a];
    const Vector3 u = (mesh.vertices[b] - p) / kSteps, v = (mesh.vertices[c] - p) / kSteps;
    points.clear();
    for (int i = 0; i < kSteps; ++i)
      for (int j = 0; i + j < kSteps; ++j) {
        points.push_back(p + (i + 1 / 3.0) * u + (j + 1 / 3.0) * v);
        if (i + j + 1 < kSteps) points.push_back(p + (i + 2 / 3.0) * u + (j + 2 / 3.0) * v);
      }
    std::vector<double> distances(points.size());
    smooth(points, distances);
    const double area = u.cross(v).norm();
    for (const double d : distances) sum += area * d * d;
    total += area * static_cast<double>(distances.size());
  }
  return std::sqrt(sum / total);
}

TEST(Shapes, catalogueListsShapesInOrder) {
  EXPECT_THAT(shapeNames(),
              ::testing::ElementsAre("sphere", "torus", "box", "gear", "helix-bowl", "marble-run", "structured-bowl"));
  for (const auto& shape : shapes::catalogue()) {
    EXPECT_FALSE(shape.help.empty());
    for (const auto& p : shape.parameters) {
      EXPECT_FALSE(p.help.empty()) << shape.name << " " << p.name;
      EXPECT_LE(p.minimum, p.defaultValue) << shape.name << " " << p.name;
      EXPECT_LE(p.defaultValue, p.maximum) << shape.name << " " << p.name;
    }
  }
}

TEST(Shapes, defaultsAreClosedOutwardCleanAndAboutTwoUnitsLong) {
  for (const std::string& name : shapeNames()) {
    const TriangleMesh mesh = shapes::mesh(name);
    EXPECT_EQ(mesh.name, "builtin:" + name);
    const auto [clean, report] = cleaned(mesh);
    EXPECT_TRUE(report.closed()) << name;
    EXPECT_FALSE(report.reversed) << name;
    EXPECT_EQ(report.components, 1u) << name;
    EXPECT_EQ(report.faces, mesh.triangles.size()) << name;
    EXPECT_EQ(report.vertices, mesh.vertices.size()) << name;
    EXPECT_EQ(report.flippedFaces, 0u) << name;
    EXPECT_NEAR(report.box.sizes().maxCoeff(), 2, 3e-4) << name;
    EXPECT_LT(report.box.center().norm(), 1e-15) << name;
  }
}

TEST(Shapes, sphereHasTheSmoothSpheresVolume) {
  const MeshReport report = inspect(shapes::mesh("sphere,radius=2.5,subdivisions=3"));
  EXPECT_EQ(report.faces, 1280u);
  EXPECT_NEAR(report.volume, 4 * kPi / 3 * 15.625, 1e-11);
  EXPECT_EQ(inspect(shapes::mesh("sphere")).faces, 81920u);
  EXPECT_EQ(inspect(shapes::mesh("sphere,subdivisions=0")).faces, 20u);
}

TEST(Shapes, torusHasTheSmoothTorusVolume) {
  const MeshReport report = inspect(shapes::mesh("torus,major=2,minor=0.5,segments=31,sides=9"));
  EXPECT_EQ(report.vertices, 31u * 9);
  EXPECT_EQ(report.faces, 2u * 31 * 9);
  EXPECT_NEAR(report.volume, 2 * kPi * kPi * 2 * 0.25, 1e-11);
}

TEST(Shapes, curvedMeshesFollowTheSmoothSurface) {
  for (const std::string name : {"sphere", "torus"}) {
    const double deviation = surfaceDeviation(shapes::mesh(name), shapes::analytic(name));
    EXPECT_LT(deviation / 2, 5e-5) << name;
    EXPECT_GT(deviation / 2, 1e-7) << name;  // A mesh of flat facets deviates; 0 would mean that nothing was measured.
    RecordProperty(name + "_rms", std::to_string(deviation));
  }
}

TEST(Shapes, boxHasTwelveTrianglesAndItsSize) {
  const TriangleMesh mesh = shapes::mesh("box,width=4,height=0.5,depth=3");
  const MeshReport report = inspect(mesh);
  EXPECT_EQ(report.faces, 12u);
  EXPECT_TRUE(report.closed());
  EXPECT_DOUBLE_EQ(report.volume, 6);
  EXPECT_EQ(report.box.max(), Vector3(2, 0.25, 1.5));
  EXPECT_EQ(report.box.min(), Vector3(-2, -0.25, -1.5));
}

TEST(Shapes, gearHasItsSizeAndOneHole) {
  const TriangleMesh mesh = shapes::mesh("gear,teeth=20,radius=3,tooth-depth=0.4,hole=1,thickness=0.8,segments=2");
  const MeshReport report = inspect(mesh);
  EXPECT_TRUE(report.closed());
  EXPECT_EQ(report.components, 1u);
  const auto edges = static_cast<double>(report.faces) * 1.5;
  EXPECT_EQ(static_cast<double>(report.vertices) - edges + static_cast<double>(report.faces),
            0);  // The Euler characteristic of a surface of genus 1 is 0.
  EXPECT_EQ(report.box.max(), Vector3(3, 3, 0.4));
  double nearest = 1e9;
  for (const Vector3& v : mesh.vertices) {
    const double r = v.head<2>().norm();
    nearest = std::min(nearest, r);
    EXPECT_TRUE(std::abs(r - 1) < 1e-14 || std::abs(r - 2.6) < 1e-14 || std::abs(r - 3) < 1e-14) << r;
  }
  EXPECT_NEAR(nearest, 1, 1e-14);
  // The volume lies between the volumes of two rings, with the gear's inner and its outer radius.
  EXPECT_GT(report.volume, 0.8 * kPi * (2.6 * 2.6 - 1) * 0.95);
  EXPECT_LT(report.volume, 0.8 * kPi * (9 - 1));
}

/// Triangles of the gear's top and bottom must not fold over each other.
TEST(Shapes, gearCapsFaceOutward) {
  for (const std::string spec :
       {"gear", "gear,teeth=3,segments=1,tooth-depth=0.6,hole=0.39", "gear,teeth=3,hole=0.779"}) {
    const TriangleMesh mesh = shapes::mesh(spec);
    const double half = boundingBox(mesh).max().z();
    for (const auto& [a, b, c] : mesh.triangles) {
      const Vector3 &p = mesh.vertices[a], &q = mesh.vertices[b], &r = mesh.vertices[c];
      const Vector3 normal = (q - p).cross(r - p);
      ASSERT_GT(normal.norm(), 0);
      if (p.z() == q.z() && q.z() == r.z()) {
        ASSERT_EQ(normal.z() > 0, p.z() == half) << spec;
      }
    }
  }
}

/// Returns the z coordinates at which the vertical line through (x, y) intersects the mesh, in ascending order.
std::vector<double> crossings(const TriangleMesh& mesh, double x, double y) {
  std::vector<double> heights;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vector3 &p = mesh.vertices[a], &q = mesh.vertices[b], &r = mesh.vertices[c];
    const auto side = [&](const Vector3& u, const Vector3& v) {
      return (v.x() - u.x()) * (y - u.y()) - (v.y() - u.y()) * (x - u.x());
    };
    const double w0 = side(q, r), w1 = side(r, p), w2 = side(p, q);
    if ((w0 > 0) != (w1 > 0) || (w1 > 0) != (w2 > 0)) continue;
    heights.push_back((w0 * p.z() + w1 * q.z() + w2 * r.z()) / (w0 + w1 + w2));
  }
  std::ranges::sort(heights);
  return heights;
}

TEST(Shapes, bowlsAreOneWallOpenTowardsPositiveZ) {
  for (const std::string name : {"helix-bowl", "structured-bowl"}) {
    const TriangleMesh mesh = shapes::mesh(name);
    const Box box = boundingBox(mesh);
    EXPECT_EQ(mesh.triangles.size(), 37'632u) << name;  // 16 n (n + 1) triangles for n = 48 cells
    double thinnest = 1e9, thickest = 0;
    for (const double x : {0.013, 0.21, 0.47, 0.63})
      for (const double y : {0.007, -0.18, 0.33, -0.52}) {
        const std::vector<double> wall = crossings(mesh, x, y);
        ASSERT_EQ(wall.size(), 2u) << name << " at " << x << ", " << y;  // The line crosses both sides of the wall.
        EXPECT_NEAR(wall[0], box.min().z() + 0.8 * (x * x + y * y), 1e-3) << name;
        const double slope = 1.6 * std::hypot(x, y);
        const double thickness = (wall[1] - wall[0]) / std::hypot(1, slope);
        thinnest = std::min(thinnest, thickness);
        thickest = std::max(thickest, thickness);
      }
    EXPECT_GT(thinnest, 0.03) << name;
    EXPECT_LT(thinnest, 0.08) << name;  // The relief makes the wall thinner somewhere.
    EXPECT_LT(thickest, 0.13) << name;
  }
}

TEST(Shapes, theHelixBowlsGrooveWindsOutwards) {
  // Along a ray from the axis, the spiral groove makes the wall thin once per turn. If the ray is rotated by a quarter
  // turn, the thin places move outwards by a quarter of their spacing.
  const TriangleMesh mesh = shapes::mesh("helix-bowl,cells=96,height=0.1");
  const auto depthAt = [&](double radius, double angle) {
    const auto wall = crossings(mesh, radius * std::cos(angle) + 1e-4, radius * std::sin(angle) + 1e-4);
    return wall.size() == 2 ? 0.1 - (wall[1] - wall[0]) : 0;
  };
  for (const double angle : {0.1, 0.1 + kPi / 2}) {
    const double groove = 0.5 + angle / (2 * kPi) / 4;  // radius of the groove in the second of its four turns
    EXPECT_GT(depthAt(groove, angle), 0.05);
    EXPECT_LT(depthAt(groove + 0.125, angle), 0.01);
    EXPECT_GT(depthAt(groove + 0.25, angle), 0.05);
  }
}

TEST(Shapes, theMarbleRunFillsLittleOfItsBoxAndDescends) {
  const TriangleMesh mesh = shapes::mesh("marble-run");
  const MeshReport report = inspect(mesh);
  EXPECT_EQ(report.faces, 2u * 18 * 4 * 96 + 4 * 8);
  EXPECT_LT(report.volume / report.box.volume(), 0.03);
  // The expected volume is half an annulus with 16 corners, swept along all turns.
  const double length = 4 * 2 * kPi * 0.92, area = 8 * std::sin(kPi / 8) / 2 * (0.08 * 0.08 - 0.06 * 0.06);
  EXPECT_NEAR(report.volume, length * area, 0.002 * length * area);
  // Vertical lines through the middle of the channel, on opposite sides of the axis, intersect the floors of all turns.
  const std::vector<double> floors = crossings(mesh, 0.92, 1e-3);
  ASSERT_EQ(floors.size(), 8u);  // two sides of the wall in each of four turns
  for (int turn = 0; turn < 4; ++turn) EXPECT_NEAR(floors[2 * turn + 1] - floors[2 * turn], 0.02, 2e-3);
  EXPECT_NEAR(floors[2] - floors[0], 0.25, 1e-3);
  const std::vector<double> opposite = crossings(mesh, -0.92, 1e-3);
  EXPECT_NEAR(std::abs(opposite[0] - floors[0]), 0.125, 2e-3);
}

TEST(Shapes, bowlsAndMarbleRunReachThePapersNumbersOfFaces) {
  EXPECT_NEAR(double(shapes::mesh("helix-bowl,cells=143").triangles.size()), 329'800, 1000);
  EXPECT_NEAR(double(shapes::mesh("marble-run,steps=255,sides=12").triangles.size()), 53'000, 200);
  EXPECT_NEAR(double(shapes::mesh("structured-bowl,cells=506,bumps=40").triangles.size()), 4'100'000, 10'000);
}

TEST(Shapes, extremeParametersStayClosed) {
  for (const std::string spec :
       {"sphere,radius=0.001,subdivisions=0", "sphere,radius=1000,subdivisions=4", "torus,segments=3,sides=3",
        "torus,major=1000,minor=0.001,segments=4096,sides=3", "torus,major=1,minor=0.9999,sides=1024,segments=5",
        "box,width=0.001,height=1000,depth=1", "gear,teeth=3,segments=1", "gear,teeth=500,segments=1",
        "gear,radius=1000,hole=0.001,thickness=0.001", "gear,radius=1,tooth-depth=0.001,hole=0.9985,segments=64",
        "helix-bowl,cells=8,turns=64", "helix-bowl,thickness=0.5,depth=0.499,height=0.9", "structured-bowl,cells=8",
        "structured-bowl,radius=1000,height=0.001,thickness=0.002,depth=0.001", "marble-run,turns=1,steps=8,sides=2",
        "marble-run,turns=64,width=0.03,thickness=0.014,steps=1024", "marble-run,width=0.9,height=10"}) {
    const TriangleMesh mesh = shapes::mesh(spec);
    const auto [clean, report] = cleaned(mesh);
    EXPECT_TRUE(report.closed()) << spec;
    EXPECT_FALSE(report.reversed) << spec;
    EXPECT_GT(report.volume, 0) << spec;
    EXPECT_EQ(report.faces, mesh.triangles.size()) << spec;
    EXPECT_EQ(report.vertices, mesh.vertices.size()) << spec;
    EXPECT_EQ(report.flippedFaces, 0u) << spec;
  }
}

TEST(Shapes, specsMayHaveBlanksAndAPrefix) {
  const TriangleMesh mesh = shapes::mesh(" builtin:torus , major = 1.5 , sides=12 ");
  EXPECT_EQ(mesh.vertices.size(), 256u * 12);
  EXPECT_EQ(mesh.name, "builtin:torus , major = 1.5 , sides=12");
  EXPECT_EQ(fingerprint(shapes::mesh(mesh.name)), fingerprint(mesh));
  EXPECT_EQ(shapes::mesh("torus,sides=1.2e1").vertices.size(), 256u * 12);
}

TEST(Shapes, badSpecsAreRefusedWithTheNearestName) {
  EXPECT_THAT(errorOf("toras"), HasSubstr("toras: there is no shape 'toras'; did you mean 'torus'?"));
  EXPECT_THAT(errorOf("builtin:gera"), HasSubstr("did you mean 'gear'?"));
  EXPECT_THAT(errorOf("dodecahedron"), HasSubstr("known: sphere, torus, box, gear"));
  EXPECT_THAT(errorOf(""), HasSubstr("known: sphere, torus, box, gear"));
  EXPECT_THAT(errorOf("helix-bowl,depth=0.1"), HasSubstr("make depth smaller than thickness"));
  EXPECT_THAT(errorOf("structured-bowl,thickness=0.7"), HasSubstr("make thickness or height smaller"));
  EXPECT_THAT(errorOf("marble-run,thickness=0.08"), HasSubstr("make thickness smaller than half of the width"));
  EXPECT_THAT(errorOf("marble-run,turns=13"), HasSubstr("the turns meet"));
  EXPECT_THAT(errorOf("marble-run,width=1"), HasSubstr("make width smaller than radius"));
  EXPECT_THAT(errorOf("torus,majro=1"), HasSubstr("torus has no parameter 'majro'; did you mean 'major'?"));
  EXPECT_THAT(errorOf("box,radius=1"), HasSubstr("known: width, height, depth"));
  EXPECT_THAT(errorOf("box,"), HasSubstr("box has no parameter ''"));
  EXPECT_THAT(errorOf("sphere,radius"), HasSubstr("radius has no value; write radius=1"));
  EXPECT_THAT(errorOf("sphere,radius="), HasSubstr("radius='' is not a number"));
  EXPECT_THAT(errorOf("sphere,radius=1m"), HasSubstr("radius='1m' is not a number"));
  EXPECT_THAT(errorOf("sphere,radius=nan"), HasSubstr("is not a number"));
  EXPECT_THAT(errorOf("sphere,radius=inf"), HasSubstr("is not a number"));
  EXPECT_THAT(errorOf("sphere,radius=1,radius=2"), HasSubstr("radius is given twice"));
  EXPECT_THAT(errorOf("sphere,subdivisions=2.5"), HasSubstr("is not a whole number"));
  EXPECT_THAT(errorOf("sphere,subdivisions=10"), HasSubstr("out of range; give 0 to 9"));
  EXPECT_THAT(errorOf("sphere,radius=0"), HasSubstr("out of range"));
  EXPECT_THAT(errorOf("sphere,radius=-1"), HasSubstr("out of range"));
  EXPECT_THAT(errorOf("torus,segments=1e9"), HasSubstr("out of range"));
  EXPECT_THAT(errorOf("torus,minor=0.7"), HasSubstr("make minor smaller than major"));
  EXPECT_THAT(errorOf("torus,minor=0.6,sides=3"), HasSubstr("make minor smaller or sides larger"));
  EXPECT_THAT(errorOf("gear,tooth-depth=1"), HasSubstr("make tooth-depth smaller"));
  EXPECT_THAT(errorOf("gear,hole=0.78"), HasSubstr("make hole smaller"));
  EXPECT_THAT(errorOf("gear", true), HasSubstr("no distance in closed form is known; use builtin:gear"));
  EXPECT_THAT(errorOf("analytic:shpere", true), HasSubstr("did you mean 'sphere'?"));
}

TEST(Shapes, analyticDistancesKnowTheirSource) {
  for (const auto& shape : shapes::catalogue()) {
    if (!shape.analytic) continue;
    const DistanceFunction distance = shapes::analytic("analytic:" + shape.name);
    EXPECT_EQ(distance.source().name, "analytic:" + shape.name);
    EXPECT_EQ(distance.source().fingerprint, 0u);
    EXPECT_TRUE(distance.source().box.isApprox(boundingBox(shapes::mesh(shape.name)), 1e-3)) << shape.name;
  }
  EXPECT_EQ(shapes::analytic("torus,major=2,minor=0.5").source().box.max(), Vector3(2.5, 2.5, 0.5));
}

TEST(Shapes, analyticDistancesAreExact) {
  EXPECT_DOUBLE_EQ(shapes::sphereDistance({0, 3, 4}, 2), 3);
  EXPECT_DOUBLE_EQ(shapes::sphereDistance({0, 0, 0}, 2), -2);
  EXPECT_DOUBLE_EQ(shapes::torusDistance({0, 0, 0}, 2, 0.5), 1.5);
  EXPECT_DOUBLE_EQ(shapes::torusDistance({0, 2, 0}, 2, 0.5), -0.5);
  EXPECT_DOUBLE_EQ(shapes::torusDistance({5, 0, 4}, 2, 0.5), 4.5);
  const Vector3 half(1, 2, 3);
  EXPECT_DOUBLE_EQ(shapes::boxDistance({0, 0, 0}, half), -1);
  EXPECT_DOUBLE_EQ(shapes::boxDistance({0, 1.75, 0}, half), -0.25);
  EXPECT_DOUBLE_EQ(shapes::boxDistance({-4, 0, 0}, half), 3);
  EXPECT_DOUBLE_EQ(shapes::boxDistance({4, -6, 0}, half), 5);
  EXPECT_DOUBLE_EQ(shapes::boxDistance({2, 4, -5}, half), 3);
}

TEST(Shapes, analyticDistancesHaveUnitGradients) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-1.5, 1.5);
  for (const auto& shape : shapes::catalogue()) {
    if (!shape.analytic) continue;
    const DistanceFunction distance = shapes::analytic(shape.name);
    int kinks = 0;
    for (int i = 0; i < 200; ++i) {
      const Vector3 x(uniform(random), uniform(random), uniform(random));
      constexpr double kStep = 1e-5;
      std::vector<Vector3> points;
      for (int axis = 0; axis < 3; ++axis)
        for (const double sign : {-1, 1}) points.push_back(x + sign * kStep * Vector3::Unit(axis));
      std::vector<double> values(6);
      distance(points, values);
      const Vector3 gradient =
          Vector3(values[1] - values[0], values[3] - values[2], values[5] - values[4]) / (2 * kStep);
      if (std::abs(gradient.norm() - 1) > 1e-6) ++kinks;  // a kink, which exists on the medial axis only
    }
    EXPECT_LE(kinks, 1) << shape.name;
  }
}

TEST(NearestName, findsMisspellingsAndBeginnings) {
  const std::vector<std::string> known = {"build", "info", "query", "slice", "render", "target-error"};
  EXPECT_EQ(nearestName("biuld", known), "build");
  EXPECT_EQ(nearestName("Render", known), "render");
  EXPECT_EQ(nearestName("slices", known), "slice");
  EXPECT_EQ(nearestName("tar", known), "target-error");
  EXPECT_EQ(nearestName("target_error", known), "target-error");
  EXPECT_EQ(nearestName("ta", known), "");
  EXPECT_EQ(nearestName("zzzz", known), "");
  EXPECT_EQ(nearestName("", known), "");
  EXPECT_EQ(nearestName("build", {}), "");
  const std::string endless(1'000'000, 'x');  // Comparing it with another such name would take 10^12 steps.
  EXPECT_EQ(nearestName(endless + "y", std::vector{endless}), "");
  EXPECT_EQ(nearestName("x", std::vector<std::string>{"y", "z"}), "");
}

TEST(NearestName, countsEditedLetters) {
  EXPECT_EQ(editDistance("", "abc"), 3u);
  EXPECT_EQ(editDistance("abc", ""), 3u);
  EXPECT_EQ(editDistance("kitten", "sitting"), 3u);
  EXPECT_EQ(editDistance("gera", "gear"), 1u);
  EXPECT_EQ(editDistance("ABC", "abc"), 0u);
}

}  // namespace shapes_test
}  // namespace hpsdf
