#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "contour/cells/implicit_surface.h"
#include "contour/edits/edit_limits.h"
#include "contour/edits/edited_mesh.h"
#include "hpsdf/error.h"

namespace hpsdf::contouring {

/// The greatest errors that were found of a mesh, or of a part of it.
struct MeshErrors {
  double value = 0;        ///< magnitude of the function in a triangle
  double gap = 0;          ///< distance of a point of the surface from the mesh
  std::size_t missed = 0;  ///< triangles of which one of these is above the tolerance
};

/// Makes those of many proposed edits of a mesh that leave it a mesh of the surface. They are judged by the points of
/// the surface that the mesh keeps, or else by some near the triangles that are replaced.
class MeshEditor {
 public:
  MeshEditor(const ImplicitSurface& surface, const EditLimits& limits, const Progress& progress, EditedMesh& mesh)
      : surface_(surface), limits_(limits), progress_(progress), mesh_(mesh) {}

  const ImplicitSurface& surface() const { return surface_; }
  const EditLimits& limits() const { return limits_; }
  const Progress& progress() const { return progress_; }
  const EditedMesh& mesh() const { return mesh_; }

  /// Returns the greatest errors of the triangles that were added.
  const MeshErrors& errors() const { return errors_; }

  /// Returns edits of which no two have a vertex in common: each one that has none in common with those before it.
  std::vector<std::size_t> independent(std::span<const Edit> edits) const;

  /// Makes those of the edits after which the mesh is within the tolerance of the surface, is not folded over and does
  /// not cross itself. The edits must be independent. Returns which of them were made.
  std::vector<bool> make(std::span<const Edit> edits);

  /// Returns, for each triangle, the cosine of the angle between its normal and that of the surface at its middle.
  std::vector<double> cosines() const;

 private:
  std::optional<MeshErrors> errorsAfter(const Edit& edit) const;
  bool isShapely(std::span<const Corners> removed, std::span<const Corners> added) const;
  MeshErrors distancesAfter(const Edit& edit, std::span<const Corners> removed, std::span<const Corners> added) const;
  void leaveOutCrossing(std::span<const Edit> edits, std::vector<bool>& isMade) const;

  const ImplicitSurface& surface_;
  EditLimits limits_;
  const Progress& progress_;
  EditedMesh& mesh_;
  MeshErrors errors_;
};

}  // namespace hpsdf::contouring
