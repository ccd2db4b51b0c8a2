#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <random>

#include "field/query/evaluate.h"
#include "hpsdf/build.h"
#include "hpsdf/continuity.h"
#include "hpsdf/detail/line.h"
#include "hpsdf/error.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/field_file.h"
#include "hpsdf/jumps.h"
#include "hpsdf/shapes.h"
#include "support/random_field.h"
#include "support/temporary_directory.h"

namespace hpsdf {
namespace blend_test {

std::vector<Cell> cellsOf(const Field& field) {
  std::vector<Cell> cells;
  field.forEachCell([&](const Cell& cell) { cells.push_back(cell); });
  return cells;
}

/// Returns a random field with non-cubic cells, in which leaves of different depths are neighbours.
Field irregular(unsigned seed) {
  return randomField(seed, {.domain = Box(Vector3(-1, -0.5, -2), Vector3(1, 1, 1)),
                            .grid = {2, 1, 3},
                            .refinement = 0.35,
                            .maxDepth = 4,
                            .deepAt = Vector3(0.2, 0.3, -0.4),
                            .maxDegree = 5});
}

/// Returns random points inside leaves and on or near their faces, edges and corners.
std::vector<Vector3> pointsNearFaces(const Field& field, std::size_t count, unsigned seed) {
  const std::vector<Cell> cells = cellsOf(field);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<Vector3> points;
  while (points.size() < count) {
    const Cell& cell = cells[random() % cells.size()];
    Vector3 x;
    for (int axis = 0; axis < 3; ++axis) {
      const double choice = unit(random), near = 0.3 * unit(random) * unit(random);
      const double part = choice < 0.4 ? unit(random) : choice < 0.6 ? near : choice < 0.8 ? 1 - near : choice < 0.9;
      x[axis] = std::lerp(cell.box.min()[axis], cell.box.max()[axis], part);
    }
    points.push_back(x);
  }
  return points;
}

/// Evaluates the definition of blending as a sum over all leaves of a field, slowly and simply.
class Definition {
 public:
  Definition(const Field& field, double width) : field_(field), width_(width), cells_(cellsOf(field)) {
    for (const Cell& cell : cells_) deltas_.push_back(deltasOf(cell));
  }

  ValueAndGradient at(const Vector3& x, std::size_t* leaves) const {
    double weights = 0, sum = 0;
    Vector3 weightsGradient = Vector3::Zero(), sumGradient = Vector3::Zero();
    *leaves = 0;
    for (std::size_t n = 0; n < cells_.size(); ++n) {
      double w = 1;
      Vector3 logSlope = Vector3::Zero();
      for (int axis = 0; axis < 3 && w > 0; ++axis)
        for (int side = 0; side < 2; ++side) {
          const double delta = deltas_[n][axis][side];
          if (delta == 0) continue;  // faces on the domain's boundary are not blended
          const double t =
              (side == 0 ? x[axis] - cells_[n].box.min()[axis] : cells_[n].box.max()[axis] - x[axis]) / delta;
          const double s = t <= -1 ? 0 : t >= 1 ? 1 : (2 + 3 * t - t * t * t) / 4;
          const double slope = std::abs(t) >= 1 ? 0 : 3 * (1 - t * t) / 4 / delta;
          w *= s;
          if (s > 0) logSlope[axis] += (side == 0 ? slope : -slope) / s;
        }
      if (!(w > 0)) continue;
      ++*leaves;
      const auto [value, gradient] = polynomial(cells_[n], x);
      weights += w;
      sum += w * value;
      weightsGradient += w * logSlope;
      sumGradient += w * logSlope * value + w * gradient;
    }
    return {sum / weights, sumGradient / weights - sum / weights * weightsGradient / weights};
  }

 private:
  using Deltas = std::array<std::array<double, 2>, 3>;

