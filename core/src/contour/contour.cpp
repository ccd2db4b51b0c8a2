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

#include "bvh/hierarchy.h"
#include "bvh/search.h"
#include "contour/cells/cell_samples.h"
#include "contour/cells/contour_octree.h"
#include "contour/cells/implicit_surface.h"
#include "contour/edits/improvement.h"
#include "contour/edits/surface_points.h"
#include "contour/open_mesh.h"
#include "contour/surface_mesh.h"
#include "hpsdf/continuity.h"
#include "hpsdf/detail/memory.h"
#include "hpsdf/detail/threads.h"
#include "hpsdf/range.h"
#include "util/chunks.h"

namespace hpsdf {
namespace contouring {
namespace {

constexpr std::int32_t kSmallestOfAll = 2;  ///< size of cells whose middles still have integer coordinates
constexpr double kRootsAlongLongest = 8;    ///< number of root cells along the longest side of the domain, about
constexpr double kAccuracy = 1e-3;          ///< greatest |f| at vertices, in tolerances
constexpr double kThin = 0.1;               ///< greatest |f| in parts and gaps that need not be found, in tolerances
constexpr double kBulge = 0.5;              ///< greatest |f| where a surface may bulge across an edge, in tolerances
/// The errors up to which triangles are merged, in tolerances: the first with which the mesh is within the tolerance.
constexpr std::array<double, 3> kSimplified = {0.8, 0.6, 0.4};
/// The greatest distance between points at which triangles are measured when they are merged, and in the end, in
/// tolerances.
constexpr double kMergedPoints = 1.5, kDenserPoints = 0.5;
/// The greatest |f| at vertices before these are rounded to single precision, and what the rounding may add, as
/// parts of the accuracy. The position changes by √3/2 of the numbers' spacing.
constexpr double kBeforeRounding = 0.25, kSpacing = 0.75;

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
      : surface_(field, options.offset, kThin * tolerance, tolerance / 2, options.threads),
        octree_(field.domain(), field.domain().sizes().maxCoeff() / kRootsAlongLongest),
        tolerance_(tolerance),
        isOpen_(options.domainCut == DomainCut::open),
        isSinglePrecision_(options.singlePrecision),
        simplifies_(options.simplify),
        progress_(progress),
        mesh_(surface_, octree_, samples_,
              {.tolerance = tolerance,
               .accuracy = kAccuracy * tolerance * (options.singlePrecision ? kBeforeRounding : 1),
               .isOpen = isOpen_,
               .isSinglePrecision = options.singlePrecision},
              progress) {
    // Cells have edges of one to two tolerances at least, and a quarter of this where the mesh misses the tolerance.
    const double smallest = std::exp2(std::floor(std::log2(tolerance / octree_.smallestEdge())) + 1);
    smallest_ =
        static_cast<std::int32_t>(std::clamp(smallest, double(kSmallestOfAll), std::ldexp(1.0, ContourOctree::kDepth)));
    finest_ = std::max(smallest_ / 4, kSmallestOfAll);
  }

  Contour make() {
    std::vector<std::int32_t> fresh(octree_.cells().size());
    for (std::size_t i = 0; i < fresh.size(); ++i) fresh[i] = static_cast<std::int32_t>(i);
    sample(fresh);
    divideUnfit();
    for (;;) {
      findEdges();
      mesh_.connect();
      wantAtMultipleSheets();
      wantWhereTooFar();
      if (wanted_.empty()) wantWhereSurfaceIsMissed();
      if (divideAsWanted()) continue;
      mesh_.mend();
      wantWhereTooFar();
      wantWhereSurfaceIsMissed();
      wantWhereWrong();
      if (!divideAsWanted()) break;
    }
    return finish();
  }

 private:
  void sample(std::span<const std::int32_t> cells) {
    progress_.update("meshing", finished_);
    sampleCells(surface_, octree_, cells, kBulge * tolerance_, progress_, samples_);
  }

  const CellSamples& samplesOf(std::int32_t cell) const { return samples_[static_cast<std::size_t>(cell)]; }

  bool canDivide(std::int32_t cell, std::int32_t smallest) const {
    return octree_[cell].isLeaf() && octree_[cell].size > smallest;
  }

