#pragma once
// Records what a user does in the explorer as a script that repeats these actions.

#include <string>
#include <vector>

#include "explorer/explorer.h"

namespace hpsdf::app {

/// Records the command lines that the explorer runs during the lifetime of this object. It sets the explorer's
/// callback `onCommand`.
class Recording {
 public:
  /// `lines` are command lines that have run already. They begin the recorded script.
  Recording(Explorer& explorer, std::vector<std::string> lines);
  ~Recording();
  Recording(const Recording&) = delete;
  Recording& operator=(const Recording&) = delete;

  /// Records a line that moves the pointer to its present position, because highlights and the readout panel depend on
  /// the pointer. `shot` does so by itself.
  void notePointer();

  std::size_t lines() const { return lines_.size(); }
  std::string script() const;

 private:
  void add(const std::string& line, bool replaces);

  Explorer& explorer_;
  std::vector<std::string> lines_;
  std::array<double, 2> pointer_ = {-1, -1};  ///< pointer position at the end of the recorded script, pixels
};

}  // namespace hpsdf::app
