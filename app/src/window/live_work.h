#pragma once
// Long work in the explorer: the panels show the progress of the work, and users can cancel it.

#include <atomic>
#include <chrono>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "console/console.h"
#include "explorer/explorer.h"

namespace hpsdf::app {

/// Listens to the session's long work during the lifetime of this object. While work runs in the thread that
/// made this object, `refresh` is called about every 50 ms, and whenever there is something new to show. `refresh` must
/// pass input events to `Explorer::input` and show a frame.
class LiveWork : public WorkListener {
 public:
  /// Limits of the rate at which a growing field is shown.
  struct Pace {
    double seconds = 0.25;  ///< least time between two states of the field
    double share = 0.1;     ///< greatest share of the time in which the field is made and shown, above 0; 1: no limit
  };

  LiveWork(Explorer& explorer, std::function<void()> refresh) : LiveWork(explorer, std::move(refresh), Pace{}) {}
  LiveWork(Explorer& explorer, std::function<void()> refresh, const Pace& pace);
  ~LiveWork() override;
  LiveWork(const LiveWork&) = delete;
  LiveWork& operator=(const LiveWork&) = delete;

  void report(std::string_view task, double fraction) override;
  bool wantsCancel() override;
  void forecast(const Forecast& forecast) override;
  /// Shows the mesh at once if there is no field yet.
  void showMesh(const TriangleMesh& mesh, const Box& domain) override;
  /// Shows the field as it is so far if there is no finished field and it is time for it.
  void offerField(const std::function<Field()>& fieldSoFar) override;
  void ended() override;

 private:
  using Clock = std::chrono::steady_clock;
  void refreshWhenDue();
  bool takeReport();
  void refresh();

  Explorer& explorer_;
  std::function<void()> refresh_;
  std::thread::id thread_ = std::this_thread::get_id();
  std::optional<Clock::time_point> last_;  ///< time of the last refresh, or of the work's beginning
  Pace pace_;
  Clock::time_point shownSince_ = {};  ///< time at which the mesh or the growing field was last shown
  double pause_ = 0;                   ///< least time from then to the next state of the field, seconds
  bool refreshing_ = false;
  std::atomic<bool> cancelled_ = false;
  std::mutex mutex_;
  std::optional<Explorer::Work> reported_;  // guarded by mutex_
  std::optional<Forecast> forecast_;        // guarded by mutex_
};

}  // namespace hpsdf::app
