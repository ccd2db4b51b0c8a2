// Fuzz target: the JSON file beside a baseline picture is written and read again without change.
#include "check/baseline.h"

#include "target.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hpsdf;
  const auto file = fuzz::fileOf("in.json", fuzz::textOf(data, size));
  fuzz::reads([&] {
    const app::BaselineFacts facts = app::loadFacts(file);
    app::saveFacts(facts, file);
    const app::BaselineFacts again = app::loadFacts(file);
    fuzz::require(again.size == facts.size && again.budget == facts.budget && again.bound == facts.bound,
                  "what was written is read");
  });
  return 0;
}
