// Tests that repeated contact queries allocate no memory after the first time.

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <random>
#include <vector>

#include "hpsdf/build.h"
#include "hpsdf/continuity.h"
#include "hpsdf/physics/contacts.h"
#include "hpsdf/shapes.h"
#include "poses.h"
#include "support/count_allocations.h"

namespace hpsdf::physics {
namespace allocations_test {

using support::allocationsOf;

class Allocations : public testing::Test {
 protected:
  Allocations() {
    std::mt19937_64 random(4);
    for (int i = 0; i < 100; ++i)
      pairs_.push_back({&samples_, randomPose(random, 0.8), i % 2 == 0 ? &plain_ : &smooth_, randomPose(random, 0.8)});
  }

  const DistanceFunction torus_ = shapes::analytic("torus");
  const Field field_ = build(torus_, domainAround(torus_.source().box), {.targetError = 1e-5});
  const Field blendedField_ = blended(field_);
  const FieldCollider plain_{field_}, smooth_{blendedField_};
  const SurfaceSamples samples_ = sampleSurface(shapes::mesh("torus"), {.count = 1000});
  std::vector<BodyPair> pairs_;
};

TEST_F(Allocations, ofAQueryAreMadeOnce) {
  ContactQuery query;
  std::size_t contacts = 0;
  const auto askAll = [&] {
    for (const BodyPair& pair : pairs_)
      contacts += query.find(pair).size() + query.find(pair, {.margin = 0.1, .deepest = 4}).size();
  };
  EXPECT_GT(allocationsOf(askAll), 0u);
  EXPECT_EQ(allocationsOf(askAll), 0u);
  EXPECT_GT(contacts, 1000u);
}

TEST_F(Allocations, ofManyPairsAreMadeOnce) {
  for (const int threads : {1, 2}) {
    tbb::task_arena arena(threads);
    PairContacts contacts;
    const auto ask = [&] { arena.execute([&] { findContacts(pairs_, {.margin = 0.1}, contacts); }); };
    EXPECT_GT(allocationsOf(ask), 0u);
    EXPECT_EQ(allocationsOf(ask), 0u) << threads << " threads";
    EXPECT_GT(contacts.all().size(), 1000u);
  }
}

}  // namespace allocations_test
}  // namespace hpsdf::physics
