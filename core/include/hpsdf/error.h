#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>
#include <string_view>

namespace hpsdf {

/// What an `Error` is about, so that callers need not parse its message.
enum class ErrorKind : std::uint8_t {
  general,  ///< none of the kinds below
  option,   ///< an option, or a parameter of a shape, has a value that is not accepted
  file,     ///< a file cannot be read, is damaged, or cannot be written
  mesh,     ///< a mesh or a shape cannot be used
  field,    ///< a field cannot be used for what is asked of it
  limit,    ///< the work would exceed the memory, or a count that the data structures hold
};

/// Bad input: a file, a mesh, an option. The message is one line that says what is wrong, where, and what to do.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;

  /// The message is "SUBJECT: PROBLEM", or "PROBLEM" if the subject is empty. The subject is the file, option or
  /// shape that the error is about, as the caller wrote it, so that callers can recognise it in the message.
  Error(ErrorKind kind, const std::string& subject, const std::string& problem)
      : std::runtime_error(subject.empty() ? problem : subject + ": " + problem), subject_(subject), kind_(kind) {}

  ErrorKind kind() const { return kind_; }
  const std::string& subject() const { return subject_; }

  /// The message without its subject.
  std::string problem() const { return what() + (subject_.empty() ? std::size_t{0} : subject_.size() + 2); }

 private:
  std::string subject_;
  ErrorKind kind_ = ErrorKind::general;
};

/// Thrown by a long operation whose `Progress` asked it to stop. Nothing has been written.
class Cancelled : public std::runtime_error {
 public:
  Cancelled() : std::runtime_error("cancelled") {}
};

/// The link between a long operation and its caller. Both callables may be empty.
struct Progress {
  /// Receives what is being done and the estimated fraction done, 0 to 1. One thread calls it at a time.
  std::function<void(std::string_view task, double fraction)> report;

  /// The operation calls this often and from any thread. Once it returns true, the operation throws `Cancelled`.
  std::function<bool()> cancelled;

  /// Operations call this between steps.
  void throwIfCancelled() const {
    if (cancelled && cancelled()) throw Cancelled();
  }

  /// Operations call this where they have progress to report; it throws `Cancelled` as `throwIfCancelled` does.
  void update(std::string_view task, double fraction) const {
    throwIfCancelled();
    if (report) report(task, fraction);
  }
};

}  // namespace hpsdf
