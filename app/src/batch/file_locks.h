#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

namespace hpsdf::app {

class FileLocks;

/// A piece of work that no other process can take while this object lives.
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

/// Divides numbered pieces of work among processes that share a file. A claim is a record lock on one byte of the file,
/// whose offset follows from the number; the byte need not exist. The system releases the lock when a process ends,
/// however it ends. The file is empty and must never be removed: processes that open its successor would not see the
/// locks on it.
class FileLocks {
 public:
  /// Creates the file where it does not exist. Throws `Error` where it cannot be written. A process must have one
  /// object a file: record locks belong to the process, and closing the file anywhere in it releases all of them.
  explicit FileLocks(std::filesystem::path file);
  ~FileLocks();
  FileLocks(const FileLocks&) = delete;
  FileLocks& operator=(const FileLocks&) = delete;

  /// Takes a piece of work, or returns nothing where another process has it. Throws `Error` where the file system does
  /// not support locks.
  std::optional<Claim> take(std::uint64_t number) const;

 private:
  friend class Claim;
  bool lock(std::uint64_t number, bool taken) const;

  std::filesystem::path file_;
  int descriptor_;
};

}  // namespace hpsdf::app
