#include "field/shares/leaf_queue.h"

#include <utility>

namespace hpsdf::detail {

void LeafQueue::push(std::uint32_t leaf) {
  const LeafRank rank = rankOf(leaf);
  if (front_.empty() || front_.rbegin()->first < rank) return rest_.push({rank.error, leaf});
  front_.emplace(rank, leaf);
  if (!hasTrial(leaf)) untried_.emplace(rank, leaf);
}

std::uint32_t LeafQueue::pop() {
  if (!front_.empty()) {
    const auto [rank, leaf] = *front_.begin();
    front_.erase(front_.begin());
    untried_.erase(rank);
    return leaf;
  }
  const std::uint32_t leaf = rest_.top().node;
  rest_.pop();
  return leaf;
}

std::optional<std::uint32_t> LeafQueue::firstUntried(std::size_t most) {
  if (trials_.size() >= most) return std::nullopt;
  if (!untried_.empty()) return untried_.begin()->second;
  while (!rest_.empty() && front_.size() < most) {
    const std::uint32_t leaf = rest_.top().node;
    rest_.pop();
    front_.emplace_hint(front_.end(), rankOf(leaf), leaf);
    if (hasTrial(leaf)) continue;
    untried_.emplace(rankOf(leaf), leaf);
    return leaf;
  }
  return std::nullopt;
}

void LeafQueue::keepTrial(std::uint32_t leaf, Trial&& trial) {
  trials_.insert_or_assign(leaf, std::move(trial));
  untried_.erase(rankOf(leaf));
}

Trial LeafQueue::takeTrial(std::uint32_t leaf) {
  const auto found = trials_.find(leaf);
  Trial trial = std::move(found->second);
  trials_.erase(found);
  return trial;
}

std::map<LeafRank, Trial> LeafQueue::takeAll() {
  std::map<LeafRank, Trial> trials;
  for (auto& [leaf, trial] : trials_) trials.emplace(rankOf(leaf), std::move(trial));
  front_.clear();
  untried_.clear();
  rest_ = decltype(rest_)(Later{&tree_});
  trials_.clear();
  return trials;
}

}  // namespace hpsdf::detail
