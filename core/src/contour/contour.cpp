#include "hpsdf/output/contour.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "contour/cell_samples.h"
#include "contour/contour_octree.h"
#include "contour/crossed_edges.h"
#include "contour/dual_mesh.h"
#include "contour/implicit_surface.h"
#include "contour/sheets.h"
#include "contour/vertex_placement.h"
#include "hpsdf/detail/crossings.h"
#include "hpsdf/detail/memory.h"
#include "hpsdf/detail/threads.h"
#include "mesh/connectivity.h"
#include "util/chunks.h"

namespace hpsdf {
namespace contouring {
namespace {

constexpr double kRootsAlongLongest = 8;  ///< number of root cells along the longest side of the domain, about
constexpr double kAccuracy = 1e-3;        ///< greatest |f| at vertices, in tolerances

/// Makes a contour in rounds: makes the mesh in the octree so far, measures it, and divides the leaves where it is too
/// far from the surface.
class Contouring {
 public:
  Contouring(const Field& field, const ContourOptions& options, double tolerance, const Progress& progress)
      : surface_(field, options.offset, tolerance / 2, options.threads),
        octree_(field.domain(), field.domain().sizes().maxCoeff() / kRootsAlongLongest),
        tolerance_(tolerance),
        isOpen_(options.domainCut == DomainCut::open),
        progress_(progress) {
    // The smallest cells have edges of one to two tolerances.
    const double smallest = std::exp2(std::floor(std::log2(tolerance / octree_.smallestEdge())) + 1);
    smallest_ = static_cast<std::int32_t>(std::clamp(smallest, 2.0, std::ldexp(1.0, ContourOctree::kDepth)));
  }

  Contour make() {
    std::vector<std::int32_t> fresh(octree_.cells().size());
    for (std::size_t i = 0; i < fresh.size(); ++i) fresh[i] = static_cast<std::int32_t>(i);
    sample(fresh);
    divideUnfit();
    for (;;) {
      result_.fans = result_.flawed = 0;
      extract({});
      wanted_.clear();
      wantAtMultipleSheets();
      wantWhereTooFar();
      wantWhereUneven();
      if (divideAsWanted()) continue;
      const std::vector<std::uint32_t> wrong = wrongPolygons();
      if (wrong.empty()) break;
      mendByFans(wrong);
      wanted_.clear();
      wantWhereTooFar();
      if (!divideAsWanted()) break;
    }
    return finish();
  }

 private:
  void sample(std::span<const std::int32_t> cells) {
    progress_.update("meshing", 1 - missedShare_);
    sampleCells(surface_, octree_, cells, 0.1 * tolerance_, progress_, samples_);
  }

  const CellSamples& samplesOf(std::int32_t cell) const { return samples_[static_cast<std::size_t>(cell)]; }

  bool canDivide(std::int32_t cell) const { return octree_[cell].isLeaf() && octree_[cell].size > smallest_; }

  /// Asks that a leaf be divided into leaves of this size, or of the smallest one.
  void want(std::int32_t cell, std::int32_t size) {
    if (canDivide(cell)) wanted_.push_back({cell, std::max(size, smallest_)});
  }

  /// Divides leaves as wanted, and those of their descendants that hold the surface. Returns false if nothing was
  /// wanted.
  bool divideAsWanted() {
    if (wanted_.empty()) return false;
    while (!wanted_.empty()) {
      std::ranges::sort(wanted_);
      std::vector<std::int32_t> cells;
      std::vector<std::int32_t> sizes;
      for (const auto& [cell, size] : wanted_)
        if (cells.empty() || cells.back() != cell) {
          cells.push_back(cell);
          sizes.push_back(size);
        }
      wanted_.clear();
      divide(cells);
      for (std::size_t i = 0; i < cells.size(); ++i)
        for (std::int32_t n = 0; n < 8; ++n) {
          const std::int32_t child = octree_[cells[i]].child + n;
          if (samplesOf(child).changesSign && octree_[child].size > sizes[i]) want(child, sizes[i]);
        }
    }
    divideUnfit();
    return true;
  }

