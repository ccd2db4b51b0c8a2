#include "pictures/up_axis.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "pictures/picture_arguments.h"

namespace hpsdf::app {
namespace {

using Point2 = Eigen::Vector2d;

constexpr double kHeight = 0.015;  // height of a base, in diagonals of the surface's box
constexpr double kClearly = 2;     // factor by which one base must be larger than another
constexpr int kSamples = 64;       // samples of a field along each side of a plane

/// Returns the area of the convex hull of the points.
double hullArea(std::vector<Point2> points) {
  std::ranges::sort(points,
                    [](const Point2& a, const Point2& b) { return std::pair(a.x(), a.y()) < std::pair(b.x(), b.y()); });
  const auto cross = [](const Point2& a, const Point2& b) { return a.x() * b.y() - a.y() * b.x(); };
  double area = 0;
  // The lower and the upper chain of the hull: Andrew's monotone chain.
  for (int chain = 0; chain < 2; ++chain) {
    std::vector<Point2> hull;
    for (const Point2& p : points) {
      while (hull.size() > 1 && cross(hull.back() - hull[hull.size() - 2], p - hull.back()) <= 0) hull.pop_back();
      hull.push_back(p);
    }
    for (std::size_t i = 1; i < hull.size(); ++i) area += 0.5 * cross(hull[i - 1], hull[i]);
    std::ranges::reverse(points);
  }
  return area;
}

render::UpAxis upFrom(double baseY, double baseZ) {
  return baseZ > kClearly * baseY ? render::UpAxis::z : render::UpAxis::y;
}

/// Returns the point of a plane perpendicular to `axis` at these coordinates along the two other axes.
Vector3 pointAt(int axis, double height, double u, double v) {
  Vector3 point;
  point[axis] = height;
  point[(axis + 1) % 3] = u;
  point[(axis + 2) % 3] = v;
  return point;
}

/// Returns the area of the base in the lowest plane perpendicular to the axis that the body meets.
double baseArea(const Field& field, const Box& box, int axis) {
  const double step = kHeight * box.diagonal().norm();
  const int first = (axis + 1) % 3, second = (axis + 2) % 3;
  // A sample belongs to the body if the body may lie between it and the next samples, so that thin legs count.
  const double between = 0.5 * std::hypot(box.sizes()[first], box.sizes()[second]) / kSamples;
  std::vector<Vector3> plane(std::size_t{kSamples} * kSamples);
  std::vector<double> values(plane.size());
  for (double height = box.min()[axis] + step; height < box.max()[axis]; height += step) {
    const auto at = [&](int i, int side) { return box.min()[side] + (i + 0.5) / kSamples * box.sizes()[side]; };
    for (int i = 0; i < kSamples; ++i)
      for (int j = 0; j < kSamples; ++j)
        plane[std::size_t(i) * kSamples + j] = pointAt(axis, height, at(i, first), at(j, second));
    field.values(plane, values);
    std::vector<Point2> inside;
    for (std::size_t i = 0; i < plane.size(); ++i)
      if (values[i] < between) inside.emplace_back(plane[i][first], plane[i][second]);
    if (!inside.empty()) return hullArea(std::move(inside));
  }
  return 0;
}

double baseArea(const TriangleMesh& mesh, const Box& box, int axis) {
  const double height = box.min()[axis] + kHeight * box.diagonal().norm();
  std::vector<Point2> base;
  for (const Vector3& vertex : mesh.vertices)
    if (vertex[axis] <= height) base.emplace_back(vertex[(axis + 1) % 3], vertex[(axis + 2) % 3]);
  return hullArea(std::move(base));
}

}  // namespace

render::UpAxis guessedUp(const TriangleMesh& mesh) {
  Box box;
  for (const Vector3& vertex : mesh.vertices) box.extend(vertex);
  return upFrom(baseArea(mesh, box, 1), baseArea(mesh, box, 2));
}

render::UpAxis guessedUp(const Field& field) {
  const Box box = shownBox(field);
  return upFrom(baseArea(field, box, 1), baseArea(field, box, 2));
}

}  // namespace hpsdf::app
