#pragma once
// The views that pictures show (a plane through the field, or a camera) and the buffers into which a view is rendered.

#include <cstdint>
#include <optional>
#include <vector>

#include "hpsdf/field.h"
#include "hpsdf/types.h"

namespace hpsdf::render {

/// A rectangle in space that is sampled by pixels. Pixel (x, y) of w × h pixels samples the point origin +
/// right·((x+½)/w − ½) + up·(½ − (y+½)/h).
struct SliceView {
  Vector3 origin;  ///< centre of the rectangle, world units
  Vector3 right;   ///< vector along the whole width, world units
  Vector3 up;      ///< vector along the whole height, upwards, world units
};

/// The point that pixel (x, y) of a view of width × height pixels samples, world units.
Vector3 pixelPoint(const SliceView& view, int x, int y, int width, int height);

/// Returns a view of the plane {x_axis = offset}, framed so that the domain's section fits into width ×
/// height square pixels. The axes x, y, z have the numbers 0, 1, 2. A plane perpendicular to x shows y to
/// the right and z up, one perpendicular to y shows x and z, one perpendicular to z shows x and y. Throws
/// `Error` if the offset is outside of the domain.
SliceView axisSlice(const Box& domain, int axis, double offset, int width, int height);

/// Returns a view of the plane through `point` that is perpendicular to `normal`, framed so that the domain's section
/// fits into the picture. Throws `Error` if the normal is zero or the plane misses the domain.
SliceView planeSlice(const Box& domain, const Vector3& point, const Vector3& normal, int width, int height);

enum class UpAxis : std::uint8_t { y, z };

enum class Projection : std::uint8_t {
  perspective,
  orthographic,  ///< parallel rays, so that sizes do not depend on the distance
};

/// A camera that orbits a target. The target is in the middle of the picture.
struct OrbitCamera {
  double azimuthDegrees = 30;      ///< angle about the up axis; at 0 the camera looks along −z (y up) or +y (z up)
  double elevationDegrees = 20;    ///< angle above the horizon, −90 to 90
  double distance = 1.1;           ///< distance from the eye to the target, in domain diagonals, above 0
  double fieldOfViewDegrees = 35;  ///< angle of view along the shorter side of the picture, above 0 and below 180
  UpAxis up = UpAxis::y;
  std::optional<Vector3> target = {};  ///< world units; unset for the centre of the domain
  Projection projection = Projection::perspective;
};

/// The camera of a view, which defines a ray for each pixel. Let across = right·(2(x+½)/w − 1) + up·(1 −
/// 2(y+½)/h) for pixel (x, y) of w × h pixels. The ray of this pixel
/// * starts at the eye and runs along forward + across in a perspective view,
/// * starts at eye + across and runs along forward in an orthographic view.
struct Camera {
  Vector3 eye;      ///< common start of the rays; orthographic: middle of the plane in which rays start
  Vector3 forward;  ///< unit vector
  Vector3 right;    ///< vector to the right, as long as half the view's width (in perspective, at distance 1)
  Vector3 up;       ///< vector upwards, as long as half the view's height (in perspective, at distance 1)
  Projection projection = Projection::perspective;
};

/// Converts an orbiting camera to a `Camera`, which defines the rays. An orthographic view has the height that a
/// perspective view has at the depth of the target. Orthographic rays start just in front of the domain, whatever the
/// distance of the camera. Lengths along the rays then stay precise, and no ray starts within the domain. Throws
/// `Error` if numbers are out of range.
Camera cameraOf(const OrbitCamera& camera, const Box& domain, int width, int height);

/// The start of the ray of pixel (x, y) of a view of width × height pixels, world units.
Vector3 pixelEye(const Camera& camera, int x, int y, int width, int height);

/// The unit direction of the ray of pixel (x, y) of a view of width × height pixels.
Vector3 pixelRay(const Camera& camera, int x, int y, int width, int height);

/// A point projected to the picture that a camera sees.
struct PicturePoint {
  double x, y;      ///< pixels from the view's upper left corner: the middle of pixel (0, 0) is at (½, ½)
  double depth;     ///< distance from the eye along `forward`; in perspective, x and y are undefined if depth <= 0
  double distance;  ///< length of the ray from its start to the point, world units
};

/// Projects a point to the picture of a camera. This is the inverse of `pixelEye` and `pixelRay`. The
/// camera's forward, right and up vectors must be perpendicular.
PicturePoint project(const Camera& camera, const Vector3& point, int width, int height);

/// Returns the height, in world units, that one pixel covers at the given depth, in a view of `height`
/// pixels.
double pixelSize(const Camera& camera, double depth, int height);

/// The clipping plane {x_axis = offset}. It removes everything on the eye's side of the plane from the
/// picture. The eye of an orthographic view counts as infinitely far away. If the rays of an orthographic
/// view are parallel to the plane, the side on which `Camera::eye` lies is removed.
struct ClipPlane {
  int axis = 2;
  double offset = 0;  ///< world units
};

/// The surface f = offset as a camera sees it. Where a clipping plane cuts the solid open, the camera sees the inside
/// of the surface.
struct SurfaceView {
  Camera camera;
  double offset = 0;  ///< value of f on the surface, world units
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

/// The data of each pixel of a view, in rows from top to bottom; a view is coloured from these buffers alone. For a
/// pixel of a slice outside of the domain, and for a ray that misses the surface, `cell` is kNoCell and the other
/// buffers are 0.
struct ViewBuffers {
  int width = 0;
  int height = 0;
  std::vector<std::uint32_t> cell;  ///< the cell that the pixel shows (`Cell::id`)
  std::vector<std::uint8_t> degree;
  std::vector<std::uint8_t> depth;
  std::vector<float> value;             ///< f at the point of a slice or at the hit of a ray
  std::vector<Eigen::Vector3f> normal;  ///< gradient of f scaled to a unit vector; empty for slices
  std::vector<float> distance;  ///< distance along the ray from its start to the hit, world units; empty for slices
  /// 1 if the pixel's ray meets a crack, else 0. A crack is a place on the face between two cells where f jumps across
  /// the offset. At a crack, `value` is f on the far side of the face. This buffer is empty for slices.
  std::vector<std::uint8_t> crack;
  /// The part of the scene that each pixel shows. This buffer is empty if the scene is a surface alone.
  std::vector<Shown> shown;
  /// The index of the body that each pixel shows, or kNoBody. This buffer is empty for a scene without
  /// bodies. For a pixel that shows a body, the buffers hold the normal and distance of the body; the other
  /// buffers hold the values of a ray that misses the surface.
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

/// Returns the point, in world units, that a pixel shows. The point of a `SurfaceView` is defined only if
/// `buffers.covered` is true for the pixel.
Vector3 pointAt(const SliceView& view, const ViewBuffers& buffers, int x, int y);
Vector3 pointAt(const SurfaceView& view, const ViewBuffers& buffers, int x, int y);

}  // namespace hpsdf::render
