// Fuzz target: a script is parsed and checked as by `hpsdf run` before its first line runs; no command is run.
#include "language/script.h"

#include <string>

#include "commands/commands.h"
#include "target.h"

namespace {

using namespace hpsdf;

/// Writes scripts that the input can include: a plain one, and two that include each other.
void writeIncluded() {
  fuzz::fileOf("plain.hps", "set width=640\nload bunny.hpsdf\n");
  fuzz::fileOf("a.hps", "include b.hps\n");
  fuzz::fileOf("b.hps", "include a.hps\n");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const app::Registry registry = [] {
    writeIncluded();
    return app::makeRegistry();
  }();
  static const std::string name = fuzz::fileOf("fuzz.hps", "").string();
  fuzz::reads([&] {
    for (const app::Call& call : app::parseScript(registry, name, fuzz::textOf(data, size), {{"mesh", "bunny.obj"}})) {
      fuzz::require(call.command != nullptr && call.line > 0, "a call has a command and a line");
      for (const app::Parameter& parameter : call.command->parameters)
        if (call.arguments.has(parameter.name)) call.arguments.texts(parameter.name);
    }
  });
  return 0;
}