  /// Asks that a leaf be divided into leaves of this size, or of the smallest one that is allowed.
  void want(std::int32_t cell, std::int32_t size, std::int32_t smallest) {
    if (canDivide(cell, smallest)) wanted_.push_back({cell, std::max(size, smallest)});
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
          if (samplesOf(child).changesSign && octree_[child].size > sizes[i]) wanted_.push_back({child, sizes[i]});
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
    constexpr double kBytesOfEdge = 1900;
    // There is about one edge for each cell with different signs; the first edges are found later than the first cells.
    const auto crossed = static_cast<std::size_t>(std::ranges::count_if(samples_, &CellSamples::changesSign));
    const double edges = double(std::max(mesh_.edges().size(), crossed)) / double(octree_.cells().size());
    const double bytes = double(cells) * (sizeof(ContourCell) + sizeof(CellSamples) + kBytesOfEdge * edges);
    requireMemory("a contour of " + std::to_string(cells) + " cells", bytes, "allow a greater tolerance");
  }

  /// Returns true if a leaf hides sheets, or if the surface in it bends too much. A certified range alone, which is
  /// wider than the values, does not lead to the smallest cells: the lattice of a cell twice as large sees all parts
  /// that are thicker than two tolerances.
  bool isUnfit(std::int32_t cell) const {
    const CellSamples& samples = samplesOf(cell);
    return ((samples.hides || samples.misfit > tolerance_) && canDivide(cell, smallest_)) ||
           (samples.mayHide && canDivide(cell, 2 * smallest_));
  }

  /// Divides leaves while they hide sheets or while the surface in them bends too much.
  void divideUnfit() {
    for (std::size_t first = 0; first < octree_.cells().size();) {
      std::vector<std::int32_t> unfit;
      const std::size_t end = octree_.cells().size();
      for (; first < end; ++first) {
        const auto cell = static_cast<std::int32_t>(first);
        if (isUnfit(cell)) unfit.push_back(cell);
      }
      if (!unfit.empty()) divide(unfit);
    }
  }

  /// Finds the crossed edges, and divides leaves until none beside them is more than twice as large as another.
  void findEdges() {
    do {
      mesh_.updateEdges();
      wantWhereUneven();
    } while (divideAsWanted());
  }

  /// Asks that leaves be divided at polygons that are too far from the surface.
  void wantWhereTooFar() {
    result_.greatestValue = 0;
    missedPolygons_ = 0;
    for (const CrossedEdge& edge : mesh_.edges()) {
      result_.greatestValue = std::max(result_.greatestValue, edge.polygon.error);
      if (edge.polygon.error <= tolerance_) continue;
      ++missedPolygons_;
      wantAround(edge, edge.polygon.error);
    }
    // Each round removes a part of the polygons that miss the tolerance, so that their logarithm tells how many rounds
    // are left.
    const double all = std::log1p(double(mesh_.edges().size())), missed = std::log1p(double(missedPolygons_));
    if (all > 0) finished_ = std::max(finished_, 1 - missed / all);
  }

  /// Asks that leaves be divided around polygons that cross others even as fans.
  void wantWhereWrong() {
    for (const std::uint32_t edge : mesh_.wrong())
      for (const std::int32_t cell : mesh_.edges()[edge].cells) want(cell, octree_[cell].size / 2, kSmallestOfAll);
  }

  /// Asks that leaves be divided that hold points of the surface too far from the mesh.
  void wantWhereSurfaceIsMissed() {
    const std::vector<double>& gaps = mesh_.findGaps();
    result_.greatestGap = 0;
    missedCells_ = 0;
    for (std::size_t i = 0; i < gaps.size(); ++i) {
      if (!octree_.cells()[i].isLeaf()) continue;
      result_.greatestGap = std::max(result_.greatestGap, gaps[i]);
      if (gaps[i] <= tolerance_) continue;
      ++missedCells_;
      want(static_cast<std::int32_t>(i), octree_.cells()[i].size / 2, finest_);
    }
  }

  /// Asks that leaves be divided through which more than one sheet passes.
  void wantAtMultipleSheets() {
    const Sheets& sheets = mesh_.sheets();
    for (std::uint32_t sheet = 1; sheet < sheets.size(); ++sheet) {
      const std::int32_t cell = sheets.cellOf(sheet);
      if (cell == sheets.cellOf(sheet - 1)) want(cell, octree_[cell].size / 2, smallest_);
    }
  }

  /// Asks that the largest leaves around an edge be divided, as far as its polygon's error asks for.
  void wantAround(const CrossedEdge& edge, double error) {
    // The error falls by four with each halving of a leaf on a smooth surface.
    const int halvings = error > 4 * tolerance_ ? 2 : 1;
    std::int32_t largest = 0;
    for (const std::int32_t cell : edge.cells) largest = std::max(largest, octree_[cell].size);
    for (const std::int32_t cell : edge.cells)
      if (octree_[cell].size == largest) want(cell, largest >> halvings, finest_);
  }

