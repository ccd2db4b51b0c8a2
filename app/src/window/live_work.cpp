#include "window/live_work.h"

#include <algorithm>
#include <utility>

namespace hpsdf::app {
namespace {

constexpr std::chrono::milliseconds kFrameInterval(50);

}  // namespace

LiveWork::LiveWork(Explorer& explorer, std::function<void()> refresh, const Pace& pace)
    : explorer_(explorer), refresh_(std::move(refresh)), pace_(pace) {
  explorer_.session().setListener(this);
}

LiveWork::~LiveWork() { explorer_.session().setListener(nullptr); }

void LiveWork::report(std::string_view task, double fraction) {
  {
    const std::lock_guard lock(mutex_);
    reported_ = Explorer::Work{.task = std::string(task), .fraction = fraction};
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
  forecast_.reset();
}

void LiveWork::forecast(const Forecast& forecast) {
  const std::lock_guard lock(mutex_);
  forecast_ = forecast;
}

void LiveWork::showMesh(const TriangleMesh& mesh, const Box& domain) {
  if (std::this_thread::get_id() != thread_ || !explorer_.isOpening()) return;
  explorer_.showMesh(mesh, domain);
  explorer_.work = Explorer::Work{.task = "preparing the exact distance", .cancellable = explorer_.running()};
  refresh();
  shownSince_ = Clock::now();
  pause_ = pace_.seconds;
}

void LiveWork::offerField(const std::function<Field()>& fieldSoFar) {
  if (std::this_thread::get_id() != thread_ || refreshing_ || !explorer_.isOpening()) return;
  using Seconds = std::chrono::duration<double>;
  const auto start = Clock::now();
  if (Seconds(start - shownSince_).count() < pause_ || !takeReport()) return;
  explorer_.showUnfinished(fieldSoFar());
  refresh();
  shownSince_ = Clock::now();
  pause_ = std::max(pace_.seconds, Seconds(shownSince_ - start).count() * (1 / pace_.share - 1));
}

void LiveWork::refreshWhenDue() {
  if (std::this_thread::get_id() != thread_ || refreshing_) return;
  const auto now = Clock::now();
  if (!last_) last_ = now;
  if (now - *last_ < kFrameInterval) return;
  if (takeReport()) refresh();
}

/// Passes what was reported last to the explorer. Returns false if nothing was reported yet.
bool LiveWork::takeReport() {
  const std::lock_guard lock(mutex_);
  if (!reported_) return false;
  explorer_.work = reported_;
  explorer_.work->forecast = forecast_;
  // Let users cancel the work only while a command runs. If they cancelled a measurement that the frame itself needs,
  // the next frame would start the measurement again.
  explorer_.work->cancellable = explorer_.running();
  return true;
}

void LiveWork::refresh() {
  refreshing_ = true;
  refresh_();
  refreshing_ = false;
  cancelled_ = explorer_.cancelWanted;
  last_ = Clock::now();
}

}  // namespace hpsdf::app
