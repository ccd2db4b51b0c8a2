#pragma once

#include "hpsdf/error.h"

namespace hpsdf::app {

/// All went well but for what was to be found out: an expectation or a comparison failed. Exit status 1 rather than 2.
class Failed : public Error {
 public:
  using Error::Error;
};

}  // namespace hpsdf::app
