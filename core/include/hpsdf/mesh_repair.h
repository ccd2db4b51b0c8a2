#pragma once

#include <cstddef>

#include "hpsdf/mesh_file.h"

namespace hpsdf {

struct RepairedMesh {
  ImportedMesh imported;            ///< the repaired mesh; its report still holds the counts from cleaning
  std::size_t reversedFaces = 0;    ///< faces reversed because they disagreed with the greater part of their patch
  std::size_t reversedPatches = 0;  ///< patches reversed as a whole because their body was oriented inward
};

/// Orients a mesh consistently and outward by reversing triangles. Vertices and triangles are neither added nor
/// removed.
///
/// 1. Patches. A patch is a set of triangles that are connected by edges of exactly two triangles. All
///    triangles of a patch get the orientation that the greater part of its area has. A one-sided patch, such
///    as a Möbius strip, stays unchanged and keeps its inconsistent edges.
/// 2. Bodies. A body is a closed patch; or several patches that are closed only in union, with solid material
///    between them; or any other patch, which is open.
/// 3. Signed volumes. A body with a negative signed volume is oriented inward. An open body takes part only if
///    its volume exceeds a hundredth of its box's volume; otherwise it stays unchanged. If there is only one body,
///    or none is oriented inward, the volumes decide and the algorithm ends here.
/// 4. Cavities. A cavity is oriented inward on purpose. Therefore the winding number of the imported mesh is
///    probed close to both sides of each body's surface, at points spread over its area. The orientation of a
///    body is decided if at least three quarters of its points show one of two patterns:
///    - Winding number at most 0 in front of the surface and at least 1 behind: the body is oriented correctly
///      and stays unchanged. A cavity is an example.
///    - Winding number at most −1 in front of the surface and at least 0 behind: the body would be correct if the
///      whole mesh were reversed. Both surfaces of a hollow body that is inside out are an example. The body is
///      reversed, unless it is open with a positive volume.
///    A point with equal winding numbers on both sides does not count, because a coincident surface of another
///    body cancels the step there. A point can fit both patterns if a body of opposite orientation touches this
///    body. Such a point counts for the pattern that agrees with the sign of this body's volume.
/// 5. Nesting. If step 4 does not decide, a body that is oriented inward is reversed, unless three quarters of
///    its points lie within an odd number of other bodies, so that it is a cavity.
///
/// Throws `Error` for a mesh without triangles or with more than 2²⁸ triangles, and for vertices that do not
/// exist, are not finite or have coordinates beyond `kLargestCoordinate`.
RepairedMesh repaired(ImportedMesh imported);

}  // namespace hpsdf
