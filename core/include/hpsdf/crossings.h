#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "hpsdf/progress.h"
#include "hpsdf/triangle_mesh.h"
#include "hpsdf/types.h"

namespace hpsdf {

/// Two triangles that meet elsewhere than in the corners and edges they share: they pass through each other, touch, or
/// lie on each other.
struct Crossing {
  std::array<std::uint32_t, 2> triangles;  ///< the lower index first
  Vector3 place;                           ///< in both triangles' boxes: the middle of what they share
};

struct Crossings {
  std::vector<Crossing> found;  ///< by their triangles
  bool all = true;              ///< none was left out
};

constexpr std::size_t kMostCrossings = 1'000'000;  ///< unless asked for others

/// Where a mesh meets itself, decided without rounding (Shewchuk 1997). Corners are the same where their indices are:
/// weld them first. Triangles whose corners lie on one line are passed over, as their neighbours hold their sides.
///
/// `limit` of them at most, the same ones for any number of threads. Throws `Error` as `ExactDistance` does,
/// `Cancelled`.
Crossings findCrossings(const TriangleMesh& mesh, std::size_t limit = kMostCrossings, const Progress& progress = {});

}  // namespace hpsdf
