#include "window/recording.h"

#include <fmt/format.h>

namespace hpsdf::app {

Recording::Recording(Explorer& explorer, std::vector<std::string> lines)
    : explorer_(explorer), lines_(std::move(lines)) {
  explorer_.onCommand = [this](const std::string& line, bool replaces) { add(line, replaces); };
}

Recording::~Recording() { explorer_.onCommand = nullptr; }

void Recording::add(const std::string& line, bool replaces) {
  // A window takes many sizes while a user resizes it. If successive lines set the size, only the last one is
  // recorded.
  const auto isSize = [](const std::string& any) { return any.starts_with("show size=") && any.rfind(' ') == 4; };
  if (line.starts_with("shot ")) notePointer();
  if (replaces || (isSize(line) && !lines_.empty() && isSize(lines_.back())))
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
