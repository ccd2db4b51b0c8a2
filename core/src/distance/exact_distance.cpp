#include "hpsdf/exact_distance.h"

#include <tbb/collaborative_call_once.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cassert>
#include <cmath>
#include <utility>
#include <vector>

#include "bvh/hierarchy.h"
#include "bvh/search.h"
#include "bvh/triangle_frame.h"
#include "distance/candidate_search.h"
#include "distance/exact_leaf_signs.h"
#include "distance/far_points.h"
#include "distance/foot.h"
#include "hpsdf/detail/threads.h"
#include "hpsdf/error.h"
#include "mesh/connectivity.h"
#include "sign/boundary_edges.h"
#include "sign/pseudonormals.h"
#include "sign/winding_sign.h"
#include "surface/crossings.h"
#include "surface/outer_hull.h"

namespace hpsdf {
namespace distance {

/// The chosen inside test with the data that it needs. The members for all other inside tests stay empty.
struct ChosenInsideTest {
  InsideTestChoice choice;
  sign::WindingSign winding = {};
  sign::Pseudonormals normals = {};
};

}  // namespace distance

namespace {

using bvh::Hierarchy;
using distance::ChosenInsideTest;
using distance::FarPoints;
using distance::Foot;
using distance::kTooNear;
using sign::BoundaryEdges;
using sign::Pseudonormals;
using sign::WindingSign;

constexpr int kLattice = 16;  // number of lattice points along each axis

/// Returns true if any point of a lattice around an open mesh is inside by the winding number. The lattice extends
/// beyond the mesh's bounding box, because the box may be flat.
bool enclosesAnyPoint(const WindingSign& winding, const Box& mesh) {
  const Vector3 beyond = Vector3::Constant(0.1 * mesh.sizes().norm());
  const Box box(mesh.min() - beyond, mesh.max() + beyond);
  const Vector3 size = box.sizes();
  std::atomic<bool> any = false;
  tbb::parallel_for(0, kLattice * kLattice * kLattice, [&](int i) {
    const Vector3 index(i % kLattice, i / kLattice % kLattice, i / (kLattice * kLattice));
    if (!any && winding.isInside(box.min() + size.cwiseProduct((index + Vector3::Constant(0.5)) / kLattice)))
      any = true;
  });
  return any;
}

/// Returns the index, in the hierarchy's order, of the largest triangle of each connected component. Two triangles are
/// connected if they share an edge that no third triangle uses and are consistently oriented at that edge.
std::vector<std::uint32_t> largestOfComponents(const Hierarchy& hierarchy,
                                               const std::vector<mesh::DirectedEdge>& sides) {
  const auto count = static_cast<std::uint32_t>(hierarchy.triangles().size());
  mesh::DisjointSets components(count);
  mesh::forEachEdge(sides, [&](std::span<const mesh::DirectedEdge> edge) {
    if (edge.size() == 2 && edge[0].rising != edge[1].rising) components.join(edge[0].face, edge[1].face);
  });
  std::vector<double> areas(count);  // doubled
  tbb::parallel_for(0U, count, [&](std::uint32_t slot) {
    const bvh::TriangleFrame frame = hierarchy.frame(slot);
    areas[slot] = frame.length * frame.apexAcross;
  });
  std::vector<std::uint32_t> largest(count);  // indexed by the first triangle of each component
  for (std::uint32_t slot = 0; slot < count; ++slot) {
    const std::uint32_t first = components.first(slot);
    if (first == slot || areas[slot] > areas[largest[first]]) largest[first] = slot;
  }
  std::vector<std::uint32_t> slots;
  for (std::uint32_t slot = 0; slot < count; ++slot)
    if (components.first(slot) == slot) slots.push_back(largest[slot]);
  return slots;
}

/// Returns the lowest index below `count` for which test(index) is true, or std::nullopt if there is none.
/// Tests the indices in parallel.
template <typename Test>
std::optional<std::size_t> firstWhere(std::size_t count, const Test& test) {
  std::vector<char> holds(count);
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) { holds[i] = test(i); });
  const auto first = std::ranges::find(holds, 1);
  if (first == holds.end()) return std::nullopt;
  return static_cast<std::size_t>(first - holds.begin());
}

