#include "hpsdf/mpi.h"

#include <mpi.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <numeric>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "hpsdf/error.h"

namespace hpsdf::mpi {
namespace {

constexpr std::size_t kMostBytes = std::size_t{1} << 30;  // of one call, because MPI counts in int

int number(std::size_t count) { return static_cast<int>(count); }

/// The beginning of a message, which all processes send each other at once. Most messages have no more than that.
struct Head {
  std::uint64_t size = 0;  ///< of the whole message
  std::array<std::byte, 4088> bytes{};
};

/// The memory of a call of MPI that goes on while the process does other work.
struct Call {
  MPI_Request request = MPI_REQUEST_NULL;
  Head head;
  std::vector<std::byte> own, rest;
  std::vector<Head> heads;
  std::vector<int> counts, begins;
  int failed = -1;  ///< a rank that has no memory for the messages to it
};

class CommunicatorRanks : public Ranks {
 public:
  explicit CommunicatorRanks(MPI_Comm communicator) {
    MPI_Comm_dup(communicator, &communicator_);
    MPI_Comm_rank(communicator_, &rank_);
    MPI_Comm_size(communicator_, &count_);
  }
  ~CommunicatorRanks() override {
    for (std::unique_ptr<Call>& call : left_)
      if (!isDone(*call)) static_cast<void>(call.release());  // MPI may still write to it
    MPI_Comm_free(&communicator_);
  }

  int rank() const override { return rank_; }
  int count() const override { return count_; }

  std::vector<Message> gatherAll(std::span<const std::byte> own, const std::function<void()>& whileWaiting) override {
    auto call = std::make_unique<Call>();
    call->own.assign(own.begin(), own.end());
    call->head.size = own.size();
    const std::size_t inHead = std::min(own.size(), call->head.bytes.size());
    std::copy_n(own.begin(), inHead, call->head.bytes.begin());
    call->heads.resize(std::size_t(count_));
    MPI_Iallgather(&call->head, sizeof(Head), MPI_BYTE, call->heads.data(), sizeof(Head), MPI_BYTE, communicator_,
                   &call->request);
    std::exception_ptr failure;
    wait(call, whileWaiting, failure);

    std::vector<Message> messages{std::size_t(count_)};
    std::vector<std::size_t> rest(std::size_t(count_), 0);
    for (std::size_t from = 0; from < messages.size(); ++from) {
      const Head& received = call->heads[from];
      const std::size_t size = std::min<std::size_t>(received.size, received.bytes.size());
      messages[from].assign(received.bytes.begin(), received.bytes.begin() + std::ptrdiff_t(size));
      rest[from] = received.size - size;
    }
    if (std::ranges::any_of(rest, [](std::size_t size) { return size > 0; }))
      appendRest(std::move(call), inHead, rest, messages, whileWaiting, failure);
    if (failure) std::rethrow_exception(failure);
    return messages;
  }

  std::vector<Message> exchange(std::vector<Message> toEach) override {
    std::vector<std::uint64_t> sent, received(std::size_t(count_), 0);
    for (const Message& message : toEach) sent.push_back(message.size());
    MPI_Alltoall(sent.data(), 1, MPI_UINT64_T, received.data(), 1, MPI_UINT64_T, communicator_);
    std::vector<Message> messages{std::size_t(count_)};
    auto call = std::make_unique<Call>();
    std::exception_ptr failure;
    const auto allocate = [&] {
      for (int other = 0; other < count_; ++other)
        if (other != rank_) messages[std::size_t(other)].resize(received[std::size_t(other)]);
    };
    if (!allocateOnAll(call, allocate, {}, failure)) std::rethrow_exception(failure);
    std::vector<MPI_Request> requests;
    for (int other = 0; other < count_; ++other) {
      if (other == rank_) continue;
      inParts(messages[std::size_t(other)], [&](std::span<std::byte> part, int tag) {
        MPI_Irecv(part.data(), number(part.size()), MPI_BYTE, other, tag, communicator_, &requests.emplace_back());
      });
    }
    for (int other = 0; other < count_; ++other) {
      if (other == rank_) continue;
      inParts(toEach[std::size_t(other)], [&](std::span<std::byte> part, int tag) {
        MPI_Isend(part.data(), number(part.size()), MPI_BYTE, other, tag, communicator_, &requests.emplace_back());
      });
    }
    MPI_Waitall(number(requests.size()), requests.data(), MPI_STATUSES_IGNORE);
    messages[std::size_t(rank_)] = std::move(toEach[std::size_t(rank_)]);
    return messages;
  }

