#include "convert/waiting.h"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>

namespace py = pybind11;

namespace hpsdf::python {
namespace {

/// The task that some work is at, and the fraction of it that is done.
struct Report {
  std::string task;
  double fraction = 0;
};

/// Holds the messages between the thread that works and the thread that waits.
class Work {
 public:
  Progress progress() {
    return {.report =
                [this](std::string_view task, double fraction) {
                  const std::lock_guard lock(mutex_);
                  report_ = {std::string(task), fraction};
                },
            .cancelled = [this] { return cancelled_.load(std::memory_order_relaxed); }};
  }

  void cancel() { cancelled_ = true; }

  void finish() {
    const std::lock_guard lock(mutex_);
    finished_ = true;
    changed_.notify_all();
  }

  /// Waits until the work is finished, but for 50 ms at most. Returns true if it is finished.
  bool waitAWhile() {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::milliseconds(50), [this] { return finished_; });
  }

  /// Returns the last report, once.
  std::optional<Report> takeReport() {
    const std::lock_guard lock(mutex_);
    return std::exchange(report_, std::nullopt);
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool finished_ = false;
  std::optional<Report> report_;
  std::atomic<bool> cancelled_ = false;
};

/// Lets Python handle signals, and passes the last report on. The caller holds the GIL.
void attend(Work& work, const py::object& progress) {
  if (PyErr_CheckSignals() != 0) throw py::error_already_set();
  if (progress.is_none()) return;
  if (const auto report = work.takeReport()) progress(report->task, report->fraction);
}

/// The callable that gets reports: that of the caller, a bar that is closed in the end, or None.
class Receiver {
 public:
  explicit Receiver(const py::object& progress) : callable_(progress) {
    if (py::isinstance<py::bool_>(progress)) {
      isBar_ = progress.cast<bool>();
      callable_ = isBar_ ? py::module_::import("hpsdf._progress").attr("Bar")() : py::none();
    } else if (!progress.is_none() && PyCallable_Check(progress.ptr()) == 0) {
      throw py::type_error("progress: expected a callable that takes a task's name and a fraction, True or None");
    }
  }
  Receiver(const Receiver&) = delete;
  Receiver& operator=(const Receiver&) = delete;
  ~Receiver() {
    if (!isBar_) return;
    const py::error_scope pending;
    try {
      callable_.attr("close")();
    } catch (const py::error_already_set&) {  // a bar that cannot be closed is no reason to lose the result
    }
  }

  const py::object& callable() const { return callable_; }

 private:
  py::object callable_;
  bool isBar_ = false;
};

}  // namespace

void waitFor(const py::object& progress, const std::function<void(const Progress&)>& work) {
  const Receiver receiver(progress);
  Work shared;
  std::exception_ptr failed, interrupted;
  {
    const py::gil_scoped_release released;
    std::thread worker([&] {
      try {
        work(shared.progress());
      } catch (...) {
        failed = std::current_exception();
      }
      shared.finish();
    });
    while (!shared.waitAWhile()) {
      if (interrupted) continue;
      const py::gil_scoped_acquire held;
      try {
        attend(shared, receiver.callable());
      } catch (...) {
        interrupted = std::current_exception();
        shared.cancel();
      }
    }
    worker.join();
  }
  if (interrupted) std::rethrow_exception(interrupted);
  if (failed) std::rethrow_exception(failed);
  attend(shared, receiver.callable());
}

}  // namespace hpsdf::python
