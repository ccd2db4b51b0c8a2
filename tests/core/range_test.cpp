// Certified ranges: they contain every value, they are not much wider than the values, and bad boxes are refused.
#include "hpsdf/range.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <string>
#include <variant>
#include <vector>

#include "../support/made_meshes.h"
#include "../support/one_leaf_field.h"
#include "../support/random_field.h"
#include "field/query/quantized.h"
#include "hpsdf/build.h"
#include "hpsdf/continuity.h"
#include "hpsdf/error.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/safe_distance.h"
#include "hpsdf/shapes.h"

namespace hpsdf {
namespace range_test {

double torus(const Vector3& x) { return std::hypot(std::hypot(x.x(), x.y()) - 0.7, x.z()) - 0.3; }
Box cube() { return Box(Vector3::Constant(-1.1), Vector3::Constant(1.1)); }

class RandomBoxes {
 public:
  explicit RandomBoxes(unsigned seed) : random_(seed) {}

  Vector3 pointIn(const Box& box) {
    const Vector3 share(unit_(random_), unit_(random_), unit_(random_));
    return (box.min() + share.cwiseProduct(box.sizes())).cwiseMin(box.max());
  }

  /// Returns a box whose edges are up to `size` of the domain's. Some boxes reach beyond the domain.
  Box within(const Box& domain, double size) {
    const Vector3 centre = domain.center() + 1.2 * (pointIn(domain) - domain.center());
    const Vector3 half = size / 2 * (pointIn(domain) - domain.min());
    return Box(centre - half, centre + half);
  }

  /// Returns random points of a box, its corners and points on its faces.
  std::vector<Vector3> pointsOf(const Box& box, std::size_t count) {
    std::vector<Vector3> points(count);
    for (std::size_t i = 0; i < count; ++i) {
      points[i] = pointIn(box);
      for (int axis = 0; axis < 3; ++axis) {
        if ((i >> (2 * axis) & 3) == 1) points[i][axis] = box.min()[axis];
        if ((i >> (2 * axis) & 3) == 2) points[i][axis] = box.max()[axis];
      }
    }
    return points;
  }

