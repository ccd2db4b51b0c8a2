#include "hpsdf/render/mesh_picture.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "coloring/color_view.h"
#include "hpsdf/build.h"
#include "hpsdf/error.h"
#include "picture/defect_marks.h"
#include "picture/legend.h"
#include "scene/body_view.h"
#include "view/view_buffers.h"

namespace hpsdf::render {
namespace {

constexpr double kFarthest = 1e15;    // greatest coordinate of a camera's target, in a unit near the mesh's size
constexpr double kMeshBorder = 0.04;  // free border around a whole mesh, as a share of the view's width and height

/// The kinds of visible faces: front side, back side, or a face that crosses another. The values are indices of
/// materials.
enum Side : std::uint32_t { front, back, crossing };

/// Maps a mesh to coordinates in which it is centred at the origin and its size is from 1 to 2. Without this
/// map, devices that compute with floats would fail: squares overflow for lengths above 1e19 and vanish below
/// 1e-19.
class Normalization {
 public:
  explicit Normalization(const Box& box) : middle_(box.center()) {
    const double size = box.sizes().maxCoeff();
    if (size > 0) unit_ = std::ldexp(1.0, std::ilogb(size));  // division by a power of two is exact
  }

  Vector3 operator()(const Vector3& point) const { return (point - middle_) / unit_; }

  Box operator()(const Box& box) const { return Box((*this)(box.min()), (*this)(box.max())); }

  /// Throws `Error` if the camera's target is too far away.
  OrbitCamera operator()(OrbitCamera camera) const {
    if (!camera.target) return camera;
    camera.target = (*this)(*camera.target);
    if (!(camera.target->cwiseAbs().maxCoeff() <= kFarthest))
      throw Error("the camera's target is too far from the mesh: give a point nearer to it");
    return camera;
  }

  TriangleMesh operator()(TriangleMesh mesh) const {
    for (Vector3& vertex : mesh.vertices) vertex = (*this)(vertex);
    return mesh;
  }

  MeshDefects operator()(MeshDefects defects) const {
    for (Defect& defect : defects.found)
      for (Vector3& end : defect.ends) end = (*this)(end);
    return defects;
  }

 private:
  Vector3 middle_;
  double unit_ = 1;
};

/// Sets the distance of the camera from its target to the least distance at which the view shows all points.
OrbitCamera nearestForWhole(const std::vector<Vector3>& points, OrbitCamera orbit, const Box& domain, int width,
                            int height) {
  OrbitCamera inSpace = orbit;
  inSpace.projection = Projection::perspective;
  const Camera camera = cameraOf(inSpace, domain, width, height);
  const Vector3 target = orbit.target.value_or(domain.center());
  double distance = 0;
  for (const Vector3& point : points) {
    const Vector3 from = point - target;
    const double nearer = orbit.projection == Projection::perspective ? -from.dot(camera.forward) : 0;
    for (const Vector3& half : {camera.right, camera.up})  // half the view's width and height at distance 1
      distance = std::max(distance, nearer + std::abs(from.dot(half)) / half.squaredNorm() / (1 - 2 * kMeshBorder));
  }
  orbit.distance = distance / domain.diagonal().norm();
  return orbit;
}

/// Returns an entry for each triangle of the mesh: 1 if the triangle crosses another triangle, else 0.
std::vector<char> areCrossing(const TriangleMesh& mesh, const MeshDefects& defects) {
  std::vector<char> result(mesh.triangles.size(), 0);
  for (const Defect& defect : defects.ofKind(DefectKind::crossing))
    for (const std::uint32_t face : defect.faces) result[face] = 1;
  return result;
}

/// Sets the material of each pixel by the visible side of the triangle that the pixel shows.
void setSides(const TriangleMesh& mesh, const MeshDefects& defects, const Camera& camera, BodyBuffers& seen) {
  const std::vector<char> crossing = areCrossing(mesh, defects);
  for (int y = 0; y < seen.height; ++y)
    for (int x = 0; x < seen.width; ++x) {
      const std::size_t i = std::size_t(y) * seen.width + x;
      if (!seen.hit(i)) continue;
      const auto& [a, b, c] = mesh.triangles[seen.triangle[i]];
      const Vector3 normal = (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]);
      const bool fromBehind = normal.dot(pixelRay(camera, x, y, seen.width, seen.height)) > 0;
      seen.body[i] = crossing[seen.triangle[i]] ? Side::crossing : fromBehind ? Side::back : Side::front;
    }
}

std::vector<Swatch> swatchesOf(const MeshDefects& defects) {
  std::vector<Swatch> swatches = defectSwatches(defects);
  swatches.push_back({{"faces, seen from outside", "outside"}, "", surfaceColor()});
  swatches.push_back({{"faces, seen from behind", "behind"}, "", kBackColor});
  if (defects.count(DefectKind::crossing) > 0)
    swatches.push_back({{"faces that meet others", "meeting"}, "", defectColor(DefectKind::crossing)});
  return swatches;
}

}  // namespace

