#include "hpsdf/output/contour.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
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
#include "contour/open_mesh.h"
#include "contour/sheets.h"
#include "contour/triangle_errors.h"
#include "contour/vertex_placement.h"
#include "hpsdf/detail/memory.h"
#include "hpsdf/detail/threads.h"
#include "mesh/connectivity.h"
#include "surface/crossings.h"
#include "util/chunks.h"

namespace hpsdf {
namespace contouring {
namespace {

constexpr double kRootsAlongLongest = 8;  ///< number of root cells along the longest side of the domain, about
constexpr double kAccuracy = 1e-3;        ///< greatest |f| at vertices, in tolerances
/// What |f| at vertices may be before these are rounded to single precision, and how much the rounding may add, as
/// parts of the accuracy. The position changes by √3/2 of the numbers' spacing.
constexpr double kBeforeRounding = 0.25, kSpacing = 0.75;

/// Returns the single-precision number nearest to x. GCC 12 leaves out conversions to float and back where it handles
/// two numbers at a time; `volatile` prevents this.
double inSinglePrecision(double x) {
  const volatile float single = static_cast<float>(x);
  return single;
}

/// Returns the spacing of single-precision numbers at the domain's farthest corner.
double singleSpacing(const Box& domain) {
  const double farthest = domain.min().cwiseAbs().cwiseMax(domain.max().cwiseAbs()).maxCoeff();
  return std::ldexp(1.0, std::ilogb(farthest) - (std::numeric_limits<float>::digits - 1));
}

/// Makes a contour in rounds: makes the mesh in the octree so far, measures it, and divides the leaves where it is too
/// far from the surface.
class Contouring {
 public:
  Contouring(const Field& field, const ContourOptions& options, double tolerance, const Progress& progress)
      : surface_(field, options.offset, tolerance / 2, options.threads),
        octree_(field.domain(), field.domain().sizes().maxCoeff() / kRootsAlongLongest),
        tolerance_(tolerance),
        isOpen_(options.domainCut == DomainCut::open),
        isSingle_(options.singlePrecision),
        accuracy_(kAccuracy * tolerance * (options.singlePrecision ? kBeforeRounding : 1)),
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
      findEdges();
      connect();
      wantAtMultipleSheets();
      wantWhereTooFar();
      if (divideAsWanted()) continue;
      const std::vector<std::uint32_t> wrong = wrongPolygons(std::vector<bool>(mesh_.triangles.size(), true));
      result_.fans = result_.flawed = 0;
      if (wrong.empty()) break;
      mendByFans(wrong);
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

  /// Finds the crossed edges, and divides leaves until none beside them is more than twice as large as another.
  void findEdges() {
    do {
      updateCrossedEdges(surface_, octree_, cellsOfEdges_, samples_, accuracy_, progress_, edges_);
      cellsOfEdges_ = octree_.cells().size();
      wantWhereUneven();
    } while (divideAsWanted());
  }

  /// Connects the edges to the mesh's polygons.
  void connect() {
    sheets_.emplace(octree_, edges_);
    vertices_ = placeVertices(surface_, octree_, edges_, *sheets_, accuracy_, progress_);
    roundIfSingle(vertices_);
    mesh_ = makeDualMesh(surface_, edges_, *sheets_, vertices_, {}, accuracy_);
  }

  /// Makes the mesh with fans around the marked edges. Where sheets share a leaf, those of fans have their vertices in
  /// the middle.
  void makeFans(const std::vector<bool>& fans) {
    std::vector<Vector3> vertices = vertices_;
    for (std::uint32_t sheet = 0; sheet < sheets_->size(); ++sheet) {
      const bool alone = (sheet == 0 || sheets_->cellOf(sheet - 1) != sheets_->cellOf(sheet)) &&
                         (sheet + 1 == sheets_->size() || sheets_->cellOf(sheet + 1) != sheets_->cellOf(sheet));
      if (!alone && std::ranges::any_of(sheets_->edgesOf(sheet), [&](std::uint32_t edge) { return fans[edge]; }))
        vertices[sheet] = middleOf(*sheets_, sheet, edges_);
    }
    mesh_ = makeDualMesh(surface_, edges_, *sheets_, std::move(vertices), fans, accuracy_);
    roundIfSingle(mesh_.vertices);
  }

