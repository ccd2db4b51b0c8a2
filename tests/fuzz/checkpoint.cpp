// Fuzz target: a construction that resumes from a checkpoint refuses it or ends. The input's first byte selects the
// construction, the rest is the state. The bytes before and after the state depend on the program's version and are
// added here.
#include "checkpoint.h"

#include <string>
#include <string_view>

#include "hpsdf/error.h"
#include "support/file_checksums.h"
#include "target.h"

namespace {

using namespace hpsdf;

Checkpoint at(const std::filesystem::path& file) { return {.file = file, .seconds = 0, .share = 1}; }

/// Returns the bytes with which checkpoints of this construction begin, up to the state.
std::string beginning(std::size_t which) {
  const auto file = fuzz::fileOf("state", "");
  std::filesystem::remove(file);
  buildResumably(fuzz::distanceOf(which), fuzz::domain(), fuzz::constructions()[which], at(file));
  const std::string whole = fuzz::bytesOf(file);
  return whole.substr(0, fuzz::bytesBeforeState(whole));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const auto kConstructions = fuzz::constructions();
  static const std::array kBeginnings = {beginning(0), beginning(1), beginning(2), beginning(3)};
  static_assert(kBeginnings.size() == kConstructions.size());
  if (size == 0) return 0;
  const std::size_t which = data[0] % kConstructions.size();
  std::string bytes = kBeginnings[which];
  bytes += fuzz::textOf(data, size).substr(1);
  bytes.append(8, '\0');
  support::mendChecksum(bytes);
  Checkpoint checkpoint = at(fuzz::fileOf("state", bytes));
  checkpoint.seconds = 1000;  // no further checkpoint is written
  fuzz::reads([&] { buildResumably(fuzz::distanceOf(which), fuzz::domain(), kConstructions[which], checkpoint); });
  return 0;
}
