#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "contour/cells/implicit_surface.h"
#include "contour/edits/edited_mesh.h"
#include "hpsdf/error.h"

namespace hpsdf::contouring {

/// What a mesh must fulfil after edits.
struct EditLimits {
  double tolerance;        ///< greatest distance between the mesh and the surface, both ways
  double accuracy;         ///< greatest magnitude of the function at vertices
  bool isSinglePrecision;  ///< vertices are rounded to single precision
};

/// Makes those of many proposed edits of a mesh that leave it a mesh of the surface.
class MeshEditor {
 public:
  MeshEditor(const ImplicitSurface& surface, const EditLimits& limits, const Progress& progress, EditedMesh& mesh)
      : surface_(surface), limits_(limits), progress_(progress), mesh_(mesh) {}

  /// Returns edits of which no two have a vertex in common: each one that has none in common with those before it.
  std::vector<std::size_t> independent(std::span<const Edit> edits) const;

  /// Makes those of the edits after which the mesh is within the tolerance of the surface, is not folded over and does
  /// not cross itself. The edits must be independent. Returns which of them were made.
  std::vector<bool> make(std::span<const Edit> edits);

  /// Returns, for each triangle, the cosine of the angle between its normal and that of the surface at its middle.
  std::vector<double> cosines() const;

 private:
  bool isFit(const Edit& edit) const;
  bool isShapely(const Edit& edit) const;
  bool isNear(const Edit& edit) const;
  void leaveOutCrossing(std::span<const Edit> edits, std::vector<bool>& isMade) const;

  const ImplicitSurface& surface_;
  EditLimits limits_;
  const Progress& progress_;
  EditedMesh& mesh_;
};

}  // namespace hpsdf::contouring
