#include "batch/file_locks.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "hpsdf/error.h"

namespace hpsdf::app {

Claim::Claim(Claim&& other) noexcept : claims_(std::exchange(other.claims_, nullptr)), number_(other.number_) {}

Claim::~Claim() {
  if (claims_ != nullptr) claims_->lock(number_, false);
}

FileLocks::FileLocks(std::filesystem::path file)
    : file_(std::move(file)), descriptor_(open(file_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666)) {
  if (descriptor_ < 0)
    throw Error(
        fmt::format("{}: cannot be written ({}); check the folder's permissions", file_.string(), strerror(errno)));
}

FileLocks::~FileLocks() { close(descriptor_); }

/// Returns whether the lock could be changed at once.
bool FileLocks::lock(std::uint64_t number, bool taken) const {
  struct flock range = {};
  range.l_type = taken ? F_WRLCK : F_UNLCK;
  range.l_whence = SEEK_SET;
  range.l_start = static_cast<off_t>(number >> 2);  // file servers differ in their largest offsets
  range.l_len = 1;
  for (;;) {
    if (fcntl(descriptor_, F_SETLK, &range) == 0) return true;
    if (errno != EINTR) return false;
  }
}

std::optional<Claim> FileLocks::take(std::uint64_t number) const {
  if (lock(number, true)) return Claim(*this, number);
  if (errno == EACCES || errno == EAGAIN) return std::nullopt;
  throw Error(
      fmt::format("{}: cannot be locked ({}), so that processes cannot share the work; name a folder on a "
                  "file system with locks",
                  file_.string(), strerror(errno)));
}

}  // namespace hpsdf::app
