#include "console/console.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <poll.h>
#include <unistd.h>

#include <mutex>
#include <ostream>

#include "console/progress_line.h"
#include "hpsdf/detail/memory.h"
#include "hpsdf/error.h"
#include "text/text.h"

namespace hpsdf::app {
namespace {

/// Returns true if the descriptor is a pipe or a socket whose other end is closed. The errno of the failed write is
/// lost in the stream.
bool hasLostReader(int descriptor) {
  pollfd pipe = {descriptor, POLLOUT, 0};
  return poll(&pipe, 1, 0) > 0 && (pipe.revents & (POLLERR | POLLHUP)) != 0;
}

void writeMessage(const Console& console, const char* kind, std::string_view text) {
  const std::lock_guard lock(messageMutex());
  if (console.redrawsProgress) console.err << kEraseLine;
  console.err << "hpsdf: " << kind << ": " << printable(text) << std::endl;
}

}  // namespace

void note(const Console& console, std::string_view text) { writeMessage(console, "note", text); }

void warn(const Console& console, std::string_view text) { writeMessage(console, "warning", text); }

std::string forecastText(const Forecast& forecast) {
  const std::string seconds = forecast.seconds < 1 ? "less than a second" : "about " + durationText(forecast.seconds);
  return fmt::format("the field will take about {} and {}", bytesText(forecast.bytes), seconds);
}

void noteForecast(const Console& console, const Forecast& forecast) { note(console, forecastText(forecast)); }

void requireWritten(const std::ostream& out, std::span<const std::string> files) {
  if (out) return;
  if (hasLostReader(STDOUT_FILENO)) throw ReaderGone();
  std::string message = "cannot write to standard output; check that it is open, and the space left on its disk";
  if (!files.empty())
    message += fmt::format("; {} {} written all the same", fmt::join(files, ", "), files.size() == 1 ? "is" : "are");
  throw Error(message);
}

}  // namespace hpsdf::app
