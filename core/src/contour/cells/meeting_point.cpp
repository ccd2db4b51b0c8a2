#include "contour/cells/meeting_point.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace hpsdf::contouring {

Vector3 middleOf(std::span<const TangentPlane> planes) {
  Vector3 sum = Vector3::Zero();
  for (const TangentPlane& plane : planes) sum += plane.point;
  return sum / double(planes.size());
}

Vector3 meetingPointOf(std::span<const TangentPlane> planes, const Vector3& middle) {
  // Directions in which the planes differ less than this hardly determine the point. The number is the square of the
  // sine of half the angle between two planes at a sharp edge, about 8 degrees.
  constexpr double kSharp = 0.005;
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  Vector3 right = Vector3::Zero();
  for (const TangentPlane& plane : planes) {
    squares += plane.normal * plane.normal.transpose();
    right += plane.normal * plane.normal.dot(plane.point - middle);
  }
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
  solver.computeDirect(squares);
  Vector3 step = Vector3::Zero();
  for (int k = 0; k < 3; ++k) {
    const double eigenvalue = solver.eigenvalues()[k];
    const Vector3 direction = solver.eigenvectors().col(k);
    if (eigenvalue > kSharp * double(planes.size())) step += direction * (direction.dot(right) / eigenvalue);
  }
  return middle + step;
}

double greatestDistance(const Vector3& x, std::span<const TangentPlane> planes) {
  double greatest = 0;
  for (const TangentPlane& plane : planes) greatest = std::max(greatest, std::abs(plane.normal.dot(x - plane.point)));
  return greatest;
}

}  // namespace hpsdf::contouring
