#pragma once

#include <sstream>
#include <string>

#include "commands/commands.h"
#include "explorer/explorer.h"
#include "hpsdf/error.h"
#include "language/script.h"

namespace hpsdf::app {

/// An explorer with its own session and without a terminal, led by scripts.
struct ExplorerBench {
  Registry registry = makeRegistry();
  std::istringstream in;
  std::ostringstream out, err;
  Session session{registry, Console{in, out, err}};

  void run(const std::string& script) { runScript(session, parseScript(registry, "test", script, {})); }
  Explorer& explorer() { return explorerOf(session); }
  const ViewState& view() { return explorer().view(); }
  /// Returns the message with which a script fails.
  std::string failure(const std::string& script) {
    try {
      run(script);
    } catch (const Error& error) {
      return error.what();
    }
    return "nothing failed";
  }
};

inline bool same(const render::Image& a, const render::Image& b) {
  return a.width == b.width && a.height == b.height && a.pixels == b.pixels;
}

}  // namespace hpsdf::app
