#pragma once
// What to look at: a plane through the field or a camera before its surface. And the data that a look yields.

#include <cstdint>
#include <optional>
#include <vector>

#include "hpsdf/field.h"
#include "hpsdf/types.h"

namespace hpsdf::render {

/// A rectangle in space. Pixel (x, y) of w × h samples the point origin + right·((x+½)/w − ½) + up·(½ − (y+½)/h).
struct SliceView {
  Vector3 origin;  ///< centre of the rectangle, world units
  Vector3 right;   ///< the whole width
  Vector3 up;      ///< the whole height
};

/// The point that pixel (x, y) of a view of width × height samples.
Vector3 pixelPoint(const SliceView& view, int x, int y, int width, int height);

/// The plane {x_axis = offset}, framed so that the domain's section fits into width × height pixels, with square
/// pixels. Axes x, y, z are 0, 1, 2. On screen: x → (right y, up z), y → (x, z), z → (x, y). Throws `Error` for an
/// offset outside of the domain.
SliceView axisSlice(const Box& domain, int axis, double offset, int width, int height);

/// The plane through `point` with `normal`. Throws `Error` for a zero normal or a plane that misses the domain.
SliceView planeSlice(const Box& domain, const Vector3& point, const Vector3& normal, int width, int height);

enum class UpAxis : std::uint8_t { y, z };

enum class Projection : std::uint8_t {
  perspective,
  orthographic,  ///< parallel rays: what is farther away is no smaller
};

/// A camera that orbits the centre of the domain, or another target.
struct OrbitCamera {
  double azimuthDegrees = 30;      ///< about the up axis, 0 looks along −z (y up) or from −y (z up)
  double elevationDegrees = 20;    ///< above the horizon, −90 to 90
  double distance = 1.1;           ///< of the eye from the target, in domain diagonals, > 0
  double fieldOfViewDegrees = 35;  ///< vertical
  UpAxis up = UpAxis::y;
  std::optional<Vector3> target = {};  ///< world units; the domain's centre when not given
  Projection projection = Projection::perspective;
};

/// The rays of a view. With across = right·(2(x+½)/w − 1) + up·(1 − 2(y+½)/h), pixel (x, y) of w × h looks
/// * in perspective from the eye along forward + across,
/// * orthographically from eye + across along forward.
struct Camera {
  Vector3 eye;      ///< orthographic: the middle of the plane where rays start; what lies before it is not seen
  Vector3 forward;  ///< unit
  Vector3 right;    ///< half the width, in perspective at distance 1
  Vector3 up;       ///< half the height, in perspective at distance 1
  Projection projection = Projection::perspective;
};

/// Orthographic: as high at the target as in perspective from `distance`; but rays start just before the domain,
/// whatever the distance, so that they do not start within it and lengths along them stay precise.
/// Throws `Error` for numbers out of range.
Camera cameraOf(const OrbitCamera& camera, const Box& domain, int width, int height);

/// Where the ray of pixel (x, y) of a view of width × height starts, world units.
Vector3 pixelEye(const Camera& camera, int x, int y, int width, int height);

/// The unit direction in which it looks.
Vector3 pixelRay(const Camera& camera, int x, int y, int width, int height);

/// Where a camera sees a point.
struct PicturePoint {
  double x, y;      ///< pixels from the view's upper left corner: the middle of pixel (0, 0) is at (½, ½)
  double depth;     ///< along forward, from the eye; in perspective x and y mean nothing where it is not above 0
  double distance;  ///< from where the ray of that place starts, world units
};

/// What `pixelEye` and `pixelRay` lead to, the other way round. The camera's forward, right and up are at right angles.
PicturePoint project(const Camera& camera, const Vector3& point, int width, int height);

/// Height that a pixel of a view of `height` pixels covers at a depth, world units.
double pixelSize(const Camera& camera, double depth, int height);

/// The plane {x_axis = offset}; the half on the eye's side is left out. Orthographically the eye is infinitely far
/// away, and the side that of the target where one looks along the plane.
struct ClipPlane {
  int axis = 2;
  double offset = 0;  ///< world units
};

/// The zero set, or that of f − offset, as seen by a camera. Where a clipping plane cuts the solid, one looks into it.
struct SurfaceView {
  Camera camera;
  double offset = 0;
  std::optional<ClipPlane> clip = {};
};

constexpr std::uint32_t kNoCell = 0xffffffff;
constexpr std::uint32_t kNoBody = 0xffffffff;

/// What a pixel of a picture with several things in it shows.
enum class Shown : std::uint8_t {
  surface,
  section,  ///< of the solid with the clipping plane
  plane,    ///< of the whole domain
  box,      ///< a cell as a solid
};

/// What the pixels of a view see, rows top to bottom; the colouring reads nothing else. Where a slice leaves the domain
/// or a ray misses, `cell` is kNoCell and the rest 0.
struct ViewBuffers {
  int width = 0;
  int height = 0;
  std::vector<std::uint32_t> cell;  ///< `Cell::id`
  std::vector<std::uint8_t> degree;
  std::vector<std::uint8_t> depth;
  std::vector<float> value;             ///< f at the point; along a ray, at the hit (near the offset)
  std::vector<Eigen::Vector3f> normal;  ///< gradient of f, made a unit vector; not filled for slices
  std::vector<float> distance;          ///< from where the ray starts to the hit, world units; not filled for slices
  /// 1 where the field jumps over the offset at a face between two cells instead of passing it within one: f − offset
  /// is the height of the step on the far side. Not filled for slices.
  std::vector<std::uint8_t> crack;
  /// Filled where a picture has more in it than a surface, else empty.
  std::vector<Shown> shown;
  /// Filled where a picture has bodies in it, else empty: the one that a pixel shows, or kNoBody. A body is no part of
  /// the field: its pixels are no hits, and but for the body's normal and distance all is as where a ray misses.
  std::vector<std::uint32_t> body;

  bool hit(std::size_t pixel) const { return cell[pixel] != kNoCell; }
  bool shows(std::size_t pixel, Shown what) const {
    return hit(pixel) && (shown.empty() ? what == Shown::surface : shown[pixel] == what);
  }
  bool showsBody(std::size_t pixel) const { return !body.empty() && body[pixel] != kNoBody; }
  /// Whether it shows anything but the backdrop.
  bool covered(std::size_t pixel) const { return hit(pixel) || showsBody(pixel); }
};

/// What a pixel of a view's buffers shows, world units; of a surface only where there is a hit.
Vector3 pointAt(const SliceView& view, const ViewBuffers& buffers, int x, int y);
Vector3 pointAt(const SurfaceView& view, const ViewBuffers& buffers, int x, int y);

}  // namespace hpsdf::render
