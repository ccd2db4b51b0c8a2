#include "hpsdf/combine/operation.h"

#include <algorithm>
#include <array>

namespace hpsdf {
namespace {

constexpr std::array kOperations = {
    OperationDescription{Operation::unite, "union", "union(A, B, …)", true, 0, "all that is in one of them or more"},
    OperationDescription{Operation::intersect, "intersection", "intersection(A, B, …)", true, 0,
                         "all that is in each of them"},
    OperationDescription{Operation::subtract, "difference", "difference(A, B, …)", true, 0,
                         "all that is in A and in none of the others"},
    OperationDescription{Operation::smoothUnite, "smooth-union", "smooth-union(A, B, …, R)", true, 1,
                         "the union with rounded creases, where distances differ by less than the radius R"},
    OperationDescription{Operation::smoothIntersect, "smooth-intersection", "smooth-intersection(A, B, …, R)", true, 1,
                         "the intersection with rounded edges"},
    OperationDescription{Operation::smoothSubtract, "smooth-difference", "smooth-difference(A, B, …, R)", true, 1,
                         "the difference with rounded edges"},
    OperationDescription{Operation::offset, "offset", "offset(A, D)", false, 1,
                         "A grown by the distance D, or shrunk where D is below 0"},
    OperationDescription{Operation::shell, "shell", "shell(A, T, SIDE)", false, 1,
                         "a wall of the thickness T along the surface of A; SIDE is inward, outward or, where it is "
                         "left out, centred"},
    OperationDescription{Operation::move, "move", "move(A, X, Y, Z)", false, 3, "A moved by X, Y, Z"},
    OperationDescription{Operation::rotate, "rotate", "rotate(A, X, Y, Z, DEGREES)", false, 4,
                         "A turned about the axis X, Y, Z through the origin"},
    OperationDescription{Operation::scale, "scale", "scale(A, S)", false, 1,
                         "A scaled about the origin by S, the same along all axes"},
};

}  // namespace

std::span<const OperationDescription> operations() { return kOperations; }

const OperationDescription& descriptionOf(Operation operation) {
  return *std::ranges::find(kOperations, operation, &OperationDescription::operation);
}

}  // namespace hpsdf