 private:
  std::mt19937_64 random_;
  std::uniform_real_distribution<double> unit_{0, 1};
};

using Ranges = std::function<Interval(const Box&)>;

/// Returns the number of points of random boxes at which `f` is outside of the boxes' ranges. Boxes have all sizes: of
/// the whole domain as of a small part of a leaf.
int countOutside(const Box& domain, const Ranges& ranges, const std::function<double(const Vector3&)>& f) {
  RandomBoxes random(11);
  int outside = 0;
  for (const double size : {1.0, 0.25, 0.125, 0.03, 0.001, 1e-9})
    for (int n = 0; n < 60; ++n) {
      const Box box = random.within(domain, size);
      const Interval range = ranges(box);
      for (const Vector3& x : random.pointsOf(box, 128)) outside += static_cast<int>(!range.contains(f(x)));
    }
  return outside;
}

int countOutside(const Field& field) {
  const RangeIndex index(field);
  return countOutside(
      field.domain(), [&](const Box& box) { return index.range(box).value; },
      [&](const Vector3& x) { return field.value(x); });
}

FieldData dataOf(Field field) { return std::move(field).data(); }

Field quantizedField(const Field& field) {
  FieldData data = field.data();
  query::Quantized quantized = query::quantized(data, std::vector<double>(data.nodes.size(), 1e-5)).value();
  query::take(std::move(quantized), data);
  return Field(std::move(data));
}

TEST(Range, containsEveryValueOfPolynomials) {
  RandomFieldOptions options;
  for (const bool single : {false, true}) {
    options.single = single;
    EXPECT_EQ(countOutside(randomField(1, options)), 0);
    options.grid = {3, 1, 5};
    EXPECT_EQ(countOutside(randomField(2, options)), 0);
  }
  options = {.domain = Box(Vector3(1e6, -2e6, 3e5), Vector3(1e6 + 2, -2e6 + 1, 3e5 + 2)),
             .refinement = 0.1,
             .deepAt = Vector3(1e6 + 0.3, -2e6 + 0.2, 3e5 + 0.1)};
  options.maxDepth = 12;
  EXPECT_EQ(countOutside(randomField(3, options)), 0) << "far from the origin, with deep leaves";
  for (const int degree : {0, 1, 2, 7, 30}) EXPECT_EQ(countOutside(oneLeafField(4, degree)), 0) << degree;
}

/// Values may exceed the range of floats, in which bounds are stored.
TEST(Range, containsHugeValues) {
  for (const double scale : {1e20, 1e38, 1e60, 1e290}) {
    FieldData data = dataOf(oneLeafField(21, 3));
    for (double& c : std::get<FieldArray<double>>(data.coefficients).values()) c *= scale;
    EXPECT_EQ(countOutside(Field(std::move(data))), 0) << scale;
  }
}

TEST(Range, containsEveryValueOfQuantizedAndBuiltFields) {
  EXPECT_EQ(countOutside(quantizedField(randomField(5))), 0);
  EXPECT_EQ(countOutside(build(torus, cube(), {.targetError = 1e-6, .coefficients = CoefficientType::quantized})), 0);
  EXPECT_EQ(countOutside(build(torus, cube(), {.targetError = 1e-6, .coefficients = CoefficientType::float32})), 0);
}

/// Random leaves disagree by much more than those of a built field, so that a blended value lies far from the values of
/// the leaf that holds the point.
TEST(Range, containsEveryValueOfBlendedFields) {
  for (const double width : {0.04, 0.25}) {
    EXPECT_EQ(countOutside(blended(randomField(6), width)), 0);
    EXPECT_EQ(countOutside(blended(randomField(7, {.grid = {1, 3, 2}, .roughness = 1, .refinement = 0.6}), width)), 0);
    EXPECT_EQ(countOutside(quantizedField(blended(randomField(8), width))), 0);
  }
}

TriangleMesh overlappingBoxes() {
  return support::joined(support::boxOfTwo(), support::moved(support::boxOfTwo(), {0.7, 0.6, 0.5}));
}

/// Fields with exact leaves of all signs. A field that was blended after its construction asks exact leaves beyond
/// their boxes, where their lists lack triangles.
TEST(Range, containsEveryValueOfExactLeaves) {
  struct Part {
    TriangleMesh mesh;
    DistanceOptions distance = {};
  };
  const std::vector<Part> parts = {
      {shapes::mesh("gear,teeth=3")},
      {overlappingBoxes()},
      {support::moved(overlappingBoxes(), {1e6, -3e5, 2e4})},
      {support::openBox(), {.insideTest = InsideTest::shell, .thickness = 0.1}},
  };
  for (const Part& part : parts) {
    const ExactDistance exact(part.mesh, part.distance);
    BuildOptions options{.targetError = 1e-5, .strategy = Strategy::hpx, .exactWithin = 0.05};
    const Field field = build(exact, domainAround(part.mesh), options);
    EXPECT_EQ(countOutside(field), 0);
    for (const double width : {0.05, 0.25}) EXPECT_EQ(countOutside(blended(field, width)), 0);
    options.blend = 0.25;
    EXPECT_EQ(countOutside(build(exact, domainAround(part.mesh), options)), 0);
  }
}

/// The test above would see intervals that are a little too narrow.
/// A leaf lists triangles for each of its octants. A small leaf is a single part, so that the boxes in it must ask the
/// octant that they lie in.
TEST(Range, ofSmallBoxesInSmallExactLeavesContainsTheirValues) {
  const ExactDistance gear(shapes::mesh("gear,teeth=3"));
  const Field field = build(gear, domainAround(gear.source().box),
                            {.targetError = 1e-5, .grid = {33, 33, 33}, .strategy = Strategy::hpx});
  const RangeIndex index(field);
  RandomBoxes random(12);
  int leaves = 0, outside = 0;
  field.forEachCell([&](const Cell& cell) {
    if (cell.degree != kExactDegree || ++leaves % 8 != 0) return;
    for (const double size : {0.3, 0.03}) {
      const Box box = random.within(cell.box, size);
      const Interval range = index.range(box).value;
      for (const Vector3& x : random.pointsOf(box, 16)) outside += static_cast<int>(!range.contains(field.value(x)));
    }
  });
  EXPECT_GT(leaves, 2000);
  EXPECT_EQ(outside, 0);
}

TEST(Range, aRangeThatIsTooNarrowIsFound) {
  const Field field = build(torus, cube(), {.targetError = 1e-6});
  const RangeIndex index(field);
  const auto narrow = [&](const Box& box) {
    const Interval range = index.range(box).value;
    return Interval{range.min + 0.25 * range.width(), range.max};
  };
  EXPECT_GT(countOutside(field.domain(), narrow, [&](const Vector3& x) { return field.value(x); }), 1000);
}

TEST(Range, containsTheExactDistanceIfThereAreBounds) {
  EXPECT_FALSE(RangeIndex(build(torus, cube(), {.targetError = 1e-5})).range(cube()).distance);
  for (const double blend : {0.0, 0.2}) {
    const Field field = build(torus, cube(), {.targetError = 1e-5, .blend = blend, .bounds = true});
    const RangeIndex index(field);
    const auto ranges = [&](const Box& box) { return *index.range(box).distance; };
    EXPECT_EQ(countOutside(cube(), ranges, torus), 0);
    RandomBoxes random(12);
    int apart = 0;  // boxes that are certainly apart from the surface
    for (int n = 0; n < 200; ++n) {
      const Interval range = ranges(random.within(cube(), 0.1));
      apart += static_cast<int>(range.min > 0 || range.max < 0);
    }
    EXPECT_GT(apart, 60);
  }
}

TEST(Range, boundsOfAllLeavesThatABlendedValueComesFromCount) {
  FieldData data = dataOf(blended(randomField(13, {.roughness = 1}), 0.25));
  std::mt19937 random(14);
  std::uniform_real_distribution<float> error(0, 0.5F);
  data.bounds.resize(data.nodes.size());
  for (CellBound& bound : data.bounds) bound.error = error(random);
  const Field field(std::move(data));
  const RangeIndex index(field);
  const auto ranges = [&](const Box& box) { return *index.range(box).distance; };
  // The exact distance may be as far from the field as the bound says, on either side.
  for (const double side : {-1.0, 1.0})
    EXPECT_EQ(countOutside(field.domain(), ranges,
                           [&](const Vector3& x) {
                             const double beyond = field.domain().exteriorDistance(x);
                             return field.value(x) + side * double(boundAt(field, x)->error) - (side < 0) * beyond;
                           }),
              0);
}

/// Returns the median, over random boxes, of the width of the range over the width of the values at 20³ points.
double medianWidth(const Field& field, double share) {
  const RangeIndex index(field);
  RandomBoxes random(15);
  const Vector3 edges = share * field.domain().sizes();
  std::vector<double> ratios;
  for (int n = 0; n < 60; ++n) {
    const Vector3 lower = random.pointIn(Box(field.domain().min(), field.domain().max() - edges));
    std::vector<Vector3> points;
    for (int i = 0; i < 8000; ++i) points.emplace_back(Vector3(i % 20, i / 20 % 20, i / 400) / 19.0);
    for (Vector3& x : points) x = lower + x.cwiseProduct(edges);
    std::vector<double> values(points.size());
    field.values(points, values);
    const auto [least, greatest] = std::ranges::minmax(values);
    ratios.push_back(index.range(Box(lower, lower + edges)).value.width() / (greatest - least));
  }
  std::ranges::nth_element(ratios, ratios.begin() + 30);
  return ratios[30];
}

/// Counts the points of random boxes whose values lie neither in the range made for known values nor among these.
int countOutsideOfKnown(const Field& field, const Interval& known) {
  const RangeIndex index(field);
  return countOutside(
      field.domain(),
      [&](const Box& box) {
        const Interval range = index.range(box, known).value;
        return Interval{std::min(range.min, known.min), std::max(range.max, known.max)};
      },
      [&](const Vector3& x) { return field.value(x); });
}

TEST(Range, besideKnownValuesContainsAllOthers) {
  const double endless = std::numeric_limits<double>::infinity();
  for (const Interval known : {Interval{0.01, endless}, Interval{-endless, 0.2}, Interval{-0.1, 0.1}}) {
    EXPECT_EQ(countOutsideOfKnown(randomField(31), known), 0);
    EXPECT_EQ(countOutsideOfKnown(blended(randomField(32), 0.1), known), 0);
    EXPECT_EQ(countOutsideOfKnown(build(torus, cube(), {.targetError = 1e-6}), known), 0);
  }
}

/// An index for relevant values must contain all values of boxes too, and must be tight where it matters.
TEST(Range, ofAnIndexForRelevantValuesContainsAllValues) {
  const Interval relevant{-0.05, 0.05};
  const ExactDistance box(shapes::mesh("box"));
  for (const Field& field : {build(torus, cube(), {.targetError = 1e-6}), blended(randomField(33), 0.1),
                             build(box, cube(), {.targetError = 1e-5, .strategy = Strategy::hpx})}) {
    const RangeIndex all(field), index(field, 0, relevant);
    EXPECT_LE(index.bytes(), all.bytes());
    EXPECT_EQ(countOutside(
                  field.domain(), [&](const Box& part) { return index.range(part).value; },
                  [&](const Vector3& x) { return field.value(x); }),
              0);
    RandomBoxes random(19);
    for (int n = 0; n < 2000; ++n) {
      const Box part = random.within(field.domain(), 0.1);
      const Interval tight = all.range(part).value, found = index.range(part).value;
      if (tight.max < relevant.min || tight.min > relevant.max) continue;
      EXPECT_LE(std::max(found.min, relevant.min), std::max(tight.min, relevant.min) + 0.1);
    }
  }
}

/// A range made for known values must not reach beyond them where the tight one does not.
TEST(Range, besideKnownValuesTellsWhetherThereAreOthers) {
  const Field field = build(torus, cube(), {.targetError = 1e-6});
  const RangeIndex index(field);
  RandomBoxes random(17);
  int within = 0, told = 0;
  for (int n = 0; n < 2000; ++n) {
    const Box box = random.within(Box(cube().min() / 2, cube().max() / 2), 0.1);
    if (index.range(box).value.min < 0) continue;
    ++within;
    told += static_cast<int>(index.range(box, Interval{0, std::numeric_limits<double>::infinity()}).value.min >= 0);
  }
  EXPECT_GT(within, 1000);
  EXPECT_EQ(told, within);
}

TEST(Range, isNotMuchWiderThanTheValues) {
  const Field smooth = build(torus, cube(), {.targetError = 1e-6});
  for (const double share : {0.5, 0.125, 0.01}) EXPECT_LT(medianWidth(smooth, share), 1.35) << share;
  EXPECT_LT(medianWidth(blended(smooth), 0.125), 1.35);
  const ExactDistance gear(shapes::mesh("gear"));
  const Field exact = build(gear, domainAround(gear.source().box), {.targetError = 1e-5, .strategy = Strategy::hpx});
  for (const double share : {0.5, 0.125}) EXPECT_LT(medianWidth(exact, share), 1.5) << share;
  EXPECT_LT(medianWidth(randomField(16, {.roughness = 0.05}), 0.25), 1.4);
}

TEST(Range, ofAPointIsItsValueUpToRounding) {
  const ExactDistance gear(shapes::mesh("gear"));
  const Field polynomial = build(torus, cube(), {.targetError = 1e-6}),
              exact = build(gear, domainAround(gear.source().box), {.targetError = 1e-5, .strategy = Strategy::hpx});
  for (const Field* field : {&polynomial, &exact}) {
    const RangeIndex index(*field);
    RandomBoxes random(17);
    for (int n = 0; n < 2000; ++n) {
      const Vector3 x = random.pointIn(field->domain());
      const Interval range = index.range(Box(x, x)).value;
      ASSERT_TRUE(range.contains(field->value(x)));
      ASSERT_LT(range.width(), 1e-10);
    }
  }
}

/// At a point between leaves, the range contains the limits from all of them.
TEST(Range, ofAFaceContainsBothSides) {
  const FieldData data{.domain = Box(Vector3::Zero(), Vector3(2, 1, 1)),
                       .grid = {2, 1, 1},
                       .nodes = {node::leaf(0, 0), node::leaf(0, 1)},
                       .coefficients = std::vector<double>{-1, 3},
                       .metadata = {}};
  const Field field(data);
  const RangeIndex index(field);
  const auto range = [&](const Vector3& from, const Vector3& to) { return index.range(Box(from, to)).value; };
  EXPECT_TRUE(range({1, 0, 0}, {1, 1, 1}).contains(3));
  EXPECT_NEAR(range({0, 0, 0}, {0.9, 1, 1}).max, -1, 1e-5);
  EXPECT_NEAR(range({1.1, 0.5, 0.5}, {1.1, 0.5, 0.6}).min, 3, 1e-5);
  EXPECT_NEAR(range({0, 0, 0}, {2, 1, 1}).min, -1, 1e-5);
  EXPECT_NEAR(range({0, 0, 0}, {2, 1, 1}).max, 3, 1e-5);
}

TEST(Range, ofTheDomainIsThatOfItsValues) {
  const Field field = build(torus, cube(), {.targetError = 1e-7});
  const Interval range = RangeIndex(field).range(cube()).value;
  EXPECT_NEAR(range.min, -0.3, 0.05);
  EXPECT_NEAR(range.max, torus({1.1, 1.1, 1.1}), 0.05);
}

/// Outside of the domain the field is f(q) + |x − q|.
TEST(Range, containsTheContinuationOutsideTheDomain) {
  const Field field = build(torus, cube(), {.targetError = 1e-6});
  const RangeIndex index(field);
  const Interval far = index.range(Box(Vector3(5, 0, 0), Vector3(5, 0, 0))).value;
  EXPECT_TRUE(far.contains(field.value({5, 0, 0})));
  EXPECT_LT(far.width(), 1e-10);
  const Interval around = index.range(Box(Vector3::Constant(-4), Vector3::Constant(4))).value;
  EXPECT_TRUE(around.contains(-0.29) && around.contains(field.value({4, 4, 4})));
  const double largest = std::numeric_limits<double>::max();
  EXPECT_TRUE(index.range(Box(Vector3::Constant(-largest), Vector3::Constant(largest)))
                  .value.contains(field.value({largest, 0, 0})));
}

TEST(Range, badBoxesAreRefused) {
  const Field field = oneLeafField(18, 2);
  const RangeIndex index(field);
  const auto refusal = [&](const Box& box) -> std::string {
    try {
      index.range(box);
    } catch (const Error& error) {
      return error.what();
    }
    return {};
  };
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInfinity = std::numeric_limits<double>::infinity();
  EXPECT_THAT(refusal(Box(Vector3(0, 1, 0), Vector3(1, 0, 1))), testing::HasSubstr("from 0,1,0 to 1,0,1 is empty"));
  EXPECT_THAT(refusal(Box()), testing::HasSubstr("is empty"));
  for (const double bad : {kNan, kInfinity, -kInfinity}) {
    EXPECT_THAT(refusal(Box(Vector3(0, bad, 0), Vector3(1, 1, 1))), testing::HasSubstr("is not finite"));
    EXPECT_THAT(refusal(Box(Vector3(0, 0, 0), Vector3(1, 1, bad))), testing::HasSubstr("is not finite"));
  }
}

TEST(Range, isTheSameForAnyNumberOfThreads) {
  const Field field = blended(randomField(19));
  const RangeIndex one(field, 1), all(field);
  RandomBoxes random(20);
  for (int n = 0; n < 200; ++n) {
    const Box box = random.within(field.domain(), 0.3);
    const Interval a = one.range(box).value, b = all.range(box).value;
    ASSERT_TRUE(a.min == b.min && a.max == b.max);
  }
  EXPECT_EQ(one.bytes(), all.bytes());
}

TEST(Range, takesAboutAsManyBytesAsTheField) {
  const Field field = build(torus, cube(), {.targetError = 1e-9});
  EXPECT_LT(double(RangeIndex(field).bytes()), 1.5 * double(field.bytes()) + 2e6);
}

}  // namespace range_test
}  // namespace hpsdf
