#pragma once

#include <algorithm>
#include <iterator>
#include <vector>

#include "language/registry.h"

namespace hpsdf::app {

/// Appends parameters that several commands share to those of one command.
inline void append(std::vector<Parameter>& parameters, std::vector<Parameter> more) {
  std::ranges::move(more, std::back_inserter(parameters));
}

}  // namespace hpsdf::app
