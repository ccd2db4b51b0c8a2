#include <fcntl.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <iostream>
#include <string>
#include <string_view>
#include <vector>

#include "console/interrupt.h"
#include "console/large_stack.h"
#include "construction/mesh_process.h"
#include "program.h"
#include "ranks/mpi_group.h"
#include "ranks/process_group.h"

namespace {

/// Opens /dev/null for each standard stream that is closed at the start of the program. Otherwise the next
/// file that the program opens would become that standard stream.
void occupyClosedStreams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    if (fcntl(stream, F_GETFD) == -1) {
      // /dev/null is opened for the wrong direction, so that reading or writing the closed stream remains an error.
      [[maybe_unused]] const int opened = open("/dev/null", stream == STDIN_FILENO ? O_WRONLY : O_RDONLY);
    }
}

/// Tells whether the standard output is a terminal with 24-bit colours whose user wants colours (no-color.org).
bool showsColors() {
  const auto valueOf = [](const char* name) {
    const char* const value = std::getenv(name);
    return std::string_view(value == nullptr ? "" : value);
  };
  const std::string_view colors = valueOf("COLORTERM");
  return isatty(STDOUT_FILENO) == 1 && valueOf("NO_COLOR").empty() && (colors == "truecolor" || colors == "24bit");
}

int runWith(const std::vector<std::string>& words, hpsdf::app::ProcessGroup* group) {
  // If several processes build a field together, the first alone writes.
  const bool writes = group == nullptr || group->isFirst();
  if (!writes) hpsdf::app::removeInterruptHandlers();
  std::ostream nowhere(nullptr);
  hpsdf::app::Console console{.in = std::cin,
                              .out = writes ? std::cout : nowhere,
                              .err = writes ? std::cerr : nowhere,
                              .redrawsProgress = writes && isatty(STDERR_FILENO) == 1,
                              .meshReader = hpsdf::app::ownProgram(),
                              .writesProgress = writes,
                              .showsColors = showsColors(),
                              .group = group};
  return hpsdf::app::runProgram(words, console);
}

int runTogether(const std::vector<std::string>& words) {
  try {
    return hpsdf::app::withProcessGroup([&](hpsdf::app::ProcessGroup& group) { return runWith(words, &group); });
  } catch (const hpsdf::Error& error) {
    std::cerr << "hpsdf: error: " << error.what() << std::endl;
    return hpsdf::app::kExitBadInput;
  }
}

int run(const std::vector<std::string>& words) {
  if (hpsdf::app::asksForReading(words)) return hpsdf::app::readForOtherProcess(words);
  return hpsdf::app::isStartedTogether() ? runTogether(words) : runWith(words, nullptr);
}

}  // namespace

int main(int argc, char** argv) {
  occupyClosedStreams();
  hpsdf::app::installInterruptHandlers();
  // The signals SIGPIPE and SIGXFSZ are ignored. A closed pipe and a file beyond the size limit are then
  // reported like other failed writes.
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  std::signal(SIGCHLD, SIG_DFL);  // waitpid would fail if the parent process ignored SIGCHLD
  std::ios::sync_with_stdio(false);
  std::cin.tie(nullptr);
  // Mesa would otherwise write warnings of its own. The program's message about OpenGL tells what was tried.
  setenv("EGL_LOG_LEVEL", "fatal", 0);
  const std::vector<std::string> words(argv + (argc > 0), argv + argc);
  return hpsdf::app::withLargeStack([&] { return run(words); });
}
