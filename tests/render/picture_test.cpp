#include "hpsdf/render/picture.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <set>
#include <tuple>

#include "coloring/color_view.h"
#include "expect_tidy.h"
#include "hpsdf/error.h"
#include "picture/cracks.h"
#include "picture/describe.h"
#include "picture/legend.h"

namespace hpsdf::render {
namespace picture_test {

const ColorMap& kDistanceMap = colorMap(MapKind::diverging, "");
constexpr double kPlane = 0.125;  // the test field's surface is at x = kPlane; points below are inside

// Returns the field x − kPlane over [−1, 1]³ with 2 × 2 × 2 base cells, of which the last is divided once. `degrees`:
// of undivided cells at x < 0, of undivided cells at x > 0, and of the children.
Field planeField(std::array<int, 3> degrees = {2, 3, 5}, std::string name = "plane") {
  FieldData data;
  data.domain = Box(Vector3::Constant(-1), Vector3::Constant(1));
  data.grid = {2, 2, 2};
  std::vector<double> coefficients;
  const auto leaf = [&](int degree, double center, double halfSize) {
    const auto offset = static_cast<std::uint32_t>(coefficients.size());
    coefficients.resize(offset + coefficientCount(degree), 0.0);
    // Coefficients are in lexicographic order: (1, 0, 0) follows all (0, j, k).
    coefficients[offset] = center - kPlane;
    coefficients[offset + (degree + 1) * (degree + 2) / 2] = halfSize;
    return node::leaf(degree, offset);
  };
  for (int i = 0; i < 7; ++i) data.nodes.push_back(leaf(degrees[i % 2], i % 2 ? 0.5 : -0.5, 0.5));
  data.nodes.push_back(node::internal(8));
  for (int i = 0; i < 8; ++i) data.nodes.push_back(leaf(degrees[2], i % 2 ? 0.75 : 0.25, 0.25));
  data.coefficients = std::move(coefficients);
  data.metadata.source.name = std::move(name);
  data.metadata.settings.targetError = 1e-6;
  return Field(std::move(data));
}

// A renderer that evaluates the field once per pixel of a slice, and shows a surface in the lower half of a 3D view.
class FakeRenderer : public Renderer {
 public:
  explicit FakeRenderer(const Field& field) : field_(field) {}

  ViewBuffers slice(const SliceView& view, int width, int height) override {
    ViewBuffers buffers = empty(width, height);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const Vector3 point =
            view.origin + view.right * ((x + 0.5) / width - 0.5) + view.up * (0.5 - (y + 0.5) / height);
        const Box& domain = field_.domain();
        if ((point.array() < domain.min().array()).any() || (point.array() >= domain.max().array()).any()) continue;
        fill(buffers, std::size_t(y) * width + x, point);
      }
    return buffers;
  }

  ViewBuffers surface(const SurfaceView&, int width, int height, std::span<const std::uint8_t>) override {
    ViewBuffers buffers = empty(width, height);
    buffers.normal.assign(buffers.cell.size(), Eigen::Vector3f::UnitX());
    buffers.distance.assign(buffers.cell.size(), 1);
    for (std::size_t i = buffers.cell.size() / 2; i < buffers.cell.size(); ++i)
      fill(buffers, i, Vector3(kPlane, 0, -0.5));
    buffers.crack.assign(buffers.cell.size(), 0);
    buffers.crack.back() = 1;
    return buffers;
  }

  std::string description() const override { return "fake"; }

  int calls = 0;
  int lastWidth = 0, lastHeight = 0;

 private:
  ViewBuffers empty(int width, int height) {
    ++calls;
    lastWidth = width;
    lastHeight = height;
    const std::size_t size = std::size_t(width) * height;
    ViewBuffers buffers;
    buffers.width = width;
    buffers.height = height;
    buffers.cell.assign(size, kNoCell);
    buffers.degree.assign(size, 0);
    buffers.depth.assign(size, 0);
    buffers.value.assign(size, 0);
    return buffers;
  }

  void fill(ViewBuffers& buffers, std::size_t i, const Vector3& point) const {
    const Cell cell = field_.cellAt(point);
    buffers.cell[i] = cell.id;
    buffers.degree[i] = static_cast<std::uint8_t>(cell.degree);
    buffers.depth[i] = static_cast<std::uint8_t>(cell.depth);
    buffers.value[i] = static_cast<float>(field_.value(point));
  }