  void divide(std::span<const std::int32_t> cells) {
    const std::size_t first = octree_.cells().size();
    requireMemoryFor(first + 8 * cells.size());
    octree_.divide(cells);
    fresh_.clear();
    for (std::size_t i = first; i < octree_.cells().size(); ++i) fresh_.push_back(static_cast<std::int32_t>(i));
    sample(fresh_);
  }

  /// Checks the memory of so many cells, with as many edges for each as there are now, and of the search for crossings
  /// between triangles.
  void requireMemoryFor(std::size_t cells) const {
    constexpr double kBytesOfEdge = 1500;
    const double edges = double(edges_.size()) / double(octree_.cells().size());
    const double bytes = double(cells) * (sizeof(ContourCell) + sizeof(CellSamples) + kBytesOfEdge * edges);
    requireMemory("a contour of " + std::to_string(cells) + " cells", bytes, "allow a greater tolerance");
  }

  /// Divides leaves while they hide sheets or while the surface in them bends too much.
  void divideUnfit() {
    for (std::size_t first = 0; first < octree_.cells().size();) {
      std::vector<std::int32_t> unfit;
      const std::size_t end = octree_.cells().size();
      for (; first < end; ++first) {
        const auto cell = static_cast<std::int32_t>(first);
        if ((samplesOf(cell).hides || samplesOf(cell).misfit > tolerance_) && canDivide(cell)) unfit.push_back(cell);
      }
      if (!unfit.empty()) divide(unfit);
    }
  }

  void extract(const std::vector<bool>& fans) {
    std::vector<std::int32_t> leaves;
    for (std::size_t i = 0; i < octree_.cells().size(); ++i)
      if (octree_.cells()[i].isLeaf() && samples_[i].changesSign) leaves.push_back(static_cast<std::int32_t>(i));
    edges_ = findCrossedEdges(surface_, octree_, leaves, samples_, kAccuracy * tolerance_, progress_);
    sheets_.emplace(octree_, edges_);
    std::vector<Vector3> vertices =
        placeVertices(surface_, octree_, edges_, *sheets_, kAccuracy * tolerance_, progress_);
    for (std::uint32_t sheet = 0; sheet < sheets_->size() && !fans.empty(); ++sheet) {
      const bool alone = (sheet == 0 || sheets_->cellOf(sheet - 1) != sheets_->cellOf(sheet)) &&
                         (sheet + 1 == sheets_->size() || sheets_->cellOf(sheet + 1) != sheets_->cellOf(sheet));
      if (!alone && std::ranges::any_of(sheets_->edgesOf(sheet), [&](std::uint32_t edge) { return fans[edge]; }))
        vertices[sheet] = middleOf(*sheets_, sheet, edges_);
    }
    mesh_ = makeDualMesh(surface_, edges_, *sheets_, std::move(vertices), fans);
  }

  /// Asks that leaves be divided through which more than one sheet passes.
  void wantAtMultipleSheets() {
    for (std::uint32_t sheet = 1; sheet < sheets_->size(); ++sheet) {
      const std::int32_t cell = sheets_->cellOf(sheet);
      if (cell == sheets_->cellOf(sheet - 1)) want(cell, octree_[cell].size / 2);
    }
  }

