#pragma once
// Long work in the explorer: its panels show how far it is and let a person cancel it.

#include <atomic>
#include <chrono>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>

#include "console/console.h"
#include "explorer/explorer.h"

namespace hpsdf::app {

/// The session's listener while one lives. From time to time during long work on this thread it calls `refresh`, which
/// is to pass on what the person does (`Explorer::input`) and show a frame.
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
  std::optional<Clock::time_point> last_;  ///< refresh, or the work's beginning
  bool refreshing_ = false;
  std::atomic<bool> cancelled_ = false;
  std::mutex mutex_;
  std::optional<Explorer::Work> reported_;  // guarded by mutex_
};

}  // namespace hpsdf::app
