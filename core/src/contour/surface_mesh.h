#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "contour/cells/cell_samples.h"
#include "contour/cells/contour_octree.h"
#include "contour/cells/crossed_edges.h"
#include "contour/cells/implicit_surface.h"
#include "contour/dual_mesh.h"
#include "contour/sheets.h"
#include "hpsdf/error.h"

namespace hpsdf::contouring {

struct SurfaceMeshOptions {
  double tolerance;
  double accuracy;         ///< greatest magnitude of the function at vertices before they are rounded
  bool isOpen;             ///< the wall will be removed
  bool isSinglePrecision;  ///< vertices are rounded to single precision
};

/// The mesh of a surface in an octree whose leaves are divided from time to time. What has not changed between two
/// times is neither made nor measured nor tested again.
class SurfaceMesh {
 public:
  /// Keeps references to all but the options.
  SurfaceMesh(const ImplicitSurface& surface, const ContourOctree& octree, const std::vector<CellSamples>& samples,
              const SurfaceMeshOptions& options, const Progress& progress)
      : surface_(surface), octree_(octree), samples_(samples), options_(options), progress_(progress) {}

  /// Brings the crossed edges up to date with the octree.
  void updateEdges();

  /// Connects the crossed edges to the polygons of the mesh, and measures these.
  void connect();

  /// Measures the mesh from points of the surface. Returns for each cell the greatest distance of those in it.
  const std::vector<double>& findGaps();

  /// Turns polygons that cross others, or share an edge with more than one other, into fans until there are none.
  void mend();

  std::span<const CrossedEdge> edges() const { return edges_; }
  const Sheets& sheets() const { return *sheets_; }
  const DualMesh& mesh() const { return mesh_; }
  std::size_t fans() const { return fans_; }  ///< number of polygons that `mend` turned into fans

  /// Returns the edges of polygons that are still wrong after `mend`.
  std::span<const std::uint32_t> wrong() const { return wrong_; }

 private:
  void placeChangedVertices(const std::optional<Sheets>& before);
  void forgetGapsAtChanges();
  void makeFans(const std::vector<bool>& fans);
  std::vector<std::uint32_t> wrongPolygons(const std::vector<bool>& chosen);
  std::vector<bool> untestedTriangles() const;
  std::vector<bool> trianglesOfFans() const;
  void round(std::vector<Vector3>& vertices) const;

  const ImplicitSurface& surface_;
  const ContourOctree& octree_;
  const std::vector<CellSamples>& samples_;
  SurfaceMeshOptions options_;
  const Progress& progress_;
  std::size_t cellsOfEdges_ = 0;  ///< number of the octree's cells when the edges were brought up to date
  std::vector<CrossedEdge> edges_;
  std::optional<Sheets> sheets_;
  std::vector<Vector3> vertices_;  ///< one for each sheet
  DualMesh mesh_;
  std::vector<double> gaps_;       ///< by cell; negative where it is not known
  bool knowsAllCrossings_ = true;  ///< the last search for crossings found all
  std::size_t fans_ = 0;
  std::vector<std::uint32_t> wrong_;
};

}  // namespace hpsdf::contouring
