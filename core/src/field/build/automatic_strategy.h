#pragma once

#include "hpsdf/build_options.h"
#include "hpsdf/detail/triangle_search.h"

namespace hpsdf::detail {

/// Greatest number of nodes in the octree of exact leaves for which `Strategy::automatic` is `hpx`. Finding so many
/// takes two cores up to ten seconds. Long, thin triangles of a fine gear would need a thousand times as many:
/// wherever their tips meet, a small ball touches more of them than a leaf may list.
constexpr double kMostNodesOfAutomatic = 60'000;

/// Returns the strategy that `Strategy::automatic` stands for with these options and the surface's size L
/// (`FieldMetadata`). `search` is the search of the distance to triangles, or nullptr for other distances.
///
/// Polynomials miss sharp edges, and the facets of a coarse mesh. The strategy is `hpx` if the edges that bend by more
/// than 60° are together longer than L/2 and a quarter of those that bend by more than 15°, as in machine parts. It is
/// also `hpx` for a mesh with up to 30,000 triangles whose edges that bend by more than 15° are together longer than
/// 5 L. For other meshes, such as large scans, whose lists of triangles would take more bytes than polynomials, it is
/// `hp`. It is also `hp` for a limit of bytes or steps, which the exact leaves alone could exceed, and where a ball
/// with the radius `exactWithin` around a point of the surface would contain more triangles, on average, than half of
/// what an exact leaf may have. That is no more than a first guess: the construction also takes `hp` where exact leaves
/// would need more than `kMostNodesOfAutomatic` nodes.
Strategy automaticStrategy(const TriangleSearch* search, const BuildOptions& options, double referenceLength);

}  // namespace hpsdf::detail
