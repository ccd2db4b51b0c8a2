#include "hpsdf/exact_distance.h"

#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <utility>
#include <vector>

#include "bvh/hierarchy.h"
#include "bvh/search.h"
#include "bvh/segment.h"
#include "bvh/triangle_frame.h"
#include "distance/inside_test.h"
#include "hpsdf/detail/threads.h"
#include "hpsdf/error.h"
#include "sign/boundary_edges.h"
#include "sign/pseudonormals.h"
#include "sign/winding_sign.h"
#include "surface/crossings.h"
#include "surface/outer_hull.h"

namespace hpsdf {
namespace {

void check(const DistanceOptions& options) {
  const bool isShell = options.insideTest == InsideTest::shell;
  if (isShell ? !(options.thickness > 0) || !std::isfinite(options.thickness) : options.thickness != 0)
    throw Error(ErrorKind::option, "thickness",
                "must be a finite number above 0 for a shell, and 0 for other inside tests");
}

}  // namespace

struct ExactDistance::Data {
  Data(const TriangleMesh& mesh, const DistanceOptions& options, const Progress& progress)
      : source{.name = mesh.name,
               .vertices = mesh.vertices.size(),
               .faces = mesh.triangles.size(),
               .box = boundingBox(mesh),
               .thickness = options.thickness} {
    tbb::parallel_invoke([&] { source.fingerprint = fingerprint(mesh); },
                         [&] { hierarchy = bvh::Hierarchy(mesh, source.box); });
    choice.insideTest = options.insideTest;
    if (options.insideTest == InsideTest::automatic) {
      distance::ChosenInsideTest chosen = distance::chooseInsideTest(hierarchy, mesh, progress);
      choice = std::move(chosen.choice);
      winding = std::move(chosen.winding);
      normals = std::move(chosen.normals);
    } else if (options.insideTest == InsideTest::pseudonormal) {
      normals = sign::Pseudonormals(hierarchy);
    } else if (options.insideTest == InsideTest::winding) {
      winding = sign::WindingSign(hierarchy, mesh, sign::BoundaryEdges(hierarchy));
    } else if (options.insideTest == InsideTest::outerHull) {
      reduceToOuterHull(mesh, progress);
    }
    source.insideTest = choice.insideTest;
  }

  void reduceToOuterHull(const TriangleMesh& mesh, const Progress& progress) {
    wholeMesh = std::move(hierarchy);
    winding = sign::WindingSign(wholeMesh, mesh, sign::BoundaryEdges(wholeMesh));
    surface::OuterHull hull = surface::makeOuterHull(wholeMesh, mesh, winding, progress);
    hierarchy = bvh::Hierarchy(hull.mesh, source.box);
    hullSources = std::move(hull.sourceTriangles);
  }

  /// Returns the closest point on a nearest triangle. It is computed from the mesh's own vertices, so that a point on a
  /// vertex has distance 0. The distance has the pseudonormal's sign if that is the inside test.
  ClosestPoint resolve(const bvh::Hierarchy& triangles, const Vector3& x, const bvh::Nearest& nearest) const {
    const std::uint32_t slot = triangles.slotAt(nearest.triangleRef);
    const bvh::TriangleFrame& frame = triangles.frames()[slot];
    const bvh::FramePoint& point = nearest.point;
    std::uint32_t side = point.side[1] < point.side[0] ? 1 : 0;
    if (point.side[2] < point.side[side]) side = 2;
    // A projection onto an edge, up to rounding errors, is not in the interior of the face.
    const double rounding = bvh::kFlat * bvh::kFlat * (frame.length * frame.length + point.height * point.height);
    if (point.inside && point.side[side] > rounding)  // adding 0 turns -0 into 0
      return {x - frame.normal * point.height, point.height + 0.0, frame.triangle, Feature::face};

    const std::uint32_t from = (frame.firstCorner + side) % 3;
    const std::uint32_t va = triangles.triangles()[slot][from], vb = triangles.triangles()[slot][(from + 1) % 3];
    const Vector3& a = triangles.vertices()[va];
    const Vector3& b = triangles.vertices()[vb];
    const double t = bvh::closestParameter(x, a, b);
    if (t <= 0) return signedAt(a, x - a, normalOfVertex(va), frame.triangle, Feature::vertex);
    if (t >= 1) return signedAt(b, x - b, normalOfVertex(vb), frame.triangle, Feature::vertex);
    const Vector3 normal = normalOfEdge(slot, from);
    return signedAt(a + (b - a) * t, x - a - (b - a) * t, normal, frame.triangle, Feature::edge);
  }

