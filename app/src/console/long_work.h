#pragma once

#include <chrono>
#include <ostream>
#include <string>
#include <string_view>

#include "console/console.h"
#include "console/interrupt.h"
#include "console/progress_line.h"
#include "hpsdf/error.h"

namespace hpsdf::app {

/// Runs work(progress), shows its progress on the console, and returns its result. Throws `Cancelled` after Ctrl-C or
/// if the console's listener cancels the work.
template <typename Work>
auto withProgress(const Console& console, const Work& work) {
  const InterruptGuard guard;
  std::ostream nowhere(nullptr);
  ProgressLine line(console.writesProgress ? console.err : nowhere, console.redrawsProgress);
  const ProgressTicker ticker(line);
  WorkListener* const listener = console.listener;
  struct AtEnd {
    WorkListener* listener;
    ~AtEnd() {
      if (listener != nullptr) listener->ended();
    }
  } const atEnd{listener};
  const Progress progress{
      .report =
          [&line, &console, listener](std::string_view task, double fraction) {
            line.report(console.work + std::string(task), fraction);
            if (listener != nullptr) listener->report(task, fraction);
          },
      .cancelled =
          [listener] { return InterruptGuard::interrupted() || (listener != nullptr && listener->wantsCancel()); },
      .forecast =
          [&console, listener](const Forecast& forecast) {
            noteForecast(console, forecast);
            if (listener != nullptr) listener->forecast(forecast);
          },
  };
  auto result = work(progress);
  progress.throwIfCancelled();  // Ctrl-C may have come after the last check inside `work`
  return result;
}

inline double secondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace hpsdf::app
