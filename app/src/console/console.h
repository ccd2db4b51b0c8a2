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
  /// Receives the progress of the work, as `Progress::report` does. Any thread may call it, but only one call
  /// runs at a time.
  virtual void report(std::string_view task, double fraction) = 0;
  /// Tells whether the work should stop. Any thread may call it, and it is called often. Once it returns true,
  /// the work ends with the exception `Cancelled`.
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
  /// Program that reads mesh files in a separate process (mesh_process.h). If it is empty, this process reads
  /// mesh files itself.
  std::filesystem::path meshReader = {};
  std::string work = {};  ///< prefix of progress messages: names the current piece of work among several
};

/// Writes one line to the stream `err`. Control characters in `text`, for example from the names of foreign
/// files, become blanks.
void note(const Console& console, std::string_view text);
void warn(const Console& console, std::string_view text);

/// Throws `Error` if a write to `out`, the standard output, has failed.
void requireWritten(const std::ostream& out);

}  // namespace hpsdf::app
