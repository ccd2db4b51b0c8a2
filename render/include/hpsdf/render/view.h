#pragma once
// The view of a picture (a plane through the field, or a camera) and the buffers that a renderer fills for it.

#include <cstdint>
#include <optional>
#include <vector>

#include "hpsdf/field.h"
#include "hpsdf/types.h"

namespace hpsdf::render {

/// A rectangle in space. Pixel (x, y) of w × h samples the point origin + right·((x+½)/w − ½) + up·(½ − (y+½)/h).
struct SliceView {
  Vector3 origin;  ///< centre of the rectangle, world units
  Vector3 right;   ///< vector along the whole width, world units
  Vector3 up;      ///< vector along the whole height, upwards, world units
};

/// The point that pixel (x, y) of a view of width × height pixels samples, world units.
Vector3 pixelPoint(const SliceView& view, int x, int y, int width, int height);

/// The plane {x_axis = offset}, framed so that the domain's section fits into width × height square pixels. Axes x, y,
/// z are 0, 1, 2. A plane across x shows y to the right and z up; one across y shows x and z, one across z shows x and
/// y. Throws `Error` for an offset outside of the domain.
SliceView axisSlice(const Box& domain, int axis, double offset, int width, int height);

/// The plane through `point` with `normal`, framed like that of `axisSlice`. Throws `Error` for a zero normal or a
/// plane that misses the domain.
SliceView planeSlice(const Box& domain, const Vector3& point, const Vector3& normal, int width, int height);

enum class UpAxis : std::uint8_t { y, z };

enum class Projection : std::uint8_t {
  perspective,
  orthographic,  ///< parallel rays, so that sizes do not depend on the distance
};

/// A camera that orbits a target, which it sees in the middle of the picture.
struct OrbitCamera {
  double azimuthDegrees = 30;      ///< angle about the up axis; at 0 the camera looks along −z (y up) or +y (z up)
  double elevationDegrees = 20;    ///< angle above the horizon, −90 to 90
  double distance = 1.1;           ///< distance from the eye to the target, in domain diagonals, above 0
  double fieldOfViewDegrees = 35;  ///< vertical angle of view, above 0 and below 180
  UpAxis up = UpAxis::y;
  std::optional<Vector3> target = {};  ///< world units; unset for the centre of the domain
  Projection projection = Projection::perspective;
};

/// The rays of a view. With across = right·(2(x+½)/w − 1) + up·(1 − 2(y+½)/h), the ray of pixel (x, y) of w × h
/// * starts in perspective at the eye and runs along forward + across,
/// * starts orthographically at eye + across and runs along forward.
struct Camera {
  Vector3 eye;      ///< common start of the rays; orthographic: middle of the plane in which rays start
  Vector3 forward;  ///< unit vector
  Vector3 right;    ///< vector to the right, half the view's width long, in perspective at distance 1
  Vector3 up;       ///< vector upwards, half the view's height long, in perspective at distance 1
  Projection projection = Projection::perspective;
};

/// The rays of an orbiting camera. An orthographic view is as high as the perspective one is at the target. Its
/// rays start just in front of the domain, whatever the camera's distance, so that none starts within the domain
/// and lengths along them stay precise. Throws `Error` for numbers out of range.
Camera cameraOf(const OrbitCamera& camera, const Box& domain, int width, int height);

/// The start of the ray of pixel (x, y) of a view of width × height pixels, world units.
Vector3 pixelEye(const Camera& camera, int x, int y, int width, int height);

/// The unit direction of the ray of pixel (x, y) of a view of width × height pixels.
Vector3 pixelRay(const Camera& camera, int x, int y, int width, int height);

/// The projection of a point to the picture of a camera.
struct PicturePoint {
  double x, y;   ///< pixels from the view's upper left corner: the middle of pixel (0, 0) is at (½, ½)
  double depth;  ///< distance from the eye along `forward`; x and y are undefined in perspective unless it is above 0
  double distance;  ///< distance of the point from the start of the ray through it, world units
};

/// Projects a point: the inverse of `pixelEye` and `pixelRay`. Requires that the camera's forward, right and up vectors
/// are at right angles.
PicturePoint project(const Camera& camera, const Vector3& point, int width, int height);

/// The height that one pixel of a view of `height` pixels covers at a depth, world units.
double pixelSize(const Camera& camera, double depth, int height);

/// The plane {x_axis = offset} that removes the half on the eye's side from the picture. The eye of an orthographic
/// view counts as infinitely far away; where its rays run along the plane, the side of `Camera::eye` is removed.
struct ClipPlane {
  int axis = 2;
  double offset = 0;  ///< world units
};

/// The surface f = offset as a camera sees it. Where a clipping plane cuts the solid open, the camera sees the inside
/// of the surface.
struct SurfaceView {
  Camera camera;
  double offset = 0;  ///< signed distance, world units
  std::optional<ClipPlane> clip = {};
};

constexpr std::uint32_t kNoCell = 0xffffffff;
constexpr std::uint32_t kNoBody = 0xffffffff;

/// The part of the scene that a pixel shows.
enum class Shown : std::uint8_t {
  surface,
  section,  ///< the section of the solid with the clipping plane
  plane,    ///< the section of the domain with a plane of the picture
  box,      ///< a cell drawn as a solid box
};

/// The data that the pixels of a view see, rows top to bottom; the colouring reads nothing else. A pixel of a slice
/// outside of the domain, or of a ray that misses the surface, has `cell` kNoCell and 0 in the other buffers.
struct ViewBuffers {
  int width = 0;
  int height = 0;
  std::vector<std::uint32_t> cell;  ///< `Cell::id`
  std::vector<std::uint8_t> degree;
  std::vector<std::uint8_t> depth;
  std::vector<float> value;             ///< f at the point of a slice or at the hit of a ray
  std::vector<Eigen::Vector3f> normal;  ///< gradient of f scaled to a unit vector; empty for slices
  std::vector<float> distance;  ///< distance along the ray from its start to the hit, world units; empty for slices
  /// 1 where the field jumps across the offset at a face between two cells, else 0. At a 1, `value` is the value on
  /// the far side of the face, so that f − offset is the part of the jump beyond the offset. Empty for slices.
  std::vector<std::uint8_t> crack;
  /// The part of the scene that each pixel with a cell shows; empty where the scene is a surface alone.
  std::vector<Shown> shown;
  /// The index of the body that each pixel shows, or kNoBody; empty for a scene without bodies. A pixel that shows a
  /// body has the body's normal and distance; the other buffers hold the values of a ray that misses the surface.
  std::vector<std::uint32_t> body;

  /// Returns true if the pixel shows a part of the field.
  bool hit(std::size_t pixel) const { return cell[pixel] != kNoCell; }
  bool shows(std::size_t pixel, Shown what) const {
    return hit(pixel) && (shown.empty() ? what == Shown::surface : shown[pixel] == what);
  }
  bool showsBody(std::size_t pixel) const { return !body.empty() && body[pixel] != kNoBody; }
  /// Returns true if the pixel shows anything but the backdrop.
  bool covered(std::size_t pixel) const { return hit(pixel) || showsBody(pixel); }
};

/// The point that a pixel shows, world units. The point of a `SurfaceView` is defined where the buffers have a hit.
Vector3 pointAt(const SliceView& view, const ViewBuffers& buffers, int x, int y);
Vector3 pointAt(const SurfaceView& view, const ViewBuffers& buffers, int x, int y);

}  // namespace hpsdf::render