  void roundIfSingle(std::vector<Vector3>& vertices) const {
    if (!isSingle_) return;
    for (Vector3& vertex : vertices)
      for (double& coordinate : vertex) coordinate = inSinglePrecision(coordinate);
  }

  /// Asks that leaves be divided through which more than one sheet passes.
  void wantAtMultipleSheets() {
    for (std::uint32_t sheet = 1; sheet < sheets_->size(); ++sheet) {
      const std::int32_t cell = sheets_->cellOf(sheet);
      if (cell == sheets_->cellOf(sheet - 1)) want(cell, octree_[cell].size / 2);
    }
  }

  /// Measures the triangles, and asks that leaves be divided at those that are too far from the surface.
  void wantWhereTooFar() {
    const std::vector<double> errors = findTriangleErrors(surface_, mesh_, edges_, isOpen_, progress_);
    result_.greatestValue = errors.empty() ? 0 : *std::ranges::max_element(errors);
    result_.unresolved = 0;
    for (std::size_t i = 0; i < errors.size(); ++i) {
      if (errors[i] <= tolerance_) continue;
      ++result_.unresolved;
      wantAround(edges_[mesh_.edgeOfTriangle[i]], errors[i]);
    }
    missedShare_ = double(result_.unresolved) / double(std::max<std::size_t>(errors.size(), 1));
  }

  /// Asks that the largest leaves around an edge be divided, as far as its polygon's error asks for.
  void wantAround(const CrossedEdge& edge, double error) {
    // The error falls by four with each halving of a leaf on a smooth surface.
    const int halvings = error > 4 * tolerance_ ? 2 : 1;
    std::int32_t largest = 0;
    for (const std::int32_t cell : edge.cells) largest = std::max(largest, octree_[cell].size);
    for (const std::int32_t cell : edge.cells)
      if (octree_[cell].size == largest) want(cell, largest >> halvings);
  }

  /// Asks that leaves be divided that are more than twice as large as one beside them at a crossed edge.
  void wantWhereUneven() {
    for (const CrossedEdge& edge : edges_)
      for (const std::int32_t cell : edge.cells)
        if (octree_[cell].size > 2 * edge.size) want(cell, 2 * edge.size);
  }

  /// Returns the crossed edges whose polygons cross others, or share an edge with more than one other. Two triangles
  /// are tested for crossing if one of them is `chosen`.
  std::vector<std::uint32_t> wrongPolygons(const std::vector<bool>& chosen) {
    std::vector<std::uint32_t> wrong;
    const std::vector<mesh::DirectedEdge> sides = mesh::directedEdgesOf(mesh_.triangles);
    mesh::forEachEdge(sides, [&](std::span<const mesh::DirectedEdge> side) {
      if (side.size() == 2) return;
      for (const mesh::DirectedEdge& one : side) wrong.push_back(mesh_.edgeOfTriangle[one.face]);
    });
    if (!mesh_.triangles.empty()) {
      const Crossings crossings = surface::findCrossingsOf({mesh_.vertices, mesh_.triangles, "contour"}, chosen,
                                                           kMaxCrossings, Progress{.cancelled = progress_.cancelled});
      knowsAllCrossings_ = crossings.complete;
      for (const Crossing& crossing : crossings.found)
        for (const std::uint32_t triangle : crossing.triangles) wrong.push_back(mesh_.edgeOfTriangle[triangle]);
    }
    std::ranges::sort(wrong);
    wrong.erase(std::unique(wrong.begin(), wrong.end()), wrong.end());
    return wrong;
  }

  /// Returns, for each triangle, whether it has a vertex that is not where it was before there were fans. Others do not
  /// cross each other, as those that did have become fans, unless not all crossings are known.
  std::vector<bool> changedTriangles() const {
    std::vector<bool> changed(mesh_.triangles.size());
    for (std::size_t i = 0; i < changed.size(); ++i)
      changed[i] = !knowsAllCrossings_ || std::ranges::any_of(mesh_.triangles[i], [&](std::uint32_t vertex) {
        return vertex >= vertices_.size() || mesh_.vertices[vertex] != vertices_[vertex];
      });
    return changed;
  }