  const Field& field_;
};

SlicePicture slice(ColorBy color, int width = 640, int height = 360, int samples = 1) {
  return {AxisPlane{2, 0.5}, color, width, height, samples};
}

/// Returns the size of the view within a picture of the given size.
ViewSize viewSize(int pictureWidth, int pictureHeight) {
  SurfacePicture picture;
  picture.width = pictureWidth;
  picture.height = pictureHeight;
  return render::viewSize(picture);
}

// Returns the colour of the pixel that shows a point of the slice.
Color colorAt(const Image& image, const Field& field, const SlicePicture& picture, const Vector3& point) {
  const SliceView view = sliceView(field, picture);
  const ViewSize size = viewSize(picture.width, picture.height);
  const Vector3 from = point - view.origin;
  const double x = (from.dot(view.right) / view.right.squaredNorm() + 0.5) * size.width;
  const double y = (0.5 - from.dot(view.up) / view.up.squaredNorm()) * size.height;
  return image.at(static_cast<int>(std::floor(x)), static_cast<int>(std::floor(y)));
}

double lightnessOf(Color color) { return toOklab(decodeSrgb(color)).lightness; }

bool holds(const Image& image, Color color, int fromColumn) {
  for (int y = 0; y < image.height; ++y)
    for (int x = fromColumn; x < image.width; ++x)
      if (image.at(x, y) == color) return true;
  return false;
}

std::string messageOf(const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

TEST(Panel, showsSharesAsBarsFromTheHighestLevelDown) {
  Overlay overlay;
  const Frame layout = frame(960, 540);
  const double next = addShares(overlay, layout, 100, "degrees by volume", {{2, 0.25}, {3, 0.7}, {6, 0.05}});
  ASSERT_EQ(overlay.boxes.size(), 3U);
  const auto lengthOf = [&](std::size_t row) { return overlay.boxes[row].x1 - overlay.boxes[row].x0; };
  EXPECT_NEAR(lengthOf(0) / lengthOf(1), 0.05 / 0.7, 1e-9) << "degree 6 over degree 3";
  EXPECT_NEAR(lengthOf(2) / lengthOf(1), 0.25 / 0.7, 1e-9) << "degree 2 over degree 3";
  EXPECT_LT(overlay.boxes[0].y1, overlay.boxes[1].y0);
  std::vector<std::string> texts;
  for (const TextItem& item : overlay.texts) {
    texts.push_back(item.text);
    EXPECT_GE(item.x, layout.panel.x0);
    EXPECT_LT(item.baseline, next);
  }
  EXPECT_THAT(texts, ::testing::ElementsAre("degrees by volume", "6", "5.0 %", "3", "70.0 %", "2", "25.0 %"));

  Overlay none;
  EXPECT_EQ(addShares(none, layout, layout.panel.y1 - 10, "degrees by volume", {{2, 1.0}}), layout.panel.y1 - 10);
  EXPECT_TRUE(none.boxes.empty()) << "shares that have no room are left out";
}

TEST(DegreeSlice, hasTheColorsOfItsCells) {
  const Field field = planeField();
  FakeRenderer renderer(field);
  for (int samples : {1, 3}) {
    const SlicePicture picture = slice(ColorBy::degree, 640, 360, samples);
    const Image image = draw(renderer, field, picture);
    EXPECT_EQ(image.width, 640);
    EXPECT_EQ(image.height, 360);
    EXPECT_EQ(colorAt(image, field, picture, {-0.5, 0.5, 0.5}), levelColor(2));
    EXPECT_EQ(colorAt(image, field, picture, {0.6, -0.5, 0.5}), levelColor(3));
    EXPECT_EQ(colorAt(image, field, picture, {0.75, 0.75, 0.5}), levelColor(5));
    EXPECT_GT(lightnessOf(colorAt(image, field, picture, {kPlane, -0.6, 0.5})), 0.9) << "no line where the surface is";
    EXPECT_EQ(image.at(3, 3), paperColor()) << "outside of the domain";
  }
}

TEST(DepthSlice, showsDepths) {
  const Field field = planeField();
  FakeRenderer renderer(field);
  const SlicePicture picture = slice(ColorBy::depth);
  const Image image = draw(renderer, field, picture);
  EXPECT_EQ(colorAt(image, field, picture, {-0.5, 0.5, 0.5}), levelColor(0));
  EXPECT_EQ(colorAt(image, field, picture, {0.75, 0.75, 0.5}), levelColor(1));
}

TEST(DistancePicture, isBlueInsideRedOutsideAndDarkAtZero) {
  const Field field = planeField();
  FakeRenderer renderer(field);
  const SlicePicture picture = slice(ColorBy::distance);
  const Image image = draw(renderer, field, picture);
  EXPECT_LT(toOklab(decodeSrgb(colorAt(image, field, picture, {-0.77, 0.3, 0.5}))).b, -0.05);
  EXPECT_GT(toOklab(decodeSrgb(colorAt(image, field, picture, {0.77, 0.3, 0.5}))).a, 0.05);
  EXPECT_LT(lightnessOf(colorAt(image, field, picture, {kPlane, 0.3, 0.5})), 0.3);
  EXPECT_EQ(image.at(3, 3), paperColor());
}

TEST(SurfacePicture, showsTheSurfaceBeforeItsBackdrop) {
  const Field field = planeField();
  FakeRenderer renderer(field);
  SurfacePicture picture;
  picture.width = 640;
  picture.height = 360;
  std::set<std::vector<Color>> pictures;
  for (ColorBy color : {ColorBy::normal, ColorBy::degree, ColorBy::depth}) {
    picture.color = color;
    const Image image = draw(renderer, field, picture);
    const ViewSize size = viewSize(640, 360);
    EXPECT_EQ(image.at(100, 20), encodeSrgb(backdropColor(20.5 / size.height)));
    EXPECT_LT(lightnessOf(image.at(100, 250)), lightnessOf(image.at(100, 20)) - 0.03);
    pictures.insert(image.pixels);
  }
  EXPECT_EQ(pictures.size(), 3U);
}

TEST(SurfacePicture, marksCracksOnRequest) {
  const Field field = planeField();
  FakeRenderer renderer(field);
  for (const int samples : {1, 2}) {
    SurfacePicture picture{.camera = {}, .width = 320, .height = 240, .samples = samples};
    const ViewSize view = viewSize(320, 240);
    const Color unmarked = draw(renderer, field, picture).at(view.width - 1, view.height - 1);
    EXPECT_NE(unmarked, kCrackColor);
    picture.cracks = true;
    const Image marked = draw(renderer, field, picture);
    EXPECT_EQ(marked.at(view.width - 1, view.height - 1), kCrackColor);
    EXPECT_NE(marked.at(view.width - 5, view.height - 5), kCrackColor);
  }
}

TEST(Legend, hasTheLevelsOfTheWholeFieldAndNoOthers) {
  const Field field = planeField({2, 3, 5});
  FakeRenderer renderer(field);
  SlicePicture picture = slice(ColorBy::degree);
  picture.plane = AxisPlane{2, -0.5};  // below the divided cell, so that no leaf of degree 5 is in the section
  const Image image = draw(renderer, field, picture);
  const int panel = viewSize(640, 360).width / 2 + 160;  // columns right of the section, which is square
  for (const int level : {2, 3, 5}) EXPECT_TRUE(holds(image, levelColor(level), panel)) << level;
  EXPECT_FALSE(holds(image, levelColor(4), panel));
}

/// A picture's scale gives the same pixels when it is applied again, and the same colours for another field.
TEST(Scale, ofOnePictureAppliesToAnother) {
  const Field field = planeField({2, 3, 5}), other = planeField({3, 3, 4});
  FakeRenderer renderer(field), otherRenderer(other);
  const DistanceFunction exact{[](const Vector3& x) { return 3 * x.x(); }};
  const ReferenceData reference{.exact = &exact};
  for (const ColorBy color : {ColorBy::degree, ColorBy::depth, ColorBy::distance, ColorBy::error, ColorBy::slope}) {
    SlicePicture picture = slice(color);
    picture.scale.logarithmic = false;
    const Drawn first = drawSlice(renderer, field, picture, reference);
    picture.scale = first.scale;
    EXPECT_EQ(drawSlice(renderer, field, picture, reference).image.pixels, first.image.pixels);
    const Drawn second = drawSlice(otherRenderer, other, picture, reference);
    EXPECT_EQ(second.scale.limits, first.scale.limits);
    EXPECT_EQ(first.scale.limits.has_value(), color == ColorBy::distance || isQuantity(color));
    if (color == ColorBy::degree) {
      EXPECT_EQ(first.scale.levels, (std::vector<int>{2, 3, 5}));
      EXPECT_EQ(second.scale.levels, (std::vector<int>{2, 3, 4, 5})) << "and its own";
    }
  }
  SlicePicture picture = slice(ColorBy::distance);
  picture.scale.limits = {{2, 1}};
  EXPECT_THROW(drawSlice(renderer, field, picture), Error);
  SurfacePicture surface;
  surface.color = ColorBy::degree;
  surface.scale.levels = {4};
  EXPECT_EQ(drawSurface(renderer, field, surface).scale.levels, (std::vector<int>{2, 3, 4, 5}));
}

TEST(Legend, namesEachLevelAndItsShare) {
  const std::map<int, double> shares = {{2, 0.14}, {3, 0.6396}, {5, 0.22}, {12, 0.0004}};
  Overlay overlay;
  static const std::string titles[] = {"polynomial degree", "degree"};
  addLevelLegend(overlay, frame(1280, 720), titles, shares);
  std::vector<std::string> texts;
  for (const TextItem& item : overlay.texts) texts.push_back(item.text);
  EXPECT_EQ(texts, (std::vector<std::string>{"polynomial degree", "share of the volume", "12", "<0.1 %", "5", "22.0 %",
                                             "3", "64.0 %", "2", "14.0 %"}));
}

TEST(Legend, namesExactLeaves) {
  const std::map<int, double> shares = {{2, 0.75}, {kExactDegree, 0.25}};
  static const std::string titles[] = {"polynomial degree", "degree"};
  for (const int width : {640, 1280}) {
    Overlay overlay;
    addLevelLegend(overlay, frame(width, width * 9 / 16), titles, shares);
    const auto text = std::ranges::find(overlay.texts, "exact", &TextItem::text);
    ASSERT_NE(text, overlay.texts.end()) << width;
    const auto under = std::ranges::find_if(overlay.boxes, [&](const BoxItem& box) {
      return box.color == levelColor(kExactDegree) && box.y0 <= text->baseline && text->baseline <= box.y1;
    });
    ASSERT_NE(under, overlay.boxes.end()) << width;
    EXPECT_GE(text->x, under->x0);
    EXPECT_LE(text->x + advanceOf(text->text, text->size), under->x1);
  }
  EXPECT_EQ(describeLevels(shares), "2, exact");
  EXPECT_EQ(describeLevels({{2, 0.5}, {4, 0.25}, {kExactDegree, 0.25}}), "2–4, exact");
  EXPECT_EQ(describeLevels({{kExactDegree, 1}}), "exact");
}

TEST(Picture, tellsWhatErrorWasAskedFor) {
  FieldData data;
  data.domain = Box(Vector3::Constant(-1), Vector3::Constant(1));
  data.nodes = {node::leaf(0, 0)};
  data.coefficients = std::vector<double>{1};
  data.metadata.settings.targetError = 2e-6;
  EXPECT_EQ(describeTarget(Field(data)), "τ = 2e-6");
  data.metadata.settings.tolerance = 0.25;
  EXPECT_EQ(describeTarget(Field(data)), "tolerance 0.25");
}

TEST(Picture, differsForAnotherField) {
  const Field right = planeField({2, 3, 5}), wrong = planeField({3, 2, 5});
  FakeRenderer ofRight(right), ofWrong(wrong);
  const Image expected = draw(ofRight, right, slice(ColorBy::degree));
  const Image actual = draw(ofWrong, wrong, slice(ColorBy::degree));
  int different = 0;
  for (std::size_t i = 0; i < expected.pixels.size(); ++i) different += expected.pixels[i] != actual.pixels[i];
  EXPECT_GT(different, 40000);
  EXPECT_EQ(draw(ofRight, right, slice(ColorBy::degree)).pixels, expected.pixels);
}

TEST(Picture, keepsItsAverageColorWithMoreSamples) {
  const Field field = planeField();
  FakeRenderer renderer(field);
  for (ColorBy color : {ColorBy::degree, ColorBy::distance}) {
    const auto meanOf = [&](int samples) {
      const Image image = draw(renderer, field, slice(color, 320, 240, samples));
      LinearColor sum = LinearColor::Zero();
      for (const Color& pixel : image.pixels) sum += decodeSrgb(pixel);
      return toOklab(sum / float(image.pixels.size()));
    };
    EXPECT_LT(colorDifference(meanOf(1), meanOf(4)), 0.004);
  }
}

TEST(Picture, asksTheRendererForTheViewAlone) {
  const Field field = planeField(), other = planeField({7, 8, 9}, "a very long name of a field");
  for (const auto& [width, height] : {std::pair{64, 64}, {320, 240}, {640, 360}, {1280, 720}}) {
    const ViewSize size = viewSize(width, height);
    for (const Field* f : {&field, &other})
      for (ColorBy color : {ColorBy::degree, ColorBy::distance}) {
        FakeRenderer renderer(*f);
        draw(renderer, *f, slice(color, width, height, 2));
        EXPECT_EQ(renderer.lastWidth, 2 * size.width);
        EXPECT_EQ(renderer.lastHeight, 2 * size.height);
      }
    const SliceView view = sliceView(field, slice(ColorBy::degree, width, height));
    EXPECT_NEAR(view.right.norm() / size.width, view.up.norm() / size.height, 1e-12) << "pixels are not square";
  }
}

TEST(BarePicture, isTheViewAloneAndKeepsItsLegendAsData) {
  const Field field = planeField();
  FakeRenderer renderer(field);
  SlicePicture picture{AxisPlane{2, 0.5}, ColorBy::degree, 320, 240};
  picture.bare = true;
  const Drawn drawn = drawSlice(renderer, field, picture);
  EXPECT_EQ(drawn.buffers.width, 320);
  EXPECT_EQ(drawn.buffers.height, 240);
  ASSERT_EQ(drawn.legend.levels.size(), 3u);
  EXPECT_EQ(drawn.legend.levels[2].level, 5);
  EXPECT_DOUBLE_EQ(drawn.legend.levels[2].share, 0.125);
  EXPECT_TRUE(drawn.legend.bar.empty());
  const Color middle = drawn.image.at(100, 60);  // in a cell of degree 2, away from lines
  EXPECT_EQ(middle, drawn.legend.levels[0].color);

  picture.color = ColorBy::slope;
  picture.scale = {.limits = std::array{1e-3, 1.0}};
  const Legend bar = drawSlice(renderer, field, picture).legend;
  ASSERT_EQ(bar.bar.size(), 256u);
  ASSERT_EQ(bar.marks.size(), 4u);
  EXPECT_EQ(bar.marks.front().text, "0.001");
  EXPECT_NEAR(bar.marks[1].t, 1 / 3.0, 1e-12);
}

TEST(Caption, ofTheCallerReplacesTheFactsAboutTheField) {
  const Field field = planeField();
  FakeRenderer renderer(field);
  SurfacePicture picture{.camera = {}, .width = 400, .height = 240};
  const Drawn plain = drawSurface(renderer, field, picture);
  EXPECT_EQ(render::viewSize(picture).width, plain.buffers.width);
  picture.caption = Caption{"a scene", {"t = 1 s"}};
  const Drawn drawn = drawSurface(renderer, field, picture);
  EXPECT_EQ(drawn.details, std::vector<std::string>{"t = 1 s"});
  EXPECT_EQ(drawn.buffers.width, 400) << "no legend: the view has its room";
  EXPECT_EQ(drawn.buffers.height, plain.buffers.height);
  EXPECT_EQ(render::viewSize(picture).width, 400);
  picture.caption->details = {"t = 2 s"};
  EXPECT_NE(drawSurface(renderer, field, picture).image.pixels, drawn.image.pixels);
  picture.color = ColorBy::degree;
  EXPECT_EQ(drawSurface(renderer, field, picture).buffers.width, plain.buffers.width) << "its colours have a legend";
  picture.bare = true;
  EXPECT_EQ(render::viewSize(picture).height, 240);
}

TEST(Slice, isZoomedAboutItsTargetWithinItsPlane) {
  const Field field = planeField();
  SlicePicture picture{AxisPlane{2, 0.5}, ColorBy::degree, 320, 240};
  const SliceView whole = sliceView(field, picture);
  picture.zoom = 4;
  picture.target = Vector3(0.25, -0.5, 0.875);
  const SliceView close = sliceView(field, picture);
  EXPECT_EQ(close.right, whole.right / 4);
  EXPECT_EQ(close.up, whole.up / 4);
  EXPECT_EQ(close.origin, Vector3(0.25, -0.5, 0.5));
  picture.zoom = 0;
  EXPECT_THROW(sliceView(field, picture), Error);
  picture.zoom = 1;
  picture.target = Vector3(0, std::nan(""), 0);
  EXPECT_THROW(sliceView(field, picture), Error);
}

TEST(Picture, rejectsSizesOutOfRangeBeforeItDraws) {
  const Field field = planeField();
  FakeRenderer renderer(field);
  struct Case {
    int width, height, samples;
    const char* says;
  };
  for (const Case& bad : {Case{15, 100, 1, "15x100"},
                          {100, 16385, 1, "100x16385"},
                          {-5, 100, 1, "-5x100"},
                          {100, 100, 0, "samples = 0"},
                          {100, 100, 9, "samples = 9"},
                          {16384, 16384, 1, "16384x16384"},
                          {4096, 4096, 8, "8x8"}}) {
    SurfacePicture surface;
    surface.width = bad.width;
    surface.height = bad.height;
    surface.samples = bad.samples;
    for (const std::string& message :
         {messageOf([&] { draw(renderer, field, slice(ColorBy::degree, bad.width, bad.height, bad.samples)); }),
          messageOf([&] { draw(renderer, field, surface); })})
      EXPECT_NE(message.find(bad.says), std::string::npos) << message;
  }
  EXPECT_EQ(renderer.calls, 0);
}

TEST(Picture, showsQuantitiesInTheColorsOfTheirScale) {
  const Field field = planeField({2, 3, 5});
  FakeRenderer renderer(field);
  const Jumps jumps = findJumps(field);
  const std::vector<double> ofCells = worstJumpOfCells(field, jumps, JumpKind::gradient);
  const DistanceFunction exact([](const Vector3& x) { return x.x() - 0.2; });
  SlicePicture picture = slice(ColorBy::error);
  picture.scale = {.limits = {{1e-3, 10}}, .logarithmic = true};
  const ColorScale scale(1e-3, 10, true);
  const Image image = draw(renderer, field, picture, {nullptr, &exact});
  for (const Vector3& point : {Vector3(-0.63, 0.31, 0.5), Vector3(0.57, -0.41, 0.5)}) {
    const double error = std::abs(field.value(point) - (point.x() - 0.2));
    const Color expected = encodeSrgb(scale(error)), shown = colorAt(image, field, picture, point);
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(shown[i], expected[i], 3);
  }
  picture.scale.limits = {{1e-4, 1}};
  EXPECT_NE(draw(renderer, field, picture, {nullptr, &exact}).pixels, image.pixels) << "another scale, other colours";

  picture = slice(ColorBy::gradientJump);
  picture.scale = {.limits = {{0, 5}}, .logarithmic = false};
  const Image ofJumps = draw(renderer, field, picture, {&jumps, nullptr});
  const Vector3 point(-0.63, 0.31, 0.5);
  EXPECT_EQ(colorAt(ofJumps, field, picture, point),
            encodeSrgb(ColorScale(0, 5, false)(float(ofCells[field.cellAt(point).id]))));
}

TEST(Picture, rejectsColorsWithoutReferenceDataOrOnTheWrongView) {
  const Field field = planeField({2, 3, 5});
  FakeRenderer renderer(field);
  const auto refusal = [&](const auto& picture) { return messageOf([&] { draw(renderer, field, picture); }); };
  EXPECT_THAT(refusal(slice(ColorBy::valueJump)), testing::HasSubstr("jumps"));
  EXPECT_THAT(refusal(slice(ColorBy::error)), testing::HasSubstr("exact"));
  EXPECT_THAT(refusal(slice(ColorBy::normal)), testing::HasSubstr("slice"));
  SurfacePicture surface;
  surface.color = ColorBy::distance;
  EXPECT_THAT(refusal(surface), testing::HasSubstr("surface"));
  for (const std::array<double, 2> limits : {std::array{1.0, 1.0}, std::array{2.0, 1.0}, std::array{0.0, 1.0}}) {
    SlicePicture picture = slice(ColorBy::slope);
    picture.scale.limits = limits;
    EXPECT_THAT(refusal(picture), testing::HasSubstr("range"));
  }
}

TEST(Picture, isDrawnInEverySize) {
  const Field field = planeField({2, 3, 5}, "a name · with ünicode that is far too long for any caption strip.obj");
  FakeRenderer renderer(field);
  for (const auto& [width, height] : {std::pair{16, 16},
                                      {64, 64},
                                      {64, 700},
                                      {700, 64},
                                      {161, 141},
                                      {240, 140},
                                      {320, 240},
                                      {300, 1000},
                                      {1023, 517},
                                      {4096, 2160}}) {
    for (ColorBy color : {ColorBy::degree, ColorBy::depth, ColorBy::distance, ColorBy::slope, ColorBy::cellError})
      EXPECT_EQ(draw(renderer, field, slice(color, width, height)).pixels.size(), std::size_t(width) * height);
    SurfacePicture picture;
    picture.width = width;
    picture.height = height;
    EXPECT_EQ(draw(renderer, field, picture).height, height);
  }
}

TEST(Layout, clipsAndOverlapsNothingAtAnySize) {
  static const std::string titles[] = {"polynomial degree", "degree"};
  const std::string longName(300, 'W');
  const std::vector<std::string> details = {"distance",
                                            "slice through (0.1235, −0.5, 1e-7) with normal (0.577, 0.577, 0.577)",
                                            "−0.4287 to 1.108", "1,234,567 cells", "τ = 1e-6"};
  const std::vector<std::pair<std::string, std::string>> facts = {
      {"cells", "1,234,567"}, {"degrees", "2–30"}, {"coefficients", "1,123,456,789"}, {"RMS estimate", "3.05e-4"}};
  for (const auto& [width, height] : {std::pair{64, 64},
                                      {160, 140},
                                      {200, 140},
                                      {200, 1000},
                                      {240, 140},
                                      {240, 2000},
                                      {320, 240},
                                      {400, 150},
                                      {640, 360},
                                      {800, 600},
                                      {783, 441},
                                      {1280, 720},
                                      {1920, 1080},
                                      {2000, 200},
                                      {4096, 2160},
                                      {16384, 4096}}) {
    const Frame f = frame(width, height);
    const std::string size = std::to_string(width) + "x" + std::to_string(height);
    EXPECT_EQ(f.view.width() + f.panel.width(), width);
    EXPECT_EQ(f.view.height() + f.caption.height(), height);
    EXPECT_GE(f.view.width(), width / 2);
    for (int count : {1, 2, 5, 10, 21, 31}) {
      std::map<int, double> shares;
      for (int level = 0; level < count; ++level) shares[level] = 1.0 / count;
      Overlay overlay;
      addLevelLegend(overlay, f, titles, shares);
      const auto swatches = overlay.boxes.size();
      EXPECT_GE(swatches, f.panel.empty() ? 0U : std::size_t(count)) << size;
      addCaption(overlay, f, count % 2 ? longName : "bunny.obj", details);
      expectTidy(overlay, f, size + ", " + std::to_string(count) + " levels");
    }
    for (double high : {1e-7, 3e-4, 0.0123, 1.108, 88.0, 3.7e5, 2e9})
      for (double ratio : {1e-6, 0.02, 0.7})
        for (bool logarithmic : {false, true}) {
          Overlay overlay;
          addScaleBar(overlay, f, titles, ColorScale(ratio * high, high, logarithmic));
          expectTidy(overlay, f, size + ", scale up to " + std::to_string(high));
          if (f.panel.empty() || f.panel.height() < 100) continue;
          EXPECT_GE(overlay.texts.size(), 3U) << size << ": hardly a number beside the scale up to " << high;
        }
    for (double range : {1e-7, 3e-4, 0.0123, 1.108, 88.0, 3.7e5, 2e9}) {
      Overlay overlay;
      addDistanceBar(overlay, f, distanceScale(-0.3 * range, range), kDistanceMap);
      expectTidy(overlay, f, size + ", range " + std::to_string(range));
      if (f.panel.empty() || f.panel.height() < 100) continue;
      EXPECT_GE(overlay.texts.size(), 4U) << size << ": hardly a number beside the bar for range " << range;
      for (const TextItem& item : overlay.texts) EXPECT_EQ(item.text.find("…"), std::string::npos) << item.text;
    }
    // The slice shows a small area far from the surface, so that the bar's range contains very many iso-lines.
    for (const double spread : {7e-2, 7e-3, 7e-5, 1e-16}) {
      Overlay overlay;
      addDistanceBar(overlay, f, distanceScale(0.4648, 0.4648 + spread), kDistanceMap);
      expectTidy(overlay, f, size + ", spread " + std::to_string(spread));
      EXPECT_LT(overlay.boxes.size(), std::size_t(3 * f.height)) << size << ": all lines drawn";
    }
    Overlay overlay;
    addFacts(overlay, f, titles, facts);
    addCaption(overlay, f, "", {});
    expectTidy(overlay, f, size + ", facts");
  }
}

TEST(Layout, hasLegendAndCaptionAt320x240) {
  const Frame f = frame(320, 240);
  EXPECT_FALSE(f.panel.empty());
  EXPECT_FALSE(f.caption.empty());
  EXPECT_TRUE(frame(64, 64).panel.empty());
  EXPECT_EQ(frame(64, 64).view, (PixelRect{0, 0, 64, 64}));
}

TEST(Layout, keepsTheLegendInNarrowPictures) {
  EXPECT_FALSE(frame(200, 1000).panel.empty());
  EXPECT_TRUE(frame(199, 1000).panel.empty());
}

constexpr Color kBlank = {250, 250, 248};

Image painted(const Overlay& overlay, const Frame& f) {
  Image image(f.width, f.height, kBlank);
  paint(image, overlay);
  return image;
}

std::optional<double> numberOf(std::string text) {
  const std::string minus = "−";
  if (text.starts_with(minus)) text = "-" + text.substr(minus.size());
  std::size_t end = 0;
  try {
    const double number = std::stod(text, &end);
    if (end == text.size()) return number;
  } catch (const std::exception&) {
  }
  return std::nullopt;
}

double middleOf(const TextItem& item) { return item.baseline - capHeight(item.size) / 2; }

TEST(LevelLegend, hasEachNumberAtItsColor) {
  static const std::string titles[] = {"polynomial degree", "degree"};
  // At 320 × 240, 31 levels leave no room to print their shares, and the legend's colour swatches touch.
  for (const auto& [width, height, count] :
       {std::tuple(1280, 720, 5), {1280, 720, 31}, {320, 240, 5}, {320, 240, 31}, {200, 1000, 9}}) {
    const Frame f = frame(width, height);
    std::map<int, double> shares;
    for (int level = 0; level < count; ++level) shares[level] = 1.0 / count;
    Overlay overlay;
    addLevelLegend(overlay, f, titles, shares);
    const Image image = painted(overlay, f);
    const int swatch = static_cast<int>(overlay.boxes.front().x0) + 1;
    std::set<int> seen;
    for (const TextItem& item : overlay.texts) {
      const auto level = numberOf(item.text);
      if (!level) continue;
      EXPECT_EQ(image.at(swatch, int(middleOf(item))), levelColor(int(*level))) << item.text << " of " << count;
      seen.insert(int(*level));
    }
    EXPECT_GE(seen.size(), std::min<std::size_t>(count, 8)) << width << "x" << height;
    EXPECT_LE(seen.size(), std::size_t(count));
  }
}

TEST(DistanceBar, hasEachNumberAtItsColor) {
  for (const auto& [width, height] : {std::pair{1280, 720}, {320, 240}, {200, 1000}})
    for (const DistanceScale& scale : {distanceScale(-0.4, 1.1), distanceScale(-3e4, 1e3), distanceScale(1e-6, 2e-5),
                                       distanceScale(0.4648, 0.4715)}) {
      const Frame f = frame(width, height);
      Overlay overlay;
      addDistanceBar(overlay, f, scale, kDistanceMap);
      const Image image = painted(overlay, f);
      std::vector<std::pair<double, double>> labels;  // pairs of value and row
      for (const TextItem& item : overlay.texts)
        if (const auto value = numberOf(item.text)) labels.emplace_back(*value, middleOf(item));
      ASSERT_GE(labels.size(), 3U);
      std::ranges::sort(labels);
      const auto [lowest, bottom] = labels.front();
      const auto [highest, top] = labels.back();
      EXPECT_GT(bottom, top) << "outside is above";
      const int bar = static_cast<int>(overlay.boxes.front().x0) + 2;
      for (const auto& [value, row] : labels)
        for (int beside : {-3, 3}) {  // the label's own row is hidden by a line
          const int y = static_cast<int>(std::floor(row)) + beside;
          const double here = value - (y + 0.5 - row) * (highest - lowest) / (bottom - top);
          if (std::abs(here) >= scale.range) continue;
          const LinearColor expected = kDistanceMap.at(0.5 + 0.5 * here / scale.range);
          EXPECT_LT(colorDifference(toOklab(decodeSrgb(image.at(bar, y))), toOklab(expected)), 0.03)
              << value << " at " << width << "x" << height;
        }
    }
}

TEST(Axes, areBesideTheSectionOrOnAPlate) {
  for (const auto& [width, height] : {std::pair{480, 270}, {640, 360}, {1280, 720}, {4096, 2160}, {300, 1000}}) {
    const Frame f = frame(width, height);
    const int w = f.view.width(), h = f.view.height(), side = static_cast<int>(0.94 * std::min(w, h));
    const PixelRect middle = {(w - side) / 2, (h - side) / 2, (w + side) / 2, (h + side) / 2};
    const PixelRect band = {0, h / 4, w, 3 * h / 4};  // a zoomed section
    const PixelRect flat = {w / 40, h / 4, w - w / 40, 3 * h / 4}, full = {w / 40, h / 40, w - w / 40, h - h / 40};
    for (const PixelRect& section : {middle, band, flat, full, f.view}) {
      Overlay overlay;
      addAxes(overlay, f, section, 'x', 'z');
      ASSERT_EQ(overlay.texts.size(), 2U) << width << "x" << height;
      const bool plate = overlay.boxes.front().color == kBlank;
      EXPECT_EQ(plate, section == full || section == f.view) << width << "x" << height;
      const BoxItem& ground = overlay.boxes.front();
      for (const TextItem& item : overlay.texts) {
        const PixelRect ink = measureText(item.text, item.size, item.x, item.baseline).ink;
        EXPECT_TRUE(f.view.contains(ink));
        EXPECT_GE(item.size, 7.9);
        EXPECT_GT(lightnessOf(kBlank) - lightnessOf(item.color), 0.4) << "hard to read";
        if (plate)
          EXPECT_TRUE(ink.x0 >= ground.x0 && ink.x1 <= ground.x1 && ink.y0 >= ground.y0 && ink.y1 <= ground.y1);
        else
          EXPECT_FALSE(section.overlaps(ink)) << "covers the slice";
      }
      for (const BoxItem& box : overlay.boxes) {
        EXPECT_TRUE(box.x0 >= 0 && box.y0 >= 0 && box.x1 <= w && box.y1 <= h);
        const PixelRect pixels = {int(box.x0), int(box.y0), int(std::ceil(box.x1)), int(std::ceil(box.y1))};
        EXPECT_TRUE(plate || !section.overlaps(pixels)) << "covers the slice";
      }
      const TextItem &right = overlay.texts[0], &up = overlay.texts[1];
      EXPECT_EQ(right.text, "x");
      EXPECT_EQ(up.text, "z");
      EXPECT_GT(right.x, up.x + up.size);
      EXPECT_GT(right.baseline, up.baseline + up.size);
    }
  }
  Overlay none;
  addAxes(none, frame(64, 64), {2, 2, 62, 62}, 'x', 'y');
  EXPECT_TRUE(none.boxes.empty() && none.texts.empty());
}

TEST(Slice, namesItsAxesWhereItsPlaneIsAcrossOne) {
  const Field field = planeField();
  FakeRenderer renderer(field);
  const char* const names[] = {"yz", "xz", "xy"};
  const auto leftOf = [](const Image& image, int column) {
    std::vector<Color> pixels;
    for (int y = 0; y < viewSize(640, 360).height; ++y)
      for (int x = 0; x < column; ++x) pixels.push_back(image.at(x, y));
    return pixels;
  };
  const Frame f = frame(640, 360);
  const auto expectAxes = [&](const SlicePicture& picture, const char* axes) {
    const ViewBuffers buffers =
        renderer.slice(sliceView(field, picture), viewSize(640, 360).width, viewSize(640, 360).height);
    PixelRect section = {buffers.width, buffers.height, 0, 0};
    for (int y = 0; y < buffers.height; ++y)
      for (int x = 0; x < buffers.width; ++x)
        if (buffers.hit(std::size_t(y) * buffers.width + x))
          section = {std::min(section.x0, x), std::min(section.y0, y), std::max(section.x1, x + 1), y + 1};
    Overlay overlay;
    if (axes != nullptr) addAxes(overlay, f, section, axes[0], axes[1]);
    EXPECT_EQ(leftOf(draw(renderer, field, picture), section.x0), leftOf(painted(overlay, f), section.x0))
        << (axes == nullptr ? "none" : axes);
  };
  for (int axis = 0; axis < 3; ++axis) {
    SlicePicture picture = slice(ColorBy::degree);
    picture.plane = AxisPlane{axis, 0.5};
    expectAxes(picture, names[axis]);
    picture.color = ColorBy::distance;
    picture.plane = FreePlane{Vector3(0.1, 0.2, 0.3), Vector3::Unit(axis)};
    expectAxes(picture, names[axis]);
  }
  SlicePicture oblique = slice(ColorBy::degree);
  oblique.plane = FreePlane{Vector3::Zero(), Vector3(1, 1, 1)};
  expectAxes(oblique, nullptr);
}

// Returns the field |x − center|² − radius² in [−1, 1]³.
Field ball(double radius, const Vector3& center = Vector3::Zero()) {
  std::vector<double> c(10, 0.0);
  c[0] = 1 + center.squaredNorm() - radius * radius;
  c[1] = -2 * center.z();
  c[3] = -2 * center.y();
  c[6] = -2 * center.x();
  c[2] = c[5] = c[9] = 2.0 / 3;
  return Field({.domain = Box(-Vector3::Ones(), Vector3::Ones()),
                .nodes = {node::leaf(2, 0)},
                .coefficients = c,
                .metadata = {}});
}

TEST(DrawnSurface, tellsWhetherThePictureShowsTheField) {
  const Field field = ball(0.8);
  const auto renderer = makeCpuRenderer(field);
  SurfacePicture picture;
  picture.width = picture.height = 64;
  const Drawn drawn = drawSurface(*renderer, field, picture);
  EXPECT_TRUE(drawn.seen);
  EXPECT_EQ(drawn.image.pixels, draw(*renderer, field, picture).pixels);
  picture.offset = 5;
  EXPECT_FALSE(drawSurface(*renderer, field, picture).seen);
  picture.offset = -0.7;
  EXPECT_FALSE(drawSurface(*renderer, field, picture).seen);
}

TEST(MeetsWalls, tellsWhetherTheDomainCutsTheSurface) {
  EXPECT_FALSE(meetsWalls(ball(0.8), 0));
  EXPECT_FALSE(meetsWalls(ball(0.8), 0.35));
  EXPECT_TRUE(meetsWalls(ball(0.8), 0.37)) << "a cap of a tenth of the wall";
  EXPECT_TRUE(meetsWalls(ball(0.8), 2));
  EXPECT_FALSE(meetsWalls(ball(0.8), 2.4)) << "no point of the domain is as far";
  EXPECT_TRUE(meetsWalls(planeField(), 0));
  EXPECT_FALSE(meetsWalls(planeField(), 0.9));
  EXPECT_FALSE(meetsWalls(planeField(), -1.2));
  for (int axis = 0; axis < 3; ++axis)
    for (double toOneWall : {-0.3, 0.3}) EXPECT_TRUE(meetsWalls(ball(0.8, toOneWall * Vector3::Unit(axis)), 0));
}

TEST(Caption, keepsTheDetailsThatFit) {
  const std::vector<std::string> details = {"distance", std::string(200, 'x'), "7 cells"};
  Overlay overlay;
  addCaption(overlay, frame(320, 240), "bunny.obj", details);
  ASSERT_EQ(overlay.texts.size(), 2U);
  EXPECT_EQ(overlay.texts[0].text, "bunny.obj");
  EXPECT_EQ(overlay.texts[1].text, "distance · 7 cells");
}

TEST(Numbers, areFormattedAsReadersExpect) {
  EXPECT_EQ(formatNumber(0), "0");
  EXPECT_EQ(formatNumber(-0.25), "−0.25");
  EXPECT_EQ(formatNumber(1.10849), "1.108");
  EXPECT_EQ(formatNumber(1e-6, 3), "1e-6");
  EXPECT_EQ(formatNumber(-1.5e-7), "−1.5e-7");
  EXPECT_EQ(formatNumber(355), "355");
  EXPECT_EQ(formatNumber(15200), "15200");
  EXPECT_EQ(formatNumber(-15234.6), "−15235");
  EXPECT_EQ(formatNumber(123456), "123456");
  EXPECT_EQ(formatNumber(9999.7), "10000");
  EXPECT_EQ(formatNumber(999999.4), "999999");
  EXPECT_EQ(formatNumber(999999.7), "1e6");
  EXPECT_EQ(formatNumber(1234567), "1.235e6");
  EXPECT_EQ(formatNumber(0.00123449), "0.001234");
  EXPECT_EQ(formatNumber(100.04, 4), "100");
  EXPECT_EQ(formatNumber(2e9), "2e9");
  EXPECT_EQ(formatCount(7), "7");
  EXPECT_EQ(formatCount(54935), "54,935");
  EXPECT_EQ(formatCount(1234567), "1,234,567");
  EXPECT_EQ(formatShare(0.6392), "63.9 %");
  EXPECT_EQ(formatShare(0.0001), "<0.1 %");
  EXPECT_EQ(formatShare(1), "100 %");
}

}  // namespace picture_test
}  // namespace hpsdf::render
