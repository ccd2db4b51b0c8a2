#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "bvh/hierarchy.h"
#include "mesh/connectivity.h"
#include "sign/angle_block.h"

namespace hpsdf::sign {

/// The unbalanced edges of a mesh: boundary edges, and edges along which more triangles run in one direction than in
/// the other. The unbalanced edges determine the gradient of the mesh's winding number and, up to a whole number, the
/// winding number itself.
///
/// A solid angle depends only on the outline of a surface. Therefore the gradient at a point is the magnetic field of a
/// current along the unbalanced edges (Biot and Savart): (1/4π) ∫ s/|s|³ × dl, where s runs from the point to the edge.
/// A closed mesh has no unbalanced edges, and its winding number is constant up to the surface.
///
/// A cluster of edges that is far enough away is replaced by the Taylor series of s/|s|³ about the cluster's center, up
/// to second order. Let R be the distance from the point to the center, r the greatest distance of the cluster's edges
/// from the center, and d the vector from the center to an edge. The truncation error is at most
///
///   B/(4πR⁵) · (4 − 3t)/(1 − t)²  with t = r/R and B = ∫ |d|³ dl.
///
/// This bound is the sum over l ≥ 4 of the bounds l |d|^(l−1)/R^(l+1) that the comment of `WindingNumber` derives.
///
/// Triangle fans that join all unbalanced edges to one common point close the mesh: the winding number of the mesh and
/// the fans together is whole. An estimate of the mesh's winding number with an error below ½ thus tells the exact one.
class BoundaryEdges {
 public:
  BoundaryEdges() = default;
  explicit BoundaryEdges(const bvh::Hierarchy& hierarchy);
  /// Finds the unbalanced edges of the hierarchy's triangles. `sides` are the directed edges of all these triangles, as
  /// `mesh::directedEdgesOf` returns them.
  BoundaryEdges(const bvh::Hierarchy& hierarchy, const std::vector<mesh::DirectedEdge>& sides);

  bool empty() const { return edges_.empty(); }
  std::size_t size() const { return edges_.size(); }

  /// The gradient of the winding number at a point. Lengths are in the hierarchy's local coordinates.
  struct Gradient {
    Vector3 value = Vector3::Zero();
    double error = 0;  ///< bound of the distance between `value` and the exact sum
    /// The sum of these is a bound of the gradient's derivative in any direction. At another point, all distances to
    /// edges and clusters are at least the share s of what they are here, where s is that of `edgeDistance`. The first
    /// grows at most by 1/s³ then, the second by 1/s⁶.
    double derivative = 0, derivativeByMoments = 0;
    double edgeDistance = HUGE_VAL;  ///< lower bound of the distance to the nearest unbalanced edge
    std::size_t terms = 0;           ///< number of edges and clusters that were summed
  };

  /// Returns the gradient of the winding number, summed over clusters of edges that are as coarse as possible for an
  /// error of at most `error`. The sum is exact if `error` is 0.
  Gradient gradient(const Vector3& local, double error) const;

  /// Returns true if there are few enough edges for `exactWinding`.
  bool haveFans() const { return !fans_.empty(); }

  /// Returns the exact winding number of the mesh, to within `WindingNumber::kRounding`, from an estimate whose error
  /// is at most `error`, which must be below ½. Returns std::nullopt where rounding may spoil the result: close to the
  /// lines through the common point and the ends of the edges.
  std::optional<double> exactWinding(const Vector3& local, double estimate, double error) const;

  std::size_t bytes() const {
    return edges_.size() * sizeof(Edge) + clusters_.size() * sizeof(Cluster) + fans_.size() * sizeof(AngleBlock) +
           toEnds_.size() * sizeof(Vector3);
  }

 private:
  struct Edge {
    Vector3 from, to;
    double multiplicity;  ///< triangles that run from `from` to `to`, minus triangles that run back

    /// Adds this edge's contributions to the gradient at the point `local` and to the gradient's bounds, each times 4π.
    void addTo(Gradient& sum, const Vector3& local) const;
  };

  /// A cluster of the edges [begin, end) with its moments ∫dl, ∫d⊗dl and, for each component of dl, ∫d⊗d dl. The vector
  /// d runs from the cluster's center to the edge. The line element dl is multiplied by the edge's multiplicity.
  struct Cluster {
    std::uint32_t begin = 0, end = 0;
    std::uint32_t next = 0;  ///< index of the next cluster that is not a part of this cluster
    Vector3 center = Vector3::Zero();
    double radius = HUGE_VAL;  ///< radius r in the error bound; infinite if the series must not be used
    double cubes = 0;          ///< upper bound of ∫ |d|³ dl, which is B in the error bound
    double length = 0;         ///< sum of the edges' lengths times their absolute multiplicities
    Vector3 first = Vector3::Zero();
    Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
    std::array<Eigen::Matrix3d, 3> third = {second, second, second};

    void add(const Edge& edge);
    /// Returns 4π times the cluster's contribution to the gradient, by the Taylor series. `toCenter` runs from
    /// the point to the cluster's center.
    Vector3 series(const Vector3& toCenter, double squaredDistance) const;
    /// Adds a bound of 4π times the derivative of the cluster's contribution in any direction, at a point with this
    /// distance from the cluster's center. Where the edges form closed loops, it is much smaller than the sum of the
    /// bounds of all edges.
    void addDerivative(Gradient& sum, double distance) const;
  };

  void addCluster(std::uint32_t begin, std::uint32_t end);
  void addFans(std::size_t most);
  bool isOnLineToEnd(const Vector3& local) const;
  void measure(Cluster& cluster) const;
  /// Returns the gradient of the winding number. Uses the Taylor series for clusters whose ratio of radius to distance
  /// is below `ratio`, and sums all other edges one by one.
  Gradient sum(const Vector3& local, double ratio) const;

  std::vector<Edge> edges_;
  std::vector<Cluster> clusters_;  ///< in depth-first order: a cluster precedes the clusters into which it is divided
  std::vector<AngleBlock> fans_;   ///< empty if there are too many edges
  std::vector<Vector3> toEnds_;    ///< unit vectors from the common point of the fans to the ends of the edges
};

}  // namespace hpsdf::sign
