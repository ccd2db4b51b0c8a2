#pragma once

namespace hpsdf::contouring {

/// The limits that a mesh must keep after edits.
struct EditLimits {
  double tolerance;        ///< greatest distance between the mesh and the surface, both ways
  double accuracy;         ///< greatest magnitude of the function at vertices
  bool isSinglePrecision;  ///< vertices are rounded to single precision
  double spacing;          ///< greatest distance between points of triangles at which the function is measured
};

}  // namespace hpsdf::contouring
