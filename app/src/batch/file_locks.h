#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

namespace hpsdf::app {

class FileLocks;

/// A piece of work that nobody else may take while this lives.
class Claim {
 public:
  Claim(Claim&& other) noexcept;
  ~Claim();
  Claim(const Claim&) = delete;
  Claim& operator=(const Claim&) = delete;
  Claim& operator=(Claim&&) = delete;

 private:
  friend class FileLocks;
  Claim(const FileLocks& claims, std::uint64_t number) : claims_(&claims), number_(number) {}

  const FileLocks* claims_;
  std::uint64_t number_;
};

/// Who is at work on what: pieces of work have numbers, and processes that share a file take them, each for itself. A
/// claim is a lock on the file's byte of that number (which need not be there), so that the system takes it back from
/// a process that dies, however it dies. The file stays empty, and stays: whoever removed it would leave others with
/// locks that newcomers cannot see.
class FileLocks {
 public:
  /// Makes the file where it is not there. Throws `Error` where it cannot be written. One object for a file in a
  /// process: locks are the process's, and closing the file anywhere in it gives all of them back.
  explicit FileLocks(std::filesystem::path file);
  ~FileLocks();
  FileLocks(const FileLocks&) = delete;
  FileLocks& operator=(const FileLocks&) = delete;

  /// Nothing where another process has it. Throws `Error` where the file system knows no locks.
  std::optional<Claim> take(std::uint64_t number) const;

 private:
  friend class Claim;
  bool lock(std::uint64_t number, bool taken) const;

  std::filesystem::path file_;
  int descriptor_;
};

}  // namespace hpsdf::app
