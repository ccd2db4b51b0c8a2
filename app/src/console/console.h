#pragma once
// The program's input and output, and the observer of its long work.

#include <filesystem>
#include <iosfwd>
#include <string>
#include <string_view>

namespace hpsdf::app {

/// Observes long work and can cancel it.
class WorkListener {
 public:
  virtual ~WorkListener() = default;
  /// Receives progress as `Progress::report` does: from any thread, one call at a time.
  virtual void report(std::string_view task, double fraction) = 0;
  /// Is called often, from any thread; once it returns true, the work ends with `Cancelled`.
  virtual bool wantsCancel() = 0;
  /// Is called when the work has succeeded, failed or been cancelled.
  virtual void ended() = 0;
};

/// The streams that the program uses: those of the process, or those of a test.
struct Console {
  std::istream& in;
  std::ostream& out;             ///< results
  std::ostream& err;             ///< progress, notes and warnings
  bool redrawsProgress = false;  ///< true where err is a terminal, on which one line of progress is redrawn
  WorkListener* listener = nullptr;
  /// Program that reads mesh files in a process of its own (mesh_process.h); empty: this process reads them.
  std::filesystem::path meshReader = {};
  std::string work = {};  ///< prefix of progress messages: names the current piece of work among several
};

/// Writes one line to `err`. Control characters, which names from other people's files may contain, become blanks.
void note(const Console& console, std::string_view text);
void warn(const Console& console, std::string_view text);

/// Throws `Error` where standard output could not be written.
void requireWritten(const std::ostream& out);

}  // namespace hpsdf::app
