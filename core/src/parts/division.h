#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "hpsdf/types.h"

namespace hpsdf::parts {

/// A division of a box into parts that hold about equally many triangles. The parts are made of cells of a regular
/// grid; a triangle belongs to the part of the cell that its centroid lies in. Such a triangle is one of the part's
/// own.
class Division {
 public:
  static constexpr int kCells = 128;  ///< along each axis

  explicit Division(const Box& box);

  /// Counts a triangle in its cell.
  void count(const Vector3& centroid) { ++counts_[cellAt(centroid)]; }
  /// Divides the box until no part has more than `most` triangles, or a part is one cell. Returns the number of parts.
  std::size_t divide(std::size_t most);

  std::uint32_t partOf(const Vector3& centroid) const { return partOf_[cellAt(centroid)]; }

  /// Receives the boxes of the parts' own triangles, for `forEachMeeting`.
  void setBoxes(std::vector<Box> boxes);
  const std::vector<Box>& boxes() const { return boxes_; }

  /// Calls visit(part) once for each part whose box meets `box`.
  template <typename Visit>
  void forEachMeeting(const Box& box, const Visit& visit) {
    meeting_.clear();
    forEachCell(box, [&](std::size_t cell) {
      for (std::size_t i = firstOfCell_[cell]; i < firstOfCell_[cell + 1]; ++i) {
        const std::uint32_t part = partsOfCells_[i];
        if (lastMet_[part] == meetings_ || !boxes_[part].intersects(box)) continue;
        lastMet_[part] = meetings_;
        meeting_.push_back(part);
      }
    });
    ++meetings_;
    for (const std::uint32_t part : meeting_) visit(part);
  }

 private:
  using Index = Eigen::Array3i;

  Index indexAt(const Vector3& x) const;
  static std::size_t numberOf(const Index& cell) {
    return (std::size_t(cell[2]) * kCells + std::size_t(cell[1])) * kCells + std::size_t(cell[0]);
  }
  std::size_t cellAt(const Vector3& x) const { return numberOf(indexAt(x)); }

  template <typename Visit>
  void forEachCell(const Box& box, const Visit& visit) const {
    const Index low = indexAt(box.min()), high = indexAt(box.max());
    for (int z = low[2]; z <= high[2]; ++z)
      for (int y = low[1]; y <= high[1]; ++y)
        for (int x = low[0]; x <= high[0]; ++x) visit(numberOf({x, y, z}));
  }

  void divide(const Index& low, const Index& high, std::size_t most);

  Box box_;
  Vector3 perUnit_;  ///< cells per unit along each axis
  std::vector<std::uint32_t> counts_;
  std::vector<std::uint32_t> partOf_;
  std::uint32_t parts_ = 0;
  std::vector<Box> boxes_;
  /// The parts whose boxes meet cell c are partsOfCells_[firstOfCell_[c]] to partsOfCells_[firstOfCell_[c + 1] - 1].
  std::vector<std::size_t> firstOfCell_;
  std::vector<std::uint32_t> partsOfCells_;
  std::vector<std::uint64_t> lastMet_;  ///< by part: the last call of `forEachMeeting` that met it
  std::uint64_t meetings_ = 1;
  std::vector<std::uint32_t> meeting_;
};

}  // namespace hpsdf::parts
