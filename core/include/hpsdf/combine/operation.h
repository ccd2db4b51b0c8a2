#pragma once
// The operations that expressions of solids have.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace hpsdf {

/// The operation that a node of an expression applies to its operands.
enum class Operation : std::uint8_t {
  operand,  ///< a leaf of the tree: a solid by itself
  unite,
  intersect,
  subtract,  ///< the first operand without the others
  smoothUnite,
  smoothIntersect,
  smoothSubtract,
  offset,
  shell,
  move,
  rotate,
  scale
};

/// The side of the surface on which a shell has its material.
enum class ShellSide : std::uint8_t { inward, centred, outward };

/// A row of the table of operations, from which the parser, `textOf` and help texts take what they know of them.
struct OperationDescription {
  Operation operation;
  std::string_view name;
  std::string_view form;  ///< how it is written, such as "offset(A, D)"
  bool takesMany;         ///< it takes two operands or more, else exactly one
  std::size_t numbers;    ///< number of numbers behind the operands
  std::string_view help;
};

/// Returns all operations that an expression can name, in the order in which help texts list them.
std::span<const OperationDescription> operations();

/// Returns the row of an operation.
const OperationDescription& descriptionOf(Operation operation);

}  // namespace hpsdf