/// Chooses the inside test by pseudonormals if their sign certainly equals the sign by the winding number. Otherwise
/// chooses the test by the winding number, which is more expensive.
///
/// The signs are certainly equal (Bærentzen & Aanæs 2005) if
/// * every edge has as many triangles in one direction as in the other, so that the mesh has no holes;
/// * the mesh does not intersect itself, and no two parts of it are so close that distances to them may round to the
///   same number;
/// * each component has the outside in front of its triangles and the inside behind them. One triangle decides for a
///   whole component, because edges between two consistently oriented triangles connect the component;
/// * no edge or vertex is so sharp that rounding errors dominate its pseudonormal.
///
/// Throws `Cancelled`.
ChosenInsideTest chooseInsideTest(const Hierarchy& hierarchy, const TriangleMesh& mesh, const Progress& progress) {
  const auto byWinding = [](std::string reason, std::optional<Vector3> position, WindingSign winding) {
    return ChosenInsideTest{.choice = {InsideTest::winding, std::move(reason), position},
                            .winding = std::move(winding)};
  };
  const std::size_t count = hierarchy.triangles().size();
  const auto originOf = [&](std::size_t slot) { return hierarchy.frame(static_cast<std::uint32_t>(slot)).origin; };

  // Choose the winding number if the mesh has unbalanced edges, along which more triangles run in one direction than in
  // the other. The mesh then has holes.
  const std::vector<mesh::DirectedEdge> sides = mesh::directedEdgesOf(hierarchy.triangles());
  BoundaryEdges edges(hierarchy, sides);
  if (const std::size_t unbalanced = edges.size(); unbalanced > 0) {
    WindingSign winding(hierarchy, mesh, std::move(edges));
    std::string reason = std::to_string(unbalanced);
    reason += unbalanced == 1 ? " edge is" : " edges are";
    reason += " unbalanced (holes or reversed faces), and ";
    reason += enclosesAnyPoint(winding, boundingBox(mesh))
                  ? "holes are closed where the winding number is 1/2"
                  : "the faces enclose nothing: a shell would give them a thickness";
    return byWinding(std::move(reason), std::nullopt, std::move(winding));
  }

  // Choose the winding number if a triangle is too thin or two surfaces are too close. Rounding errors could then
  // select the pseudonormal of a wrong surface.
  const auto isThin = [&](std::size_t slot) { return !hasArea(hierarchy.frame(static_cast<std::uint32_t>(slot))); };
  if (const auto thin = firstWhere(count, isThin))
    return byWinding("a face is thinner than the rounding errors of its corners", originOf(*thin),
                     WindingSign(hierarchy, mesh, std::move(edges)));
  const Crossings crossings = surface::findCrossings(hierarchy, 1, kTooNear, progress);
  if (!crossings.found.empty())
    return byWinding("the mesh intersects itself, so that normals may mislead", crossings.found[0].position,
                     WindingSign(hierarchy, mesh, std::move(edges)));

  // Choose the winding number unless the components are nested and oriented like solids and their cavities. One
  // triangle of each component decides.
  const std::vector<std::uint32_t> largest = largestOfComponents(hierarchy, sides);
  if (largest.size() > 1) {
    WindingSign winding(hierarchy, mesh, std::move(edges));
    const auto isWrong = [&](std::size_t i) { return !winding.separatesOutsideFromInside(largest[i]); };
    if (const auto wrong = firstWhere(largest.size(), isWrong))
      return byWinding("a component is oriented the wrong way, or lies within another", originOf(largest[*wrong]),
                       std::move(winding));
  }
  Pseudonormals normals(hierarchy);
  const auto tooSharp = [&](std::size_t slot) {
    return sign::isSharp(hierarchy, normals, static_cast<std::uint32_t>(slot));
  };
  if (const auto sharp = firstWhere(count, tooSharp))
    return byWinding("an edge or corner is too sharp for normals", originOf(*sharp),
                     WindingSign(hierarchy, mesh, std::move(edges)));
  return {.choice = {InsideTest::pseudonormal, "the mesh has no holes and does not intersect itself"},
          .normals = std::move(normals)};
}

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
                         [&] { hierarchy = Hierarchy(mesh, source.box); });
    inside.choice.insideTest = options.insideTest;
    if (options.insideTest == InsideTest::automatic) {
      inside = chooseInsideTest(hierarchy, mesh, progress);
    } else if (options.insideTest == InsideTest::pseudonormal) {
      inside.normals = Pseudonormals(hierarchy);
    } else if (options.insideTest == InsideTest::winding) {
      inside.winding = WindingSign(hierarchy, mesh, BoundaryEdges(hierarchy));
    } else if (options.insideTest == InsideTest::outerHull) {
      reduceToOuterHull(mesh, progress);
    }
    source.insideTest = inside.choice.insideTest;
    far = FarPoints(source.box, source.thickness / 2);
    // Chosen pseudonormals tell the same sign all around the mesh.
    if (options.insideTest == InsideTest::automatic && source.insideTest == InsideTest::pseudonormal) {
      const Vector3 x = far.pointAround();
      far.setSideAround(resolve(hierarchy, x, nearestTriangle(hierarchy, x)).signedDistance < 0);
    }
    signs.emplace(hierarchy, source.insideTest, inside.winding);
    candidates.emplace(hierarchy, *signs, source.thickness / 2);
  }

  void reduceToOuterHull(const TriangleMesh& mesh, const Progress& progress) {
    wholeMesh = std::move(hierarchy);
    inside.winding = WindingSign(wholeMesh, mesh, BoundaryEdges(wholeMesh));
    surface::OuterHull hull = surface::makeOuterHull(wholeMesh, mesh, inside.winding, progress);
    hierarchy = Hierarchy(hull.mesh, source.box);
    std::vector<std::uint32_t> slotOf(wholeMesh.triangles().size());
    for (std::uint32_t slot = 0; slot < slotOf.size(); ++slot) slotOf[wholeMesh.numbers()[slot]] = slot;
    hullSlots = std::move(hull.sourceTriangles);
    for (std::uint32_t& slot : hullSlots) slot = slotOf[slot];  // until now, the number of the mesh's triangle
  }

  /// Returns the closest point on the nearest triangle, as `distance::footOf` does.
  Foot resolve(const Hierarchy& triangles, const Vector3& x, const bvh::Nearest& nearest) const {
    const bool bySurface = inside.choice.insideTest == InsideTest::pseudonormal;
    return distance::footOf(triangles, bySurface ? &inside.normals : nullptr, x, nearest);
  }

  /// Returns the barycentric coordinates of the projection of x onto a triangle's plane, in the order of the corners of
  /// the mesh's triangle. Weights that rounding makes negative become 0.
  static Vector3 barycentric(const bvh::TriangleFrame& frame, const Vector3& x) {
    const Vector3 fromA = x - frame.origin;
    const double apex = bvh::hasArea(frame) ? std::clamp(fromA.dot(frame.across) / frame.apexAcross, 0.0, 1.0) : 0;
    const double end = frame.length > 0
                           ? std::clamp((fromA.dot(frame.along) - apex * frame.apexAlong) / frame.length, 0.0, 1 - apex)
                           : 0;
    Vector3 weights;
    weights[frame.firstCorner] = 1 - apex - end;
    weights[(frame.firstCorner + 1) % 3] = end;
    weights[(frame.firstCorner + 2) % 3] = apex;
    return weights;
  }

  /// Returns the closest point with everything that is known of it, but for the inside tests other than pseudonormals.
  ClosestPoint closestOf(const Vector3& x, const bvh::Nearest& nearest) const {
    const Foot foot = resolve(hierarchy, x, nearest);
    const std::uint32_t triangle = hierarchy.numbers()[foot.slot];
    ClosestPoint closest{foot.point, foot.signedDistance, triangle, foot.feature, foot.index};
    if (!hullSlots.empty()) {
      describeInMesh(closest, wholeMesh.frame(hullSlots[triangle]));
    } else if (foot.feature == Feature::face) {
      closest.barycentric = barycentric(hierarchy.frame(foot.slot), x);
    } else if (foot.feature == Feature::edge) {
      closest.barycentric[foot.index] = 1 - foot.along;
      closest.barycentric[(foot.index + 1) % 3] = foot.along;
    } else {
      closest.barycentric[foot.index] = 1;
    }
    return closest;
  }

  /// Describes a closest point on a triangle of an outer hull, which may be a piece of the mesh's triangle, by the
  /// mesh's triangle with this frame.
  static void describeInMesh(ClosestPoint& closest, const bvh::TriangleFrame& frame) {
    constexpr double kWithinRounding = 1e-12;
    closest.triangle = frame.triangle;
    Vector3 weights = barycentric(frame, closest.point);
    weights = (weights.array() < kWithinRounding).select(0, weights);
    closest.barycentric = weights / weights.sum();
    const auto zeros = (weights.array() == 0).count();
    int corner = 0;
    if (zeros == 2) weights.maxCoeff(&corner);
    if (zeros == 1) weights.minCoeff(&corner);
    closest.feature = zeros == 0 ? Feature::face : zeros == 1 ? Feature::edge : Feature::vertex;
    closest.featureIndex = static_cast<std::uint8_t>(zeros == 1 ? (corner + 1) % 3 : corner);
  }

  /// Finds the nearest triangles of points in a hierarchy, packet by packet, and calls visit(index of the point,
  /// nearest triangle) for each point.
  template <typename Visit>
  static void forEachNearest(const Hierarchy& triangles, std::span<const Vector3> points, const Visit& visit) {
    using bvh::kPacket;
    std::array<bvh::Nearest, kPacket> nearest{};  // nearest triangles of the previous points; they bound the search
    for (std::size_t first = 0; first < points.size(); first += kPacket) {
      const auto packet = points.subspan(first, std::min<std::size_t>(kPacket, points.size() - first));
      nearestTriangles(triangles, packet, std::span(nearest).first(packet.size()));
      for (std::size_t i = 0; i < packet.size(); ++i) visit(first + i, nearest[i]);
    }
  }

  /// Computes the distances of points to the nearest triangles of a hierarchy. `resolve` determines the signs. If
  /// `directions` is not empty, also computes the unit vectors from the nearest points of the triangles.
  void toTriangles(const Hierarchy& triangles, std::span<const Vector3> points, std::span<double> out,
                   std::span<Vector3> directions = {}) const {
    forEachNearest(triangles, points, [&](std::size_t i, const bvh::Nearest& nearest) {
      const Foot closest = resolve(triangles, points[i], nearest);
      out[i] = closest.signedDistance;
      if (!directions.empty()) directions[i] = distance::directionFrom(closest, points[i], nearest);
    });
  }

  /// Turns the distances from `toTriangles` into signed distances according to the chosen inside test.
  void applyInsideTest(std::span<const Vector3> points, std::span<double> distances) const {
    if (inside.choice.insideTest == InsideTest::pseudonormal) return far.applySideAround(points, distances);
    for (double& distance : distances) distance = std::abs(distance) - source.thickness / 2;
    if (inside.choice.insideTest == InsideTest::outerHull) {
      // Compute the distances to the whole mesh, which count for points outside. A triangle that is nearer than the
      // computed hull belongs to the true hull, and is missing only because the computed hull has a limited resolution.
      std::vector<double> clearances(points.size());
      toTriangles(wholeMesh, points, clearances);
      for (double& clearance : clearances) clearance = std::abs(clearance);
      inside.winding.applyTo(distances, points, clearances);
    } else if (inside.choice.insideTest == InsideTest::winding) {
      inside.winding.applyTo(distances, points);
    }
  }

  /// Evaluates the signed distances of points, none of which is far, and the gradients of the unsigned ones unless
  /// `directions` is empty.
  void evaluateNear(std::span<const Vector3> points, std::span<double> out, std::span<Vector3> directions) const {
    toTriangles(hierarchy, points, out, directions);
    applyInsideTest(points, out);
  }

  /// Evaluates the signed distances of any points, and the gradients of the unsigned ones unless `directions` is empty.
  void evaluate(std::span<const Vector3> points, std::span<double> out, std::span<Vector3> directions = {}) const {
    far.evaluate(points, out, directions,
                 [&](std::span<const Vector3> some, std::span<double> distances, std::span<Vector3> theirs) {
                   evaluateNear(some, distances, theirs);
                 });
  }

  /// Finds the closest points of points, none of which is far.
  void closestPointsNear(std::span<const Vector3> points, std::span<ClosestPoint> out) const {
    constexpr std::size_t kPointsAtOnce = 512;  // enough for the inside test to derive signs from each other
    std::array<double, kPointsAtOnce> distances;
    forEachNearest(hierarchy, points,
                   [&](std::size_t i, const bvh::Nearest& nearest) { out[i] = closestOf(points[i], nearest); });
    for (std::size_t first = 0; first < points.size(); first += kPointsAtOnce) {
      const std::size_t count = std::min(kPointsAtOnce, points.size() - first);
      for (std::size_t i = 0; i < count; ++i) distances[i] = out[first + i].signedDistance;
      applyInsideTest(points.subspan(first, count), std::span(distances).first(count));
      for (std::size_t i = 0; i < count; ++i) out[first + i].signedDistance = distances[i];
    }
  }

  /// Returns the winding numbers of the mesh. Where the inside test does not need them, prepares them at the first
  /// call.
  const WindingSign& windingNumbers() const {
    if (inside.choice.insideTest == InsideTest::winding || inside.choice.insideTest == InsideTest::outerHull)
      return inside.winding;
    // A thread that waits for another one to prepare them helps it. With a mutex it could wait for itself: a thread may
    // run another caller's task while it waits for its own parallel loop.
    tbb::collaborative_call_once(preparesWinding_, [&] {
      preparedWinding_ = std::make_unique<const WindingSign>(hierarchy, BoundaryEdges(hierarchy));
      winding = preparedWinding_.get();
    });
    return *preparedWinding_;
  }

  Source source;
  Hierarchy hierarchy;                   ///< the triangles to which distances are measured
  Hierarchy wholeMesh;                   ///< all triangles; only for an outer hull
  std::vector<std::uint32_t> hullSlots;  ///< slot in `wholeMesh` of each hull triangle's source; only for an outer hull
  ChosenInsideTest inside;
  FarPoints far;
  std::optional<distance::ExactLeafSigns> signs;
  std::optional<distance::CandidateSearch> candidates;
  mutable std::atomic<const WindingSign*> winding = nullptr;  ///< is `preparedWinding_` once this is complete

 private:
  mutable tbb::collaborative_once_flag preparesWinding_;
  mutable std::unique_ptr<const WindingSign> preparedWinding_;
};

