#include "hpsdf/field.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <string>

#include "basis/projection.h"
#include "field/blend.h"
#include "field/evaluate.h"
#include "field/evaluate_batch.h"
#include "field/reach.h"
#include "field/visit_nodes.h"
#include "hpsdf/error.h"

namespace hpsdf {
namespace {

[[noreturn]] void notAField(const std::string& what) { throw Error("not a valid field: " + what); }

void checkDomain(const FieldData& data) {
  if (data.domain.isEmpty() || !data.domain.min().allFinite() || !data.domain.max().allFinite() ||
      !((data.domain.max() - data.domain.min()).minCoeff() > 0) || !(data.domain.max() - data.domain.min()).allFinite())
    notAField("its domain is empty or not finite");
}

/// Number of base cells; the nodes must at least hold them.
std::size_t checkGrid(const FieldData& data) {
  std::size_t cells = 1;
  for (const std::uint32_t n : data.grid) {
    if (n == 0 || cells > data.nodes.size() / n) notAField("its base grid does not fit its nodes");
    cells *= n;
  }
  if (data.nodes.size() > 0xffffffffu) notAField("it has more than 2^32 nodes");
  return cells;
}

/// Every group of children belongs to exactly one node that comes before it, so that the nodes form trees.
void checkNodes(const FieldData& data, std::size_t baseCells, std::size_t coefficients) {
  const auto& nodes = data.nodes;
  if ((nodes.size() - baseCells) % 8 != 0) notAField("its nodes do not come in groups of eight");
  std::vector<std::uint8_t> depth(nodes.size(), 0xff);
  std::fill_n(depth.begin(), baseCells, std::uint8_t{0});
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    if (depth[n] == 0xff) notAField("node " + std::to_string(n) + " is nobody's child");
    if (!node::hasOnlyKnownBits(nodes[n])) notAField("node " + std::to_string(n) + " has bits without a meaning");
    if (node::isLeaf(nodes[n])) {
      const int degree = node::degree(nodes[n]);
      if (degree > kMaxDegree) notAField("a cell has degree " + std::to_string(degree));
      if (std::size_t(node::offset(nodes[n])) + coefficientCount(degree) > coefficients)
        notAField("a cell's coefficients lie beyond the end");
      continue;
    }
    const std::size_t first = node::firstChild(nodes[n]);
    if (first <= n || first < baseCells || (first - baseCells) % 8 != 0 || first + 8 > nodes.size() ||
        depth[first] != 0xff)
      notAField("node " + std::to_string(n) + " has bad children");
    if (depth[n] == kMaxDepth) notAField("it is deeper than " + std::to_string(kMaxDepth) + " levels");
    std::fill_n(depth.begin() + first, 8, std::uint8_t(depth[n] + 1));
  }
}

void checkBlendAndBounds(const FieldData& data) {
  if (!(data.blend >= 0 && data.blend <= kMaxBlend)) notAField("its blended zones have a width out of range");
  if (!data.bounds.empty() && data.bounds.size() != data.nodes.size()) notAField("its bounds do not fit its nodes");
  for (const CellBound& bound : data.bounds)
    if (!(bound.error >= 0) || !(bound.slope >= 0)) notAField("a bound is not a number above 0");
}

template <typename Answer>
Answer answerOne(const FieldData& field, const Directory& directory, const Vector3& x) {
  if (!contains(directory.frame, x)) [[unlikely]] {
    const Vector3 closest = closestWithin(directory.frame, x);
    Answer result = answerOne<Answer>(field, directory, closest);
    extend(x - closest, result);
    return result;
  }
  const GridPoint at = gridPoint(directory.frame, x);
  return answerWithin<Answer>(field, directory, at.coordinates, find(field, directory, at));
}

/// As deep as a sixteenth of the field's own size allows.
Directory makeDirectory(const FieldData& field) {
  Directory directory;
  const std::size_t base = std::size_t(field.grid[0]) * field.grid[1] * field.grid[2];
  const std::size_t bytes = std::visit([](const auto& c) { return c.size() * sizeof(c[0]); }, field.coefficients) +
                            field.nodes.size() * sizeof(field.nodes[0]);
  const std::size_t most = bytes / 16 / sizeof(directory.entries[0]);
  while (directory.depth < kMaxDepth && base << (3 * (directory.depth + 1)) <= most) ++directory.depth;
  directory.entries.resize(base << (3 * directory.depth));
  if (field.blend > 0) {
    directory.reaches = findReaches(field);
    directory.reaches.resize(field.nodes.size() + directory.entries.size());
  }
  directory.frame = gridFrame(field);
  directory.row = std::int64_t{field.grid[0]} << directory.depth;
  directory.slab = directory.row * (std::int64_t{field.grid[1]} << directory.depth);
  visitNodes(field, [&](const Visited& at) {
    if (!node::isLeaf(field.nodes[at.node]) && at.depth < directory.depth) return true;
    const std::size_t width = std::size_t{1} << (directory.depth - at.depth);
    std::array<std::size_t, 3> first;  // of the entries that the node covers
    for (int axis = 0; axis < 3; ++axis) first[axis] = ((at.base[axis] << at.depth) + at.path[axis]) * width;
    for (std::size_t z = first[2]; z < first[2] + width; ++z)
      for (std::size_t y = first[1]; y < first[1] + width; ++y) {
        const std::size_t row = z * directory.slab + y * directory.row + first[0];
        std::fill_n(&directory.entries[row], width, Directory::entry(field.nodes[at.node], at.depth));
        if (field.blend > 0)
          std::fill_n(&directory.reaches[field.nodes.size() + row], width, directory.reaches[at.node]);
      }
    return false;
  });
  return directory;
}

Cell makeCell(const FieldData& field, const GridFrame& frame, std::uint32_t id, int depth,
              const std::array<std::int64_t, 3>& place) {
  Cell cell;
  cell.id = id;
  cell.depth = depth;
  cell.degree = node::degree(field.nodes[id]);
  cell.box = boxOf(frame, depth, place);
  const double volume = cellSize(field, depth).prod();
  cell.error = std::visit(
      [&](const auto& c) { return topDegreeError(c.data() + node::offset(field.nodes[id]), cell.degree, volume); },
      field.coefficients);
  return cell;
}

}  // namespace

