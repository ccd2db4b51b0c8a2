#include "hpsdf/physics/contacts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "hpsdf/build.h"
#include "hpsdf/continuity.h"
#include "hpsdf/error.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/mesh_file.h"
#include "hpsdf/safe_distance.h"
#include "hpsdf/shapes.h"
#include "poses.h"
#include "support/random_field.h"
#include "support/test_mesh.h"

namespace hpsdf::physics {
namespace contacts_test {

bool operator==(const Contact& a, const Contact& b) {
  return a.sample == b.sample && a.depth == b.depth && a.position == b.position && a.normal == b.normal;
}

bool same(std::span<const Contact> a, std::span<const Contact> b) {
  return std::ranges::equal(a, b, [](const Contact& x, const Contact& y) { return x == y; });
}

double degreesBetween(const Vector3& a, const Vector3& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180 / std::numbers::pi;
}

/// Evaluates every sample, one at a time, as a reference for queries that skip samples.
std::vector<Contact> unculled(const BodyPair& pair, double margin) {
  const Eigen::Isometry3d fieldFromSamples = pair.worldFromField.inverse() * pair.worldFromSamples;
  std::vector<Contact> result;
  for (std::uint32_t i = 0; i < pair.samples->size(); ++i) {
    const Vector3& x = pair.samples->points()[i];
    const auto [value, gradient] = pair.field->field().valueAndGradient(fieldFromSamples * x);
    if (!(value <= margin)) continue;
    const double length = gradient.norm();
    result.push_back({i, -value, pair.worldFromSamples * x, pair.worldFromField.linear() * (gradient / length)});
  }
  return result;
}

Field fieldOf(const std::string& shape, double targetError = 1e-5, bool bounds = false) {
  const TriangleMesh mesh = shapes::mesh(shape);
  return build(ExactDistance(mesh), domainAround(mesh), {.targetError = targetError, .bounds = bounds});
}

Field exactFieldOf(const TriangleMesh& mesh, Strategy strategy = Strategy::hpx) {
  return build(ExactDistance(mesh), domainAround(mesh), {.strategy = strategy});
}

struct Compared {
  std::size_t poses = 0, touching = 0;  ///< `touching`: poses with contacts
  QueryCost cost;
  std::size_t samples = 0;
};

/// Compares queries with the reference for random poses of both bodies, also far from the world's origin.
Compared compare(const Field& field, const SurfaceSamples& samples, int poses, double reach, unsigned seed) {
  const FieldCollider collider(field);
  ContactQuery query;
  std::mt19937_64 random(seed);
  Compared compared;
  for (int i = 0; i < poses; ++i) {
    BodyPair pair{&samples, {}, &collider, randomPose(random, i % 2 == 0 ? 1 : 1000)};
    Eigen::Isometry3d between = randomPose(random, reach);
    between.translation() += field.domain().center();
    pair.worldFromSamples = pair.worldFromField * between;
    const double margin = i % 3 == 0 ? 0 : i % 3 == 1 ? 0.01 : 0.2;
    const auto found = query.find(pair, {.margin = margin});
    const auto expected = unculled(pair, margin);
    EXPECT_TRUE(same(found, expected)) << "pose " << i << ": " << found.size() << " for " << expected.size();
    ++compared.poses;
    compared.touching += !expected.empty();
    compared.cost += query.cost();
    compared.samples += samples.size();
  }
  return compared;
}

void expectWorth(const Compared& compared) {
  EXPECT_GT(compared.touching, compared.poses / 10);
  EXPECT_LT(compared.touching, compared.poses);
  EXPECT_LT(compared.cost.samples, compared.samples / 2) << "nothing was culled";
}

TEST(Contacts, equalThoseOfAllSamplesOnTheGear) {
  expectWorth(compare(fieldOf("gear"), sampleSurface(shapes::mesh("torus"), {.count = 1500}), 1000, 1.6, 1));
}

TEST(Contacts, equalThoseOfAllSamplesOnTheMarbleRun) {
  expectWorth(compare(fieldOf("marble-run", 1e-4), sampleSurface(shapes::mesh("gear"), {.count = 1500}), 1000, 3, 2));
}

TEST(Contacts, equalThoseOfAllSamplesWithBounds) {
  const Field field = fieldOf("torus", 1e-5, true);
  ASSERT_FALSE(field.data().bounds.empty());
  expectWorth(compare(field, sampleSurface(shapes::mesh("gear"), {.count = 1500}), 1000, 1.6, 3));
}

TEST(Contacts, equalThoseOfAllSamplesInBlendedFields) {
  expectWorth(compare(blended(fieldOf("gear", 1e-4), 0.2), sampleSurface(shapes::mesh("torus"), {.count = 1500}), 1000,
                      1.6, 4));
}

TEST(Contacts, equalThoseOfAllSamplesInTheCoarsestFields) {
  const SurfaceSamples samples = sampleSurface(shapes::mesh("torus,major=0.5,minor=0.2"), {.count = 1000});
  for (unsigned seed = 0; seed < 5; ++seed) {
    const Field field = randomField(seed, {.roughness = 1});
    compare(field, samples, 100, 1.6, seed);
    compare(blended(field, 0.25), samples, 100, 1.6, seed);
  }
}

TEST(Contacts, equalThoseOfAllSamplesInExactLeaves) {
  const SurfaceSamples samples = sampleSurface(shapes::mesh("torus"), {.count = 1500});
  for (const char* shape : {"gear", "box"}) {
    const Field field = exactFieldOf(shapes::mesh(shape));
    ASSERT_GT(statistics(field).degreeLeaves[kExactDegree], 10U);
    expectWorth(compare(field, samples, 500, 1.6, 10));
    expectWorth(compare(blended(field, 0.2), samples, 500, 1.6, 11));
  }
}

/// The errors of contacts' depths, by the exact distance, over the size of the field's body.
struct DepthErrors {
  std::size_t contacts = 0;
  double greatest = 0, squares = 0;