ExactDistance::ExactDistance(const TriangleMesh& mesh, const DistanceOptions& options, const Progress& progress) {
  bvh::requireSurface(mesh);
  check(options);
  data_ = withThreads(options.threads, [&] { return std::make_unique<const Data>(mesh, options, progress); });
}

ExactDistance::~ExactDistance() = default;
ExactDistance::ExactDistance(ExactDistance&&) noexcept = default;
ExactDistance& ExactDistance::operator=(ExactDistance&&) noexcept = default;

double ExactDistance::operator()(const Vector3& x) const {
  double distance = 0;
  if (data_->far.isFar(x)) {
    data_->evaluate({&x, 1}, {&distance, 1});
    return distance;
  }
  distance = data_->resolve(data_->hierarchy, x, nearestTriangle(data_->hierarchy, x)).signedDistance;
  data_->applyInsideTest({&x, 1}, {&distance, 1});
  return distance;
}

void ExactDistance::operator()(std::span<const Vector3> points, std::span<double> out) const {
  assert(points.size() == out.size());
  data_->evaluate(points, out);
}

bool ExactDistance::hasGradients() const {
  switch (data_->inside.choice.insideTest) {
    case InsideTest::pseudonormal:
    case InsideTest::shell:
      return true;
    case InsideTest::winding:
      return data_->inside.winding.isClosed();
    default:
      return false;
  }
}

