#include "hpsdf/detail/line.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <set>

#include "hpsdf/error.h"
#include "support/random_field.h"

namespace hpsdf {
namespace line_test {

Vector3 pointAt(const Vector3& from, const Vector3& to, double t) { return from + t * (to - from); }

std::vector<std::uint32_t> cellsOf(const std::vector<Piece>& pieces) {
  std::vector<std::uint32_t> cells;
  for (const Piece& piece : pieces)
    if (piece.cell) cells.push_back(piece.cell->id);
  return cells;
}

/// Expects pieces that cover t = 0 to 1 without gaps, each in the leaf at its midpoint, and no leaf twice.
void expectValidPieces(const Field& field, const Vector3& from, const Vector3& to) {
  const std::vector<Piece> pieces = piecesAlong(field, from, to);
  ASSERT_FALSE(pieces.empty());
  EXPECT_EQ(pieces.front().tEnter, 0);
  EXPECT_EQ(pieces.back().tLeave, 1);
  std::set<std::uint32_t> seen;
  for (std::size_t n = 0; n < pieces.size(); ++n) {
    const Piece& piece = pieces[n];
    ASSERT_LT(piece.tEnter, piece.tLeave);
    if (n > 0) {
      ASSERT_EQ(pieces[n - 1].tLeave, piece.tEnter);
    }
    const Vector3 middle = pointAt(from, to, 0.5 * (piece.tEnter + piece.tLeave));
    if (!piece.cell) {
      EXPECT_TRUE(n == 0 || n + 1 == pieces.size());
      EXPECT_FALSE(field.domain().contains(middle));
      continue;
    }
    EXPECT_TRUE(seen.insert(piece.cell->id).second) << "the leaf occurs twice";
    EXPECT_EQ(piece.cell->id, field.cellAt(middle).id) << "piece " << n << " of " << pieces.size();
    const double rounding = 1e-12 * field.domain().sizes().norm();
    for (const double t : {piece.tEnter, piece.tLeave})
      EXPECT_LT(piece.cell->box.exteriorDistance(pointAt(from, to, t)), rounding);
  }
}

RandomFieldOptions oblong() {
  RandomFieldOptions options;
  options.domain = Box(Vector3(-1, 2, -3), Vector3(2, 4, 1));
  options.grid = {3, 2, 1};
  options.refinement = 0.6;
  return options;
}

TEST(Line, isCutAtTheFacesThatItCrosses) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(-0.3, 1.3);
  for (const unsigned seed : {1u, 2u, 3u}) {
    const Field field = randomField(seed, oblong());
    const auto point = [&]() -> Vector3 {
      return field.domain().min() +
             Vector3(unit(random), unit(random), unit(random)).cwiseProduct(field.domain().sizes());
    };
    for (int n = 0; n < 500; ++n) {
      const Vector3 from = point(), to = point();
      expectValidPieces(field, from, to);
      auto back = cellsOf(piecesAlong(field, to, from));
      std::ranges::reverse(back);
      EXPECT_EQ(cellsOf(piecesAlong(field, from, to)), back);
      expectValidPieces(field, from, from + 1e-3 * (to - from));
      expectValidPieces(field, from, Vector3(to.x(), from.y(), from.z()));
    }
  }
}

/// Makes n³ unit base cells, each with its own number as a constant value.
Field lattice(std::uint32_t n) {
  FieldData data;
  data.domain = Box(Vector3::Zero(), Vector3::Constant(n));
  data.grid = {n, n, n};
  std::vector<double> coefficients;
  for (std::uint32_t cell = 0; cell < n * n * n; ++cell) {
    data.nodes.push_back(node::leaf(0, cell));
    coefficients.push_back(cell);
  }
  data.coefficients = coefficients;
  return Field(std::move(data));
}

TEST(Line, continuesInTheOppositeCellAtCornersAndEdges) {
  const Field field = lattice(5);
  const auto cell = [](std::uint32_t x, std::uint32_t y, std::uint32_t z) { return x + 5 * (y + 5 * z); };
  using Cells = std::vector<std::uint32_t>;
  Cells diagonal, inPlane;
  for (std::uint32_t i = 0; i < 5; ++i) {
    diagonal.push_back(cell(i, i, i));
    inPlane.push_back(cell(i, 4 - i, 2));
  }
  EXPECT_EQ(cellsOf(piecesAlong(field, Vector3::Zero(), Vector3::Constant(5))), diagonal);
  EXPECT_EQ(cellsOf(piecesAlong(field, Vector3::Constant(-2), Vector3::Constant(9))), diagonal);
  EXPECT_EQ(cellsOf(piecesAlong(field, Vector3(0, 5, 2.3), Vector3(5, 0, 2.3))), inPlane);
  std::ranges::reverse(diagonal);
  EXPECT_EQ(cellsOf(piecesAlong(field, Vector3::Constant(5), Vector3::Zero())), diagonal);
  EXPECT_EQ(cellsOf(piecesAlong(field, Vector3::Constant(5.7), Vector3::Constant(-0.1))), diagonal)
      << "rounded differently along no axis";
  // These segments pass through a corner of cells at a parameter t that is not representable.
  for (int n = 1; n < 200; ++n) {
    const Vector3 direction(1 / 3.0 * n, 1 / 7.0 * n, -1 / 11.0 * n), corner(2, 3, 2);
    const auto pieces = piecesAlong(field, corner - direction, corner + 1.7 * direction);
    for (const Piece& piece : pieces) EXPECT_GT(piece.tLeave - piece.tEnter, 1e-9);
    const auto cells = cellsOf(pieces);
    EXPECT_NE(std::ranges::find(cells, cell(1, 2, 2)), cells.end());
    EXPECT_NE(std::ranges::find(cells, cell(2, 3, 1)), cells.end());
  }
}

TEST(Line, runsThroughCellsOfGreaterCoordinatesAlongFacesAndEdges) {
  const Field field = lattice(3);
  using Cells = std::vector<std::uint32_t>;
  EXPECT_EQ(cellsOf(piecesAlong(field, {0, 1, 0.5}, {3, 1, 0.5})), (Cells{3, 4, 5}));
  EXPECT_EQ(cellsOf(piecesAlong(field, {3, 1, 1}, {0, 1, 1})), (Cells{14, 13, 12}));
  EXPECT_EQ(cellsOf(piecesAlong(field, {0, 3, 3}, {3, 3, 3})), (Cells{24, 25, 26})) << "the domain's upper edge";
  EXPECT_EQ(cellsOf(piecesAlong(field, {0, 0, 0}, {0, 0, 3})), (Cells{0, 9, 18}));
  EXPECT_EQ(cellsOf(piecesAlong(field, {1, 0.5, 0.5}, {0.5, 0.5, 0.5})), (Cells{0})) << "from a face backwards";
  EXPECT_EQ(cellsOf(piecesAlong(field, {1, 0.5, 0.5}, {1.5, 0.5, 0.5})), (Cells{1}));
  EXPECT_EQ(cellsOf(piecesAlong(field, {0.5, 0.5, 0.5}, {1, 0.5, 0.5})), (Cells{0})) << "up to a face";
  const auto pieces = piecesAlong(field, {0, 0.5, 0.5}, {3, 0.5, 0.5});
  ASSERT_EQ(pieces.size(), 3u);
  EXPECT_EQ(pieces[1].tEnter, 1 / 3.0);
  EXPECT_EQ(pieces[1].tLeave, 2 / 3.0);
}

TEST(Line, hasNoCellOutsideTheDomain) {
  const Field field = lattice(3);
  const auto through = piecesAlong(field, {-1, 0.5, 0.5}, {5, 0.5, 0.5});
  ASSERT_EQ(through.size(), 5u);
  EXPECT_FALSE(through.front().cell || through.back().cell);
  EXPECT_EQ(through.front().tLeave, 1 / 6.0);
  EXPECT_EQ(through.back().tEnter, 4 / 6.0);
  for (const auto& [from, to] : {std::pair<Vector3, Vector3>({-1, 4, 0}, {4, 4, 3}), {{-1, 1, 0}, {1, -1.5, 0}}}) {
    const auto past = piecesAlong(field, from, to);
    ASSERT_EQ(past.size(), 1u);
    EXPECT_FALSE(past[0].cell);
    EXPECT_EQ(past[0].tLeave, 1);
  }
}

TEST(Line, findsDeepCellsFromFarAway) {
  RandomFieldOptions options;
  options.maxDepth = 16;
  options.refinement = 0;
  options.deepAt = Vector3(0.3, 0.3, 0.3);
  const Field field = randomField(5, options);
  expectValidPieces(field, *options.deepAt - 1e-4 * Vector3(1, 2, 3), *options.deepAt + 1e-4 * Vector3(3, 2, 1));
  const auto pieces =
      piecesAlong(field, *options.deepAt - 30 * Vector3(3, 2, 1), *options.deepAt + 7 * Vector3(3, 2, 1));
  EXPECT_TRUE(std::ranges::any_of(pieces, [](const Piece& piece) { return piece.cell && piece.cell->depth == 16; }));
}

TEST(Line, samplesLimitsFromBothLeavesAtFaces) {
  for (const bool single : {false, true}) {
    RandomFieldOptions options = oblong();
    options.single = single;
    const Field field = randomField(9, options);
    const Vector3 from(-0.91, 2.12, -2.83), to(1.9, 3.7, 0.6);
    const Line line = sampleLine(field, from, to, 101);
    EXPECT_EQ(line.samples.size(), 101 - 2 + 2 * line.pieces.size());
    EXPECT_EQ(line.samples.front().point, from);
    EXPECT_EQ(line.samples.back().point, to);
    int inner = 0;
    for (std::size_t i = 0; i < line.samples.size(); ++i) {
      const LineSample& sample = line.samples[i];
      const Piece& piece = line.pieces[sample.piece];
      if (i > 0) {
        EXPECT_GE(sample.t, line.samples[i - 1].t);
      }
      if (sample.t == piece.tEnter || sample.t == piece.tLeave) {
        // The sample's one-sided limit equals the field a little inside the piece.
        const double inwards = (sample.t == piece.tEnter ? 1 : -1) * 1e-9;
        const auto near = field.valueAndGradient(pointAt(from, to, sample.t + inwards));
        EXPECT_NEAR(sample.value, near.value, 1e-6);
        EXPECT_LT((sample.gradient - near.gradient).norm(), 1e-5);
      } else {
        ++inner;
        const auto expected = field.valueAndGradient(sample.point);
        EXPECT_EQ(sample.value, expected.value);
        EXPECT_EQ(sample.gradient, expected.gradient);
      }
      EXPECT_NEAR(line.slopeAlong(sample), sample.gradient.dot((to - from).normalized()), 1e-12);
    }
    EXPECT_EQ(inner, 99);
    EXPECT_EQ(jumpsAlong(line).size(), line.pieces.size() - 1);
  }
}

TEST(Line, findsKnownJumps) {
  const Line line = sampleLine(lattice(4), {-1, 0.5, 0.5}, {7, 0.5, 0.5}, 9);
  const auto jumps = jumpsAlong(line);
  ASSERT_EQ(jumps.size(), 3u) << "no jump at the domain's boundary";
  for (std::size_t n = 0; n < 3; ++n) {
    EXPECT_EQ(jumps[n].t, double(n + 2) / 8);
    EXPECT_EQ(jumps[n].value, 1);
  }
  // Samples on faces are replaced by the limits from both sides.
  EXPECT_EQ(line.samples.size(), 2u * 6 + 2);
}

TEST(Line, samplesTheContinuationOutsideTheDomain) {
  const Field field = randomField(3);
  const Line line = sampleLine(field, {0.2, 0.1, 2}, {0.2, 0.1, 0.9}, 12);
  ASSERT_FALSE(line.pieces.front().cell);
  for (const LineSample& sample : line.samples) {
    if (sample.piece != 0) break;
    EXPECT_EQ(sample.value, field.value(sample.point));
    EXPECT_NEAR(sample.gradient.z(), 1, 1e-12) << "the limit from outside, on the wall too";
    EXPECT_NEAR(line.slopeAlong(sample), -1, 1e-12);
  }
}

TEST(Line, refusesEqualAndInfiniteEnds) {
  const Field field = lattice(2);
  const double infinity = std::numeric_limits<double>::infinity(), nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(piecesAlong(field, {1, 1, 1}, {1, 1, 1}), Error);
  for (const double bad : {infinity, -infinity, nan}) {
    EXPECT_THROW(piecesAlong(field, {1, bad, 1}, {1, 1, 1}), Error);
    EXPECT_THROW(sampleLine(field, {1, 1, 1}, {1, 1, bad}, 10), Error);
  }
  EXPECT_THROW(piecesAlong(field, {-1e308, 1, 1}, {1e308, 1, 1}), Error);
  EXPECT_EQ(cellsOf(piecesAlong(field, {-1e6, 0.5, 0.5}, {1e6, 0.5, 0.5})).size(), 2u);
}

}  // namespace line_test
}  // namespace hpsdf
