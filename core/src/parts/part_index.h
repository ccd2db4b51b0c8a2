#pragma once

#include <filesystem>
#include <vector>

#include "hpsdf/distance_function.h"
#include "hpsdf/types.h"
#include "parts/mesh_part.h"

namespace hpsdf::parts {

/// The description of a mesh in parts, which tells where they lie without reading them.
struct PartIndex {
  struct Part {
    Box box;  ///< of the part's own triangles
    PartStamp stamp;
  };

  Source source;
  std::vector<Part> parts;
};

/// Returns the file of a part in the folder of parts.
std::filesystem::path partFile(const std::filesystem::path& folder, std::size_t part);

/// Writes the index into the folder of the parts. Throws `Error` as `OutputFile` does.
void writeIndex(const PartIndex& index, const std::filesystem::path& folder);

/// Reads the index of a folder of parts. Throws `Error` (of the kind `file`) if it is missing or damaged.
PartIndex readIndex(const std::filesystem::path& folder);

}  // namespace hpsdf::parts
