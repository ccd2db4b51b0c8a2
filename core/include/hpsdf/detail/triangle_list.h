#pragma once
// Access to the triangles of exact leaves.

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <variant>

#include "hpsdf/detail/field_data.h"

namespace hpsdf {

/// The list of an exact leaf within `ExactTriangles::lists`.
class TriangleListView {
 public:
  TriangleListView(const ExactTriangles& exact, std::uint64_t leaf) : from_(&exact.lists[node::offset(leaf)]) {}
  explicit TriangleListView(const std::uint32_t* from) : from_(from) {}

  std::uint32_t count() const { return *from_ & ~kReferenceBit; }
  bool hasReference() const { return (*from_ & kReferenceBit) != 0; }
  /// Returns the octants of the triangle at place i of the list.
  std::uint8_t octants(std::uint32_t i) const { return static_cast<std::uint8_t>(from_[1 + i / 4] >> (8 * (i % 4))); }
  /// Returns the octants of all triangles, a byte each.
  const std::uint8_t* octants() const {
    static_assert(std::endian::native == std::endian::little);  // the words of a list are read as bytes
    return reinterpret_cast<const std::uint8_t*>(from_ + 1);
  }
  const std::uint32_t* runs() const { return from_ + runsAt(count()); }

  /// Returns the offset of the runs in a list of `count` triangles, that is behind their number and their octants.
  static std::size_t runsAt(std::uint32_t count) { return 1 + (std::size_t{count} + 3) / 4; }

  /// Calls f(run) for each run.
  template <typename F>
  void forEachRun(const F& f) const {
    for (const std::uint32_t* run = runs();; ++run) {
      f(*run);
      if (triangle_run::isLast(*run)) return;
    }
  }

  /// Returns the words behind the runs, where the reference of a list begins if it has one.
  const std::uint32_t* referenceWords() const {
    const std::uint32_t* word = runs();
    while (!triangle_run::isLast(*word)) ++word;
    return word + 1;
  }

  static constexpr std::uint32_t kReferenceBit = std::uint32_t{1} << 31;  ///< in the number of triangles
  static constexpr std::size_t kReferenceWords = 4;

 private:
  const std::uint32_t* from_;
};

/// Calls f(index) for each triangle of an exact leaf's list. `leaf` is the packed node.
template <typename F>
void forEachTriangle(const ExactTriangles& exact, std::uint64_t leaf, const F& f) {
  TriangleListView(exact, leaf).forEachRun([&](std::uint32_t run) {
    const std::uint32_t first = triangle_run::first(run), end = first + triangle_run::length(run);
    for (std::uint32_t triangle = first; triangle < end; ++triangle) f(triangle);
  });
}

/// The words of a `WindingReference`, as they follow the runs of a list.
struct PackedReference {
  Eigen::Vector3f offset;  ///< of the point from the first corner of the first listed triangle, in world units
  std::int32_t winding;

  explicit PackedReference(const std::uint32_t* words)
      : offset(std::bit_cast<float>(words[0]), std::bit_cast<float>(words[1]), std::bit_cast<float>(words[2])),
        winding(std::bit_cast<std::int32_t>(words[3])) {}
  /// `corner` is the first corner of the first listed triangle.
  PackedReference(const WindingReference& reference, const Vector3& corner)
      : offset((reference.point - corner).cast<float>()), winding(reference.winding) {}

  std::array<std::uint32_t, TriangleListView::kReferenceWords> words() const {
    return {std::bit_cast<std::uint32_t>(offset.x()), std::bit_cast<std::uint32_t>(offset.y()),
            std::bit_cast<std::uint32_t>(offset.z()), std::bit_cast<std::uint32_t>(winding)};
  }
};

/// Returns the reference of an exact leaf whose sign follows from the winding number. `leaf` is the packed node.
inline WindingReference referenceOf(const ExactTriangles& exact, std::uint64_t leaf) {
  const TriangleListView list(exact, leaf);
  const PackedReference packed(list.referenceWords());
  const std::uint32_t first = exact.triangles[triangle_run::first(*list.runs())][0];
  const Vector3 corner = std::visit(
      [&](const auto& vertices) { return Vector3(vertices[first].template cast<double>()); }, exact.vertices);
  return {corner + packed.offset.cast<double>(), packed.winding};
}

}  // namespace hpsdf
