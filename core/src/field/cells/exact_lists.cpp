#include "field/cells/exact_lists.h"

#include <algorithm>
#include <utility>

namespace hpsdf::detail {
namespace {

/// Packs ascending triangle numbers into runs.
std::vector<std::uint32_t> runsOf(std::span<const std::uint32_t> triangles) {
  std::vector<std::uint32_t> runs;
  for (std::size_t begin = 0; begin < triangles.size();) {
    std::uint32_t length = 1;
    while (length < triangle_run::kMostLength && begin + length < triangles.size() &&
           triangles[begin + length] == triangles[begin] + length)
      ++length;
    runs.push_back(triangle_run::packed(triangles[begin], length));
    begin += length;
  }
  runs.back() |= triangle_run::kLast;
  return runs;
}

}  // namespace

void ExactListPacker::mark(std::span<const std::uint32_t> triangles) {
  for (const std::uint32_t triangle : triangles) numbers_[triangle] = 0;
}

void ExactListPacker::number() {
  std::uint32_t next = 0;
  for (std::uint32_t& number : numbers_)
    if (number != kUnused) number = next++;
  isNumbered_ = true;
}

std::uint32_t ExactListPacker::pack(std::span<const std::uint32_t> triangles) {
  if (!isNumbered_) number();
  std::vector<std::uint32_t> numbers(triangles.size());
  std::ranges::transform(triangles, numbers.begin(), [&](std::uint32_t triangle) { return numbers_[triangle]; });
  std::vector<std::uint32_t> runs = runsOf(numbers);
  const auto [entry, isNew] = offsets_.try_emplace(runs, static_cast<std::uint32_t>(lists_.size()));
  if (isNew) lists_.insert(lists_.end(), runs.begin(), runs.end());
  return entry->second;
}

ExactTriangles ExactListPacker::finish() {
  ExactTriangles exact;
  exact.lists = std::move(lists_);
  if (exact.lists.empty()) return exact;
  exact.offset = search_.offset();
  std::vector<Vector3> vertices;
  std::vector<std::uint32_t> vertexNumbers(search_.vertices().size(), kUnused);
  for (std::size_t triangle = 0; triangle < numbers_.size(); ++triangle) {
    if (numbers_[triangle] == kUnused) continue;
    auto corners = search_.triangles()[triangle];
    for (std::uint32_t& corner : corners) {
      std::uint32_t& number = vertexNumbers[corner];
      if (number == kUnused) {
        number = static_cast<std::uint32_t>(vertices.size());
        vertices.push_back(search_.vertices()[corner]);
      }
      corner = number;
    }
    exact.triangles.push_back(corners);
  }
  exact.vertices = std::move(vertices);
  return exact;
}

}  // namespace hpsdf::detail
