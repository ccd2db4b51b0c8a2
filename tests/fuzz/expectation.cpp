// Fuzz target: an expectation holds for the number that it names exactly if its comparison allows equality.
#include "language/expectation.h"

#include <algorithm>
#include <string>

#include "target.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hpsdf;
  std::string text(fuzz::textOf(data, size));
  std::ranges::replace(text, '\n', ' ');  // a word of a script has no newline
  fuzz::reads([&] {
    const app::Expectation expectation = app::parseExpectation(text);
    const bool allowsEqual = expectation.comparison.ends_with('=') && expectation.comparison != "!=";
    fuzz::require(expectation.holds(expectation.wanted) == allowsEqual, "the number itself is equal to it");
    fuzz::require(!expectation.path.empty(), "there is a name");
  });
  return 0;
}
