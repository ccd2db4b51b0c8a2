#pragma once

#include "hpsdf/error.h"
#include "hpsdf/progress.h"
#include "interrupt.h"
#include "progress_line.h"
#include "session.h"

namespace hpsdf::app {

/// Runs work(progress) with a progress line on the console; Ctrl-C cancels it. Throws `Cancelled` then.
template <typename Work>
auto withProgress(const Console& console, const Work& work) {
  const InterruptGuard guard;
  ProgressLine line(console.err, console.redrawsProgress);
  const Progress progress{
      .report = [&line](std::string_view task, double fraction) { line.report(task, fraction); },
      .cancelled = &InterruptGuard::interrupted,
  };
  auto result = work(progress);
  if (InterruptGuard::interrupted()) throw Cancelled();  // asked for in the very last moment
  return result;
}

}  // namespace hpsdf::app
