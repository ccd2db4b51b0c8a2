#pragma once
// Blocks of pixels whose rays may hit the surface, with a lower bound of the distance to the surface. Pixels
// outside of these blocks are not drawn at all. Rays of pixels in the blocks start near the surface.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "view/grid_space.h"
#include "view/surface_bounds.h"

namespace hpsdf::render {

constexpr int kBlock = 8;  // pixels along each side of a block

struct Block {
  float x, y;   ///< upper left pixel of the block
  float start;  ///< on all rays of the block, f − offset has the sign `side` up to this distance; world units
  /// The pixels whose rays are traced: bit 8·y + x is that of the pixel in column x and row y of the block; bits 32 to
  /// 63 are in the second number.
  std::array<std::uint32_t, 2> chosen = {~0U, ~0U};
};

struct SurfaceBlocks {
  /// The sign, 1 or −1, of f − offset at the start of every ray. For a pixel in a block, the sign holds along the
  /// ray from its entry into the domain up to `Block::start`. For any other pixel, it holds up to the ray's exit
  /// from the domain.
  float side;
  std::vector<Block> blocks;
};

/// Finds the blocks of pixels whose rays may hit the surface. Descends through the nodes in which the sign of
/// f − offset may differ from `SurfaceBlocks::side`, down to nodes that cover about one block of the view.
SurfaceBlocks surfaceBlocks(const FieldData& field, const std::vector<SurfaceBounds>& bounds, const GridSpace& space,
                            const RayGeometry& rays, double offset);

/// Sets `Block::chosen` to the pixels of a view of width × height pixels for which `chosen`, in rows from top to
/// bottom, is not 0, or to all pixels of the view if `chosen` is empty. Removes blocks without such a pixel.
void keepChosen(std::span<const std::uint8_t> chosen, int width, int height, std::vector<Block>& blocks);

}  // namespace hpsdf::render