void ExactDistance::withGradients(std::span<const Vector3> points, std::span<double> out,
                                  std::span<Vector3> gradients) const {
  assert(points.size() == out.size() && points.size() == gradients.size() && hasGradients());
  data_->evaluate(points, out, gradients);
  if (data_->inside.choice.insideTest == InsideTest::shell) return;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (out[i] < 0) gradients[i] = -gradients[i];
}

ClosestPoint ExactDistance::closestPoint(const Vector3& x) const {
  const Vector3 nearer = data_->far.nearer(x);
  ClosestPoint closest = data_->closestOf(nearer, nearestTriangle(data_->hierarchy, nearer));
  data_->applyInsideTest({&nearer, 1}, {&closest.signedDistance, 1});
  if (data_->far.isFar(x)) closest.signedDistance = data_->far.continued(closest.signedDistance, x, nearer);
  return closest;
}

void ExactDistance::closestPoints(std::span<const Vector3> points, std::span<ClosestPoint> out) const {
  assert(points.size() == out.size());
  if (data_->far.areAnyFar(points)) {
    const std::vector<Vector3> nearer = data_->far.nearer(points);
    data_->closestPointsNear(nearer, out);
    for (std::size_t i = 0; i < points.size(); ++i)
      if (data_->far.isFar(points[i]))
        out[i].signedDistance = data_->far.continued(out[i].signedDistance, points[i], nearer[i]);
  } else {
    data_->closestPointsNear(points, out);
  }
}