 private:
  /// Allocates memory on all ranks before any of them counts on the others' messages. Returns false on all ranks if
  /// `allocate` throws on one; `failure` is then an exception, if it was none before.
  bool allocateOnAll(std::unique_ptr<Call>& call, const std::function<void()>& allocate,
                     const std::function<void()>& whileWaiting, std::exception_ptr& failure) {
    std::exception_ptr own;
    try {
      allocate();
    } catch (...) {
      own = std::current_exception();
    }
    call->failed = own ? rank_ : -1;
    MPI_Iallreduce(MPI_IN_PLACE, &call->failed, 1, MPI_INT, MPI_MAX, communicator_, &call->request);
    wait(call, whileWaiting, failure);
    if (call->failed < 0) return true;
    if (!own)
      own = std::make_exception_ptr(
          Error("process " + std::to_string(call->failed) + " has no memory for the messages to it"));
    if (!failure) failure = own;
    return false;
  }

  /// Calls f(part, number of the part) for parts of a message that are not too long for one call.
  template <typename F>
  static void inParts(Message& message, const F& f) {
    int part = 0;
    for (std::size_t begin = 0; begin < message.size(); begin += kMostBytes)
      f(std::span(message).subspan(begin, std::min(kMostBytes, message.size() - begin)), part++);
  }

  static bool isDone(Call& call) {
    int done = 0;
    MPI_Test(&call.request, &done, MPI_STATUS_IGNORE);
    return done != 0;
  }

  /// Waits for a call. What `whileWaiting` throws becomes `failure` and is thrown when all calls for these messages are
  /// done, because the other processes make all of them. If it is `Cancelled`, the others may have been killed: it is
  /// thrown after a while in any case, and the memory of the call is kept for it.
  void wait(std::unique_ptr<Call>& call, const std::function<void()>& whileWaiting, std::exception_ptr& failure) {
    using Clock = std::chrono::steady_clock;
    constexpr auto kPatience = std::chrono::milliseconds(300);
    std::optional<Clock::time_point> end;
    while (!isDone(*call)) {
      if (end && Clock::now() > *end) {
        left_.push_back(std::move(call));
        std::rethrow_exception(failure);
      }
      try {
        if (whileWaiting && !failure) whileWaiting();
      } catch (const Cancelled&) {
        failure = std::current_exception();
        end = Clock::now() + kPatience;
      } catch (...) {
        failure = std::current_exception();
      }
      std::this_thread::yield();  // to other processes, where there are more of them than processors
    }
  }

  /// Sends what the heads had no room for, and appends it to the messages.
  void appendRest(std::unique_ptr<Call> call, std::size_t inHead, const std::vector<std::size_t>& sizes,
                  std::vector<Message>& messages, const std::function<void()>& whileWaiting,
                  std::exception_ptr& failure) {
    const std::size_t all = std::accumulate(sizes.begin(), sizes.end(), std::size_t{0});
    if (all > kMostBytes) throw Error("messages of " + std::to_string(all) + " bytes to all processes are too long");
    std::size_t begin = 0;
    for (const std::size_t size : sizes) {
      call->counts.push_back(number(size));
      call->begins.push_back(number(begin));
      begin += size;
    }
    const auto allocate = [&] {
      call->rest.resize(all);
      for (std::size_t from = 0; from < messages.size(); ++from)
        messages[from].reserve(messages[from].size() + sizes[from]);
    };
    if (!allocateOnAll(call, allocate, whileWaiting, failure)) return;
    MPI_Iallgatherv(call->own.data() + inHead, number(call->own.size() - inHead), MPI_BYTE, call->rest.data(),
                    call->counts.data(), call->begins.data(), MPI_BYTE, communicator_, &call->request);
    wait(call, whileWaiting, failure);
    for (std::size_t from = 0; from < messages.size(); ++from) {
      const auto part = std::span(call->rest).subspan(std::size_t(call->begins[from]), sizes[from]);
      messages[from].insert(messages[from].end(), part.begin(), part.end());
    }
  }

  MPI_Comm communicator_ = MPI_COMM_NULL;
  int rank_ = 0, count_ = 1;
  std::vector<std::unique_ptr<Call>> left_;  ///< calls for which nobody waits any more
};

}  // namespace

Session::Session() {
  int provided = MPI_THREAD_SINGLE;
  MPI_Init_thread(nullptr, nullptr, MPI_THREAD_SERIALIZED, &provided);
  if (provided < MPI_THREAD_SERIALIZED) {
    MPI_Finalize();
    throw Error("this MPI does not allow calls from more than one thread: install one that does");
  }
}

Session::~Session() { MPI_Finalize(); }

std::unique_ptr<Ranks> ranksOf(int communicator) {
  return std::make_unique<CommunicatorRanks>(MPI_Comm_f2c(communicator));
}

std::unique_ptr<Ranks> allRanks() { return std::make_unique<CommunicatorRanks>(MPI_COMM_WORLD); }

}  // namespace hpsdf::mpi
