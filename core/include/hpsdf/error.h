#pragma once

#include <functional>
#include <stdexcept>
#include <string>
#include <string_view>

namespace hpsdf {

/// Bad input: a file, a mesh, an option. The message is one line that says what is wrong, where, and what to do.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Thrown by a long operation whose `Progress` asked it to stop. Nothing has been written.
class Cancelled : public std::runtime_error {
 public:
  Cancelled() : std::runtime_error("cancelled") {}
};

/// The link between a long operation and its caller. Both callables may be empty.
struct Progress {
  /// Called now and then, by one thread at a time, with what is being done and the estimated fraction done, 0 to 1.
  std::function<void(std::string_view task, double fraction)> report;

  /// Asked often and from any thread; once it answers true the operation throws `Cancelled`.
  std::function<bool()> cancelled;

  // What operations call.

  /// Throws `Cancelled` where that is wanted.
  void pause() const {
    if (cancelled && cancelled()) throw Cancelled();
  }

  /// The same, and reports.
  void at(std::string_view task, double fraction) const {
    pause();
    if (report) report(task, fraction);
  }
};

}  // namespace hpsdf
