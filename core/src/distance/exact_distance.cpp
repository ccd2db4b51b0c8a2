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
#include "sign/inside.h"
#include "sign/pseudonormals.h"
#include "surface/crossings.h"
#include "surface/outer_hull.h"

namespace hpsdf {
namespace {

using distance::closestParameter;
using distance::FramePoint;
using distance::TriangleFrame;

void check(const DistanceOptions& options) {
  const bool isShell = options.insideTest == InsideTest::shell;
  if (isShell ? !(options.thickness > 0) || !std::isfinite(options.thickness) : options.thickness != 0)
    throw Error("a shell, and nothing else, has a thickness, a number above 0");
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
                         [&] { hierarchy = distance::Hierarchy(mesh, source.box); });
    choice.insideTest = options.insideTest;
    if (options.insideTest == InsideTest::automatic) {
      distance::ChosenInsideTest chosen = distance::chooseInsideTest(hierarchy, mesh, progress);
      choice = std::move(chosen.choice);
      inside = std::move(chosen.inside);
      normals = std::move(chosen.normals);
    } else if (options.insideTest == InsideTest::pseudonormal) {
      normals = distance::Pseudonormals(hierarchy);
    } else if (options.insideTest == InsideTest::winding) {
      inside = distance::Inside(hierarchy, mesh, distance::BoundaryEdges(hierarchy));
    } else if (options.insideTest == InsideTest::outerHull) {
      leaveOutBuried(mesh, progress);
    }
    source.insideTest = choice.insideTest;
  }

  void leaveOutBuried(const TriangleMesh& mesh, const Progress& progress) {
    whole = std::move(hierarchy);
    inside = distance::Inside(whole, mesh, distance::BoundaryEdges(whole));
    distance::Hull hull = distance::hullOf(whole, mesh, inside, progress);
    hierarchy = distance::Hierarchy(hull.mesh, source.box);
    parts = std::move(hull.triangles);
  }

  /// What x is to its nearest triangle: from the mesh's own corners, so that a point on a vertex is at distance 0. Its
  /// sign is the pseudonormal's, where that counts.
  ClosestPoint resolve(const distance::Hierarchy& of, const Vector3& x, const distance::Nearest& nearest) const {
    const std::uint32_t slot = of.slotAt(nearest.place);
    const TriangleFrame& frame = of.frames()[slot];
    const FramePoint& point = nearest.point;
    std::uint32_t side = point.side[1] < point.side[0] ? 1 : 0;
    if (point.side[2] < point.side[side]) side = 2;
    // within the roundings of a place in the plane, a point on a side is no point of the face
    const double rounding =
        distance::kFlat * distance::kFlat * (frame.length * frame.length + point.height * point.height);
    if (point.inside && point.side[side] > rounding)  // adding 0 turns -0 into 0
      return {x - frame.normal * point.height, point.height + 0.0, frame.triangle, Feature::face};

    const std::uint32_t from = (frame.firstCorner + side) % 3;
    const std::uint32_t va = of.triangles()[slot][from], vb = of.triangles()[slot][(from + 1) % 3];
    const Vector3& a = of.vertices()[va];
    const Vector3& b = of.vertices()[vb];
    const double t = closestParameter(x, a, b);
    if (t <= 0) return at(a, x - a, normalOfVertex(va), frame.triangle, Feature::vertex);
    if (t >= 1) return at(b, x - b, normalOfVertex(vb), frame.triangle, Feature::vertex);
    const Vector3 normal = normalOfEdge(slot, from);
    return at(a + (b - a) * t, x - a - (b - a) * t, normal, frame.triangle, Feature::edge);
  }