  Deltas deltasOf(const Cell& cell) const {
    const Vector3 tolerance = 1e-9 * field_.domain().sizes();
    Deltas deltas;
    for (int axis = 0; axis < 3; ++axis)
      for (int side = 0; side < 2; ++side) {
        const double plane = side == 0 ? cell.box.min()[axis] : cell.box.max()[axis];
        const double wall = side == 0 ? field_.domain().min()[axis] : field_.domain().max()[axis];
        Box face = cell.box;
        (side == 0 ? face.max() : face.min())[axis] = plane;
        double least = cell.box.sizes()[axis];
        for (const Cell& other : cells_) {
          const bool touches = ((other.box.min() - tolerance).array() <= face.max().array()).all() &&
                               ((other.box.max() + tolerance).array() >= face.min().array()).all();
          if (touches) least = std::min(least, other.box.sizes()[axis]);
        }
        deltas[axis][side] = std::abs(plane - wall) < tolerance[axis] ? 0 : width_ * least;
      }
    return deltas;
  }

  ValueAndGradient polynomial(const Cell& cell, const Vector3& x) const {
    const Vector3 half = cell.box.sizes() / 2, u = (x - cell.box.center()).cwiseQuotient(half);
    return withCoefficients(field_.data(), field_.data().nodes[cell.id], [&](const auto* c) {
      ValueAndGradient result = query::evaluateWithGradient(c, cell.degree, {u.x(), u.y(), u.z()});
      result.gradient = result.gradient.cwiseQuotient(half);
      return result;
    });
  }

