#include "field/cells/exact_lists.h"

#include <utility>

#include "hpsdf/detail/triangle_list.h"

namespace hpsdf::detail {

std::size_t packedWords(const TriangleList& list, const LeafSign& sign) {
  const std::vector<std::uint32_t>& triangles = list.triangles;
  std::size_t words = TriangleListView::runsAt(static_cast<std::uint32_t>(triangles.size()));
  for (std::size_t begin = 0, length = 0; begin < triangles.size(); begin += length, ++words)
    for (length = 1; length < triangle_run::kMostLength && begin + length < triangles.size(); ++length)
      if (triangles[begin + length] != triangles[begin] + length) break;
  return words + (sign.rule == ExactSign::winding ? TriangleListView::kReferenceWords : 0);
}

void ExactListPacker::mark(const TriangleList& list) {
  for (const std::uint32_t triangle : list.triangles) numbers_[triangle] = 0;
}

void ExactListPacker::number() {
  std::uint32_t next = 0;
  for (std::uint32_t& number : numbers_)
    if (number != kUnused) number = next++;
  isNumbered_ = true;
}

std::vector<std::uint32_t> ExactListPacker::packed(const TriangleList& list) const {
  const auto count = static_cast<std::uint32_t>(list.triangles.size());
  std::vector<std::uint32_t> words(TriangleListView::runsAt(count));
  words[0] = count;
  for (std::uint32_t i = 0; i < count; ++i) words[1 + i / 4] |= std::uint32_t{list.octants[i]} << (8 * (i % 4));
  const auto numberAt = [&](std::uint32_t i) { return numbers_[list.triangles[i]]; };
  for (std::uint32_t begin = 0, length = 0; begin < count; begin += length) {
    for (length = 1; length < triangle_run::kMostLength && begin + length < count; ++length)
      if (numberAt(begin + length) != numberAt(begin) + length) break;
    words.push_back(triangle_run::packed(numberAt(begin), length));
  }
  words.back() |= triangle_run::kLast;
  return words;
}

std::uint32_t ExactListPacker::pack(const TriangleList& list, const LeafSign& sign) {
  if (!isNumbered_) number();
  std::vector<std::uint32_t> words = packed(list);
  if (sign.rule == ExactSign::winding) {
    words[0] |= TriangleListView::kReferenceBit;
    const Vector3& corner = search_.vertices()[search_.triangles()[list.triangles.front()][0]];
    const auto reference = PackedReference(sign.reference, corner).words();
    words.insert(words.end(), reference.begin(), reference.end());
  }
  const auto [entry, isNew] = offsets_.try_emplace(std::move(words), static_cast<std::uint32_t>(lists_.size()));
  if (isNew) lists_.insert(lists_.end(), entry->first.begin(), entry->first.end());
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
