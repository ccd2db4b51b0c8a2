// Sends messages between the processes of an MPI program, some of which have no room in one process's memory. Test
// program: mpirun -n 3 mpi_messages. The exit status is 0 if all of it went right.

#include <sys/resource.h>
#include <unistd.h>

#include <cstddef>
#include <cstdlib>
#include <exception>
#include <fstream>
#include <functional>
#include <iostream>
#include <memory>
#include <vector>

#include "hpsdf/error.h"
#include "hpsdf/mpi.h"

namespace {

using hpsdf::Ranks;
using Message = Ranks::Message;

constexpr std::size_t kRoom = std::size_t{64} << 20;    // bytes that one process has room for
constexpr std::size_t kLarge = std::size_t{256} << 20;  // bytes that it has no room for
constexpr std::size_t kTwice = std::size_t{40} << 20;   // bytes that it has room for once, but not twice

void require(bool holds, const char* what) {
  if (!holds) throw hpsdf::Error(what);
}

std::byte byteOf(int from, int to) { return std::byte(16 * from + to + 1); }

/// Sends messages of `size` bytes to all ranks, and checks what arrives.
void exchange(Ranks& ranks, std::size_t size) {
  std::vector<Message> toEach;
  for (int to = 0; to < ranks.count(); ++to) toEach.emplace_back(size, byteOf(ranks.rank(), to));
  const std::vector<Message> received = ranks.exchange(std::move(toEach));
  for (int from = 0; from < ranks.count(); ++from)
    require(received.at(std::size_t(from)) == Message(size, byteOf(from, ranks.rank())), "a message has changed");
}

void gather(Ranks& ranks, std::size_t size) {
  const std::vector<Message> received = ranks.gatherAll(Message(size, byteOf(ranks.rank(), 0)), {});
  for (int from = 0; from < ranks.count(); ++from)
    require(received.at(std::size_t(from)) == Message(size, byteOf(from, 0)), "a gathered message has changed");
}

std::size_t addressSpace() {
  std::size_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return pages * std::size_t(sysconf(_SC_PAGESIZE));
}

/// Lets the process take `kRoom` more bytes, or as many as it was allowed before.
class LessMemory {
 public:
  LessMemory() {
    getrlimit(RLIMIT_AS, &before_);
    const rlimit less{.rlim_cur = addressSpace() + kRoom, .rlim_max = before_.rlim_max};
    require(setrlimit(RLIMIT_AS, &less) == 0, "the limit of the address space cannot be set");
  }
  ~LessMemory() { setrlimit(RLIMIT_AS, &before_); }
  LessMemory(const LessMemory&) = delete;
  LessMemory& operator=(const LessMemory&) = delete;

 private:
  rlimit before_{};
};

bool throws(const std::function<void()>& call) {
  try {
    call();
    return false;
  } catch (const std::exception&) {
    return true;
  }
}

void testMessages(Ranks& ranks) {
  for (const std::size_t size : {std::size_t{0}, std::size_t{100}, std::size_t{100'000}}) {
    exchange(ranks, size);
    gather(ranks, size);
  }
}

/// Rank 0 sends rank 1 more than it has room for. All ranks must get an exception.
void testNoRoom(Ranks& ranks) {
  const std::size_t size = ranks.rank() == 0 ? 1 : 0;
  std::vector<Message> toEach(std::size_t(ranks.count()));
  toEach[1] = Message(size * kLarge);
  const Message large(size * kLarge), twice(size * kTwice);
  std::unique_ptr<LessMemory> less;
  if (ranks.rank() == 1) less = std::make_unique<LessMemory>();
  require(throws([&] { ranks.exchange(std::move(toEach)); }), "an exchange without room did not throw");
  require(throws([&] { ranks.gatherAll(large, {}); }), "a gathered message without room did not throw");
  require(throws([&] { ranks.gatherAll(twice, {}); }), "a gathered message without room for a copy did not throw");
}

}  // namespace

int main() {
  const hpsdf::mpi::Session session;
  const auto ranks = hpsdf::mpi::allRanks();
  try {
    testMessages(*ranks);
    testNoRoom(*ranks);
    testMessages(*ranks);
    return 0;
  } catch (const std::exception& error) {
    std::cerr << "rank " << ranks->rank() << ": " << error.what() << std::endl;
    std::_Exit(1);  // without MPI_Finalize, which would wait for the others
  }
}
