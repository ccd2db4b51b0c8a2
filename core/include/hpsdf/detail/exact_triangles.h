#pragma once
// The triangles to which the exact leaves of a field measure their distances.

#include <array>
#include <cstdint>
#include <variant>
#include <vector>

#include "hpsdf/types.h"

namespace hpsdf {

/// The triangles of a field's exact leaves. An exact leaf refers to a list of triangles. The list contains every
/// triangle that is nearest to any point of the leaf, and all triangles that share a nearest edge or vertex. In an
/// exact leaf, the field is the exact signed distance to the listed triangles.
///
/// A list is a part of `lists`, from the leaf's offset. It begins with the number of its triangles. Then come their
/// octants, one byte for each triangle and four bytes in a word, lowest byte first. The octants of a triangle are those
/// octants of the leaf, including the blend zone beyond its faces, in which the triangle can be nearest: bit x + 2y +
/// 4z stands for the octant in the place of child number x + 2y + 4z. Then come the triangles as runs, up to the first
/// run that is marked as the last one. A run is a sequence of triangles with successive indices. If bit 31 of the
/// number is set, four more words follow: a `WindingReference`, as three floats and an integer. Its point is stored
/// relative to the first corner of the first listed triangle, so that it is accurate far from the origin, too.
struct ExactTriangles {
  /// Vertices in world units: doubles, or floats where these suffice.
  std::variant<std::vector<Eigen::Vector3d>, std::vector<Eigen::Vector3f>> vertices;
  /// Three indices into `vertices` each, counter-clockwise as seen from outside. Triangles that are close in space are
  /// close in this list.
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::uint32_t> lists;
  double offset = 0;  ///< subtracted from every distance: half of the thickness of a shell

  bool empty() const { return lists.empty(); }
};

/// Functions that pack and unpack a run of triangles: the index of its first triangle in bits 0 to 26, the number of
/// its triangles minus 1 in bits 27 to 30, and in bit 31 whether it is the last run of its list.
namespace triangle_run {
constexpr std::uint32_t kMostTriangles = std::uint32_t{1} << 27;  ///< number of triangles that a run can refer to
constexpr std::uint32_t kMostLength = 16;
constexpr std::uint32_t kLast = std::uint32_t{1} << 31;
constexpr std::uint32_t packed(std::uint32_t first, std::uint32_t length) { return (length - 1) << 27 | first; }
constexpr std::uint32_t first(std::uint32_t run) { return run & (kMostTriangles - 1); }
constexpr std::uint32_t length(std::uint32_t run) { return (run >> 27 & 15) + 1; }
constexpr bool isLast(std::uint32_t run) { return (run & kLast) != 0; }
}  // namespace triangle_run

/// The way in which the distance in an exact leaf gets its sign.
enum class ExactSign : std::uint8_t {
  pseudonormal,  ///< by the angle-weighted pseudonormal of the nearest face, edge or vertex (Bærentzen & Aanæs 2005)
  positive,      ///< the distance is positive throughout the leaf
  negative,      ///< the distance is negative throughout the leaf
  winding,       ///< by the winding number, which differs from that of a `WindingReference` by the triangles in between
};

/// A point of an exact leaf at which the winding number is known. At another point of the leaf, the winding number
/// follows from the listed triangles that the segment between the two points crosses.
struct WindingReference {
  Vector3 point = Vector3::Zero();  ///< world units
  /// The winding number, plus 1 in a mesh that is oriented inward. A point is inside if the number is above 0 there.
  std::int32_t winding = 0;
};

/// The rule by which the distance in an exact leaf gets its sign.
struct LeafSign {
  ExactSign rule = ExactSign::pseudonormal;
  WindingReference reference = {};  ///< for `ExactSign::winding`
};

}  // namespace hpsdf
