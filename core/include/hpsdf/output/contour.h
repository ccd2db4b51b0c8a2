#pragma once
// Triangle meshes of the surfaces on which a field has a given value.

#include <cstddef>
#include <vector>

#include "hpsdf/error.h"
#include "hpsdf/field.h"
#include "hpsdf/triangle_mesh.h"
#include "hpsdf/types.h"

namespace hpsdf {

/// The choices for the places where the domain's boundary cuts the solid.
enum class DomainCut : unsigned char {
  wall,  ///< a wall closes the mesh, half of the tolerance within the domain
  open,  ///< the mesh ends there
};

/// The least and the default tolerance of a contour, as shares of the longest side of the field's domain.
constexpr double kLeastContourTolerance = 0x1p-22, kDefaultContourTolerance = 1e-3;

struct ContourOptions {
  /// The value of the field on the surface, in the field's units: above 0 for a surface around the solid.
  double offset = 0;
  /// Greatest distance between the mesh and the surface on which the field has this value, in the field's units; 0 for
  /// `kDefaultContourTolerance`. It must be at least `kLeastContourTolerance` of the longest side of the domain.
  /// Parts of the solid and gaps that are thinner than twice the tolerance may be lost.
  double tolerance = 0;
  DomainCut domainCut = DomainCut::wall;
  /// The coordinates of vertices are single-precision numbers, for files that hold only these, such as STL. The
  /// tolerance must then be at least `leastSinglePrecisionTolerance`.
  bool singlePrecision = false;
  /// Vertices are merged as far as the tolerance allows (Garland and Heckbert 1997): the mesh has fewer triangles, and
  /// making it takes several times as long.
  bool simplify = false;
  int threads = 0;  ///< greatest number of threads, 0 for all; the mesh does not depend on it
};

/// A mesh of a field's surface, and what is known about it.
struct Contour {
  TriangleMesh mesh;  ///< triangles face outward: towards greater values
  /// A unit vector for each vertex: along the field's gradient, normal to the wall at the wall, and the mean of the
  /// triangles' normals where there is no gradient.
  std::vector<Vector3> normals;
  double greatestValue = 0;  ///< greatest |f − offset| found at edges and in triangles: the distance from the surface
  double greatestGap = 0;    ///< greatest distance of points of the surface, some in each cell, from the mesh
  /// Triangles, and cells with points of the surface, that miss the tolerance although the cells are the smallest ones.
  std::size_t unresolved = 0;
  /// Cells in which the field has a part of the solid, or a gap, that the mesh lacks: it is thin, and farther from the
  /// mesh than two tolerances. At most 20,000 cells are searched, spread evenly over those that may have such parts.
  std::size_t lostParts = 0;
  std::size_t cells = 0;           ///< cells of the contour's octree
  std::size_t multipleSheets = 0;  ///< smallest cells through which several sheets of the surface pass
  std::size_t fans = 0;            ///< polygons that were divided more finely because they would have crossed others
  std::size_t flawed = 0;  ///< polygons that still cross others, or share an edge with more than one: none are known
};

/// Returns the least tolerance of a contour of this field with vertices in single precision: about 1,000 times the
/// spacing of these numbers at the domain's farthest corner.
double leastSinglePrecisionTolerance(const Field& field);

/// Returns the mesh of the surface on which the field has the value `options.offset`, by dual contouring (Ju et al.
/// 2002) on an octree of its own, whose cells are divided until the mesh is within the tolerance. Each cell has one
/// vertex for each sheet that passes through it (Schaefer et al. 2007), at the point that fits the planes of the sheet
/// best, so that sharp edges are kept.
///
/// The mesh is a manifold without crossings: each edge belongs to two triangles, which traverse it in opposite
/// directions, unless it lies on the boundary of the domain and this is left open; the triangles at each vertex form
/// one fan; and triangles have only their common vertices and edges in common. Where the surface is rougher than the
/// smallest cells, which are as large as one to two tolerances, the corners of a triangle may lie in one line, and fans
/// of an open mesh that touch at its boundary have a vertex each at the same position. If the
/// whole domain is outside, the mesh is empty.
///
/// Throws `Error` for options out of range and for a contour that would not fit into memory, and `Cancelled` when
/// `progress` says so.
Contour contour(const Field& field, const ContourOptions& options = {}, const Progress& progress = {});

/// Returns true if the surface on which the field has the value `offset` may have steps between leaves. It has none in
/// a blended field, and none where it passes only through exact leaves and the linear polynomials in place of plane
/// triangles.
bool mayHaveSteps(const Field& field, double offset);

/// Makes the contour of the field or, if that may have steps (`mayHaveSteps`), of a blended copy (`blended`), from
/// which the field differs by no more than it jumps. The tolerance is then that to the surface of the copy.
Contour blendedContour(const Field& field, const ContourOptions& options = {}, const Progress& progress = {});

}  // namespace hpsdf