  /// Asks that leaves be divided that are more than twice as large as one beside them at a crossed edge.
  void wantWhereUneven() {
    for (const CrossedEdge& edge : mesh_.edges())
      for (const std::int32_t cell : edge.cells)
        if (octree_[cell].size > 2 * edge.size) want(cell, 2 * edge.size, finest_);
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

  /// Counts the smallest cells that hold more than the mesh can show.
  void countLosses() {
    result_.lostParts = countLostParts();
    const Sheets& sheets = mesh_.sheets();
    for (std::uint32_t sheet = 1; sheet < sheets.size(); ++sheet) {
      const std::int32_t cell = sheets.cellOf(sheet);
      const bool isFirst = sheet == 1 || sheets.cellOf(sheet - 2) != cell;
      if (cell == sheets.cellOf(sheet - 1) && isFirst) ++result_.multipleSheets;
    }
  }

  /// Counts the cells without a sheet that have a point of another sign than their corners, farther from the mesh than
  /// two tolerances. Nearer ones belong to parts that bulge across a face of the cell.
  std::size_t countLostParts() const {
    constexpr std::size_t kMostChecked = 20'000, kAtOnce = 256;
    std::vector<ContourCell> cells;
    for (std::size_t i = 0; i < samples_.size(); ++i)
      if (octree_.cells()[i].isLeaf() && samples_[i].mayHide) cells.push_back(octree_.cells()[i]);
    const std::size_t stride = cells.size() / kMostChecked + 1;
    const auto points =
        detail::listOfChunks<Vector3>(cells.size() / stride, kAtOnce, Progress{.cancelled = progress_.cancelled}, "",
                                      [&](std::vector<Vector3>& found, std::size_t first, std::size_t count) {
                                        for (std::size_t i = first; i < first + count; ++i)
                                          if (const auto point = pointOfOtherSign(cells[i * stride]))
                                            found.push_back(*point);
                                      });
    const DualMesh& made = mesh_.mesh();
    if (points.empty() || made.triangles.empty()) return points.size();
    const TriangleMesh mesh{made.vertices, made.triangles, "contour"};
    const bvh::Hierarchy hierarchy(mesh, boundingBox(mesh));
    return static_cast<std::size_t>(std::ranges::count_if(
        points, [&](const Vector3& point) { return bvh::distanceTo(hierarchy, point) > 2 * tolerance_; }));
  }

  /// Returns the point of a lattice in the cell with the greatest value of another sign than at the cell's corner.
  std::optional<Vector3> pointOfOtherSign(const ContourCell& cell) const {
    constexpr int kAlong = 5;
    const Box box = octree_.box(cell);
    std::array<Vector3, kAlong * kAlong * kAlong> points;
    for (int n = 0; n < kAlong * kAlong * kAlong; ++n) {
      const Vector3 share = Vector3(n % kAlong, n / kAlong % kAlong, n / (kAlong * kAlong)) / (kAlong - 1);
      points[n] = box.min() + share.cwiseProduct(box.sizes());
    }
    std::array<double, points.size()> values;
    surface_.values(points, values);
    const auto [least, greatest] = std::ranges::minmax_element(values);
    const auto other = isInside(values[0]) ? greatest : least;
    if (isInside(*other) == isInside(values[0])) return std::nullopt;
    return points[static_cast<std::size_t>(other - values.begin())];
  }

  /// Flips edges of the finished mesh, turns over triangles that are folded, and merges others if that was asked for.
  void improve() {
    if (result_.mesh.triangles.empty()) return;
    EditLimits limits{tolerance_, kAccuracy * tolerance_, isSinglePrecision_, kMergedPoints * tolerance_};
    EditedMesh mesh(std::move(result_.mesh.vertices), std::move(result_.mesh.triangles));
    MeshEditor editor(surface_, limits, progress_, mesh);
    align(editor);
    unfold(editor);
    result_.greatestValue = std::max(result_.greatestValue, editor.errors().value);
    result_.greatestGap = std::max(result_.greatestGap, editor.errors().gap);
    if (simplifies_) simplifyWithin(limits, mesh);
    result_.mesh = std::move(mesh).finish();
  }

  /// Merges vertices up to a part of the tolerance that leaves the mesh within the tolerance at many more points.
  void simplifyWithin(EditLimits limits, EditedMesh& mesh) {
    mesh.setPoints(surfacePointsOf(surface_, limits, progress_, mesh));
    const EditedMesh before = mesh;
    EditLimits denser = limits;
    denser.spacing = kDenserPoints * tolerance_;
    const MeshErrors least = measure(surface_, denser, progress_, before);
    for (const double share : kSimplified) {
      mesh = before;
      limits.tolerance = share * tolerance_;
      MeshEditor editor(surface_, limits, progress_, mesh);
      simplify(editor);
      const MeshErrors errors = measure(surface_, denser, progress_, mesh);
      result_.greatestValue = errors.value;
      result_.greatestGap = missedCells_ > 0 ? std::max(result_.greatestGap, errors.gap) : errors.gap;
      // Merging is not to be blamed for what missed the tolerance before.
      const bool isAsGood = errors.missed <= least.missed && errors.value <= std::max(tolerance_, least.value) &&
                            errors.gap <= std::max(tolerance_, least.gap);
      result_.unresolved = (isAsGood ? missedPolygons_ : errors.missed) + missedCells_;
      if (isAsGood) return;
    }
  }

  Contour finish() {
    countLosses();
    result_.unresolved = missedPolygons_ + missedCells_;
    result_.cells = octree_.cells().size();
    result_.fans = mesh_.fans();
    result_.flawed = mesh_.wrong().size();
    const DualMesh& made = mesh_.mesh();
    result_.mesh.vertices = made.vertices;
    result_.mesh.triangles = made.triangles;
    if (isOpen_) {
      std::vector<bool> isKept(made.triangles.size());
      for (std::size_t i = 0; i < isKept.size(); ++i)
        isKept[i] = !surface_.isAtWall(mesh_.edges()[made.edgeOfTriangle[i]].point);
      removeTriangles(isKept, result_.mesh.vertices, result_.mesh.triangles);
      surface_.removeWall();
    }
    improve();
    findNormals();
    return std::move(result_);
  }

  ImplicitSurface surface_;
  ContourOctree octree_;
  double tolerance_;
  bool isOpen_;
  bool isSinglePrecision_;
  bool simplifies_;
  std::int32_t smallest_;
  std::int32_t finest_;  ///< size of the smallest cells where the mesh misses the tolerance
  const Progress& progress_;
  std::vector<CellSamples> samples_;
  double finished_ = 0;  ///< estimated share of the work that is done
  std::vector<std::int32_t> fresh_;
  std::vector<std::pair<std::int32_t, std::int32_t>> wanted_;  ///< leaves to be divided, and into which size
  SurfaceMesh mesh_;
  std::size_t missedPolygons_ = 0;  ///< polygons that miss the tolerance
  std::size_t missedCells_ = 0;     ///< cells with points of the surface that miss it
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

namespace {

/// Returns true if the field may have a value in a box, which is halved along each axis up to so many times.
bool takes(const RangeIndex& index, double value, const Box& box, int halvings) {
  const Interval range = index.range(box).value;
  if (value < range.min || value > range.max) return false;
  if (halvings == 0) return true;
  const Vector3 half = box.sizes() / 2;
  for (int child = 0; child < 8; ++child) {
    const Vector3 low = box.min() + half.cwiseProduct(Vector3(child & 1, child >> 1 & 1, child >> 2));
    if (takes(index, value, Box(low, low + half), halvings - 1)) return true;
  }
  return false;
}

}  // namespace

bool mayHaveSteps(const Field& field, double offset) {
  constexpr int kHalvings = 6;  // of a cell, to bound the field's values in its parts
  const FieldData& data = field.data();
  if (data.blend != 0) return false;
  if (data.exact.empty()) return true;
  const int stepless = offset == -data.exact.offset ? 1 : -1;  // degree up to which polynomials continue exact leaves
  const RangeIndex index(field, 0, Interval{offset, offset});
  bool found = false;
  field.forEachCell([&](const Cell& cell) {
    if (found || cell.degree == kExactDegree || cell.degree <= stepless) return;
    const Vector3 inset = 1e-9 * cell.box.sizes();  // values on the faces are those of neighbours too
    found = takes(index, offset, Box(cell.box.min() + inset, cell.box.max() - inset), kHalvings);
  });
  return found;
}

Contour blendedContour(const Field& field, const ContourOptions& options, const Progress& progress) {
  return mayHaveSteps(field, options.offset) ? contour(blended(field), options, progress)
                                             : contour(field, options, progress);
}

}  // namespace hpsdf
