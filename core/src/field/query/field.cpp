#include "hpsdf/field.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "basis/projection.h"
#include "field/query/blend.h"
#include "field/query/evaluate.h"
#include "field/query/quantized.h"
#include "hpsdf/detail/triangle_list.h"
#include "hpsdf/error.h"

namespace hpsdf {

using namespace query;

namespace {

[[noreturn]] void notAField(const std::string& what) { throw Error("not a valid field: " + what); }

void checkDomain(const FieldData& data) {
  if (data.domain.isEmpty() || !data.domain.min().allFinite() || !data.domain.max().allFinite() ||
      !((data.domain.max() - data.domain.min()).minCoeff() > 0) || !(data.domain.max() - data.domain.min()).allFinite())
    notAField("its domain is empty or not finite");
}

/// Returns where the lists of triangles begin. Throws `Error` unless the lists are whole and refer to triangles.
std::vector<std::uint32_t> checkLists(const ExactTriangles& exact) {
  const std::span<const std::uint32_t> words = exact.lists;
  std::vector<std::uint32_t> starts;
  if (words.size() > 0xffffffffu) notAField("its lists of triangles are too long");
  for (std::size_t at = 0; at < words.size();) {
    starts.push_back(static_cast<std::uint32_t>(at));
    const TriangleListView list(&words[at]);
    at += TriangleListView::runsAt(list.count());
    std::size_t listed = 0;
    bool isLast = false;
    for (; !isLast && at < words.size(); ++at) {
      const std::uint32_t run = words[at];
      if (std::size_t(triangle_run::first(run)) + triangle_run::length(run) > exact.triangles.size())
        notAField("a list of triangles refers beyond their end");
      listed += triangle_run::length(run);
      isLast = triangle_run::isLast(run);
    }
    if (list.hasReference()) at += TriangleListView::kReferenceWords;
    if (!isLast || listed != list.count() || at > words.size()) notAField("a list of triangles has a wrong length");
    std::uint8_t octants = 0;
    for (std::uint32_t i = 0; i < list.count(); ++i) octants |= list.octants(i);
    if (octants != 0xff) notAField("a list has no triangle for an octant");
    if (list.hasReference() && !PackedReference(list.referenceWords()).offset.allFinite())
      notAField("the reference point of a list of triangles is not finite");
  }
  return starts;
}

/// Throws `Error` unless `leaf` refers to one of the lists that begin at `lists`, whose reference point fits its sign.
void checkExactLeaf(const ExactTriangles& exact, const std::vector<std::uint32_t>& lists, std::uint64_t leaf) {
  if (!std::ranges::binary_search(lists, node::offset(leaf))) notAField("a cell has no list of triangles");
  const bool hasReference = TriangleListView(exact, leaf).hasReference();
  if (hasReference != (node::exactSign(leaf) == ExactSign::winding))
    notAField("a cell's list of triangles does not fit its sign");
}

/// Returns true if the coefficients of a leaf lie within the array.
template <typename T>
bool hasLeaf(const FieldArray<T>& coefficients, std::uint64_t leaf) {
  return std::size_t(node::offset(leaf)) + coefficientCount(node::degree(leaf)) <= coefficients.size();
}
bool hasLeaf(const QuantizedCoefficients& coefficients, std::uint64_t leaf) {
  const std::size_t offset = node::offset(leaf), size = coefficients.bytes.size();
  // A leaf in a mapped file is not read before it is needed. Whatever its bytes are, it must not be read beyond the
  // end.
  if (coefficients.bytes.isMapped() && offset + mostQuantizedBytes(node::degree(leaf)) <= size) return true;
  return quantizedLeafBytes(coefficients, leaf) > 0;
}

template <typename T>
void checkCoefficients(const FieldArray<T>& coefficients) {
  if (coefficients.isMapped()) return;  // They are checked when they are read.
  for (const T c : coefficients.all())
    if (!std::isfinite(c)) notAField("a coefficient is not finite");
}
void checkCoefficients(const QuantizedCoefficients& coefficients) {
  if (!(coefficients.step >= QuantizedCoefficients::kLeastStep &&
        coefficients.step <= QuantizedCoefficients::kGreatestStep))
    notAField("the step of its coefficients is out of range");
}

/// Throws `Error` if the shared parts of quantized coefficients, without which no leaf can be read, are out of range.
void checkQuantization(const FieldData& data) {
  const auto* quantized = std::get_if<QuantizedCoefficients>(&data.coefficients);
  if (quantized == nullptr) return;
  if (quantized->bytes.size() < QuantizedCoefficients::kPadding) notAField("its coefficients are too short");
  if (quantized->meanBits < 1 || quantized->meanBits > QuantizedCoefficients::kMostMeanBits)
    notAField("the width of its coefficients is out of range");
}

/// Throws `Error` unless the nodes form trees: every group of children must belong to exactly one node, which precedes
/// the group.
void checkNodes(const FieldData& data) {
  const std::size_t baseCells = std::size_t{data.grid[0]} * data.grid[1] * data.grid[2];
  const std::vector<std::uint32_t> lists = checkLists(data.exact);
  const auto& nodes = data.nodes;
  const bool isQuantized = std::holds_alternative<QuantizedCoefficients>(data.coefficients);
  constexpr std::uint8_t kUnreached = 0xff;
  if ((nodes.size() - baseCells) % 8 != 0) notAField("its nodes do not come in groups of eight");
  std::vector<std::uint8_t> depth(nodes.size(), kUnreached);
  std::fill_n(depth.begin(), baseCells, std::uint8_t{0});
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    if (depth[n] == kUnreached) notAField("node " + std::to_string(n) + " is no other node's child");
    if (!node::hasOnlyKnownBits(nodes[n], isQuantized))
      notAField("node " + std::to_string(n) + " has bits without a meaning");
    if (node::isExact(nodes[n])) {
      checkExactLeaf(data.exact, lists, nodes[n]);
      continue;
    }
    if (node::isLeaf(nodes[n])) {
      const int degree = node::degree(nodes[n]);
      if (degree > kMaxDegree) notAField("a cell has degree " + std::to_string(degree));
      const bool areThere = std::visit([&](const auto& c) { return hasLeaf(c, nodes[n]); }, data.coefficients);
      if (!areThere) notAField("a cell's coefficients lie beyond the end, or are not well formed");
      continue;
    }
    const std::size_t first = node::firstChild(nodes[n]);
    if (first <= n || first < baseCells || (first - baseCells) % 8 != 0 || first + 8 > nodes.size() ||
        depth[first] != kUnreached)
      notAField("node " + std::to_string(n) + " has bad children");
    if (depth[n] == kMaxDepth) notAField("it is deeper than " + std::to_string(kMaxDepth) + " levels");
    std::fill_n(depth.begin() + first, 8, std::uint8_t(depth[n] + 1));
  }
}

/// Throws `Error` unless all indices and coordinates of the exact leaves' triangles are in range.
void checkExact(const ExactTriangles& exact) {
  const std::size_t vertices = std::visit([](const auto& v) { return v.size(); }, exact.vertices);
  static constexpr double kLargest = 1e18;  // products of two lengths must be finite in single precision
  const auto isInRange = [](const auto& vertex) {
    return (vertex.template cast<double>().cwiseAbs().array() <= kLargest).all();
  };
  const bool areInRange = std::visit([&](const auto& v) { return std::ranges::all_of(v, isInRange); }, exact.vertices);
  if (!areInRange) notAField("a vertex is out of range");
  for (const auto& triangle : exact.triangles)
    for (const std::uint32_t vertex : triangle)
      if (vertex >= vertices) notAField("a triangle refers to vertex " + std::to_string(vertex));
  if (!(exact.offset >= 0 && exact.offset <= kLargest)) notAField("the offset of its exact cells is out of range");
}

void checkBlendAndBounds(const FieldData& data) {
  if (!(data.blend >= 0 && data.blend <= kMaxBlend)) notAField("its blended zones have a width out of range");
  for (const CellBound& bound : data.bounds)
    if (!(bound.error >= 0) || !(bound.slope >= 0)) notAField("a bound is not a number above 0");
}

void assertNotMovedFrom([[maybe_unused]] const FieldData& field) {
  assert(!field.nodes.empty() && "the field was moved from");
}

template <typename Result>
Result evaluateAt(const FieldData& field, const LookupGrid& lookupGrid, const Vector3& x) {
  if (!contains(lookupGrid.frame, x)) [[unlikely]] {
    const Vector3 closest = closestInDomain(lookupGrid.frame, x);
    Result result = evaluateAt<Result>(field, lookupGrid, closest);
    continueOutside(x - closest, result);
    return result;
  }
  const GridPoint point = gridPoint(lookupGrid.frame, x);
  return evaluateInLeaf<Result>(field, lookupGrid, point.coordinates, findLeaf(field, lookupGrid, point));
}

Cell makeCell(const FieldData& field, const GridFrame& frame, const OctreeNode& leaf) {
  const std::uint64_t bits = field.nodes[leaf.node];
  Cell cell{.id = leaf.node,
            .box = cellBox(frame, leaf.depth, leaf.cellIndex),
            .degree = node::degree(bits),
            .depth = leaf.depth,
            .error = 0};
  const double volume = cellSize(field, leaf.depth).prod();
  if (node::isExact(bits)) return cell;
  cell.error =
      withCoefficients(field, bits, [&](const auto* c) { return basis::topDegreeError(c, cell.degree, volume); });
  return cell;
}

/// Returns the statistics of exact leaves whose lists have these numbers of triangles.
ExactLeafStatistics exactStatistics(std::vector<std::size_t> lists, std::size_t triangles) {
  if (lists.empty()) return {};
  std::ranges::sort(lists);
  return {.leaves = lists.size(),
          .triangles = triangles,
          .medianList = lists[lists.size() / 2],
          .longestList = lists.back()};
}

}  // namespace