  /// Turns polygons into fans until none is wrong.
  void mendByFans(std::vector<std::uint32_t> wrong) {
    std::vector<bool> fans(edges_.size());
    while (!wrong.empty()) {
      const auto marked = std::ranges::count(fans, true);
      for (const std::uint32_t edge : wrong) fans[edge] = true;
      if (std::ranges::count(fans, true) == marked) break;
      makeFans(fans);
      wrong = wrongPolygons(changedTriangles());
    }
    result_.fans = static_cast<std::size_t>(std::ranges::count(fans, true));
    result_.flawed = wrong.size();
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

  void removeWall() {
    std::vector<bool> isKept(mesh_.triangles.size());
    for (std::size_t i = 0; i < isKept.size(); ++i)
      isKept[i] = !surface_.isAtWall(edges_[mesh_.edgeOfTriangle[i]].point);
    removeTriangles(isKept, mesh_.vertices, mesh_.triangles);
  }

  /// Counts the smallest cells that hold more than the mesh can show.
  void countLosses() {
    for (std::size_t i = 0; i < samples_.size(); ++i)
      if (octree_.cells()[i].isLeaf() && samples_[i].hides) ++result_.mayMissParts;
    for (std::uint32_t sheet = 1; sheet < sheets_->size(); ++sheet) {
      const std::int32_t cell = sheets_->cellOf(sheet);
      const bool isFirst = sheet == 1 || sheets_->cellOf(sheet - 2) != cell;
      if (cell == sheets_->cellOf(sheet - 1) && isFirst) ++result_.multipleSheets;
    }
  }

  Contour finish() {
    countLosses();
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
  bool isSingle_;
  double accuracy_;  ///< greatest |f| at vertices before they are rounded
  std::int32_t smallest_;
  const Progress& progress_;
  std::vector<CellSamples> samples_;
  double missedShare_ = 1;  ///< share of the triangles that missed the tolerance when they were last measured
  std::vector<std::int32_t> fresh_;
  std::vector<std::pair<std::int32_t, std::int32_t>> wanted_;  ///< leaves to be divided, and into which size
  std::size_t cellsOfEdges_ = 0;  ///< number of the octree's cells when `edges_` was brought up to date
  std::vector<CrossedEdge> edges_;
  std::optional<Sheets> sheets_;
  std::vector<Vector3> vertices_;  ///< one for each sheet
  bool knowsAllCrossings_ = true;  ///< the last search for crossings found all
  DualMesh mesh_;
  Contour result_;
};

}  // namespace
}  // namespace contouring

double leastSinglePrecisionTolerance(const Field& field) {
  return contouring::singleSpacing(field.domain()) / (contouring::kSpacing * contouring::kAccuracy);
}

Contour contour(const Field& field, const ContourOptions& options, const Progress& progress) {
  if (!std::isfinite(options.offset)) throw Error(ErrorKind::option, "offset", "must be a finite number");
  if (!(options.tolerance >= 0) || !std::isfinite(options.tolerance))
    throw Error(ErrorKind::option, "tolerance", "must be a finite number of at least 0");
  const double longest = field.domain().sizes().maxCoeff();
  const double tolerance = options.tolerance > 0 ? options.tolerance : kDefaultContourTolerance * longest;
  if (tolerance < kLeastContourTolerance * longest)
    throw Error(ErrorKind::option, "tolerance",
                "must be at least 1/4,000,000 of the longest side of the domain; allow a greater tolerance");
  if (options.singlePrecision && tolerance < leastSinglePrecisionTolerance(field))
    throw Error(ErrorKind::option, "tolerance", "is too small for vertices in single precision");
  return withThreads(options.threads,
                     [&] { return contouring::Contouring(field, options, tolerance, progress).make(); });
}

}  // namespace hpsdf
