// Contacts of one pair of bodies, and of a pile, by one thread: bodies of 10,000 samples, as in the paper's sec. 4.

#include <tbb/task_arena.h>

#include <Eigen/Geometry>
#include <random>
#include <vector>

#include "hpsdf/physics/contacts.h"
#include "scene.h"

namespace hpsdf::bench {
namespace {

using physics::BodyPair;
using physics::FieldCollider;
using physics::SurfaceSamples;

const SurfaceSamples& bunnySamples() {
  static const SurfaceSamples samples = physics::sampleSurface(bunny(), {.count = 10'000});
  return samples;
}

const FieldCollider& bunnyCollider() {
  static const FieldCollider collider(bunnyField());
  return collider;
}

const SurfaceSamples& armadilloSamples() {
  static const SurfaceSamples samples = physics::sampleSurface(testMesh("paper/armadillo_100k.obj"), {.count = 10'000});
  return samples;
}

const FieldCollider& armadilloCollider() {
  static const FieldCollider collider(armadilloField());
  return collider;
}

Eigen::Isometry3d randomPose(std::mt19937_64& random, double reach) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> shift(-reach, reach);
  const Eigen::Quaterniond rotation(normal(random), normal(random), normal(random), normal(random));
  Eigen::Isometry3d pose(rotation.normalized());
  for (double& x : pose.translation()) x = shift(random);
  return pose;
}

/// 800 bodies in a lattice of 10 x 10 x 8, turned and moved by chance: all pairs of which the spheres meet, both ways.
std::vector<BodyPair> pile() {
  constexpr int kBodies = 800;
  constexpr double kPitch = 2.05;  // some 50 contacts a body, five times as many as in the paper
  std::mt19937_64 random(2016);
  std::vector<BodyPair> bodies, pairs;
  for (int i = 0; i < kBodies; ++i) {
    Eigen::Isometry3d pose = randomPose(random, 0.1);
    pose.translation() += kPitch * Vector3(i % 10, i / 10 % 10, i / 100);
    bodies.push_back({i % 2 == 0 ? &bunnySamples() : &armadilloSamples(), pose,
                      i % 2 == 0 ? &bunnyCollider() : &armadilloCollider(), pose});
  }
  for (const BodyPair& a : bodies)
    for (const BodyPair& b : bodies) {
      const physics::Sphere &one = a.samples->spheres()[0], &other = b.samples->spheres()[0];
      const double apart = (a.worldFromSamples * one.center - b.worldFromSamples * other.center).norm();
      if (&a != &b && apart < one.radius + other.radius)
        pairs.push_back({a.samples, a.worldFromSamples, b.field, b.worldFromField});
    }
  return pairs;
}

void collider(benchmark::State& state) {
  const Field& field = bunnyField();
  timeEach(state, 1, [&] { benchmark::DoNotOptimize(FieldCollider(field)); });
}

/// On poses that touch.
void query(benchmark::State& state) {
  std::mt19937_64 random(2016);
  physics::ContactQuery query;
  std::vector<BodyPair> pairs;
  while (pairs.size() < 1000) {
    const BodyPair pair{&bunnySamples(), randomPose(random, 1), &bunnyCollider(), randomPose(random, 1)};
    const std::size_t contacts = query.find(pair).size();
    if (contacts > 0 && contacts < 100) pairs.push_back(pair);
  }
  timeEach(state, pairs.size(), [&] {
    for (const BodyPair& pair : pairs) benchmark::DoNotOptimize(query.find(pair).size());
  });
}

void pileStep(benchmark::State& state) {
  const std::vector<BodyPair> pairs = pile();
  physics::PairContacts contacts;
  tbb::task_arena arena(1);
  timeEach(state, 1, [&] { arena.execute([&] { physics::findContacts(pairs, {}, contacts); }); });
  state.counters["pairs"] = double(pairs.size());
  state.counters["contacts"] = double(contacts.all().size());
  state.counters["spheres"] = double(contacts.cost().spheres);
  state.counters["samples"] = double(contacts.cost().samples);
  state.counters["evaluations"] = double(contacts.cost().evaluations);
}

void bunnySampling(benchmark::State& state) {
  const TriangleMesh& mesh = bunny();
  timeEach(state, 1, [&] { benchmark::DoNotOptimize(physics::sampleSurface(mesh, {.count = 10'000})); });
}

BENCHMARK(bunnySampling)->Name("contacts/bunny/samples")->Unit(benchmark::kMillisecond);
BENCHMARK(collider)->Name("contacts/bunny/collider")->Unit(benchmark::kMillisecond);
BENCHMARK(query)->Name("contacts/bunny/query")->Unit(benchmark::kMillisecond);
BENCHMARK(pileStep)->Name("contacts/pile")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace hpsdf::bench
