#pragma once
// The program's input and output streams, and an observer of its long work.

#include <filesystem>
#include <functional>
#include <iosfwd>
#include <map>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>

#include "hpsdf/error.h"
#include "hpsdf/field.h"
#include "hpsdf/triangle_mesh.h"

namespace hpsdf::app {

/// Observes operations that take long, such as the construction of a field, and can cancel them.
class WorkListener {
 public:
  virtual ~WorkListener() = default;
  /// Receives the name of the running task and its completed fraction. Any thread may call it, but calls never overlap.
  virtual void report(std::string_view task, double fraction) = 0;
  /// Tells whether the work should stop. Any thread may call it, and it is called often. Once it returns true,
  /// the work ends with the exception `Cancelled`.
  virtual bool wantsCancel() = 0;
  /// Receives the forecast of the work, if it makes one. Any thread may call it.
  virtual void forecast(const Forecast&) {}
  /// Receives the mesh and the domain of a field that is about to be built.
  virtual void showMesh(const TriangleMesh& /*mesh*/, const Box& /*domain*/) {}
  /// Is offered the field of an unfinished construction, often: fieldSoFar() makes it. Any thread may call it.
  virtual void offerField(const std::function<Field()>& /*fieldSoFar*/) {}
  /// Called when the work has succeeded, failed or been cancelled.
  virtual void ended() = 0;
};

struct ProcessGroup;

/// The streams that the program uses. Tests pass streams of their own.
struct Console {
  std::istream& in;
  std::ostream& out;             ///< results
  std::ostream& err;             ///< progress, notes and warnings
  bool redrawsProgress = false;  ///< true if `err` is a terminal, where a progress line can be redrawn
  WorkListener* listener = nullptr;
  /// Program that reads mesh files in a separate process if assimp or Draco take part (mesh_process.h). If it is empty,
  /// this process reads them itself.
  std::filesystem::path meshReader = {};
  /// Meshes in memory that take the place of files of their names. It may be null.
  const std::map<std::string, TriangleMesh, std::less<>>* meshes = nullptr;
  std::string work = {};          ///< prefix of progress messages, such as "3 of 10, bunny.obj: "
  bool writesProgress = true;     ///< false if only the listener shows progress
  bool showsColors = false;       ///< true if `out` is a terminal that shows 24-bit colours
  ProcessGroup* group = nullptr;  ///< the processes that build a field together; null if this one is alone
};

/// Writes one line to the stream `err`, in place of a progress line. Any thread may call it. Control characters in
/// `text`, which file names may contain, are escaped.
void note(const Console& console, std::string_view text);
void warn(const Console& console, std::string_view text);

/// Says what a long operation will take: "the field will take about 12.3 MB and 40 s".
std::string forecastText(const Forecast& forecast);

/// Writes a line that says what a long operation will take.
void noteForecast(const Console& console, const Forecast& forecast);

/// Thrown if nobody reads the standard output any more, for instance because `head` has ended. It is no error of the
/// program, which ends without a message.
class ReaderGone : public std::runtime_error {
 public:
  ReaderGone() : std::runtime_error("the reader of the standard output has gone") {}
};

/// Throws `ReaderGone` if a write to `out`, the standard output, has failed for want of a reader. Throws `Error` if it
/// has failed for another reason. Its message names `files`, which the program has written before.
void requireWritten(const std::ostream& out, std::span<const std::string> files = {});

}  // namespace hpsdf::app
