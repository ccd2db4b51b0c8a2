#pragma once
// What a person does in the explorer, as a script that does it again.

#include <string>
#include <vector>

#include "explorer/explorer.h"

namespace hpsdf::app {

/// Takes down the lines that run while one lives: the explorer's `onCommand` is its own.
class Recording {
 public:
  /// `lines` come first: those that ran before.
  Recording(Explorer& explorer, std::vector<std::string> lines);
  ~Recording();
  Recording(const Recording&) = delete;
  Recording& operator=(const Recording&) = delete;

  /// What is highlighted and read out depends on the pointer, which no other line sets.
  void notePointer();

  std::size_t lines() const { return lines_.size(); }
  std::string script() const;

 private:
  void add(const std::string& line, bool replaces);

  Explorer& explorer_;
  std::vector<std::string> lines_;
  std::array<double, 2> pointer_ = {-1, -1};  ///< as the lines leave it
};

}  // namespace hpsdf::app
