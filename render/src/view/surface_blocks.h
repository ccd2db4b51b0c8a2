#pragma once
// Where in a view rays may meet the surface, and how far along them at the nearest: so that pixels which see nothing
// of it are not drawn at all, and the others start next to it.

#include <vector>

#include "view/grid_space.h"
#include "view/surface_bounds.h"

namespace hpsdf::render {

constexpr int kBlock = 8;  // pixels a side

/// A square of kBlock × kBlock pixels.
struct Block {
  float x, y;   ///< its upper left pixel
  float start;  ///< world units along a ray: up to there no ray of the block has left `SurfaceBlocks::side`
};

struct SurfaceBlocks {
  float side;  ///< 1 or −1: the sign of f − offset along every ray from where it enters the domain up to `Block::start`
  std::vector<Block> blocks;  ///< rays of all other pixels stay on that side, or never enter the domain
};

/// By the bounds of the octree's nodes as the view sees them: those not wholly on `side`, down to nodes that cover no
/// more than a block or so.
SurfaceBlocks surfaceBlocks(const FieldData& field, const std::vector<NodeBounds>& bounds, const GridSpace& space,
                            const RayGeometry& rays, double offset);

}  // namespace hpsdf::render
