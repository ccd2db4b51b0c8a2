// Contacts of one pair of bodies and of a pile, on one thread; bodies have 10,000 samples, as in sec. 4 of the paper.

#include <tbb/task_arena.h>

#include <Eigen/Geometry>
#include <random>
#include <vector>

#include "contact_places.h"
#include "hpsdf/physics/contacts.h"

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
  static const SurfaceSamples samples = physics::sampleSurface(armadillo(), {.count = 10'000});
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

/// Returns all ordered pairs with overlapping bounding spheres among 800 bodies in a randomly disturbed lattice.
std::vector<BodyPair> pile() {
  constexpr int kBodies = 800;
  constexpr double kPitch = 2.05;  // gives about 50 contacts per body, five times as many as in the paper
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

BodyPair bunnyInArmadillo(const Places& where) {
  return {&bunnySamples(), where.bunny, &armadilloCollider(), where.armadillo};
}

BodyPair armadilloInBunny(const Places& where) {
  return {&armadilloSamples(), where.armadillo, &bunnyCollider(), where.bunny};
}

std::vector<Places> findPlaces(Nearness nearness) {
  std::mt19937_64 random(2016);
  physics::ContactQuery query;
  const auto contacts = [&](const Places& where, double margin) {
    const std::size_t bunnys = query.find(bunnyInArmadillo(where), {.margin = margin}).size();
    return bunnys + query.find(armadilloInBunny(where), {.margin = margin}).size();
  };
  std::vector<Places> found;
  while (found.size() < kPlaces) {
    const Places where{randomPose(random, 1), randomPose(random, 1)};
    const std::size_t touching = contacts(where, 0);
    if (nearness == Nearness::touching ? touching > 0 && touching < 100
                                       : contacts(where, 0.03) == 0 && contacts(where, 0.1) > 0)
      found.push_back(where);
  }
  return found;
}

void collider(benchmark::State& state) {
  const Field& field = bunnyField();
  timeEach(state, 1, [&] { benchmark::DoNotOptimize(FieldCollider(field)); });
}

/// Times a query on random poses that have 1 to 99 contacts.
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

void report(const physics::QueryCost& cost, std::size_t of, benchmark::State& state) {
  state.counters["spheres"] = double(cost.spheres) / double(of);
  state.counters["samples"] = double(cost.samples) / double(of);
  state.counters["evaluations"] = double(cost.evaluations) / double(of);
}

/// Queries the samples of each body in the field of the other one, as for two bodies in Bullet.
void bothWays(benchmark::State& state, Nearness nearness) {
  physics::ContactQuery query;
  timeContacts(state, nearness, [&](const Places& where) {
    Touch touch;
    for (const BodyPair& pair : {bunnyInArmadillo(where), armadilloInBunny(where)})
      for (const physics::Contact& contact : query.find(pair)) {
        ++touch.contacts;
        touch.deepest = std::max(touch.deepest, contact.depth);
      }
    return touch;
  });
  physics::QueryCost cost;
  for (const Places& where : places(nearness))
    for (const BodyPair& pair : {bunnyInArmadillo(where), armadilloInBunny(where)}) {
      query.find(pair);
      cost += query.cost();
    }
  report(cost, places(nearness).size(), state);
}

void pileStep(benchmark::State& state) {
  const std::vector<BodyPair> pairs = pile();
  physics::PairContacts contacts;
  tbb::task_arena arena(1);
  timeEach(state, 1, [&] { arena.execute([&] { physics::findContacts(pairs, {}, contacts); }); });
  state.counters["pairs"] = double(pairs.size());
  state.counters["contacts"] = double(contacts.all().size());
  report(contacts.cost(), 1, state);
}

void bunnySampling(benchmark::State& state) {
  const TriangleMesh& mesh = bunny();
  timeEach(state, 1, [&] { benchmark::DoNotOptimize(physics::sampleSurface(mesh, {.count = 10'000})); });
}

BENCHMARK(bunnySampling)->Name("contacts/bunny/samples")->Unit(benchmark::kMillisecond);
BENCHMARK(collider)->Name("contacts/bunny/collider")->Unit(benchmark::kMillisecond);
BENCHMARK(query)->Name("contacts/bunny/query")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(bothWays, touching, Nearness::touching)->Name("contacts/touching/ours");
BENCHMARK_CAPTURE(bothWays, apart, Nearness::apart)->Name("contacts/apart/ours");
BENCHMARK(pileStep)->Name("contacts/pile")->Unit(benchmark::kMillisecond);

}  // namespace

const TriangleMesh& armadillo() {
  static const TriangleMesh mesh = testMesh("paper/armadillo_100k.obj");
  return mesh;
}

const std::vector<Places>& places(Nearness nearness) {
  static const std::vector<Places> touching = findPlaces(Nearness::touching), apart = findPlaces(Nearness::apart);
  return nearness == Nearness::touching ? touching : apart;
}

}  // namespace hpsdf::bench
