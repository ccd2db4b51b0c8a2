#pragma once
// Files of numbers whose blocks each have a checksum, so that parts of a file can be read and checked alone.

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "hpsdf/detail/field_data.h"
#include "util/checked_file.h"
#include "util/mapped_file.h"

namespace hpsdf::detail {

/// The parts of a file that `BlockWriter` wrote: the content, the XXH3 hash of each block of the content, and the hash
/// of all these hashes.
struct BlockedLayout {
  static constexpr std::size_t kBlockBytes = std::size_t{1} << 16;  ///< of all blocks but the last one
  static constexpr std::size_t kHashBytes = sizeof(std::uint64_t);

  std::size_t content;  ///< bytes
  std::size_t blocks;

  /// Returns the layout of a file of this length. Throws `Error` if none has this length.
  static BlockedLayout of(std::size_t fileBytes, const std::filesystem::path& file, const FileKind& kind);

  std::size_t sizeOf(std::size_t block) const { return std::min(kBlockBytes, content - block * kBlockBytes); }
};

/// A mapped file whose blocks are checked when they are first needed, and are then read as a whole. If the operating
/// system has dropped their pages since, it reads only those that are touched, so that memory holds nothing else,
/// unless blocks are read one after the other.
class CheckedBlocks {
 public:
  /// Maps a file that `BlockWriter` wrote. After `mostInMemory` blocks were read, or as many as a quarter of the
  /// allowed memory holds, the first ones are taken to have been dropped. Throws `Error` (of the kind `file`) for a
  /// file that cannot be mapped, or whose checksums are damaged.
  CheckedBlocks(const std::filesystem::path& file, const FileKind& kind, std::size_t mostInMemory = 0);

  /// Tells that this part of the content holds numbers of type T, which must be finite. It begins at a multiple of
  /// their size.
  template <typename T>
  void requireFinite(std::size_t first, std::size_t bytes) {
    numbers_ = {first, first + bytes, sizeof(T) == sizeof(double)};
  }

  /// Returns the content. None of it may be read before `require`.
  std::span<const std::byte> content() const { return content_; }
  /// Checks the blocks that hold the given part of the content. Throws `Error` (of the kind `file`) if one is damaged.
  void require(std::size_t first, std::size_t bytes) const {
    for (std::size_t block = first / BlockedLayout::kBlockBytes; block * BlockedLayout::kBlockBytes < first + bytes;
         ++block)
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
  /// A part of the content that holds floats or doubles.
  struct Numbers {
    std::size_t first = 0, end = 0;
    bool areDoubles = true;
  };

  void read(std::size_t block) const;
  void check(std::size_t block) const;
  /// Returns true if the blocks before were read recently.
  bool isInSequence(std::size_t block) const;
  /// Makes all blocks `checked` that are `inMemory`, so that sequences are recognised anew.
  void forgetMemory() const;

  std::filesystem::path path_;
  FileKind kind_;
  MappedFile file_;
  BlockedLayout layout_;
  std::span<const std::byte> content_;
  std::vector<std::uint64_t> checksums_;
  Numbers numbers_;
  std::unique_ptr<std::atomic<State>[]> states_;       ///< of the blocks
  std::size_t mostInMemory_;                           ///< number of blocks
  mutable std::atomic<std::size_t> countInMemory_{0};  ///< number of blocks that became `inMemory`
};

/// Writes numbers to a file, and at its end the checksums.
class BlockWriter : public NumberWriter<BlockWriter> {
 public:
  /// All members of this class throw the same errors as `OutputFile`.
  explicit BlockWriter(const std::filesystem::path& file) : output_(file) {}

  template <typename T>
  void item(const T& value) {
    put(bytesOf(value));
  }
  /// Writes zeros up to a multiple of `kArrayAlignment`.
  void align();
  void put(std::span<const std::byte> bytes);
  /// Writes the checksums and commits the file.
  void finish();

 private:
  void finishBlock();

  OutputFile output_;
  std::size_t position_ = 0;
  Checksum block_;
  std::vector<std::uint64_t> checksums_;
};

/// Base of a class `Stream` that reads the content of a file that `BlockWriter` wrote. `Stream` has the members
/// require(holds, how), get(bytes) and position().
template <typename Stream>
class BlockReaderBase : public NumberReader<Stream> {
 public:
  template <typename T>
  void item(T& value) {
    stream().get(std::as_writable_bytes(std::span(&value, 1)));
  }
  /// Goes on to a multiple of `kArrayAlignment`.
  void align() {
    for (std::size_t left = paddingAt(stream().position()).size(); left > 0; --left) {
      std::byte padding{};
      item(padding);
      stream().require(padding == std::byte{0}, "its padding is not 0");
    }
  }

 private:
  Stream& stream() { return static_cast<Stream&>(*this); }
};

/// Reads a file as a stream, and checks all blocks at its end. Every member throws `Error` (of the kind `file`) if the
/// file ends too early, cannot be read or contains an impossible value.
class BlockStreamReader : public BlockReaderBase<BlockStreamReader> {
 public:
  BlockStreamReader(const std::filesystem::path& file, const FileKind& kind);

  void get(std::span<std::byte> bytes);
  /// Throws unless all of the content has been read and matches the checksums.
  void finish();

  std::size_t position() const { return position_; }
  std::uint64_t remaining() const { return layout_.content - position_; }
  void require(bool holds, const char* how) const {
    if (!holds) damaged(how);
  }

 private:
  [[noreturn]] void damaged(const std::string& how) const { throwDamaged(path_, kind_, how); }
  void read(std::span<std::byte> bytes);

  std::filesystem::path path_;
  FileKind kind_;
  std::ifstream stream_;
  BlockedLayout layout_;
  std::size_t position_ = 0;
  Checksum block_;
  std::vector<std::uint64_t> found_;  ///< the hashes of the blocks that were read
};

/// Reads a mapped file. Every member throws `Error` (of the kind `file`) if the file ends too early, is damaged where
/// it is read, or contains an impossible value.
class MappedBlockReader : public BlockReaderBase<MappedBlockReader> {
 public:
  MappedBlockReader(const std::filesystem::path& file, const FileKind& kind)
      : blocks_(std::make_shared<CheckedBlocks>(file, kind)) {}

  void get(std::span<std::byte> bytes);
  /// Refers to the next `count` numbers, without reading them. May be called once for floating-point numbers.
  template <typename T>
  void refer(FieldArray<T>& values, std::uint64_t count) {
    require(count <= remaining() / sizeof(T), "it ends too early");
    if constexpr (std::is_floating_point_v<T>) blocks_->requireFinite<T>(position_, count * sizeof(T));
    values = {blocks_, reinterpret_cast<const T*>(blocks_->content().data() + position_), count};
    position_ += count * sizeof(T);
  }
  /// Throws unless all has been read or referred to.
  void finish() const { require(remaining() == 0, "it goes on too long"); }

  std::size_t position() const { return position_; }
  std::uint64_t remaining() const { return blocks_->content().size() - position_; }
  void require(bool holds, const char* how) const {
    if (!holds) blocks_->damaged(how);
  }

 private:
  std::shared_ptr<CheckedBlocks> blocks_;
  std::size_t position_ = 0;
};

}  // namespace hpsdf::detail
