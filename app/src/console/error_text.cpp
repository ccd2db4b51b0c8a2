#include "console/error_text.h"

#include <fmt/format.h>

#include <filesystem>
#include <new>

#include "hpsdf/error.h"

namespace hpsdf::app {

std::string errorText(const std::exception& error) {
  if (dynamic_cast<const Error*>(&error) != nullptr) return error.what();
  if (const auto* file = dynamic_cast<const std::filesystem::filesystem_error*>(&error))
    return fmt::format("{}: {}; check that it is there, and its permissions", file->path1().string(),
                       file->code().message());
  if (dynamic_cast<const std::bad_alloc*>(&error) != nullptr)
    return "not enough memory; end other programs, or take a smaller mesh, field or picture";
  return fmt::format("{} (this is a fault of the program)", error.what());
}

}  // namespace hpsdf::app
