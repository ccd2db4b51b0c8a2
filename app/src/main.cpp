#include <fcntl.h>
#include <unistd.h>

#include <csignal>
#include <iostream>
#include <string>
#include <vector>

#include "console/interrupt.h"
#include "construction/mesh_process.h"
#include "program.h"

namespace {

/// A standard stream that the caller closed must not be handed to the first file that we open.
void occupyClosedStreams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    if (fcntl(stream, F_GETFD) == -1) {
      // the wrong direction on purpose: writing to a closed stream stays an error
      [[maybe_unused]] const int opened = open("/dev/null", stream == STDIN_FILENO ? O_WRONLY : O_RDONLY);
    }
}

}  // namespace

int main(int argc, char** argv) {
  occupyClosedStreams();
  hpsdf::app::installInterruptHandlers();
  // a reader that went away, or a file longer than allowed, is reported like any other failed write
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  std::signal(SIGCHLD, SIG_DFL);  // ignored, as some callers leave it, nobody could be waited for
  std::ios::sync_with_stdio(false);
  std::cin.tie(nullptr);
  const std::vector<std::string> words(argv + (argc > 0), argv + argc);
  if (hpsdf::app::asksForReading(words)) return hpsdf::app::readForOtherProcess(words);
  const bool terminal = isatty(STDERR_FILENO) == 1;
  return hpsdf::app::runProgram(words, {std::cin, std::cout, std::cerr, terminal, nullptr, hpsdf::app::ownProgram()});
}