double FieldMetadata::rmsEstimate(const Box& domain) const {
  const double volume = (domain.max() - domain.min()).prod();
  return std::sqrt(totalError * std::pow(referenceLength / 2, 5) / volume);
}

Field::Field(FieldData data) : data_(std::move(data)) {
  checkDomain(data_);
  const std::size_t baseCells = checkGrid(data_);
  std::visit(
      [&](const auto& coefficients) {
        checkNodes(data_, baseCells, coefficients.size());
        for (const auto c : coefficients)
          if (!std::isfinite(c)) notAField("a coefficient is not finite");
      },
      data_.coefficients);
  checkBlendAndBounds(data_);
  directory_ = makeDirectory(data_);
}

std::size_t Field::bytes() const {
  const auto sizeOf = [](const auto& values) { return values.size() * sizeof(values[0]); };
  return sizeOf(data_.nodes) + sizeOf(data_.bounds) + sizeOf(directory_.entries) + sizeOf(directory_.reaches) +
         std::visit(sizeOf, data_.coefficients);
}

double Field::value(const Vector3& x) const { return answerOne<double>(data_, directory_, x); }

ValueAndGradient Field::valueAndGradient(const Vector3& x) const {
  return answerOne<ValueAndGradient>(data_, directory_, x);
}

void Field::values(std::span<const Vector3> points, std::span<double> out) const {
  assert(points.size() == out.size());
  answerBatch(data_, directory_, points, out);
}

void Field::valuesAndGradients(std::span<const Vector3> points, std::span<ValueAndGradient> out) const {
  assert(points.size() == out.size());
  answerBatch(data_, directory_, points, out);
}

Cell Field::cellAt(const Vector3& x) const {
  const GridPoint point = gridPoint(directory_.frame, closestWithin(directory_.frame, x));
  const Location at = locate(data_, point);
  return makeCell(data_, directory_.frame, at.node, at.depth,
                  {point.cell(0, at.depth), point.cell(1, at.depth), point.cell(2, at.depth)});
}

void Field::forEachCell(const std::function<void(const Cell&)>& visit) const {
  visitNodes(data_, [&](const Visited& at) {
    if (node::isLeaf(data_.nodes[at.node])) visit(makeCell(data_, directory_.frame, at.node, at.depth, placeOf(at)));
    return true;
  });
}

}  // namespace hpsdf
