// A checkpoint: a construction that takes it up refuses it or comes to its end. The first byte says which construction
// it is, the rest is the state; what a checkpoint has before and behind, which depends on the program's version, is
// added here.
#include "checkpoint.h"

#include <string>
#include <string_view>

#include "hpsdf/error.h"
#include "target.h"

namespace {

using namespace hpsdf;

Checkpoint at(const std::filesystem::path& file) { return {.file = file, .seconds = 0, .share = 1}; }

/// What checkpoints of this construction begin with.
std::string beginning(const BuildOptions& options) {
  const auto file = fuzz::fileOf("state", "");
  std::filesystem::remove(file);
  buildResumably(fuzz::sphere, fuzz::domain(), options, at(file));
  const std::string whole = fuzz::bytesOf(file);
  return whole.substr(0, fuzz::bytesBeforeState(whole));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const auto kConstructions = fuzz::constructions();
  static const std::array kBeginnings = {beginning(kConstructions[0]), beginning(kConstructions[1]),
                                         beginning(kConstructions[2])};
  if (size == 0) return 0;
  const std::size_t which = data[0] % kConstructions.size();
  std::string bytes = kBeginnings[which];
  bytes += fuzz::textOf(data, size).substr(1);
  bytes.append(8, '\0');
  fuzz::mendChecksum(reinterpret_cast<std::uint8_t*>(bytes.data()), bytes.size());
  Checkpoint checkpoint = at(fuzz::fileOf("state", bytes));
  checkpoint.seconds = 1000;  // no other is kept
  fuzz::reads([&] { buildResumably(fuzz::sphere, fuzz::domain(), kConstructions[which], checkpoint); });
  return 0;
}