  /// Computes distances to the nearest triangles of a hierarchy, with the signs of `resolve`.
  void toTriangles(const bvh::Hierarchy& triangles, std::span<const Vector3> points, std::span<double> out) const {
    using bvh::kPacket;
    std::array<bvh::Nearest, kPacket> nearest{};  // those of the previous packet bound the next search from its start
    for (std::size_t first = 0; first < points.size(); first += kPacket) {
      const std::size_t count = std::min<std::size_t>(kPacket, points.size() - first);
      std::array<Vector3, kPacket> packet;
      for (std::size_t i = 0; i < kPacket; ++i) packet[i] = points[first + std::min(i, count - 1)];
      nearestTriangles(triangles, packet, nearest);
      for (std::size_t i = 0; i < count; ++i) out[first + i] = resolve(triangles, packet[i], nearest[i]).signedDistance;
    }
  }

  /// Replaces the results of `toTriangles` by signed distances according to the inside test.
  void applyInsideTest(std::span<const Vector3> points, std::span<double> distances) const {
    if (choice.insideTest == InsideTest::pseudonormal) return;
    for (double& distance : distances) distance = std::abs(distance) - source.thickness / 2;
    if (choice.insideTest == InsideTest::outerHull) {
      // Outside, a triangle nearer than the hull belongs to the hull and was removed only by its limited resolution.
      std::vector<double> clearances(points.size());
      toTriangles(wholeMesh, points, clearances);
      for (double& clearance : clearances) clearance = std::abs(clearance);
      winding.applyTo(distances, points, clearances);
    } else if (choice.insideTest == InsideTest::winding) {
      winding.applyTo(distances, points);
    }
  }

  std::uint32_t meshTriangle(std::uint32_t triangle) const {
    return hullSources.empty() ? triangle : hullSources[triangle];
  }

  Source source;
  bvh::Hierarchy hierarchy;                ///< the triangles to which distances are measured
  bvh::Hierarchy wholeMesh;                ///< all triangles; only for an outer hull
  std::vector<std::uint32_t> hullSources;  ///< `OuterHull::sourceTriangles`; only for an outer hull
  sign::Pseudonormals normals;             ///< empty for other inside tests
  sign::WindingSign winding;               ///< empty for other inside tests
  InsideTestChoice choice;

 private:
  Vector3 normalOfVertex(std::uint32_t vertex) const {
    return choice.insideTest == InsideTest::pseudonormal ? normals.ofVertex(vertex) : Vector3::Zero();
  }
  Vector3 normalOfEdge(std::uint32_t slot, std::uint32_t from) const {
    return choice.insideTest == InsideTest::pseudonormal ? normals.ofEdge(hierarchy, slot, from) : Vector3::Zero();
  }

  /// `difference` is x − closest. The caller computes it without rounding to `closest`, which is coarse far from the
  /// origin.
  static ClosestPoint signedAt(const Vector3& closest, const Vector3& difference, const Vector3& normal,
                               std::uint32_t triangle, Feature feature) {
    const double length = difference.norm();
    return {closest, (difference.dot(normal) < 0 ? -length : length) + 0.0, triangle, feature};
  }
};

ExactDistance::ExactDistance(const TriangleMesh& mesh, const DistanceOptions& options, const Progress& progress) {
  bvh::requireSurface(mesh);
  check(options);
  data_ = withThreads(options.threads, [&] { return std::make_unique<const Data>(mesh, options, progress); });
}

ExactDistance::~ExactDistance() = default;
ExactDistance::ExactDistance(ExactDistance&&) noexcept = default;
ExactDistance& ExactDistance::operator=(ExactDistance&&) noexcept = default;

double ExactDistance::operator()(const Vector3& x) const { return closestPoint(x).signedDistance; }

void ExactDistance::operator()(std::span<const Vector3> points, std::span<double> out) const {
  assert(points.size() == out.size());
  data_->toTriangles(data_->hierarchy, points, out);
  data_->applyInsideTest(points, out);
}

ClosestPoint ExactDistance::closestPoint(const Vector3& x) const {
  ClosestPoint closest = data_->resolve(data_->hierarchy, x, nearestTriangle(data_->hierarchy, x));
  data_->applyInsideTest({&x, 1}, {&closest.signedDistance, 1});
  closest.triangle = data_->meshTriangle(closest.triangle);
  return closest;
}

const InsideTestChoice& ExactDistance::insideTestChoice() const { return data_->choice; }

TriangleMesh ExactDistance::surface() const {
  const auto vertices = data_->hierarchy.vertices();
  const auto triangles = data_->hierarchy.triangles();
  return {{vertices.begin(), vertices.end()}, {triangles.begin(), triangles.end()}, data_->source.name};
}

Crossings ExactDistance::crossings(std::size_t limit, const Progress& progress) const {
  return surface::findCrossings(data_->hullSources.empty() ? data_->hierarchy : data_->wholeMesh, limit, 0, progress);
}

std::string_view instructionSet() { return bvh::instructionSet(); }

const Source& ExactDistance::source() const { return data_->source; }

std::size_t ExactDistance::bytes() const {
  return data_->hierarchy.bytes() + data_->wholeMesh.bytes() + data_->hullSources.size() * sizeof(std::uint32_t) +
         data_->normals.bytes() + data_->winding.bytes();
}

}  // namespace hpsdf