  /// To the triangles of a hierarchy; signed by pseudonormals, where these count.
  void toTriangles(const distance::Hierarchy& of, std::span<const Vector3> points, std::span<double> out) const {
    using distance::kPacket;
    std::array<distance::Nearest, kPacket> nearest{};  // of the packet before: a tight bound from the outset
    for (std::size_t first = 0; first < points.size(); first += kPacket) {
      const std::size_t count = std::min<std::size_t>(kPacket, points.size() - first);
      std::array<Vector3, kPacket> packet;
      for (std::size_t i = 0; i < kPacket; ++i) packet[i] = points[first + std::min(i, count - 1)];
      nearestTriangles(of, packet, nearest);
      for (std::size_t i = 0; i < count; ++i) out[first + i] = resolve(of, packet[i], nearest[i]).signedDistance;
    }
  }

  /// From those, in place, the distances that were asked for.
  void sign(std::span<const Vector3> points, std::span<double> distances) const {
    if (choice.insideTest == InsideTest::pseudonormal) return;
    for (double& distance : distances) distance = std::abs(distance) - source.thickness / 2;
    if (choice.insideTest == InsideTest::outerHull) {
      // outside, none that is nearer than the hull was rightly left out of it
      std::vector<double> free(points.size());
      toTriangles(whole, points, free);
      for (double& distance : free) distance = std::abs(distance);
      inside.sign(points, free, distances);
    } else if (choice.insideTest == InsideTest::winding) {
      inside.sign(points, distances);
    }
  }

  std::uint32_t triangleOf(std::uint32_t triangle) const { return parts.empty() ? triangle : parts[triangle]; }

  Source source;
  distance::Hierarchy hierarchy;     ///< of the triangles that distances go to
  distance::Hierarchy whole;         ///< of all, where those are only a hull's
  std::vector<std::uint32_t> parts;  ///< of which triangle each of a hull's is a part
  distance::Pseudonormals normals;   ///< empty unless they give the sign
  distance::Inside inside;           ///< likewise
  InsideTestChoice choice;

 private:
  Vector3 normalOfVertex(std::uint32_t vertex) const {
    return choice.insideTest == InsideTest::pseudonormal ? normals.ofVertex(vertex) : Vector3::Zero();
  }
  Vector3 normalOfEdge(std::uint32_t slot, std::uint32_t from) const {
    return choice.insideTest == InsideTest::pseudonormal ? normals.ofEdge(hierarchy, slot, from) : Vector3::Zero();
  }

  /// `difference` is x - closest, given apart: far from the origin the point itself is rounded more.
  static ClosestPoint at(const Vector3& closest, const Vector3& difference, const Vector3& normal,
                         std::uint32_t triangle, Feature feature) {
    const double length = difference.norm();
    return {closest, (difference.dot(normal) < 0 ? -length : length) + 0.0, triangle, feature};
  }
};

ExactDistance::ExactDistance(const TriangleMesh& mesh, const DistanceOptions& options, const Progress& progress) {
  distance::requireSurface(mesh);
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
  data_->sign(points, out);
}

ClosestPoint ExactDistance::closestPoint(const Vector3& x) const {
  ClosestPoint closest = data_->resolve(data_->hierarchy, x, nearestTriangle(data_->hierarchy, x));
  data_->sign({&x, 1}, {&closest.signedDistance, 1});
  closest.triangle = data_->triangleOf(closest.triangle);
  return closest;
}

const InsideTestChoice& ExactDistance::insideTestChoice() const { return data_->choice; }

TriangleMesh ExactDistance::surface() const {
  const auto vertices = data_->hierarchy.vertices();
  const auto triangles = data_->hierarchy.triangles();
  return {{vertices.begin(), vertices.end()}, {triangles.begin(), triangles.end()}, data_->source.name};
}

Crossings ExactDistance::crossings(std::size_t limit, const Progress& progress) const {
  return distance::findCrossings(data_->parts.empty() ? data_->hierarchy : data_->whole, limit, 0, progress);
}

std::string_view instructionSet() { return distance::instructionSet(); }

const Source& ExactDistance::source() const { return data_->source; }

std::size_t ExactDistance::bytes() const {
  return data_->hierarchy.bytes() + data_->whole.bytes() + data_->parts.size() * sizeof(std::uint32_t) +
         data_->normals.bytes() + data_->inside.bytes();
}

}  // namespace hpsdf
