#include "hpsdf/field.h"

#include <cassert>
#include <cmath>
#include <string>

#include "basis/projection.h"
#include "field/evaluate.h"
#include "hpsdf/error.h"

namespace hpsdf {
namespace {

[[noreturn]] void notAField(const std::string& what) { throw Error("not a valid field: " + what); }

void checkDomain(const FieldData& data) {
  if (data.domain.isEmpty() || !data.domain.min().allFinite() || !data.domain.max().allFinite() ||
      !((data.domain.max() - data.domain.min()).minCoeff() > 0))
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

std::array<double, 3> localFrom(const Location& at) {
  return {2 * at.fraction[0] - 1, 2 * at.fraction[1] - 1, 2 * at.fraction[2] - 1};
}

/// The closest point of the domain; NaN stays NaN.
Vector3 clampedTo(const Box& domain, const Vector3& x) { return x.cwiseMax(domain.min()).cwiseMin(domain.max()); }

/// Without squares, which overflow or vanish far from the domain or very close to it. (The hypot of three arguments
/// of GCC 12 loses NaN and infinity.)
double length(const Vector3& v) { return std::hypot(std::hypot(v.x(), v.y()), v.z()); }

template <typename T>
double valueIn(const FieldData& field, const T* coefficients, const Vector3& x) {
  const Location at = locate(field, x);
  const std::uint64_t leaf = field.nodes[at.node];
  const double inside = evaluate(coefficients + node::offset(leaf), node::degree(leaf), localFrom(at));
  if (field.domain.contains(x)) return inside;
  return inside + length(x - clampedTo(field.domain, x));
}

template <typename T>
ValueAndGradient valueAndGradientIn(const FieldData& field, const T* coefficients, const Vector3& x) {
  const Location at = locate(field, x);
  const std::uint64_t leaf = field.nodes[at.node];
  ValueAndGradient result = evaluateWithGradient(coefficients + node::offset(leaf), node::degree(leaf), localFrom(at));
  result.gradient.array() *= 2 / cellSize(field, at.depth).array();
  if (field.domain.contains(x)) return result;
  // f(q) + |x - q|: along an axis on which x is clamped, f(q) does not change
  const Vector3 beyond = x - clampedTo(field.domain, x);
  const double distance = length(beyond);
  result.value += distance;
  for (int axis = 0; axis < 3; ++axis)
    if (beyond[axis] != 0) result.gradient[axis] = 0;
  result.gradient += beyond / distance;
  return result;
}

Cell makeCell(const FieldData& field, std::uint32_t id, int depth, const std::array<std::uint32_t, 3>& base,
              const std::array<std::uint32_t, 3>& path) {
  Cell cell;
  cell.id = id;
  cell.depth = depth;
  cell.degree = node::degree(field.nodes[id]);
  const double scale = std::ldexp(1.0, -depth);
  Vector3 lo, hi;
  for (int axis = 0; axis < 3; ++axis) {
    const double origin = field.domain.min()[axis];
    const double size = field.domain.max()[axis] - origin;
    lo[axis] = origin + (base[axis] + path[axis] * scale) / field.grid[axis] * size;
    hi[axis] = origin + (base[axis] + (path[axis] + 1) * scale) / field.grid[axis] * size;
  }
  cell.box = Box(lo, hi);
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
}

double Field::value(const Vector3& x) const {
  return std::visit([&](const auto& c) { return valueIn(data_, c.data(), x); }, data_.coefficients);
}

ValueAndGradient Field::valueAndGradient(const Vector3& x) const {
  return std::visit([&](const auto& c) { return valueAndGradientIn(data_, c.data(), x); }, data_.coefficients);
}

void Field::values(std::span<const Vector3> points, std::span<double> out) const {
  assert(points.size() == out.size());
  std::visit(
      [&](const auto& c) {
        for (std::size_t i = 0; i < points.size(); ++i) out[i] = valueIn(data_, c.data(), points[i]);
      },
      data_.coefficients);
}

void Field::valuesAndGradients(std::span<const Vector3> points, std::span<ValueAndGradient> out) const {
  assert(points.size() == out.size());
  std::visit(
      [&](const auto& c) {
        for (std::size_t i = 0; i < points.size(); ++i) out[i] = valueAndGradientIn(data_, c.data(), points[i]);
      },
      data_.coefficients);
}

Cell Field::cellAt(const Vector3& x) const {
  const Location at = locate(data_, x);
  return makeCell(data_, at.node, at.depth, at.base, at.path);
}

void Field::forEachCell(const std::function<void(const Cell&)>& visit) const {
  struct Entry {
    std::uint32_t node;
    int depth;
    std::array<std::uint32_t, 3> path;
  };
  std::vector<Entry> stack;
  std::uint32_t root = 0;
  for (std::uint32_t z = 0; z < data_.grid[2]; ++z)
    for (std::uint32_t y = 0; y < data_.grid[1]; ++y)
      for (std::uint32_t x = 0; x < data_.grid[0]; ++x) {
        stack.push_back({root++, 0, {0, 0, 0}});
        while (!stack.empty()) {
          const Entry entry = stack.back();
          stack.pop_back();
          const std::uint64_t bits = data_.nodes[entry.node];
          if (node::isLeaf(bits)) {
            visit(makeCell(data_, entry.node, entry.depth, {x, y, z}, entry.path));
            continue;
          }
          for (std::uint32_t child = 8; child-- > 0;)
            stack.push_back({node::firstChild(bits) + child,
                             entry.depth + 1,
                             {2 * entry.path[0] + (child & 1), 2 * entry.path[1] + ((child >> 1) & 1),
                              2 * entry.path[2] + (child >> 2)}});
        }
      }
}

}  // namespace hpsdf
