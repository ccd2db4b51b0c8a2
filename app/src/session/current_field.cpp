#include "session/current_field.h"

#include <cstdint>
#include <system_error>

#include "hpsdf/detail/memory.h"
#include "hpsdf/field_file.h"

namespace hpsdf::app {

Field loadOrMap(const std::filesystem::path& file) {
  std::error_code unknown;
  const std::uintmax_t bytes = std::filesystem::file_size(file, unknown);
  const bool isLarge = !unknown && double(bytes) > allowedMemory() / 2;
  return load(file, isLarge && canBeMapped(file) ? Loading::mapped : Loading::resident);
}

}  // namespace hpsdf::app
