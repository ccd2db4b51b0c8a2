#include <fcntl.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <iostream>
#include <string>
#include <vector>

#include "console/interrupt.h"
#include "console/large_stack.h"
#include "construction/mesh_process.h"
#include "program.h"

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

int run(const std::vector<std::string>& words) {
  if (hpsdf::app::asksForReading(words)) return hpsdf::app::readForOtherProcess(words);
  const bool terminal = isatty(STDERR_FILENO) == 1;
  return hpsdf::app::runProgram(words, {std::cin, std::cout, std::cerr, terminal, nullptr, hpsdf::app::ownProgram()});
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
