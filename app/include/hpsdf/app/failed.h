#pragma once

#include <string>
#include <utility>

#include "hpsdf/error.h"

namespace hpsdf::app {

constexpr int kExitFailed = 1;        ///< an expectation or a comparison failed
constexpr int kExitPartlyFailed = 3;  ///< some meshes of a batch failed

/// Thrown if the input was correct but the result is negative: a comparison failed, or some meshes of a batch
/// failed. The program then exits with `status` instead of status 2, which means bad input.
class Failed : public Error {
 public:
  explicit Failed(const std::string& message, int status = kExitFailed) : Error(message), status_(status) {}
  int status() const { return status_; }

 private:
  int status_;
};

/// Thrown if work was cancelled after some of its results were kept.
class CancelledPartway : public Cancelled {
 public:
  explicit CancelledPartway(std::string kept) : kept_(std::move(kept)) {}
  /// Returns a text that says which results were kept, and how to continue the work.
  const std::string& kept() const { return kept_; }

 private:
  std::string kept_;
};

}  // namespace hpsdf::app