double FieldMetadata::rmsEstimate(const Box& domain) const {
  const double volume = (domain.max() - domain.min()).prod();
  return std::sqrt(totalError * std::pow(referenceLength / 2, 5) / volume);
}

bool FieldMetadata::hasEstimate() const {
  return settings.tolerance == 0 && (totalError != 0 || steps || !settings.targetError.isNone());
}

Field::Field(FieldData data) : data_(std::move(data)) {
  checkDomain(data_);
  if (const char* misfit = misfitOf(data_.grid, data_.nodes.size(), data_.bounds.size())) notAField(misfit);
  checkQuantization(data_);
  checkNodes(data_);
  std::visit([](const auto& coefficients) { checkCoefficients(coefficients); }, data_.coefficients);
  checkExact(data_.exact);
  checkBlendAndBounds(data_);
  lookupGrid_ = makeLookupGrid(data_);
}

const char* misfitOf(const std::array<std::uint32_t, 3>& grid, std::uint64_t nodes, std::uint64_t bounds) {
  std::uint64_t cells = 1;
  for (const std::uint32_t n : grid) {
    if (n == 0 || cells > nodes / n) return "its base grid does not fit its nodes";
    cells *= n;
  }
  if (nodes > 0xffffffffu) return "it has 2^32 nodes or more";
  if (bounds != 0 && bounds != nodes) return "its bounds do not fit its nodes";
  return nullptr;
}

