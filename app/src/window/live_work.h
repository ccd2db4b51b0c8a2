#pragma once
// Long work in the explorer: the panels show the progress of the work, and users can cancel it.

#include <atomic>
#include <chrono>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>

#include "console/console.h"
#include "explorer/explorer.h"

namespace hpsdf::app {

/// Listens to the session's long work during the lifetime of this object. While work runs in the thread that
/// made this object, `refresh` is called about every 50 ms. `refresh` must pass input events to
/// `Explorer::input` and show a frame.
class LiveWork : public WorkListener {
 public:
  LiveWork(Explorer& explorer, std::function<void()> refresh);
  ~LiveWork() override;
  LiveWork(const LiveWork&) = delete;
  LiveWork& operator=(const LiveWork&) = delete;

  void report(std::string_view task, double fraction) override;
  bool wantsCancel() override;
  void ended() override;

 private:
  using Clock = std::chrono::steady_clock;
  void refreshWhenDue();

  Explorer& explorer_;
  std::function<void()> refresh_;
  std::thread::id thread_ = std::this_thread::get_id();
  std::optional<Clock::time_point> last_;  ///< time of the last refresh, or of the work's beginning
  bool refreshing_ = false;
  std::atomic<bool> cancelled_ = false;
  std::mutex mutex_;
  std::optional<Explorer::Work> reported_;  // guarded by mutex_
};

}  // namespace hpsdf::app