  void add(double error) {
    ++contacts;
    greatest = std::max(greatest, error);
    squares += error * error;
  }
  double meanSquare() const { return squares / double(contacts); }
};

struct ErrorsByDepth {
  DepthErrors shallow, all;  ///< up to the depth to which fields are exact by default, and up to ten times that depth
};

/// Lets copies of a body meet at random and measures the errors of the depths.
ErrorsByDepth depthErrors(const TriangleMesh& mesh, Strategy strategy) {
  const Field field = exactFieldOf(mesh, strategy);
  const FieldCollider collider(field);
  const ExactDistance exact(mesh);
  const Vector3 center = boundingBox(mesh).center();
  const double size = boundingBox(mesh).sizes().maxCoeff(), shallow = BuildOptions{}.exactWithin * size;
  const SurfaceSamples samples = sampleSurface(mesh, {.count = 2000});
  std::mt19937_64 random(12);
  ContactQuery query;
  ErrorsByDepth errors;
  for (int i = 0; i < 200; ++i) {
    Eigen::Isometry3d pose = randomPose(random, 0.8 * size);
    pose.translation() += center - pose.linear() * center;
    for (const Contact& contact : query.find({&samples, pose, &collider, Eigen::Isometry3d::Identity()})) {
      const double depth = -exact(contact.position), error = std::abs(contact.depth - depth) / size;
      if (depth <= 10 * shallow) errors.all.add(error);
      if (std::abs(depth) <= shallow) errors.shallow.add(error);
    }
  }
  return errors;
}

void expectBetterDepths(const TriangleMesh& mesh) {
  const ErrorsByDepth plain = depthErrors(mesh, Strategy::hp), exact = depthErrors(mesh, Strategy::hpx);
  EXPECT_GT(exact.shallow.contacts, 300U);
  EXPECT_LT(exact.shallow.greatest, 1e-7) << "no more than the rounding of vertices to float";
  EXPECT_LE(exact.shallow.greatest, 1e-3 * plain.shallow.greatest);
  EXPECT_LE(exact.all.meanSquare(), plain.all.meanSquare());
}

TEST(Contacts, haveBetterDepthsByExactLeaves) {
  for (const char* shape : {"gear", "box"}) {
    SCOPED_TRACE(shape);
    expectBetterDepths(shapes::mesh(shape));
  }
}

TEST(Contacts, ofMachinePartsHaveBetterDepthsByExactLeaves) {
  HPSDF_SKIP_WITHOUT_MESHES();
  for (const char* part : {"cad/fandisk.obj", "cad/rocker-arm.obj"}) {
    SCOPED_TRACE(part);
    expectBetterDepths(loadMesh(support::testMesh(part)));
  }
}

TEST(Contacts, ofSpheresHaveTheirDepthsAndNormals) {
  constexpr double kRadius = 0.6;
  const DistanceFunction sphere = shapes::analytic("sphere,radius=0.6");
  const Field field = build(sphere, domainAround(sphere.source().box), {.targetError = 3e-10});
  const FieldCollider collider(field);
  const SurfaceSamples samples = sampleSurface(shapes::mesh("sphere,radius=0.4"), {.count = 2000});
  std::mt19937_64 random(5);
  ContactQuery query;
  std::size_t contacts = 0;
  for (int i = 0; i < 100; ++i) {
    BodyPair pair{&samples, {}, &collider, randomPose(random, 3)};
    pair.worldFromSamples = pair.worldFromField * randomPose(random, 0.7);
    const Vector3 center = pair.worldFromField.translation();
    for (const Contact& contact : query.find(pair)) {
      const Vector3 out = contact.position - center;
      ASSERT_NEAR(contact.depth, kRadius - out.norm(), 1e-3 * 2 * kRadius);
      ASSERT_EQ(contact.position, pair.worldFromSamples * samples.points()[contact.sample]);
      ASSERT_NEAR(contact.normal.norm(), 1, 1e-12);
      if (out.norm() < kRadius / 3) continue;  // near the center the normal is undefined
      ASSERT_LT(degreesBetween(contact.normal, out), 0.5);
      ++contacts;
    }
  }
  EXPECT_GT(contacts, 5000u);
}

TEST(Contacts, ofABoxHaveItsDepthsAndNormals) {
  const Vector3 half(0.5, 0.35, 0.25);
  const auto box = [&](const Vector3& x) { return shapes::boxDistance(x, half); };
  const Field field = build(box, Box(-1.2 * half, 1.2 * half), {.targetError = 1e-9});
  const FieldCollider collider(field);
  const SurfaceSamples samples = sampleSurface(shapes::mesh("sphere,radius=0.3"), {.count = 2000});
  std::mt19937_64 random(6);
  ContactQuery query;
  std::size_t contacts = 0;
  for (int i = 0; i < 100; ++i) {
    BodyPair pair{&samples, {}, &collider, randomPose(random, 3)};
    pair.worldFromSamples = pair.worldFromField * randomPose(random, 0.6);
    for (const Contact& contact : query.find(pair)) {
      const Vector3 x = pair.worldFromField.inverse() * contact.position;
      ASSERT_NEAR(contact.depth, -box(x), 1e-3 * 2 * half.maxCoeff());
      Vector3 below = half - x.cwiseAbs();
      Eigen::Index axis;
      const double least = below.minCoeff(&axis);
      below[axis] = std::numeric_limits<double>::infinity();
      if (below.minCoeff() < least + 0.05) continue;  // near an edge of the box, two normals are possible
      const Vector3 out = std::copysign(1.0, x[axis]) * Vector3::Unit(axis);
      ASSERT_LT(degreesBetween(contact.normal, pair.worldFromField.linear() * out), 0.5) << x.transpose();
      ++contacts;
    }
  }
  EXPECT_GT(contacts, 2000u);
}

TEST(Contacts, outsideTheDomainAreFoundByTheMargin) {
  const Field field = fieldOf("sphere,radius=0.5", 1e-6);
  const FieldCollider collider(field);
  const SurfaceSamples samples = sampleSurface(shapes::mesh("sphere,radius=0.1"), {.count = 300});
  BodyPair pair{&samples, Eigen::Isometry3d::Identity(), &collider, Eigen::Isometry3d::Identity()};
  pair.worldFromSamples.translation() = Vector3(2, 0, 0);
  ContactQuery query;
  EXPECT_TRUE(query.find(pair, {.margin = 1.39}).empty());
  const auto found = query.find(pair, {.margin = 1.5});
  EXPECT_TRUE(same(found, unculled(pair, 1.5)));
  ASSERT_FALSE(found.empty());
  EXPECT_NEAR(found[0].depth, -1.45, 0.06);
  EXPECT_LT(degreesBetween(found[0].normal, Vector3::UnitX()), 5);
}

/// Returns a field with one leaf and a constant value.
Field constantField(double value) {
  FieldData data;
  data.domain = Box(Vector3(-1, -1, -1), Vector3(1, 1, 1));
  data.nodes = {node::leaf(0, 0)};
  data.coefficients = std::vector<double>{value};
  return Field(std::move(data));
}

TEST(Contacts, withoutAGradientOpposeTheSamplesNormal) {
  const Field field = constantField(-0.25);
  const FieldCollider collider(field);
  const SurfaceSamples samples(std::vector<Vector3>{{0.1, 0.2, 0.3}}, std::vector<Vector3>{Vector3::UnitX()});
  std::mt19937_64 random(7);
  const BodyPair pair{&samples, randomPose(random, 0.1), &collider, randomPose(random, 0.1)};
  ContactQuery query;
  const auto found = query.find(pair);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].depth, 0.25);
  EXPECT_EQ(found[0].normal, pair.worldFromSamples.linear() * -Vector3::UnitX());
}