  /// Measures the greatest value, and asks that leaves be divided at triangles that are too far from the surface.
  void wantWhereTooFar() {
    constexpr std::size_t kAtOnce = 128;
    std::vector<double> greatest(mesh_.triangles.size());
    detail::forEachChunk(mesh_.triangles.size(), kAtOnce, [&](std::size_t, std::size_t first, std::size_t count) {
      progress_.throwIfCancelled();
      std::array<Vector3, 4 * kAtOnce> points;
      std::array<double, 4 * kAtOnce> values;
      for (std::size_t i = 0; i < count; ++i) {
        const Triangle& t = mesh_.triangles[first + i];
        const Vector3 &a = mesh_.vertices[t[0]], &b = mesh_.vertices[t[1]], &c = mesh_.vertices[t[2]];
        points[4 * i] = (a + b + c) / 3;
        points[4 * i + 1] = (a + b) / 2;
        points[4 * i + 2] = (b + c) / 2;
        points[4 * i + 3] = (c + a) / 2;
      }
      const auto take = [&](auto isCounted) {
        for (std::size_t i = 0; i < 4 * count; ++i)
          if (isCounted(first + i / 4))
            greatest[first + i / 4] = std::max(greatest[first + i / 4], std::abs(values[i]));
      };
      surface_.values(std::span(points).first(4 * count), std::span(values).first(4 * count));
      take([](std::size_t) { return true; });
      if (!isOpen_) return;
      // Where the mesh stays open, its boundary must lie on the surface, too.
      surface_.valuesWithoutWall(std::span(points).first(4 * count), std::span(values).first(4 * count));
      take([&](std::size_t triangle) { return !surface_.isAtWall(edges_[mesh_.edgeOfTriangle[triangle]].point); });
    });
    result_.greatestValue = 0;
    result_.unresolved = 0;
    for (std::size_t i = 0; i < greatest.size(); ++i) {
      result_.greatestValue = std::max(result_.greatestValue, greatest[i]);
      if (greatest[i] <= tolerance_) continue;
      ++result_.unresolved;
      // The error falls by four with each halving of a leaf on a smooth surface.
      const int halvings = greatest[i] > 4 * tolerance_ ? 2 : 1;
      const CrossedEdge& edge = edges_[mesh_.edgeOfTriangle[i]];
      std::int32_t largest = 0;
      for (const std::int32_t cell : edge.cells) largest = std::max(largest, octree_[cell].size);
      for (const std::int32_t cell : edge.cells)
        if (octree_[cell].size == largest) want(cell, largest >> halvings);
    }
    missedShare_ = double(result_.unresolved) / double(std::max<std::size_t>(greatest.size(), 1));
  }

  /// Asks that leaves be divided that are more than twice as large as one beside them at a crossed edge.
  void wantWhereUneven() {
    for (const CrossedEdge& edge : edges_)
      for (const std::int32_t cell : edge.cells)
        if (octree_[cell].size > 2 * edge.size) want(cell, 2 * edge.size);
  }

  /// Returns the crossed edges whose polygons cross others, or share an edge with more than one other.
  std::vector<std::uint32_t> wrongPolygons() const {
    std::vector<std::uint32_t> wrong;
    const std::vector<mesh::DirectedEdge> sides = mesh::directedEdgesOf(mesh_.triangles);
    mesh::forEachEdge(sides, [&](std::span<const mesh::DirectedEdge> side) {
      if (side.size() == 2) return;
      for (const mesh::DirectedEdge& one : side) wrong.push_back(mesh_.edgeOfTriangle[one.face]);
    });
    if (!mesh_.triangles.empty()) {
      const Crossings crossings = findCrossings({mesh_.vertices, mesh_.triangles, "contour"}, kMaxCrossings,
                                                Progress{.cancelled = progress_.cancelled});
      for (const Crossing& crossing : crossings.found)
        for (const std::uint32_t triangle : crossing.triangles) wrong.push_back(mesh_.edgeOfTriangle[triangle]);
    }
    std::ranges::sort(wrong);
    wrong.erase(std::unique(wrong.begin(), wrong.end()), wrong.end());
    return wrong;
  }

  /// Turns polygons into fans until none is wrong.
  void mendByFans(std::vector<std::uint32_t> wrong) {
    std::vector<bool> fans(edges_.size());
    while (!wrong.empty()) {
      const auto marked = std::ranges::count(fans, true);
      for (const std::uint32_t edge : wrong) fans[edge] = true;
      if (std::ranges::count(fans, true) == marked) break;
      extract(fans);
      wrong = wrongPolygons();
    }
    result_.fans = static_cast<std::size_t>(std::ranges::count(fans, true));
    result_.flawed = wrong.size();
  }

