#include "view/supersampling.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "hpsdf/build.h"
#include "hpsdf/error.h"
#include "hpsdf/shapes.h"
#include "support/random_field.h"
#include "support/require_gl.h"

namespace hpsdf::render {
namespace supersampling_test {

constexpr int kWidth = 163, kHeight = 118;  // no multiples of the size of a block
const Box kCube(Vector3(-1.1, -1.1, -1.1), Vector3(1.1, 1.1, 1.1));

Field fieldOf(const std::string& shape) {
  return build(shapes::analytic(shape), kCube, {.targetError = 1e-7, .estimator = Estimator::embedded});
}

/// Passes everything on to another renderer and counts the rays that it is to trace.
class CountingRenderer : public Renderer {
 public:
  explicit CountingRenderer(Renderer& inner) : inner_(inner) {}

  ViewBuffers slice(const SliceView& view, int width, int height) override { return inner_.slice(view, width, height); }

  ViewBuffers surface(const SurfaceView& view, int width, int height, std::span<const std::uint8_t> chosen) override {
    const std::size_t all = std::size_t(width) * height;
    rays += chosen.empty() ? all : all - std::size_t(std::ranges::count(chosen, std::uint8_t{0}));
    return inner_.surface(view, width, height, chosen);
  }

  std::string description() const override { return inner_.description(); }

  std::size_t rays = 0;