TEST(Contacts, canBeLimitedToTheDeepest) {
  const Field field = fieldOf("torus");
  const FieldCollider collider(field);
  const SurfaceSamples samples = sampleSurface(shapes::mesh("gear"), {.count = 2000});
  std::mt19937_64 random(8);
  ContactQuery query, deepest;
  for (int i = 0; i < 50; ++i) {
    const BodyPair pair{&samples, randomPose(random, 0.5), &collider, randomPose(random, 0.5)};
    const auto found = query.find(pair);
    std::vector<Contact> all(found.begin(), found.end());
    std::ranges::stable_sort(all, std::greater(), &Contact::depth);
    for (const std::size_t count : {1, 4, 100, 5000}) {
      const std::span<const Contact> expected(all.data(), std::min(all.size(), count));
      ASSERT_TRUE(same(deepest.find(pair, {.deepest = count}), expected));
    }
  }
}

TEST(Contacts, ofEqualDepthAreOrderedByIndex) {
  const Field field = constantField(-0.25);
  const FieldCollider collider(field);
  const SurfaceSamples samples = sampleSurface(shapes::mesh("sphere,radius=0.5"), {.count = 300});
  const BodyPair pair{&samples, Eigen::Isometry3d::Identity(), &collider, Eigen::Isometry3d::Identity()};
  ContactQuery query;
  const auto found = query.find(pair, {.deepest = 20});
  ASSERT_EQ(found.size(), 20u);
  for (std::uint32_t i = 0; i < 20; ++i) EXPECT_EQ(found[i].sample, i);
}