  const Field& field_;
  double width_;
  std::vector<Cell> cells_;
  std::vector<Deltas> deltas_;
};

/// Returns a random field with a lookup grid that is deeper than some of its leaves.
Field irregularWithLookupGrid(unsigned seed) {
  return randomField(seed, {.grid = {1, 2, 1},
                            .refinement = 0.5,
                            .maxDepth = 4,
                            .deepAt = Vector3(0.2, 0.3, -0.4),
                            .minDegree = 7,
                            .maxDegree = 8});
}

TEST(Blend, equalsItsDefinition) {
  std::size_t most = 0;
  ASSERT_GT(irregularWithLookupGrid(1).lookupGrid().depth, 0);
  for (const unsigned seed : {1u, 2u, 3u, 4u})
    for (const double width : {0.03, 0.25}) {
      const Field field = seed % 2 == 0 ? irregular(seed) : irregularWithLookupGrid(seed),
                  smooth = blended(field, width);
      const Definition definition(field, width);
      for (const Vector3& x : pointsNearFaces(field, 1500, seed)) {
        std::size_t leaves = 0;
        const auto [value, gradient] = definition.at(x, &leaves);
        most = std::max(most, leaves);
        const ValueAndGradient result = smooth.valueAndGradient(x);
        ASSERT_NEAR(result.value, value, 1e-12) << x.transpose();
        ASSERT_LT((result.gradient - gradient).norm(), 1e-8) << x.transpose();
        ASSERT_EQ(smooth.value(x), result.value);
      }
    }
  EXPECT_EQ(most, 8u) << "corners at which eight leaves meet are among the points";
}

/// The greatest differences of value and gradient among eight points that surround a point at rounding distance.
struct Step {
  double value = 0, gradient = 0;
};

Step greatestStep(const Field& field, const std::vector<Vector3>& points) {
  Step step;
  for (const Vector3& x : points) {
    std::optional<ValueAndGradient> first;
    Vector3 firstAt = Vector3::Zero();
    for (int corner = 0; corner < 8; ++corner) {
      Vector3 neighbour;
      for (int axis = 0; axis < 3; ++axis) {
        // The offset is a few units in the last place, because a face may lie between two representable numbers.
        const double by = 1e-15 * field.domain().sizes()[axis];
        neighbour[axis] = std::clamp(x[axis] + (corner >> axis & 1 ? by : -by), field.domain().min()[axis],
                                     field.domain().max()[axis]);
      }
      const ValueAndGradient result = field.valueAndGradient(neighbour);
      if (!first) {
        first = result;
        firstAt = neighbour;
      }
      const double slope = first->gradient.dot(neighbour - firstAt);  // not counted as a jump
      step.value = std::max(step.value, std::abs(result.value - first->value - slope));
      step.gradient = std::max(step.gradient, (result.gradient - first->gradient).norm());
    }
  }
  return step;
}

TEST(Blend, removesJumpsAcrossFacesEdgesAndCorners) {
  for (const unsigned seed : {4u, 5u, 6u, 7u}) {
    const Field field = seed % 2 == 0 ? irregular(seed) : irregularWithLookupGrid(seed);
    const std::vector<Vector3> points = pointsNearFaces(field, 20'000, seed);
    const Step jumps = greatestStep(field, points), none = greatestStep(blended(field), points);
    EXPECT_GT(jumps.value, 0.1) << "the field without blending, which the check must find to jump";
    EXPECT_GT(jumps.gradient, 1);
    EXPECT_LT(none.value, 1e-12);
    EXPECT_LT(none.gradient, 1e-9);
  }
}

TEST(Blend, gradientIsTheDerivativeEverywhere) {
  std::mt19937 random(8);
  std::normal_distribution<double> normal;
  for (const unsigned seed : {8u, 9u}) {
    const Field field = irregular(seed), smooth = blended(field, 0.1);
    double worst = 0, worstWithout = 0;
    for (const Vector3& x : pointsNearFaces(field, 20'000, seed)) {
      const Vector3 direction = Vector3(normal(random), normal(random), normal(random)).normalized();
      const double by = 1e-7;
      const Vector3 before = x - by * direction, after = x + by * direction;
      if (!field.domain().contains(before) || !field.domain().contains(after)) continue;
      const auto difference = [&](const Field& f) {
        return std::abs((f.value(after) - f.value(before)) / (2 * by) - f.valueAndGradient(x).gradient.dot(direction));
      };
      worst = std::max(worst, difference(smooth));
      worstWithout = std::max(worstWithout, difference(field));
    }
    EXPECT_LT(worst, 1e-3);
    EXPECT_GT(worstWithout, 1e3);
  }
}

TEST(Blend, reproducesFunctionsThatAllLeavesShare) {
  const Field field = irregular(10);
  const Vector3 slope(0.3, -2, 1.5);
  const auto with = [&](const Vector3& gradient) {
    FieldData data = field.data();
    std::vector<double> coefficients(std::get<FieldArray<double>>(data.coefficients).size(), 0.0);
    for (const Cell& cell : cellsOf(field)) {
      double* c = &coefficients[node::offset(data.nodes[cell.id])];
      const Vector3 half = cell.box.sizes() / 2;
      c[0] = 0.7 + gradient.dot(cell.box.center());
      c[1] = gradient.z() * half.z();
      c[cell.degree + 1] = gradient.y() * half.y();
      c[coefficientCount(cell.degree) - coefficientCount(cell.degree - 1)] = gradient.x() * half.x();
    }
    data.coefficients = std::move(coefficients);
    data.blend = 0.2;
    return Field(std::move(data));
  };
  const Field constant = with(Vector3::Zero()), linear = with(slope);
  for (const Vector3& x : pointsNearFaces(field, 5000, 10)) {
    ASSERT_EQ(constant.value(x), 0.7);
    ASSERT_EQ(constant.valueAndGradient(x).gradient, Vector3::Zero());
    const auto [value, gradient] = linear.valueAndGradient(x);
    ASSERT_NEAR(value, 0.7 + slope.dot(x), 1e-14);
    ASSERT_LT((gradient - slope).norm(), 1e-11);
  }
}

TEST(Blend, changesNothingOutsideBlendZones) {
  const double width = 0.1;
  const Field field = irregular(11), smooth = blended(field, width);
  std::size_t inner = 0, changed = 0;
  for (const Vector3& x : pointsNearFaces(field, 20'000, 11)) {
    const Cell cell = field.cellAt(x);
    const Vector3 local = (x - cell.box.center()).cwiseQuotient(cell.box.sizes() / 2);
    const bool same = smooth.value(x) == field.value(x);
    if (local.cwiseAbs().maxCoeff() < 1 - 2 * width - 1e-12) {
      ++inner;
      ASSERT_TRUE(same) << local.transpose();
      ASSERT_EQ(smooth.valueAndGradient(x).gradient, field.valueAndGradient(x).gradient);
    } else {
      changed += !same;
    }
  }
  EXPECT_GT(inner, 1000u);
  EXPECT_GT(changed, 5000u);
}

TEST(Blend, batchesEqualSingleQueries) {
  for (const bool single : {false, true}) {
    const Field smooth = blended(randomField(12, {.maxDepth = 5, .maxDegree = 7, .single = single}), 0.15);
    std::vector<Vector3> points = pointsNearFaces(smooth, 5000, 12);
    for (std::size_t i = 0; i < points.size(); i += 7) points[i] *= 1.5;
    constexpr double kInfinity = std::numeric_limits<double>::infinity(), kNaN = NAN;
    points.insert(points.end(), {Vector3(kInfinity, 0, 0), Vector3(kNaN, 0, 0), Vector3(0, -kInfinity, kInfinity)});
    std::vector<double> values(points.size());
    std::vector<ValueAndGradient> results(points.size());
    smooth.values(points, values);
    smooth.valuesAndGradients(points, results);
    const auto same = [](double a, double b) {
      return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b) || (std::isnan(a) && std::isnan(b));
    };
    for (std::size_t i = 0; i < points.size(); ++i) {
      const ValueAndGradient one = smooth.valueAndGradient(points[i]);
      ASSERT_TRUE(same(values[i], smooth.value(points[i]))) << points[i].transpose();
      ASSERT_TRUE(same(results[i].value, one.value)) << points[i].transpose();
      for (int axis = 0; axis < 3; ++axis) ASSERT_TRUE(same(results[i].gradient[axis], one.gradient[axis]));
    }
  }
}

TEST(Blend, removesJumpsOutsideTheDomain) {
  const Field field = irregular(13), smooth = blended(field);
  const auto outside = [&] {
    std::vector<Vector3> points = pointsNearFaces(field, 5000, 13);
    for (Vector3& x : points) x.z() = -2.5;
    std::erase_if(points, [&](const Vector3& x) {  // the gradient is discontinuous at the boundary of the domain
      return std::min({x.x() + 1, 1 - x.x(), x.y() + 0.5, 1 - x.y()}) < 1e-9;
    });
    return points;
  }();
  Step jumps, none;
  for (const Vector3& x : outside)
    for (const Field* f : {&field, &smooth}) {
      Step& step = f == &field ? jumps : none;
      const ValueAndGradient before = f->valueAndGradient(x - Vector3(1e-15, 1e-15, 0));
      const ValueAndGradient after = f->valueAndGradient(x + Vector3(1e-15, 1e-15, 0));
      step.value = std::max(step.value, std::abs(after.value - before.value));
      step.gradient = std::max(step.gradient, (after.gradient - before.gradient).norm());
    }
  EXPECT_GT(jumps.value, 0.01);
  EXPECT_LT(none.value, 1e-12);
  EXPECT_LT(none.gradient, 1e-9);
}

TEST(Blend, isMeasuredByJumpsAndLines) {
  const Field field = irregular(14), smooth = blended(field);
  const Jumps before = findJumps(field), after = findJumps(smooth);
  EXPECT_EQ(before.interfaces.size(), after.interfaces.size());
  EXPECT_GT(before.value.max, 0.1);
  EXPECT_LT(after.value.max, 1e-12);
  EXPECT_LT(after.gradient.max, 1e-9);
  std::mt19937 random(14);
  std::uniform_real_distribution<double> unit(0, 1);
  double jumped = 0;
  for (int n = 0; n < 200; ++n) {
    const auto end = [&] {
      return Vector3(field.domain().min() +
                     field.domain().sizes().cwiseProduct(Vector3(unit(random), unit(random), unit(random))));
    };
    const Vector3 from = end(), to = end();
    for (const LineJump& jump : jumpsAlong(sampleLine(field, from, to, 20))) jumped = std::max(jumped, jump.value);
    const Line line = sampleLine(smooth, from, to, 20);
    for (const LineJump& jump : jumpsAlong(line)) ASSERT_NEAR(jump.value, 0, 1e-12);
    for (const LineSample& sample : line.samples) ASSERT_NEAR(sample.value, smooth.value(sample.point), 1e-12);
  }
  EXPECT_GT(jumped, 0.01);
}

TEST(Blend, worksInVeryDeepCells) {
  const Field field = randomField(15, {.refinement = 0, .maxDepth = kMaxDepth, .deepAt = Vector3(0.1, 0.2, 0.3)});
  const Field smooth = blended(field);
  const std::vector<Vector3> points = pointsNearFaces(field, 5000, 15);
  EXPECT_LT(greatestStep(smooth, points).value, 1e-12);
  for (const Vector3& x : points) ASSERT_TRUE(smooth.valueAndGradient(x).gradient.allFinite());
}

/// The blend zones are so narrow that rounding removes their width far from the origin.
TEST(Blend, worksInZonesWithoutWidth) {
  const Field field = irregular(20);
  for (const double width : {1e-300, 1e-17, 1e-16, 1e-15, 1e-12}) {
    const Field smooth = blended(field, width);
    std::vector<Vector3> points;
    for (const Cell& cell : cellsOf(field))
      for (int corner = 0; corner < 8; ++corner)
        points.push_back(cell.box.corner(static_cast<Box::CornerType>(corner)));
    std::vector<ValueAndGradient> results(points.size());
    smooth.valuesAndGradients(points, results);
    for (std::size_t i = 0; i < points.size(); ++i) {
      ASSERT_TRUE(std::isfinite(results[i].value)) << width << " at " << points[i].transpose();
      ASSERT_EQ(smooth.value(points[i]), results[i].value);
    }
  }
}

TEST(Blend, isKeptInFiles) {
  const support::TemporaryDirectory folder;
  const std::string file = (folder.path() / "blended.hpsdf").string();
  const Field smooth = blended(irregular(16), 0.07);
  save(smooth, file);
  const Field again = load(file);
  EXPECT_EQ(again.data().blend, 0.07);
  for (const Vector3& x : pointsNearFaces(smooth, 500, 16)) ASSERT_EQ(again.value(x), smooth.value(x));
}

TEST(Blend, countsItsMemory) {
  const Field field = irregular(17);
  EXPECT_EQ(blended(field, 0).bytes(), field.bytes());
  EXPECT_EQ(blended(field, 0.1).bytes(),
            field.bytes() + 4 * (field.data().nodes.size() + field.lookupGrid().entries.size()));
}

TEST(Blend, refusesWidthsOutOfRange) {
  const Field field = irregular(18);
  for (const double width : {-0.01, 0.26, double(NAN)}) EXPECT_THROW(blended(field, width), Error) << width;
}

/// docs/accuracy.md lists the errors of blended fields of larger meshes.
TEST(Blend, keepsTheErrorOfAMeshsField) {
  const ExactDistance distance(shapes::mesh("torus"));
  const Field field =
      build(distance, Box(Vector3::Constant(-1.2), Vector3::Constant(1.2)), {.targetError = 1e-6, .grid = {4, 4, 4}});
  const Field smooth = blended(field);
  std::mt19937 random(19);
  std::uniform_real_distribution<double> unit(-1.2, 1.2);
  std::vector<Vector3> points(50'000);
  for (Vector3& x : points) x = Vector3(unit(random), unit(random), unit(random));
  std::vector<double> exact(points.size()), before(points.size()), after(points.size());
  distance(points, exact);
  field.values(points, before);
  smooth.values(points, after);
  const auto rms = [&](const std::vector<double>& values) {
    double sum = 0;
    for (std::size_t i = 0; i < values.size(); ++i) sum += (values[i] - exact[i]) * (values[i] - exact[i]);
    return std::sqrt(sum / double(values.size()));
  };
  EXPECT_LE(rms(after), 1.05 * rms(before));
  EXPECT_LE(double(smooth.bytes()), 1.2 * double(field.bytes()));
  const Step none = greatestStep(smooth, pointsNearFaces(field, 50'000, 19));
  EXPECT_LT(none.value, 1e-12);
  EXPECT_LT(none.gradient, 1e-9);
}

}  // namespace blend_test
}  // namespace hpsdf
