#pragma once
// The list of interfaces at which a field jumps most, and which of them lie at the surface.

#include <cstddef>
#include <vector>

#include "hpsdf/field.h"
#include "hpsdf/jumps.h"

namespace hpsdf::app {

/// Returns the edge length of a cell at this depth, in world units.
double cellSizeAt(const Field& field, int depth);

/// Tells whether the greatest jump of an interface is at the surface: whether |f| there is at most a tenth of the edge
/// of the smaller cell, or whether the surface is torn there.
bool isAtSurface(const Field& field, const Interface& face);

/// Tells whether the surface is torn at the place of an interface's greatest jump: whether f has different signs on its
/// two sides.
bool isTorn(const Field& field, const Interface& face);

/// Returns the indices of at most `count` interfaces with the greatest jumps, greatest first: of all interfaces, or of
/// those at the surface.
std::vector<std::size_t> worstPlaces(const Field& field, const Jumps& jumps, JumpKind kind, bool atSurface,
                                     std::size_t count);

}  // namespace hpsdf::app
