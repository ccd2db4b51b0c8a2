#include "window/live_work.h"

namespace hpsdf::app {
namespace {

constexpr std::chrono::milliseconds kFrameInterval(50);

}  // namespace

LiveWork::LiveWork(Explorer& explorer, std::function<void()> refresh)
    : explorer_(explorer), refresh_(std::move(refresh)) {
  explorer_.session().setListener(this);
}

LiveWork::~LiveWork() { explorer_.session().setListener(nullptr); }

void LiveWork::report(std::string_view task, double fraction) {
  {
    const std::lock_guard lock(mutex_);
    reported_ = Explorer::Work{std::string(task), fraction};
  }
  refreshWhenDue();
}

bool LiveWork::wantsCancel() {
  refreshWhenDue();
  return cancelled_;
}

void LiveWork::ended() {
  explorer_.work.reset();
  explorer_.cancelWanted = false;
  cancelled_ = false;
  last_.reset();
  const std::lock_guard lock(mutex_);
  reported_.reset();
}

void LiveWork::refreshWhenDue() {
  if (std::this_thread::get_id() != thread_ || refreshing_) return;
  const auto now = Clock::now();
  if (!last_) last_ = now;
  if (now - *last_ < kFrameInterval) return;
  {
    const std::lock_guard lock(mutex_);
    if (!reported_) return;
    explorer_.work = reported_;
  }
  // Let users cancel the work only while a command runs. If they cancelled a measurement that the frame itself needs,
  // the next frame would start the measurement again.
  explorer_.work->cancellable = explorer_.running();
  refreshing_ = true;
  refresh_();
  refreshing_ = false;
  cancelled_ = explorer_.cancelWanted;
  last_ = Clock::now();
}

}  // namespace hpsdf::app