class ContactsOfPairs : public testing::Test {
 protected:
  ContactsOfPairs() {
    std::mt19937_64 random(9);
    for (int i = 0; i < 200; ++i)
      pairs_.push_back({&samples_, randomPose(random, 0.8), i % 2 == 0 ? &torus_ : &gear_, randomPose(random, 0.8)});
  }

  const Field torusField_ = fieldOf("torus"), gearField_ = blended(fieldOf("gear", 1e-4));
  const FieldCollider torus_{torusField_}, gear_{gearField_};
  const SurfaceSamples samples_ = sampleSurface(shapes::mesh("torus"), {.count = 1000});
  std::vector<BodyPair> pairs_;
};

TEST_F(ContactsOfPairs, areThoseOfEachPairInOrder) {
  PairContacts contacts;
  ContactQuery query;
  for (const std::size_t count : {200, 17, 0, 64}) {  // memory is reused for fewer pairs
    const std::span<const BodyPair> pairs = std::span(pairs_).first(count);
    for (const ContactOptions& options : {ContactOptions{}, {.margin = 0.05}, {.margin = 0.05, .deepest = 3}}) {
      findContacts(pairs, options, contacts);
      ASSERT_EQ(contacts.pairs(), count);
      QueryCost cost;
      std::size_t all = 0;
      for (std::size_t i = 0; i < count; ++i) {
        ASSERT_TRUE(same(contacts.of(i), query.find(pairs[i], options))) << i;
        cost += query.cost();
        all += contacts.of(i).size();
      }
      EXPECT_EQ(contacts.all().size(), all);
      EXPECT_EQ(contacts.cost().spheres, cost.spheres);
      EXPECT_EQ(contacts.cost().samples, cost.samples);
      EXPECT_EQ(contacts.cost().evaluations, cost.evaluations);
    }
  }
}

