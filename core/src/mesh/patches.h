#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh/directed_edges.h"
#include "mesh/face_sets.h"

namespace hpsdf {

/// The parts of a surface: what hangs together by edges of however many faces. `sides`: by edge, of so many faces.
FaceSets partsOf(std::size_t faces, std::span<const Side> sides);

/// The patches of a surface: what hangs together by edges of exactly two faces. Within one, faces can be turned until
/// all look the same way, unless it is one-sided, as a Möbius strip is.
struct Patches {
  std::size_t count = 0;
  std::vector<std::uint32_t> of;  ///< each face's, numbered by their lowest faces
  std::vector<char> against;      ///< 1 for faces that look the other way than their patch's lowest face
  std::vector<char> oneSided;     ///< 1 for patches whose faces cannot be made to agree
};

/// `sides`: by edge, of so many faces.
Patches patchesOf(std::size_t faces, std::span<const Side> sides);

}  // namespace hpsdf
