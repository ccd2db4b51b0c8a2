#include "scene/cell_lines.h"

#include <array>
#include <bit>
#include <cmath>

#include "scene/cell_boxes.h"
#include "scene/line_painter.h"

namespace hpsdf::render {
namespace {

/// Identifies an edge of a cell. All cells of one size that share the edge have the same key for it.
struct EdgeKey {
  std::array<std::uint64_t, 3> from;  ///< lower end of the edge, in units of the smallest possible cell
  std::uint64_t kind;                 ///< axis of the edge, and octree depth of its cells
  bool operator==(const EdgeKey&) const = default;
};

/// Collects the edges of cells. An edge that cells of one size share is collected once.
class EdgeCollector {
 public:
  EdgeCollector(const Field& field, std::size_t mostCells)
      : lower_(field.domain().min()),
        cellsPerUnit_(Vector3(field.grid()[0], field.grid()[1], field.grid()[2]).cwiseQuotient(field.domain().sizes()) *
                      std::ldexp(1.0, kMaxDepth)),
        slots_(std::bit_ceil(24 * mostCells + 1), 0) {
    keys_.reserve(12 * mostCells);
  }

  /// Adds the edges of a cell. `box` is the part of the cell that a clipping plane does not remove.
  void add(const Cell& cell, const Box& box) {
    const Vector3 first = (cell.box.min() - lower_).cwiseProduct(cellsPerUnit_);
    const std::uint64_t size = std::uint64_t{1} << (kMaxDepth - cell.depth);
    const std::array<Vector3, 8> corners = cornersOf(box);
    for (int edge = 0; edge < 12; ++edge) {
      // Edges 0 to 3 run along x, 4 to 7 along y, 8 to 11 along z. The two low bits of `edge` choose the sides along
      // the other two axes.
      const int axis = edge / 4, from = (edge & 1) << (axis + 1) % 3 | (edge >> 1 & 1) << (axis + 2) % 3;
      EdgeKey key{{}, std::uint64_t(cell.depth) * 3 + axis};
      for (int k = 0; k < 3; ++k) key.from[k] = std::uint64_t(std::llround(first[k])) + (from >> k & 1 ? size : 0);
      if (insert(key)) segments.push_back({corners[from], corners[from | 1 << axis], cell.box.sizes()[axis]});
    }
  }

  std::vector<SpaceLine> segments;

 private:
  /// Adds a key to the hash set. Returns true if the key is new. This hash set with open addressing is several
  /// times faster than `std::unordered_set`.
  bool insert(const EdgeKey& key) {
    std::uint64_t hash = key.kind;
    for (const std::uint64_t x : key.from) hash = (hash ^ x) * 0x9e3779b97f4a7c15;
    for (std::size_t i = hash >> 32;; ++i) {
      std::uint32_t& slot = slots_[i & (slots_.size() - 1)];
      if (slot != 0 && keys_[slot - 1] == key) return false;
      if (slot != 0) continue;
      keys_.push_back(key);
      slot = static_cast<std::uint32_t>(keys_.size());
      return true;
    }
  }

  Vector3 lower_;
  Vector3 cellsPerUnit_;              ///< number of cells of the greatest depth in a unit of length, along each axis
  std::vector<std::uint32_t> slots_;  ///< index of a key + 1, or 0 for a free slot
  std::vector<EdgeKey> keys_;
};

}  // namespace

std::vector<float> cellLines(const Field& field, const SurfaceView& view, const std::vector<Cell>& cells,
                             const ViewBuffers& buffers, double lineWidth, float hiddenStrength) {
  const LinePainter painter(view.camera, field.domain(), buffers, lineWidth, {.hiddenStrength = hiddenStrength});
  EdgeCollector collector(field, cells.size());
  for (const Cell& cell : cells)
    if (const Box box = clipped(cell.box, view); !box.isEmpty() && painter.mayShow(cell.box)) collector.add(cell, box);
  return painter.coverage(collector.segments);
}

}  // namespace hpsdf::render