std::size_t coefficientBytes(const FieldData& field) {
  return std::visit([](const auto& c) { return arrayOf(c).size() * sizeof(*arrayOf(c).data()); }, field.coefficients);
}

bool isMapped(const FieldData& field) {
  return std::visit([](const auto& c) { return arrayOf(c).isMapped(); }, field.coefficients);
}

FieldBytes Field::bytesOfParts() const {
  const auto sizeOf = [](const auto& values) { return values.size() * sizeof(values[0]); };
  const ExactTriangles& exact = data_.exact;
  return {.nodes = sizeOf(data_.nodes),
          .coefficients = coefficientBytes(data_),
          .exactTriangles = std::visit(sizeOf, exact.vertices) + sizeOf(exact.triangles) + sizeOf(exact.lists),
          .lookupGrid = sizeOf(lookupGrid_.entries) + sizeOf(lookupGrid_.blendExtents),
          .bounds = sizeOf(data_.bounds)};
}

double Field::value(const Vector3& x) const {
  assertNotMovedFrom(data_);
  return evaluateAt<double>(data_, lookupGrid_, x);
}

ValueAndGradient Field::valueAndGradient(const Vector3& x) const {
  assertNotMovedFrom(data_);
  return evaluateAt<ValueAndGradient>(data_, lookupGrid_, x);
}