Image drawMesh(const MakeBodyRenderer& make, const TriangleMesh& mesh, const MeshDefects& defects,
               const MeshPicture& picture) {
  checkPictureSize(picture.width, picture.height, picture.samples);
  const Frame frame = render::frame(picture.width, picture.height);
  const int width = frame.view.width(), height = frame.view.height(), samples = picture.samples;

  // Normalise the mesh, and place the camera in its normalised coordinates.
  const Body body{.mesh = 0, .worldFromBody = Eigen::Isometry3d::Identity(), .color = surfaceColor()};
  const Normalization normalized(boundingBox(mesh));
  const TriangleMesh normalizedMesh = normalized(mesh);
  const auto renderer = make({normalizedMesh});
  OrbitCamera orbit = normalized(picture.camera);
  const Box box = renderer->bounds({&body, 1}), domain = domainAround(box);
  if (picture.whole) orbit = nearestForWhole(normalizedMesh.vertices, orbit, domain, width, height);
  const Camera camera = startingBefore(box, cameraOf(orbit, domain, width, height));

  // Render the mesh as a body.
  BodyBuffers seen = renderer->view(camera, {&body, 1}, width * samples, height * samples);
  setSides(mesh, defects, camera, seen);
  ViewBuffers buffers = emptyBuffers(seen.width, seen.height, true);
  addBodies(seen, buffers);

  // Colour the view of the mesh in a picture, and mark the mesh's defects.
  Image image = backdropPicture(picture.width, picture.height, height);
  const Sampling sampling{samples, frame.lineWidth(), 1};
  const SurfaceLook look{
      .bodies = {decodeSrgb(surfaceColor()), decodeSrgb(kBackColor), decodeSrgb(defectColor(DefectKind::crossing))},
      .lightTilt = lightTiltOf(orbit.elevationDegrees)};
  pasteView(image, colorSurface(buffers, camera, look, sampling));
  paintDefects(image, camera, buffers, samples, normalized(defects), sampling.lineWidth);

  // Add the legend in the panel and the caption.
  Overlay overlay;
  addSwatches(overlay, frame, kDefectTitles, swatchesOf(defects));
  const std::array<std::string, 3> details = {formatCount(mesh.triangles.size()) + " faces",
                                              formatCount(mesh.vertices.size()) + " vertices",
                                              "camera " + formatNumber(picture.camera.azimuthDegrees) + "°, " +
                                                  formatNumber(picture.camera.elevationDegrees) + "°"};
  addCaption(overlay, frame, mesh.name, details);
  paint(image, overlay);
  return image;
}

DrawView meshView(const MakeBodyRenderer& make, const TriangleMesh& mesh, const Box& domain) {
  const Normalization normalized(domain);
  const std::shared_ptr<BodyRenderer> renderer = make({normalized(mesh)});
  return [normalized, renderer, domain = normalized(domain)](const OrbitCamera& orbit, int width, int height) {
    checkPictureSize(width, height, 1);
    const Body body;
    const Camera camera =
        startingBefore(renderer->bounds({&body, 1}), cameraOf(normalized(orbit), domain, width, height));
    ViewBuffers buffers = emptyBuffers(width, height, true);
    addBodies(renderer->view(camera, {&body, 1}, width, height), buffers);
    const SurfaceLook look{.bodies = {decodeSrgb(surfaceColor())}, .lightTilt = lightTiltOf(orbit.elevationDegrees)};
    return colorSurface(buffers, camera, look, Sampling{});
  };
}

}  // namespace hpsdf::render
