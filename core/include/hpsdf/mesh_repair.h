#pragma once

#include <cstddef>

#include "hpsdf/mesh_file.h"

namespace hpsdf {

struct RepairedMesh {
  ImportedMesh imported;          ///< what cleaning did is in the report, too
  std::size_t turnedFaces = 0;    ///< looked another way than most of their patch
  std::size_t turnedPatches = 0;  ///< turned as a whole, with their bodies: they looked inwards
  std::size_t leftEdges = 0;      ///< of two faces that still run the same way: the surface has one side only
};

/// Turns triangles so that inside and outside are told consistently. Positions stay, no triangle is added or left out.
///
/// Patches are what hangs together by edges of two triangles. Within each, all look the way of the greater part of its
/// area; one that has one side only, as a Möbius strip, stays as it is.
///
/// Bodies are closed patches, patches that only together are closed (at every edge as many sides run one way as the
/// other, with a solid between them), and each other patch.
///
/// If any body's volume says that it looks inwards, what winding numbers say of three quarters of its area decides:
/// - it stays with the outside before it and the inside behind it, such as a cavity;
/// - it is turned where that is so of the mesh turned as a whole, such as both sides of a hollow body that looks
///   inwards, unless it is open and its volume says otherwise; where both are so, because it touches another that looks
///   the other way, it is by its volume;
/// - of others one that looks inwards is turned, unless it lies within an odd number of other bodies.
///
/// Only bodies whose volume is plain are turned, or have something within; open ones as the whole mesh in `cleaned`.
///
/// Throws `Error` for a mesh without triangles or of more than 2²⁸, of vertices that do not exist or are not finite.
RepairedMesh repaired(ImportedMesh imported);

}  // namespace hpsdf
