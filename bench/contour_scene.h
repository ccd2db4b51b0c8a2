#pragma once
// Benchmarks of contours share the field, and the measuring of meshes against the bunny.

#include "hpsdf/output/contour.h"
#include "scene.h"

namespace hpsdf::bench {

/// The tolerance at which the mesh is as near to the bunny as OpenVDB's at the voxels and the adaptivity of
/// openvdb_bench.cpp.
inline const ContourOptions kContourOptions{.tolerance = 0.0095};

/// Returns the bunny's field for the target error τ = 1e-7, blended.
const Field& contourField();

/// Returns the contours of some random combinations of solids, those of the tests.
const std::vector<TriangleMesh>& combinedContours();

/// Reports the number of a mesh's triangles and its Hausdorff distance to the bunny: both ways, at vertices and at
/// 400,000 random points of triangles.
void countMesh(benchmark::State& state, const TriangleMesh& mesh);

}  // namespace hpsdf::bench