 private:
  Renderer& inner_;
};

std::vector<std::unique_ptr<Renderer>> renderersOf(const Field& field) {
  std::vector<std::unique_ptr<Renderer>> renderers;
  renderers.push_back(makeCpuRenderer(field));
  if (support::glProblem().empty()) renderers.push_back(makeGlRenderer(field, support::testedGl()));
  return renderers;
}

SurfaceView viewOf(const Field& field) { return {cameraOf({}, field.domain(), kWidth, kHeight)}; }

/// Returns true if two buffers have the same data in pixel i.
bool isSame(const ViewBuffers& a, const ViewBuffers& b, std::size_t i) {
  return a.cell[i] == b.cell[i] && a.degree[i] == b.degree[i] && a.depth[i] == b.depth[i] && a.value[i] == b.value[i] &&
         a.normal[i] == b.normal[i] && a.distance[i] == b.distance[i] && a.crack[i] == b.crack[i];
}

TEST(ChosenPixels, areOneForEachPixelOfTheView) {
  const Field field = randomField(5, {.roughness = 0.05});
  const std::vector<std::uint8_t> tooFew(100);
  for (const auto& renderer : renderersOf(field))
    EXPECT_THROW(renderer->surface(viewOf(field), kWidth, kHeight, tooFew), Error);
}

TEST(ChosenPixels, ofViewsWithMoreBlocksThanATargetHolds) {
  constexpr int kSide = 2200;  // 275 × 275 blocks
  const Field field = fieldOf("sphere");
  const Camera camera = cameraOf({.distance = 0.3}, field.domain(), kSide, kSide);
  std::vector<std::uint8_t> chosen(std::size_t(kSide) * kSide);
  for (int y = 3; y < kSide; y += 8)
    for (int x = 5; x < kSide; x += 8) chosen[std::size_t(y) * kSide + x] = 1;
  std::vector<ViewBuffers> seen;
  for (const auto& renderer : renderersOf(field)) seen.push_back(renderer->surface({camera}, kSide, kSide, chosen));
  std::size_t hits = 0;
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    if (!seen.front().hit(i)) continue;
    ++hits;
    ASSERT_NEAR(seen.front().distance[i], seen.back().distance[i], 1e-4) << i;
  }
  EXPECT_GT(hits, std::size_t{1} << 16);
}

TEST(ChosenPixels, aloneAreTraced) {
  const Field field = randomField(5, {.roughness = 0.05});
  const SurfaceView view = viewOf(field);
  std::vector<std::uint8_t> chosen(std::size_t(kWidth) * kHeight);
  std::mt19937 random(7);
  // The upper half has scattered pixels, the lower one a few blocks.
  for (std::size_t i = 0; i < chosen.size(); ++i)
    chosen[i] = i < chosen.size() / 2 ? random() % 3 == 0 : i / kWidth / 8 % 3 == 0 && i % kWidth / 8 % 2 == 0;
  for (const auto& renderer : renderersOf(field)) {
    const ViewBuffers all = renderer->surface(view, kWidth, kHeight);
    const ViewBuffers some = renderer->surface(view, kWidth, kHeight, chosen);
    std::size_t hits = 0, left = 0;
    for (std::size_t i = 0; i < chosen.size(); ++i) {
      hits += some.hit(i);
      left += all.hit(i) && chosen[i] == 0;
      if (chosen[i] != 0)
        ASSERT_TRUE(isSame(all, some, i)) << renderer->description() << ", pixel " << i;
      else
        ASSERT_FALSE(some.hit(i)) << renderer->description() << ", pixel " << i;
    }
    EXPECT_GT(hits, 1000u);
    EXPECT_GT(left, 1000u);
  }
}

/// Shares of the samples in which a supersampled view differs from one of which all samples were traced.
struct Difference {
  double cells = 0;      ///< samples with another cell, or with nothing in place of a cell
  double hits = 0;       ///< samples with the surface in one of the views alone
  double distances = 0;  ///< samples whose distances differ by more than a quarter of a pixel
  double normals = 0;    ///< samples whose normals differ by more than 8°
};

Difference difference(const SurfaceView& view, const ViewBuffers& found, const ViewBuffers& truth) {
  Difference result;
  const double share = 1.0 / double(truth.cell.size());
  for (std::size_t i = 0; i < truth.cell.size(); ++i) {
    if (found.cell[i] != truth.cell[i]) result.cells += share;
    if (found.hit(i) != truth.hit(i)) result.hits += share;
    if (!truth.hit(i) || !found.hit(i)) continue;
    const double quarter = 0.25 * pixelSize(view.camera, truth.distance[i], kHeight);
    if (std::abs(double(found.distance[i]) - truth.distance[i]) > quarter) result.distances += share;
    if (found.normal[i].dot(truth.normal[i]) < 0.99) result.normals += share;
  }
  return result;
}

TEST(Supersampling, agreesWithTracingAllSamplesButTracesFewer) {
  for (const char* shape : {"sphere", "torus", "box"}) {
    const Field field = fieldOf(shape);
    for (const auto& renderer : renderersOf(field))
      for (const auto& clip : {std::optional<ClipPlane>(), std::optional(ClipPlane{2, 0.1})})
        for (const int samples : {2, 3})
          for (const bool showsCells : {false, true}) {
            SCOPED_TRACE(shape + (" by " + renderer->description()));
            SurfaceView view = viewOf(field);
            view.clip = clip;
            CountingRenderer counting(*renderer);
            const ViewBuffers found = supersampledSurface(counting, view, kWidth, kHeight, samples, showsCells);
            const ViewBuffers truth = renderer->surface(view, samples * kWidth, samples * kHeight);
            ASSERT_EQ(found.width, truth.width);
            ASSERT_EQ(found.cell.size(), truth.cell.size());
            const Difference differ = difference(view, found, truth);
            EXPECT_LT(differ.cells, showsCells ? 1e-3 : 0.05);
            EXPECT_LT(differ.hits, 1e-4);
            EXPECT_LT(differ.distances, 1e-3);
            EXPECT_LT(differ.normals, 2e-3);
            EXPECT_LT(double(counting.rays), (showsCells ? 0.6 : 0.45) * double(truth.cell.size()));
          }
  }
}

TEST(Supersampling, tracesAllSamplesWhereCellsDisagree) {
  // The field jumps at every face, and no pixel lies in the midst of one cell.
  const Field field = randomField(5, {.roughness = 0.2, .maxDepth = 5});
  SurfaceView view = viewOf(field);
  const auto renderer = makeCpuRenderer(field);
  const ViewBuffers coarse = renderer->surface(view, kWidth, kHeight);
  const ViewBuffers found = supersampledSurface(*renderer, view, kWidth, kHeight, 2, true);
  const ViewBuffers truth = renderer->surface(view, 2 * kWidth, 2 * kHeight);
  std::size_t uneven = 0, cracks = 0;
  for (int y = 1; y + 1 < kHeight; ++y)
    for (int x = 1; x + 1 < kWidth; ++x) {
      const std::size_t i = std::size_t(y) * kWidth + x;
      if (coarse.cell[i] == coarse.cell[i - 1] && coarse.cell[i] == coarse.cell[i + 1] && coarse.crack[i] == 0)
        continue;
      ++uneven;
      for (const std::size_t row : {0, 1})
        for (const std::size_t column : {0, 1}) {
          const std::size_t sample = (2 * std::size_t(y) + row) * 2 * kWidth + 2 * std::size_t(x) + column;
          cracks += truth.crack[sample];
          ASSERT_TRUE(isSame(found, truth, sample)) << x << ", " << y;
        }
    }
  EXPECT_GT(uneven, 500u);
  EXPECT_GT(cracks, 100u);
}

TEST(Supersampling, tracesWideCracksAndStepsWhateverIsShown) {
  // In the first field f jumps at the faces of cells. The second one has a step whose edge runs across the picture.
  const Field jumping = randomField(5, {.roughness = 0.2, .maxDepth = 5});
  const auto step = [](const Vector3& x) { return x.z() - (x.x() + x.y() > 0.02 ? 0.3 : -0.3); };
  const Field stepped = build(step, kCube, {.targetError = 1e-3, .maxDepth = 6});
  for (const Field* field : {&jumping, &stepped})
    for (const double offset : {0.0, 0.05})
      for (const Projection projection : {Projection::perspective, Projection::orthographic}) {
        const OrbitCamera camera{.azimuthDegrees = 0, .elevationDegrees = 3, .projection = projection};
        const SurfaceView view{cameraOf(camera, field->domain(), kWidth, kHeight), offset};
        const auto renderer = makeCpuRenderer(*field);
        const ViewBuffers found = supersampledSurface(*renderer, view, kWidth, kHeight, 2, false);
        const ViewBuffers truth = renderer->surface(view, 2 * kWidth, 2 * kHeight);
        std::size_t hits = 0, wrong = 0;
        for (std::size_t i = 0; i < truth.cell.size(); ++i) {
          if (!truth.hit(i) || !found.hit(i)) continue;
          ++hits;
          const double pixel = pixelSize(view.camera, truth.distance[i], kHeight);
          wrong += std::abs(double(found.distance[i]) - truth.distance[i]) > pixel;
        }
        EXPECT_GT(hits, 3000u);
        EXPECT_LT(wrong, hits / 500);
      }
}

TEST(Supersampling, isPlainTracingForOneSample) {
  const Field field = fieldOf("torus");
  const SurfaceView view = viewOf(field);
  const auto renderer = makeCpuRenderer(field);
  const ViewBuffers found = supersampledSurface(*renderer, view, kWidth, kHeight, 1, true);
  const ViewBuffers truth = renderer->surface(view, kWidth, kHeight);
  for (std::size_t i = 0; i < truth.cell.size(); ++i) ASSERT_TRUE(isSame(found, truth, i));
}

}  // namespace supersampling_test
}  // namespace hpsdf::render