  /// Removes the triangles of the wall, and vertices that no triangle uses. Where the wall held fans of triangles
  /// together, each gets a vertex of its own.
  void removeWall() {
    std::vector<Triangle> kept;
    for (std::size_t i = 0; i < mesh_.triangles.size(); ++i)
      if (!surface_.isAtWall(edges_[mesh_.edgeOfTriangle[i]].point)) kept.push_back(mesh_.triangles[i]);

    // The corners of triangles, three for each, are united across edges that two triangles share.
    mesh::DisjointSets corners(3 * kept.size());
    const auto cornerAt = [&](std::uint32_t triangle, std::uint32_t vertex) {
      const auto place = std::ranges::find(kept[triangle], vertex) - kept[triangle].begin();
      return 3 * triangle + static_cast<std::uint32_t>(place);
    };
    const std::vector<mesh::DirectedEdge> sides = mesh::directedEdgesOf(kept);
    mesh::forEachEdge(sides, [&](std::span<const mesh::DirectedEdge> side) {
      for (std::size_t i = 1; i < side.size(); ++i)
        for (const std::uint32_t end : {side[0].low(), side[0].high()})
          corners.join(cornerAt(side[0].face, end), cornerAt(side[i].face, end));
    });
    std::vector<std::uint32_t> number(3 * kept.size());
    std::vector<Vector3> vertices;
    for (std::uint32_t corner = 0; corner < number.size(); ++corner) {
      std::uint32_t& vertex = kept[corner / 3][corner % 3];
      if (corners.first(corner) == corner) {
        number[corner] = static_cast<std::uint32_t>(vertices.size());
        vertices.push_back(mesh_.vertices[vertex]);
      }
      vertex = number[corners.first(corner)];
    }
    mesh_.vertices = std::move(vertices);
    mesh_.triangles = std::move(kept);
  }

  /// Sets the normals of the finished mesh.
  void findNormals() {
    constexpr std::size_t kAtOnce = 256;
    const std::vector<Vector3>& vertices = result_.mesh.vertices;
    result_.normals.resize(vertices.size());
    detail::forEachChunk(vertices.size(), kAtOnce, [&](std::size_t, std::size_t first, std::size_t count) {
      std::array<ValueAndGradient, kAtOnce> found;
      const std::span points = std::span(vertices).subspan(first, count);
      if (isOpen_)
        surface_.field().valuesAndGradients(points, std::span(found).first(count));
      else
        surface_.valuesAndGradients(points, std::span(found).first(count));
      for (std::size_t i = 0; i < count; ++i) result_.normals[first + i] = found[i].gradient.stableNormalized();
    });
    std::vector<Vector3> means(vertices.size(), Vector3::Zero());
    for (const Triangle& triangle : result_.mesh.triangles) {
      const auto [a, b, c] = cornersOf(result_.mesh, triangle);
      const Vector3 normal = (b - a).cross(c - a);
      for (const std::uint32_t corner : triangle) means[corner] += normal;
    }
    for (std::size_t i = 0; i < vertices.size(); ++i)
      if (!(result_.normals[i].squaredNorm() > 0.5)) result_.normals[i] = means[i].stableNormalized();
  }

  Contour finish() {
    if (isOpen_) removeWall();
    result_.mesh.vertices = std::move(mesh_.vertices);
    result_.mesh.triangles = std::move(mesh_.triangles);
    findNormals();
    return std::move(result_);
  }

  ImplicitSurface surface_;
  ContourOctree octree_;
  double tolerance_;
  bool isOpen_;
  std::int32_t smallest_;
  const Progress& progress_;
  std::vector<CellSamples> samples_;
  double missedShare_ = 1;  ///< share of the triangles that missed the tolerance when they were last measured
  std::vector<std::int32_t> fresh_;
  std::vector<std::pair<std::int32_t, std::int32_t>> wanted_;  ///< leaves to be divided, and into which size
  std::vector<CrossedEdge> edges_;
  std::optional<Sheets> sheets_;
  DualMesh mesh_;
  Contour result_;
};

}  // namespace
}  // namespace contouring

Contour contour(const Field& field, const ContourOptions& options, const Progress& progress) {
  if (!std::isfinite(options.offset)) throw Error(ErrorKind::option, "offset", "must be a finite number");
  if (!(options.tolerance >= 0) || !std::isfinite(options.tolerance))
    throw Error(ErrorKind::option, "tolerance", "must be a finite number of at least 0");
  const double longest = field.domain().sizes().maxCoeff();
  const double tolerance = options.tolerance > 0 ? options.tolerance : 1e-3 * longest;
  if (tolerance < kLeastContourTolerance * longest)
    throw Error(ErrorKind::option, "tolerance",
                "must be at least 1/4,000,000 of the longest side of the domain; allow a greater tolerance");
  return withThreads(options.threads,
                     [&] { return contouring::Contouring(field, options, tolerance, progress).make(); });
}

}  // namespace hpsdf
