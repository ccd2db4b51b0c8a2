#pragma once
// Parameters and helpers that the tables of several commands share.

#include <initializer_list>
#include <utility>
#include <vector>

#include "language/registry.h"

namespace hpsdf::app {

/// Returns the command with these parameters in order.
inline Command withParameters(Command command, std::initializer_list<std::vector<Parameter>> tables) {
  command.parameters = joined(tables);
  return command;
}

/// Returns the parameter `mesh` of commands that compare a field with its surface.
inline Parameter surfaceParameter() {
  return {.name = "mesh",
          .type = ParameterType::text,
          .help =
              "The surface from which the field was made: a mesh file, builtin:SHAPE or analytic:SHAPE. It may be "
              "left out where the field was made from a built-in or analytic shape.",
          .valueName = "MESH",
          .positional = true};
}

}  // namespace hpsdf::app
