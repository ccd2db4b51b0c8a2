#pragma once
// Records what a person does in the explorer as a script that repeats it.

#include <string>
#include <vector>

#include "explorer/explorer.h"

namespace hpsdf::app {

/// Records the lines that the explorer runs during its lifetime. It uses the explorer's `onCommand`.
class Recording {
 public:
  /// `lines` have run before and begin the script.
  Recording(Explorer& explorer, std::vector<std::string> lines);
  ~Recording();
  Recording(const Recording&) = delete;
  Recording& operator=(const Recording&) = delete;

  /// Adds a line that moves the pointer to its present position, on which highlights and the readout depend.
  void notePointer();

  std::size_t lines() const { return lines_.size(); }
  std::string script() const;

 private:
  void add(const std::string& line, bool replaces);

  Explorer& explorer_;
  std::vector<std::string> lines_;
  std::array<double, 2> pointer_ = {-1, -1};  ///< position after the recorded lines, pixels
};

}  // namespace hpsdf::app
