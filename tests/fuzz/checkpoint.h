#pragma once
// The constructions that the fuzz target `checkpoint` resumes. The target's corpus contains their states.

#include <array>
#include <filesystem>
#include <string>
#include <string_view>

#include "hpsdf/build.h"

namespace hpsdf::fuzz {

/// Returns constructions that end soon from any state, because they have few cells to refine.
inline std::array<BuildOptions, 3> constructions() {
  BuildOptions paper{.targetError = 1e-3, .grid = {2, 1, 1}, .maxDegree = 2, .maxDepth = 2, .threads = 1};
  BuildOptions optimal = paper;
  optimal.criterion = Criterion::optimal;
  BuildOptions byDistance = paper;
  byDistance.targetError = NearFarError{3e-2, 1e-1};
  byDistance.maxError = 0.1;
  return {paper, optimal, byDistance};
}

inline double sphere(const Vector3& x) { return (x - Vector3(0.1, 0.2, 0)).norm() - 0.5; }
inline Box domain() { return Box(Vector3::Constant(-1), Vector3::Constant(1)); }

/// Returns the number of bytes before the state in a checkpoint: magic number, versions and three digests.
inline std::size_t bytesBeforeState(std::string_view checkpoint) {
  constexpr std::size_t kLengthAt = 8 + 4;  // position of the length of the program's version text
  std::uint32_t length = 0;
  checkpoint.copy(reinterpret_cast<char*>(&length), sizeof length, kLengthAt);
  return kLengthAt + sizeof length + length + 3 * 8;
}

}  // namespace hpsdf::fuzz
