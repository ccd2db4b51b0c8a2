#pragma once

#include <string>
#include <utility>

#include "hpsdf/error.h"

namespace hpsdf::app {

constexpr int kExitFailed = 1;        ///< an expectation, a comparison
constexpr int kExitPartlyFailed = 3;  ///< some of many meshes

/// The call was right, but for what was to be found out, or for some of many: an exit status of its own rather than 2.
class Failed : public Error {
 public:
  explicit Failed(const std::string& message, int status = kExitFailed) : Error(message), status_(status) {}
  int status() const { return status_; }

 private:
  int status_;
};

/// Cancelled when some of the results were there already.
class CancelledPartway : public Cancelled {
 public:
  explicit CancelledPartway(std::string kept) : kept_(std::move(kept)) {}
  /// What stays, and how to go on.
  const std::string& kept() const { return kept_; }

 private:
  std::string kept_;
};

}  // namespace hpsdf::app