TEST_F(ContactsOfPairs, areTheSameForAnyNumberOfThreads) {
  const tbb::global_control allow(tbb::global_control::max_allowed_parallelism, 8);
  PairContacts one;
  tbb::task_arena(1).execute([&] { findContacts(pairs_, {.margin = 0.02}, one); });
  ASSERT_GT(one.all().size(), 1000u);
  for (const int threads : {2, 3, 8}) {
    PairContacts many;
    tbb::task_arena(threads).execute([&] { findContacts(pairs_, {.margin = 0.02}, many); });
    ASSERT_TRUE(same(many.all(), one.all()));
    for (std::size_t i = 0; i < pairs_.size(); ++i) ASSERT_EQ(many.of(i).size(), one.of(i).size());
  }
}

TEST_F(ContactsOfPairs, refuseTheFirstFaultyPair) {
  const auto refusal = [&](const ContactOptions& options = {}) -> std::string {
    PairContacts contacts;
    try {
      findContacts(pairs_, options, contacts);
    } catch (const Error& error) {
      return error.what();
    }
    return {};
  };
  EXPECT_EQ(refusal(), "");
  EXPECT_THAT(refusal({.margin = -1}), testing::HasSubstr("margin"));
  EXPECT_THAT(refusal({.margin = std::nan("")}), testing::HasSubstr("margin"));
  EXPECT_THAT(refusal({.deepest = 0}), testing::HasSubstr("1 or more"));
  pairs_[120].samples = nullptr;
  EXPECT_EQ(refusal(), "pair 120: samples or field are missing");
  pairs_[77].worldFromField.translation().x() = std::nan("");
  EXPECT_EQ(refusal(), "pair 77: the field's transform is not finite");
  pairs_[33].worldFromSamples.linear() *= 1.001;
  EXPECT_EQ(refusal(), "pair 33: the samples' transform is not rigid: give a rotation and a shift");
}

TEST_F(ContactsOfPairs, refuseTransformsThatAreNotRigid) {
  ContactQuery query;
  const auto refused = [&](auto&& change) {
    for (const bool ofField : {false, true}) {
      BodyPair pair = pairs_[0];
      change(ofField ? pair.worldFromField : pair.worldFromSamples);
      try {
        query.find(pair);
        return false;
      } catch (const Error& error) {
        if (std::string(error.what()).find(ofField ? "the field's transform" : "the samples' transform") != 0)
          return false;
      }
    }
    return true;
  };
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(refused([&](Eigen::Isometry3d& t) { t.translation().z() = infinity; }));
  EXPECT_TRUE(refused([&](Eigen::Isometry3d& t) { t.linear()(1, 2) = std::nan(""); }));
  EXPECT_TRUE(refused([&](Eigen::Isometry3d& t) { t.linear().col(1) *= 1.01; }));
  EXPECT_TRUE(refused([&](Eigen::Isometry3d& t) { t.linear().col(0) *= -1; })) << "a mirror";
  EXPECT_TRUE(refused([&](Eigen::Isometry3d& t) { t.linear().setZero(); }));
  EXPECT_TRUE(refused([&](Eigen::Isometry3d& t) { t.linear()(0, 1) += 1e-3; })) << "a shear";
  EXPECT_FALSE(refused([](Eigen::Isometry3d& t) { t.linear() *= 1 + 1e-9; })) << "a long simulation's rounding";
}

}  // namespace contacts_test
}  // namespace hpsdf::physics
