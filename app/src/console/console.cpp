#include "console/console.h"

#include <fmt/format.h>

#include <ostream>

#include "console/progress_line.h"
#include "hpsdf/detail/memory.h"
#include "hpsdf/error.h"
#include "text/text.h"

namespace hpsdf::app {

void note(const Console& console, std::string_view text) {
  console.err << "hpsdf: note: " << printable(text) << std::endl;
}

void warn(const Console& console, std::string_view text) {
  console.err << "hpsdf: warning: " << printable(text) << std::endl;
}

std::string forecastText(const Forecast& forecast) {
  const std::string seconds = forecast.seconds < 1 ? "less than a second" : "about " + durationText(forecast.seconds);
  return fmt::format("the field will take about {} and {}", bytesText(forecast.bytes), seconds);
}

void noteForecast(const Console& console, const Forecast& forecast) {
  if (console.redrawsProgress) console.err << kEraseLine;
  note(console, forecastText(forecast));
}

void requireWritten(const std::ostream& out) {
  if (!out) throw Error("cannot write to standard output: its reader has gone, or the disk is full");
}

}  // namespace hpsdf::app
