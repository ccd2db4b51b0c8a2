#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>

#include "bvh/hierarchy.h"
#include "sign/pseudonormals.h"
#include "util/shared_array.h"

namespace hpsdf::parts {

/// A part of a mesh: its own triangles, and all others that meet the box of these. Around its own triangles it knows
/// all neighbours, so that their pseudonormals are those of the whole mesh.
struct MeshPart {
  static constexpr std::uint32_t kOwn = std::uint32_t{1} << 31;  ///< the bit in `faces` of the part's own triangles

  bvh::Hierarchy hierarchy;
  sign::Pseudonormals normals;
  detail::SharedArray<std::uint32_t> faces;  ///< by slot: the triangle's index in the whole mesh, and kOwn

  std::uint32_t faceOf(std::uint32_t slot) const { return faces[slot] & ~kOwn; }
  bool isOwn(std::uint32_t slot) const { return (faces[slot] & kOwn) != 0; }
};

/// The size and the checksum (XXH3) of a part's file.
struct PartStamp {
  std::uint64_t bytes = 0;
  std::uint64_t checksum = 0;
};

/// Writes a part to a file. Throws `Error` as `OutputFile` does.
PartStamp writePart(const MeshPart& part, const std::filesystem::path& file);

/// Maps a part's file into memory. If `isTrusted` is false, reads it once to compare its checksum. Throws `Error` (of
/// the kind `file`) if the file is missing or differs from its stamp.
std::shared_ptr<const MeshPart> mapPart(const std::filesystem::path& file, const PartStamp& stamp, bool isTrusted);

}  // namespace hpsdf::parts
