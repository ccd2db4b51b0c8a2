#pragma once
// Files of numbers whose blocks each have a checksum, so that parts of a file can be read and checked alone.

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "hpsdf/detail/field_data.h"
#include "util/checked_file.h"
#include "util/mapped_file.h"

namespace hpsdf::detail {

/// The order in which a file is read.
enum class ReadOrder : std::uint8_t { sequential, any };

/// A mapped file whose content is divided into blocks. After the content, the file holds the XXH3 hash of each block,
/// and the hash of all these hashes. A block is checked when it is first needed, and is then read as a whole. If the
/// operating system has dropped its pages since, it reads only those that are touched, so that memory holds nothing
/// else, unless blocks are read one after the other.
class CheckedBlocks {
 public:
  static constexpr std::size_t kBlockBytes = std::size_t{1} << 16;  ///< of all blocks but the last one

  /// Maps a file that `BlockWriter` wrote. Throws `Error` (of the kind `file`) for a file that cannot be mapped, or
  /// whose checksums are damaged.
  CheckedBlocks(const std::filesystem::path& file, const FileKind& kind, ReadOrder order);

  /// Returns the content. None of it may be read before `require`.
  std::span<const std::byte> content() const { return content_; }
  /// Checks the blocks that hold the given part of the content. Throws `Error` (of the kind `file`) if one is damaged.
  void require(std::size_t first, std::size_t bytes) const {
    for (std::size_t block = first / kBlockBytes; block * kBlockBytes < first + bytes; ++block)
      if (states_[block].load(std::memory_order_relaxed) != State::inMemory) [[unlikely]]
        read(block);
  }
  [[noreturn]] void damaged(const std::string& how) const { throwDamaged(path_, kind_, how); }

 private:
  enum class State : std::uint8_t {
    unchecked,
    checked,   ///< The operating system may have dropped pages of the block since then.
    inMemory,  ///< Few blocks have been read since this one.
  };

  void read(std::size_t block) const;
  /// Returns true if the blocks before were read recently.
  bool isInSequence(std::size_t block) const;
  std::size_t sizeOf(std::size_t block) const { return std::min(kBlockBytes, content_.size() - block * kBlockBytes); }
  /// Makes all blocks `checked` that are `inMemory`, so that they are read as a whole again.
  void forgetMemory() const;

  std::filesystem::path path_;
  FileKind kind_;
  MappedFile file_;
  std::span<const std::byte> content_;
  std::vector<std::uint64_t> checksums_;
  std::unique_ptr<std::atomic<State>[]> states_;
  std::size_t mostInMemory_;                           ///< number of blocks
  mutable std::atomic<std::size_t> countInMemory_{0};  ///< number of blocks that became `inMemory`
};

/// Writes numbers to a file, and at its end the checksums that `CheckedBlocks` reads.
class BlockWriter : public NumberWriter<BlockWriter> {
 public:
  /// All members of this class throw the same errors as `OutputFile`.
  explicit BlockWriter(const std::filesystem::path& file) : output_(file) {}

  template <typename T>
  void item(const T& value) {
    put(bytesOf(value));
  }
  /// Writes zeros up to a multiple of `kAlignment`.
  void align();
  void put(std::span<const std::byte> bytes);
  /// Writes the checksums and commits the file.
  void finish();

  static constexpr std::size_t kAlignment = 64;  ///< of arrays: a line of the processor's cache

 private:
  void finishBlock();

  OutputFile output_;
  std::size_t position_ = 0;
  Checksum block_;
  std::vector<std::uint64_t> checksums_;
};

/// Reads the content of a file that `BlockWriter` wrote. Every member throws `Error` (of the kind `file`) if the file
/// ends too early, is damaged where it is read, or contains an impossible value.
class BlockReader : public NumberReader<BlockReader> {
 public:
  BlockReader(const std::filesystem::path& file, const FileKind& kind, ReadOrder order)
      : blocks_(std::make_shared<CheckedBlocks>(file, kind, order)) {}

  template <typename T>
  void item(T& value) {
    get(std::as_writable_bytes(std::span(&value, 1)));
  }
  /// Goes on to a multiple of `BlockWriter::kAlignment`.
  void align();
  void get(std::span<std::byte> bytes);
  /// Refers to the next `count` numbers, without reading them.
  template <typename T>
  void mapped(FieldArray<T>& values, std::uint64_t count) {
    require(count <= remaining() / sizeof(T), "it ends too early");
    values = {blocks_, reinterpret_cast<const T*>(blocks_->content().data() + position_), count};
    position_ += count * sizeof(T);
  }
  /// Throws unless all has been read.
  void finish() const { require(remaining() == 0, "it goes on too long"); }

  std::uint64_t remaining() const { return blocks_->content().size() - position_; }
  void require(bool holds, const char* how) const {
    if (!holds) blocks_->damaged(how);
  }

 private:
  std::shared_ptr<CheckedBlocks> blocks_;
  std::size_t position_ = 0;
};

}  // namespace hpsdf::detail
