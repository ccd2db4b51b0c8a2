#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "hpsdf/types.h"
#include "util/checked_file.h"

namespace hpsdf::mesh {

/// The hash that `fingerprint` returns, of a mesh whose vertices and then triangles are added in their order.
class MeshFingerprint {
 public:
  MeshFingerprint(std::uint64_t vertices, std::uint64_t triangles) {
    checksum_.add(detail::bytesOf(vertices));
    checksum_.add(detail::bytesOf(triangles));
  }

  void add(const Vector3& vertex) {
    const Vector3 v = vertex.array() + 0.0;  // Adding 0 turns -0 into 0, so that equal positions have equal bits.
    checksum_.add(std::as_bytes(std::span(v.data(), 3)));
  }
  void add(std::span<const std::array<std::uint32_t, 3>> triangles) { checksum_.add(std::as_bytes(triangles)); }

  std::uint64_t value() const { return checksum_.value(); }

 private:
  detail::Checksum checksum_;
};

}  // namespace hpsdf::mesh
