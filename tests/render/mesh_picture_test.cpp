// Tests pictures of meshes, which show the orientation of faces and the places of defects.

#include "hpsdf/render/mesh_picture.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "expect_tidy.h"
#include "hpsdf/build.h"
#include "hpsdf/detail/crossings.h"
#include "hpsdf/error.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/render/picture.h"
#include "picture/defect_marks.h"
#include "support/made_meshes.h"
#include "support/require_gl.h"

namespace hpsdf::render {
namespace mesh_picture_test {

using support::boxOfTwo;
using support::joined;
using support::moved;
using support::openBox;

constexpr int kWidth = 480, kHeight = 300;

MeshDefects defectsOf(const TriangleMesh& mesh) { return findDefects(mesh, findCrossings(mesh)); }

MeshPicture pictureFrom(double azimuth, double elevation) {
  MeshPicture picture{.camera = {.azimuthDegrees = azimuth, .elevationDegrees = elevation, .up = UpAxis::z},
                      .width = kWidth,
                      .height = kHeight};
  return picture;
}

Image drawn(const TriangleMesh& mesh, const MeshPicture& picture) {
  return drawMesh(makeCpuBodyRenderer, mesh, defectsOf(mesh), picture);
}

/// Returns the colour of the pixel that shows a point of the mesh.
Color colorAt(const Image& image, const TriangleMesh& mesh, const MeshPicture& picture, const Vector3& place) {
  const PixelRect view = frame(picture.width, picture.height).view;
  const Camera camera = cameraOf(picture.camera, domainAround(mesh), view.width(), view.height());
  const PicturePoint p = project(camera, place, view.width(), view.height());
  return image.at(int(p.x), int(p.y));
}

int differenceOf(const Color& a, const Color& b) {
  return std::abs(a[0] - b[0]) + std::abs(a[1] - b[1]) + std::abs(a[2] - b[2]);
}

bool isBlue(const Color& color) { return color[2] > color[0] + 20; }
bool isClay(const Color& color) { return color[0] > color[2] + 20 && color[1] > color[2]; }

TEST(MeshPicture, showsTheOrientationOfFaces) {
  const MeshPicture above = pictureFrom(20, 75);
  const TriangleMesh open = openBox();
  EXPECT_TRUE(isBlue(colorAt(drawn(open, above), open, above, {0, 0, -1}))) << "the floor, seen through the hole";
  TriangleMesh wrong = boxOfTwo();
  for (auto& triangle : wrong.triangles)
    if (std::ranges::all_of(triangle, [&](std::uint32_t v) { return wrong.vertices[v].z() > 0; }))
      std::swap(triangle[0], triangle[1]);
  EXPECT_TRUE(isBlue(colorAt(drawn(wrong, above), wrong, above, {0.3, 0, 1})));
  EXPECT_TRUE(isClay(colorAt(drawn(boxOfTwo(), above), boxOfTwo(), above, {0.3, 0, 1})));
}

/// Returns the smallest difference from a colour among the pixels around a point of the mesh.
int nearestTo(const Color& color, const Image& image, const TriangleMesh& mesh, const MeshPicture& picture,
              const Vector3& place) {
  const PixelRect view = frame(picture.width, picture.height).view;
  const Camera camera = cameraOf(picture.camera, domainAround(mesh), view.width(), view.height());
  const PicturePoint p = project(camera, place, view.width(), view.height());
  int least = 1000;
  for (int y = int(p.y) - 1; y <= int(p.y) + 1; ++y)
    for (int x = int(p.x) - 1; x <= int(p.x) + 1; ++x) least = std::min(least, differenceOf(image.at(x, y), color));
  return least;
}

TEST(MeshPicture, drawsEdgesInTheirColor) {
  const TriangleMesh open = openBox();
  const Color yellow = defectColor(DefectKind::boundaryEdge);
  const Vector3 onRim(0, -1, 1);  // a point on the open box's front edge
  const MeshPicture above = pictureFrom(0, 30);
  EXPECT_LT(nearestTo(yellow, drawn(open, above), open, above, onRim), 150);
  EXPECT_GT(nearestTo(yellow, drawn(boxOfTwo(), above), boxOfTwo(), above, onRim), 200);
}

TEST(MeshPicture, dashesHiddenMarksAndKeepsTheirHue) {
  MeshPicture below = pictureFrom(0, -30);
  below.width = 1280;
  below.height = 720;
  const TriangleMesh box = boxOfTwo(), open = openBox();
  TriangleMesh wrong = box;  // will have inconsistent edges where `open` has boundary edges
  for (auto& triangle : wrong.triangles)
    if (std::ranges::all_of(triangle, [&](std::uint32_t v) { return wrong.vertices[v].z() > 0; }))
      std::swap(triangle[0], triangle[1]);
  const Image plain = drawn(box, below), boundary = drawn(open, below), inconsistent = drawn(wrong, below);
  int gaps = 0, dashes = 0;
  constexpr int kPlaces = 200;
  for (int i = 0; i < kPlaces; ++i) {
    const Vector3 behind(1.8 * (i + 0.5) / kPlaces - 0.9, 1, 1);  // hidden by the floor and the front side
    const Color yellow = colorAt(boundary, box, below, behind), green = colorAt(inconsistent, box, below, behind);
    gaps += yellow == colorAt(plain, box, below, behind) && green == yellow;
    dashes += differenceOf(yellow, green) > 150;
  }
  EXPECT_GT(gaps, kPlaces / 3);
  EXPECT_GT(dashes, kPlaces / 3);
}

TEST(MeshPicture, drawsEdgesThatBeginBehindTheEye) {
  const TriangleMesh open = openBox();
  MeshPicture within = pictureFrom(0, 10);
  within.camera.target = Vector3(0.8, 0, 1.1);
  within.camera.distance = 0.05;
  const PixelRect view = frame(kWidth, kHeight).view;
  const Camera camera = cameraOf(within.camera, domainAround(open), view.width(), view.height());
  ASSERT_LT(project(camera, {1, -1, 1}, view.width(), view.height()).depth, 0);
  ASSERT_GT(project(camera, {1, 1, 1}, view.width(), view.height()).depth, 0);
  const Color yellow = defectColor(DefectKind::boundaryEdge);
  for (const double y : {0.3, 0.6, 0.9})
    EXPECT_LT(nearestTo(yellow, drawn(open, within), open, within, {1, y, 1}), 150) << y;
}

TEST(MeshPicture, putsRingsAroundSmallDefects) {
  TriangleMesh mesh = shapes::mesh("builtin:sphere,subdivisions=5");
  const MeshPicture front = pictureFrom(0, 0);
  const auto facing = std::ranges::min_element(mesh.triangles, {}, [&](const auto& t) {
    return mesh.vertices[t[0]].y() + std::abs(mesh.vertices[t[0]].x() - 0.2);
  });
  const Vector3 place = mesh.vertices[(*facing)[0]];
  const Image whole = drawn(mesh, front);
  mesh.triangles.erase(facing);
  const Image holed = drawn(mesh, front);
  const PixelRect view = frame(kWidth, kHeight).view;
  const Camera camera = cameraOf(front.camera, domainAround(mesh), view.width(), view.height());
  const PicturePoint p = project(camera, place, view.width(), view.height());
  int changed = 0, farthest = 0;
  for (int y = 0; y < view.y1; ++y)
    for (int x = 0; x < view.x1; ++x)
      if (differenceOf(whole.at(x, y), holed.at(x, y)) > 60) {
        ++changed;
        farthest = std::max(farthest, int(std::hypot(x + 0.5 - p.x, y + 0.5 - p.y)));
      }
  EXPECT_GT(changed, 60) << "a hole of a few pixels is lost";
  EXPECT_LT(farthest, 20);
}

TEST(MeshPicture, showsCrossingFacesInRed) {
  const TriangleMesh mesh = joined(boxOfTwo(), moved(boxOfTwo(), {1, 1, 1}));
  const MeshPicture above = pictureFrom(20, 40);
  const Color meeting = colorAt(drawn(mesh, above), mesh, above, {-0.5, -0.7, 1});
  EXPECT_GT(meeting[0], meeting[1] + 60);
  EXPECT_LT(std::abs(meeting[1] - meeting[2]), 40);
  EXPECT_GT(differenceOf(meeting, {255, 255, 255}), 150) << "the light casings of rings on them do not show";
}

/// Returns the bounding box of the pixels in which two pictures differ.
Eigen::AlignedBox2i differenceBox(const Image& a, const Image& b) {
  Eigen::AlignedBox2i box;
  for (int y = 0; y < a.height; ++y)
    for (int x = 0; x < a.width; ++x)
      if (a.at(x, y) != b.at(x, y)) box.extend(Eigen::Vector2i(x, y));
  return box;
}

TEST(MeshPicture, showsTheWholeMeshForAnyShapeOfMeshAndView) {
  for (const Vector3& sizes : {Vector3(1, 1, 1), Vector3(1, 9, 1), Vector3(9, 1, 1), Vector3(3, 1, 3)})
    for (const auto& [width, height] : {std::pair(480, 300), std::pair(150, 400)})
      for (const Projection projection : {Projection::perspective, Projection::orthographic})
        for (const double elevation : {20.0, 90.0}) {
          TriangleMesh mesh = boxOfTwo();
          for (Vector3& vertex : mesh.vertices) vertex = vertex.cwiseProduct(sizes);
          MeshPicture picture = pictureFrom(30, elevation);
          picture.whole = true;
          picture.width = width;
          picture.height = height;
          picture.camera.projection = projection;
          MeshPicture away = picture;  // looks past the mesh
          away.whole = false;
          away.camera.target = Vector3(1e4, 0, 0);
          const Eigen::AlignedBox2i seen = differenceBox(drawn(mesh, picture), drawn(mesh, away));
          const PixelRect view = frame(width, height).view;
          SCOPED_TRACE(testing::Message() << sizes.transpose() << ", " << width << "x" << height << ", elevation "
                                          << elevation << ", projection " << int(projection));
          EXPECT_GT(seen.min().minCoeff(), 0);
          EXPECT_LT(seen.max().x(), view.x1 - 1);
          EXPECT_LT(seen.max().y(), view.y1 - 1);
          const Eigen::Array2d share = seen.sizes().cast<double>().array() / Eigen::Array2d(view.x1, view.y1);
          EXPECT_GT(share.maxCoeff(), 0.6) << "smaller than need be";
        }
}

/// Makes an OpenGL renderer on the device that the tests draw on.
std::unique_ptr<BodyRenderer> makeGl(std::vector<TriangleMesh> meshes) {
  return makeGlBodyRenderer(std::move(meshes), support::testedGl());
}

std::size_t differentPixels(const Image& a, const Image& b, int limit) {
  std::size_t different = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) different += differenceOf(a.at(x, y), b.at(x, y)) > limit;
  return different;
}

TEST(MeshPicture, isTheSameAtAnySizeAndPlace) {
  HPSDF_REQUIRE_GL();
  const TriangleMesh mesh = joined(openBox(), moved(boxOfTwo(), {1.5, 0, 0}, 0.5));
  for (const Projection projection : {Projection::perspective, Projection::orthographic})
    for (const MakeBodyRenderer& make : {MakeBodyRenderer(makeCpuBodyRenderer), MakeBodyRenderer(makeGl)}) {
      const auto drawnBy = [&](double scale, const Vector3& by) {
        MeshPicture above = pictureFrom(20, 40);
        above.camera.projection = projection;
        above.camera.target = scale * Vector3(0.5, 0, 0) + by;
        const TriangleMesh other = moved(mesh, by, scale);
        return drawMesh(make, other, defectsOf(other), above);
      };
      const Image image = drawnBy(1, {0, 0, 0});
      for (const int exponent : {-148, -100, 60, 126}) {
        const double scale = std::ldexp(1.0, exponent);
        EXPECT_EQ(differentPixels(image, drawnBy(scale, {0, 0, 0}), 0), 0u) << exponent;
      }
      const double far = std::ldexp(1.0, 60);  // the scaled mesh's coordinates are still exact there
      EXPECT_EQ(differentPixels(image, drawnBy(std::ldexp(1.0, 20), {far, -far, far}), 0), 0u);
    }
}

TEST(MeshPicture, isTheSameWithOpenGl) {
  HPSDF_REQUIRE_GL();
  const TriangleMesh mesh = joined(openBox(), moved(boxOfTwo(), {1.5, 0, 0}, 0.5));
  const MeshPicture above = pictureFrom(20, 40);
  const Image cpu = drawn(mesh, above);
  const Image gl = drawMesh(makeGl, mesh, defectsOf(mesh), above);
  EXPECT_LT(differentPixels(cpu, gl, 40), std::size_t(kWidth) * kHeight / 500) << "edges of a pixel, at most";
}

TEST(MeshView, isThatOfTheFieldsSurface) {
  HPSDF_REQUIRE_GL();
  const TriangleMesh mesh = moved(boxOfTwo(), {3, 0, 0}, 0.5);
  const Box domain = domainAround(mesh);
  const Field field =
      build(ExactDistance(mesh), domain, {.targetError = 1e-4, .grid = {4, 4, 4}, .strategy = Strategy::hpx});
  SurfacePicture picture{.camera = pictureFrom(20, 40).camera, .width = kWidth, .height = kHeight, .bare = true};
  picture.shadows = false;  // meshes throw none
  for (const std::optional<Vector3>& target : {std::optional<Vector3>(), std::optional(Vector3(3.2, 0, 0))}) {
    picture.camera.target = target;
    const Image surface = draw(*makeCpuRenderer(field), field, picture);
    for (const MakeBodyRenderer& make : {MakeBodyRenderer(makeCpuBodyRenderer), MakeBodyRenderer(makeGl)}) {
      const DrawView drawView = meshView(make, mesh, domain);
      const Image view = drawView(picture.camera, kWidth, kHeight);
      EXPECT_LT(differentPixels(surface, view, 40), std::size_t(kWidth) * kHeight / 100) << "edges, at most";
      picture.camera.azimuthDegrees += 30;
      EXPECT_GT(differentPixels(surface, drawView(picture.camera, kWidth, kHeight), 40),
                std::size_t(kWidth) * kHeight / 50);
      picture.camera.azimuthDegrees -= 30;
    }
  }
}

TEST(MeshPicture, hasATidyLegendAtAnySize) {
  MeshDefects defects;
  defects.counts = {1234567, 89, 1, 12, 1000000};
  defects.allCrossings = false;
  const std::array<std::string, 2> titles = {"Defects of the mesh", "Defects"};
  for (const auto& [width, height] : {std::pair(200, 140), std::pair(320, 240), std::pair(400, 800),
                                      std::pair(640, 360), std::pair(1280, 720), std::pair(3840, 2160)}) {
    const Frame frame = render::frame(width, height);
    Overlay overlay;
    addSwatches(overlay, frame, titles, defectSwatches(defects));
    expectTidy(overlay, frame, std::to_string(width));
    for (const TextItem& item : overlay.texts) EXPECT_FALSE(item.text.ends_with("…")) << width << ": " << item.text;
    if (width >= 640) {
      EXPECT_EQ(overlay.texts.size(), 11u) << width;
    }
  }
}

TEST(MeshPicture, tellsWhereTheSearchForCrossingsWasCutShort) {
  MeshDefects defects;
  defects.counts = {12, 0, 0, 0, 1234};
  for (const bool all : {true, false}) {
    defects.allCrossings = all;
    const std::vector<Swatch> swatches = defectSwatches(defects);
    const std::vector<Legend::Defects> legend = defectLegend(defects);
    ASSERT_EQ(swatches.size(), 2u);
    ASSERT_EQ(legend.size(), 2u);
    EXPECT_EQ(swatches[0].count, "12");
    EXPECT_EQ(swatches[1].count, all ? "1,234" : "≥1,234");
    EXPECT_EQ(legend[1].count, swatches[1].count);
    EXPECT_EQ(legend[1].name, "pairs of faces that meet");
  }
}

TEST(MeshPicture, rejectsSizesAndTargetsOutOfRange) {
  TriangleMesh mesh = boxOfTwo();
  MeshPicture picture = pictureFrom(0, 0);
  picture.width = 8;
  EXPECT_THROW(drawn(mesh, picture), Error);
  for (Vector3& x : mesh.vertices) x *= 1e-30;
  picture = pictureFrom(0, 0);
  picture.camera.target = Vector3(1e300, 0, 0);
  EXPECT_THAT([&] { drawn(mesh, picture); },
              testing::ThrowsMessage<Error>(testing::HasSubstr("too far from the mesh")));
}

}  // namespace mesh_picture_test
}  // namespace hpsdf::render
