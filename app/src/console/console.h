#pragma once
// Where the program reads and writes, and who watches its long work.

#include <filesystem>
#include <iosfwd>
#include <string>
#include <string_view>

namespace hpsdf::app {

/// Watches long work and may end it.
class WorkListener {
 public:
  virtual ~WorkListener() = default;
  /// As `Progress` has it: from any thread, by one at a time.
  virtual void report(std::string_view task, double fraction) = 0;
  /// Asked often, from any thread.
  virtual bool wantsCancel() = 0;
  /// The work is over, whatever came of it.
  virtual void ended() = 0;
};

/// Where the program reads and writes: the process's own streams, or a test's.
struct Console {
  std::istream& in;
  std::ostream& out;             ///< results
  std::ostream& err;             ///< progress, notes and warnings
  bool redrawsProgress = false;  ///< err is a terminal: one line, drawn again and again
  WorkListener* listener = nullptr;
  std::filesystem::path meshReader =
      {};                 ///< program that mesh files are read by (mesh_process.h); empty: by this process
  std::string work = {};  ///< what progress is told of, in front of it, where that is one of many
};

/// A line for the user, on any terminal, whatever a stranger's file or name holds.
void note(const Console& console, std::string_view text);
void warn(const Console& console, std::string_view text);

}  // namespace hpsdf::app
