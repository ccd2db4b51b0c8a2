#include "hpsdf/physics/mass.h"

#include <Eigen/Eigenvalues>

#include "hpsdf/error.h"

namespace hpsdf::physics {

MassProperties massProperties(const TriangleMesh& mesh) {
  requireValidIndices(mesh);
  // Integrate the moments relative to a vertex of the mesh, so that a body far from the origin loses no
  // precision.
  const Vector3 base = mesh.vertices.empty() ? Vector3::Zero() : mesh.vertices.front();
  double volume = 0;
  Vector3 first = Vector3::Zero();
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();  // integral of x·xᵀ
  for (const auto& face : mesh.triangles) {
    const Vector3 a = mesh.vertices[face[0]] - base, b = mesh.vertices[face[1]] - base,
                  c = mesh.vertices[face[2]] - base, sum = a + b + c;
    const double part = a.dot(b.cross(c)) / 6;
    volume += part;
    first += part / 4 * sum;
    second += part / 20 * (a * a.transpose() + b * b.transpose() + c * c.transpose() + sum * sum.transpose());
  }
  if (!(volume > 0) || !second.allFinite()) throw Error("a body needs a closed surface around some volume");

  // Diagonalise the covariance of the body about its centre of mass. The eigenvectors are the principal axes
  // of inertia.
  const Vector3 center = first / volume;
  const Eigen::Matrix3d covariance = second / volume - center * center.transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(covariance);
  MassProperties properties{volume, Eigen::Isometry3d::Identity(), Vector3::Zero(), Box()};
  Eigen::Matrix3d rotation = axes.eigenvectors();
  if (rotation.determinant() < 0) rotation.col(2) = -rotation.col(2);
  properties.meshFromInertia.linear() = rotation;
  properties.meshFromInertia.translation() = base + center;
  const Vector3 along = axes.eigenvalues().cwiseMax(0);
  properties.inertia = Vector3::Constant(along.sum()) - along;
  const Eigen::Isometry3d inertiaFromMesh = properties.meshFromInertia.inverse();

  for (const auto& face : mesh.triangles)
    for (const std::uint32_t vertex : face) properties.box.extend(inertiaFromMesh * mesh.vertices[vertex]);
  return properties;
}

}  // namespace hpsdf::physics
