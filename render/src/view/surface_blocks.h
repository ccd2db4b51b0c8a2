#pragma once
// Blocks of pixels whose rays may meet the surface, and a lower bound of the distance to it. Pixels that do not
// see the surface are not drawn at all, and the rays of the other pixels start near it.

#include <vector>

#include "view/grid_space.h"
#include "view/surface_bounds.h"

namespace hpsdf::render {

constexpr int kBlock = 8;  // pixels along each side of a block

struct Block {
  float x, y;   ///< upper left pixel
  float start;  ///< distance along the block's rays, world units, up to which none has left `SurfaceBlocks::side`
};

struct SurfaceBlocks {
  /// The sign, 1 or −1, of f − offset along every ray from its entry into the domain: up to `Block::start`, or up to
  /// its exit from the domain if its pixel lies in no block.
  float side;
  std::vector<Block> blocks;
};

/// Projects the nodes whose bounds are not wholly on `side` to the view, down to nodes that cover about one block.
SurfaceBlocks surfaceBlocks(const FieldData& field, const std::vector<SurfaceBounds>& bounds, const GridSpace& space,
                            const RayGeometry& rays, double offset);

}  // namespace hpsdf::render
