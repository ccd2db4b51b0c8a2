#pragma once
// Ranks that are threads of one process, for tests.

#include <cstddef>
#include <exception>
#include <functional>
#include <mutex>
#include <span>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

#include "hpsdf/parallel/ranks.h"

namespace hpsdf::support {

/// What the ranks of one group share: the messages of each call, by its number.
class ThreadGroup {
 public:
  explicit ThreadGroup(int count) : count_(count) {}

  int count() const { return count_; }

  /// Puts the messages of a rank down for call number `call`.
  void put(std::size_t call, int rank, std::vector<Ranks::Message> messages) {
    const std::scoped_lock lock(mutex_);
    if (calls_.size() <= call) calls_.resize(call + 1);
    calls_[call].resize(std::size_t(count_));
    calls_[call][std::size_t(rank)] = std::move(messages);
  }

  /// Returns true once all ranks have put down their messages for a call, none of which is empty.
  bool isComplete(std::size_t call) {
    const std::scoped_lock lock(mutex_);
    for (const auto& messages : calls_[call])
      if (messages.empty()) return false;
    return true;
  }

  Ranks::Message message(std::size_t call, int from, std::size_t number) {
    const std::scoped_lock lock(mutex_);
    return calls_[call][std::size_t(from)].at(number);
  }

 private:
  int count_;
  std::mutex mutex_;
  std::vector<std::vector<std::vector<Ranks::Message>>> calls_;  ///< by call, by rank
};

class ThreadRank : public Ranks {
 public:
  ThreadRank(ThreadGroup& group, int rank) : group_(group), rank_(rank) {}

  int rank() const override { return rank_; }
  int count() const override { return group_.count(); }

  std::vector<Message> gatherAll(std::span<const std::byte> own, const std::function<void()>& whileWaiting) override {
    const std::size_t call = next_++;
    group_.put(call, rank_, {Message(own.begin(), own.end())});
    while (!group_.isComplete(call)) {
      if (whileWaiting) whileWaiting();
      std::this_thread::yield();
    }
    std::vector<Message> all;
    for (int from = 0; from < count(); ++from) all.push_back(group_.message(call, from, 0));
    return all;
  }

  std::vector<Message> exchange(std::vector<Message> toEach) override {
    if (toEach.size() != std::size_t(count())) throw std::logic_error("expected a message for each rank");
    const std::size_t call = next_++;
    group_.put(call, rank_, std::move(toEach));
    while (!group_.isComplete(call)) std::this_thread::yield();
    std::vector<Message> all;
    for (int from = 0; from < count(); ++from) all.push_back(group_.message(call, from, std::size_t(rank_)));
    return all;
  }

 private:
  ThreadGroup& group_;
  int rank_;
  std::size_t next_ = 0;
};

/// Calls work(rank) in a thread for each rank of a group, and returns what it threw, by rank.
inline std::vector<std::exception_ptr> runRanks(int count, const std::function<void(Ranks&)>& work) {
  ThreadGroup group(count);
  std::vector<std::exception_ptr> thrown(std::size_t(count), nullptr);
  std::vector<std::thread> threads;
  for (int rank = 0; rank < count; ++rank) {
    threads.emplace_back([&, rank] {
      ThreadRank own(group, rank);
      try {
        work(own);
      } catch (...) {
        thrown[std::size_t(rank)] = std::current_exception();
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  return thrown;
}

}  // namespace hpsdf::support
