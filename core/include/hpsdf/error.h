#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>
#include <string_view>

namespace hpsdf {

/// The kind of thing that an `Error` is about, so that callers need not parse its message.
enum class ErrorKind : std::uint8_t {
  general,  ///< none of the kinds below
  option,   ///< an option, or a parameter of a shape, has a value that is not accepted
  file,     ///< a file cannot be read, is damaged, or cannot be written
  mesh,     ///< a mesh or a shape cannot be used
  field,    ///< a field does not support the operation that the caller asks for
  limit,    ///< the work would exceed the memory, or the largest count that the data structures can hold
};

/// Thrown for bad input, such as a file, a mesh or an option. The message is one line that says what is wrong,
/// where it is wrong, and what to do about it. A blank stands for each NUL byte that the message would contain, because
/// what() would end there.
class Error : public std::runtime_error {
 public:
  explicit Error(const std::string& message) : std::runtime_error(withoutNul(message)) {}

  /// Makes an error with the message "SUBJECT: PROBLEM", or "PROBLEM" if the subject is empty. The subject is the file,
  /// the option or the shape that the error is about. It is spelled as the caller wrote it, so that the caller can
  /// recognise it in the message.
  Error(ErrorKind kind, const std::string& subject, const std::string& problem)
      : std::runtime_error(withoutNul(subject.empty() ? problem : subject + ": " + problem)),
        subject_(subject),
        kind_(kind) {}

  ErrorKind kind() const { return kind_; }
  const std::string& subject() const { return subject_; }

  /// Returns the message without its subject.
  std::string problem() const { return what() + (subject_.empty() ? std::size_t{0} : subject_.size() + 2); }

 private:
  static std::string withoutNul(std::string text) {
    std::ranges::replace(text, '\0', ' ');
    return text;
  }

  std::string subject_;
  ErrorKind kind_ = ErrorKind::general;
};

/// Thrown if a construction needs more memory than `BuildOptions::memoryLimit` or the machine allows. It is of the kind
/// `limit`.
class MemoryLimitError : public Error {
 public:
  /// `shortage` tells what is needed and how to need less. `enough` is a memory limit in bytes that is likely to
  /// suffice, or 0 if it is more than the machine allows.
  MemoryLimitError(const std::string& shortage, std::uint64_t enough)
      : Error(ErrorKind::limit, "",
              shortage + (enough > 0 ? ", or allow more memory: a memoryLimit of " + std::to_string(enough) +
                                           " bytes is likely to suffice"
                                     : "; this machine does not allow more memory")),
        shortage_(shortage),
        enough_(enough) {}

  /// Returns the message without what it says of memory limits.
  const std::string& shortage() const { return shortage_; }
  std::uint64_t enough() const { return enough_; }

 private:
  std::string shortage_;
  std::uint64_t enough_;
};

/// Thrown by a long operation if its `Progress` asks it to stop. The stopped operation has written no output.
class Cancelled : public std::runtime_error {
 public:
  Cancelled() : std::runtime_error("cancelled") {}
};

/// An estimate of what a long operation will take, made at an early moment from a sample of its work.
struct Forecast {
  double bytes = 0;    ///< memory of the result
  double seconds = 0;  ///< time of the whole operation, from its start
};

/// The link between a long operation and its caller: progress reports and cancellation. All functions may be empty.
struct Progress {
  /// Receives the name of the current task and the estimated fraction of it that is done, 0 to 1. Calls never
  /// overlap, even if they come from several threads.
  std::function<void(std::string_view task, double fraction)> report = {};

  /// The operation calls this function often and from any thread. Once the function returns true, the operation
  /// throws `Cancelled`.
  std::function<bool()> cancelled = {};

  /// Receives the forecast of an operation that makes one, once, before a tenth of the work is done.
  std::function<void(const Forecast&)> forecast = {};

  /// Throws `Cancelled` if the caller asks to stop. Operations call this function between steps.
  void throwIfCancelled() const {
    if (cancelled && cancelled()) throw Cancelled();
  }

  /// Reports progress, and throws `Cancelled` as `throwIfCancelled` does. Operations call this function when they
  /// have progress to report.
  void update(std::string_view task, double fraction) const {
    throwIfCancelled();
    if (report) report(task, fraction);
  }
};

}  // namespace hpsdf