double ExactDistance::windingNumber(const Vector3& x) const {
  double number = 0;
  windingNumbers({&x, 1}, {&number, 1});
  return number;
}

void ExactDistance::windingNumbers(std::span<const Vector3> points, std::span<double> out) const {
  assert(points.size() == out.size());
  const WindingSign& winding = data_->windingNumbers();
  // The winding number of a far point is within kWindingError of 0.
  for (std::size_t i = 0; i < points.size(); ++i)
    out[i] = data_->far.isFar(points[i]) ? 0 : winding.numberAt(points[i], kWindingError);
}

const InsideTestChoice& ExactDistance::insideTestChoice() const { return data_->inside.choice; }

TriangleMesh ExactDistance::surface() const {
  const auto vertices = data_->hierarchy.vertices();
  const auto triangles = data_->hierarchy.triangles();
  return {{vertices.begin(), vertices.end()}, {triangles.begin(), triangles.end()}, data_->source.name};
}

Crossings ExactDistance::crossings(std::size_t limit, const Progress& progress) const {
  return surface::findCrossings(data_->hullSlots.empty() ? data_->hierarchy : data_->wholeMesh, limit, 0, progress);
}

std::string_view instructionSet() { return bvh::instructionSet(); }

const TriangleSearch& ExactDistance::triangleSearch() const { return *data_->candidates; }

const Source& ExactDistance::source() const { return data_->source; }

std::size_t ExactDistance::bytes() const {
  const WindingSign* const prepared = data_->winding;
  return data_->hierarchy.bytes() + data_->wholeMesh.bytes() + data_->hullSlots.size() * sizeof(std::uint32_t) +
         data_->inside.normals.bytes() + data_->inside.winding.bytes() + (prepared ? prepared->bytes() : 0);
}

}  // namespace hpsdf