ValueGradientHessian Field::valueGradientHessian(const Vector3& x) const {
  assertNotMovedFrom(data_);
  return evaluateAt<ValueGradientHessian>(data_, lookupGrid_, x);
}

void Field::values(std::span<const Vector3> points, std::span<double> out) const {
  assert(points.size() == out.size());
  assertNotMovedFrom(data_);
  evaluateBatch(data_, lookupGrid_, points, out);
}

void Field::valuesAndGradients(std::span<const Vector3> points, std::span<ValueAndGradient> out) const {
  assert(points.size() == out.size());
  assertNotMovedFrom(data_);
  evaluateBatch(data_, lookupGrid_, points, out);
}

void Field::valuesAndGradients(std::span<const Vector3> points, std::span<double> values,
                               std::span<Vector3> gradients) const {
  assert(points.size() == values.size() && points.size() == gradients.size());
  std::array<ValueAndGradient, 512> piece;  // two batches or four
  for (std::size_t first = 0; first < points.size(); first += piece.size()) {
    const std::size_t count = std::min(piece.size(), points.size() - first);
    valuesAndGradients(points.subspan(first, count), std::span(piece).first(count));
    for (std::size_t i = 0; i < count; ++i) {
      values[first + i] = piece[i].value;
      gradients[first + i] = piece[i].gradient;
    }
  }
}

void Field::valuesGradientsHessians(std::span<const Vector3> points, std::span<ValueGradientHessian> out) const {
  assert(points.size() == out.size());
  std::ranges::transform(points, out.begin(), [&](const Vector3& x) { return valueGradientHessian(x); });
}

Cell Field::cellAt(const Vector3& x) const {
  assertNotMovedFrom(data_);
  const GridFrame& frame = lookupGrid_.frame;
  return makeCell(data_, frame, findLeafNode(data_, gridPoint(frame, closestInDomain(frame, x))));
}

void Field::forEachCell(const std::function<void(const Cell&)>& visit) const {
  assertNotMovedFrom(data_);
  visitNodes(data_, [&](const OctreeNode& at) {
    if (node::isLeaf(data_.nodes[at.node])) visit(makeCell(data_, lookupGrid_.frame, at));
    return true;
  });
}

std::string levelName(int level) {
  static_assert(kExactDegree > kMaxDepth);
  return level == kExactDegree ? "exact" : std::to_string(level);
}

FieldStatistics statistics(const Field& field) {
  FieldStatistics s;
  const FieldData& data = field.data();
  assertNotMovedFrom(data);
  std::vector<std::size_t> exactLists;
  const double domainVolume = (field.domain().max() - field.domain().min()).prod();
  visitNodes(data, [&](const OctreeNode& at) {  // `forEachCell` would read all coefficients.
    const std::uint64_t bits = data.nodes[at.node];
    if (!node::isLeaf(bits)) return true;
    const Box box = cellBox(field.lookupGrid().frame, at.depth, at.cellIndex);
    const double share = (box.max() - box.min()).prod() / domainVolume;
    const int degree = node::degree(bits);
    ++s.leaves;
    ++s.degreeLeaves[degree];
    ++s.depthLeaves[at.depth];
    s.degreeVolume[degree] += share;
    s.depthVolume[at.depth] += share;
    if (degree == kExactDegree)
      exactLists.push_back(TriangleListView(data.exact, bits).count());
    else
      s.coefficients += coefficientCount(degree);
    return true;
  });
  s.nodes = data.nodes.size();
  s.bytes = field.bytes();
  s.exact = exactStatistics(std::move(exactLists), data.exact.triangles.size());
  return s;
}

std::string precisionName(const Field& field) {
  constexpr std::array kNames = {"double", "float", "quantized"};
  return kNames[field.data().coefficients.index()];
}

}  // namespace hpsdf
