// Fuzz target: a `--batch` list gives each mesh once, with a safe file name that depends on its line only.
#include "batch/batch_list.h"

#include <algorithm>
#include <cctype>
#include <set>
#include <string>

#include "target.h"

namespace {

using namespace hpsdf;

constexpr std::size_t kLongestName = 200;  // bytes; file systems allow 255, and suffixes need some

bool isPlain(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '.' || c == '-' || c == '_'; }

void check(const app::BatchMesh& mesh) {
  fuzz::require(!mesh.surface.empty() && mesh.surface.find('\n') == std::string::npos, "a mesh is a line");
  fuzz::require(std::ranges::all_of(mesh.name, isPlain) && !mesh.name.starts_with('.'), "a name is safe");
  fuzz::require(mesh.name.size() <= kLongestName, "a name is short");
  const auto alone = app::parseBatchList("\n" + mesh.surface);  // a byte order mark is skipped in the first line only
  fuzz::require(alone.size() == 1 && alone[0].surface == mesh.surface && alone[0].name == mesh.name,
                "a line stands for itself");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::reads([&] {
    std::set<std::string> surfaces, names;
    for (const app::BatchMesh& mesh : app::parseBatchList(fuzz::textOf(data, size))) {
      check(mesh);
      fuzz::require(surfaces.insert(mesh.surface).second, "a mesh is there once");
      fuzz::require(names.insert(mesh.name).second, "names differ");
    }
  });
  return 0;
}
