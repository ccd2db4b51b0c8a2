#include "explorer/recording.h"

#include <fmt/format.h>

namespace hpsdf::app {

Recording::Recording(Explorer& explorer, std::vector<std::string> lines)
    : explorer_(explorer), lines_(std::move(lines)) {
  explorer_.onCommand = [this](const std::string& line, bool replaces) { add(line, replaces); };
}

Recording::~Recording() { explorer_.onCommand = nullptr; }

void Recording::add(const std::string& line, bool replaces) {
  // a window that is resized asks for each size on the way
  constexpr std::string_view kSize = "show size=";
  const bool resized = line.starts_with(kSize) && !lines_.empty() && lines_.back().starts_with(kSize);
  if (replaces || resized)
    lines_.back() = line;
  else
    lines_.push_back(line);
}

void Recording::notePointer() {
  const auto at = explorer_.ui().pointer();
  if (at == pointer_) return;
  pointer_ = at;
  lines_.push_back(fmt::format("ui hover {},{}", at[0], at[1]));
}

std::string Recording::script() const {
  std::string script;
  for (const std::string& line : lines_) script += line + "\n";
  return script;
}

}  // namespace hpsdf::app
