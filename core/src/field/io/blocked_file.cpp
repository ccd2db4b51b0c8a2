#include "field/io/blocked_file.h"

#include <cmath>
#include <cstring>

#include "hpsdf/detail/memory.h"

namespace hpsdf::detail {
namespace {

constexpr std::size_t kBlockBytes = BlockedLayout::kBlockBytes;
constexpr std::size_t kSequence = 16;  // number of blocks, read one after the other, after which as many are read ahead

std::uint64_t checksumOf(std::span<const std::byte> bytes) {
  Checksum checksum;
  checksum.add(bytes);
  return checksum.value();
}

std::string blockIsWrong(std::size_t block) {
  return "its checksum of the block at byte " + std::to_string(block * kBlockBytes) + " is wrong";
}

constexpr const char* kTableIsWrong = "its checksums are damaged, or its length is wrong";

/// Calls f(piece) for the pieces of `bytes` that lie in one block each. `bytes` begin at `position` of the content.
template <typename Byte, typename F>
void forEachPiece(std::span<Byte> bytes, std::size_t position, const F& f) {
  while (!bytes.empty()) {
    const auto piece = bytes.first(std::min(bytes.size(), kBlockBytes - position % kBlockBytes));
    f(piece);
    position += piece.size();
    bytes = bytes.subspan(piece.size());
  }
}

template <typename T>
bool areFinite(std::span<const std::byte> bytes) {
  const std::span numbers(reinterpret_cast<const T*>(bytes.data()), bytes.size() / sizeof(T));
  return std::ranges::all_of(numbers, [](T number) { return std::isfinite(number); });
}

}  // namespace

BlockedLayout BlockedLayout::of(std::size_t fileBytes, const std::filesystem::path& file, const FileKind& kind) {
  if (fileBytes < 2 * kHashBytes) throwDamaged(file, kind, "it ends too early");
  // Each block adds its bytes and its hash to the length of the file, the last one at least one byte.
  constexpr std::size_t kWithHash = BlockedLayout::kBlockBytes + kHashBytes;
  const std::size_t withHashes = fileBytes - kHashBytes;
  const std::size_t blocks = (withHashes + kWithHash - 1) / kWithHash;
  if (withHashes - (blocks - 1) * kWithHash <= kHashBytes) throwDamaged(file, kind, "its length is wrong");
  return {.content = withHashes - blocks * kHashBytes, .blocks = blocks};
}

CheckedBlocks::CheckedBlocks(const std::filesystem::path& file, const FileKind& kind, std::size_t mostInMemory)
    : path_(file),
      kind_(kind),
      file_(file),
      layout_(BlockedLayout::of(file_.bytes().size(), file, kind)),
      content_(file_.bytes().first(layout_.content)),
      checksums_(layout_.blocks),
      states_(std::make_unique<std::atomic<State>[]>(layout_.blocks)),
      mostInMemory_(mostInMemory > 0 ? mostInMemory : std::size_t(hpsdf::allowedMemory() / 4) / kBlockBytes) {
  const auto table = file_.bytes().subspan(layout_.content, layout_.blocks * BlockedLayout::kHashBytes);
  std::uint64_t ofTable = 0;
  std::memcpy(&ofTable, table.data() + table.size(), sizeof ofTable);
  if (checksumOf(table) != ofTable) damaged(kTableIsWrong);
  std::memcpy(checksums_.data(), table.data(), table.size());
  file_.readAnywhere();
}

bool CheckedBlocks::isInSequence(std::size_t block) const {
  if (block < kSequence) return false;
  for (std::size_t before = block - kSequence; before < block; ++before)
    if (states_[before].load(std::memory_order_relaxed) != State::inMemory) return false;
  return true;
}

void CheckedBlocks::read(std::size_t block) const {
  const std::size_t first = block * kBlockBytes;
  const bool isUnchecked = states_[block].load(std::memory_order_relaxed) == State::unchecked;
  if (block % kSequence == 0 && isInSequence(block))
    file_.readSoon(first, std::min(kSequence * kBlockBytes, content_.size() - first));
  else if (isUnchecked)
    file_.readSoon(first, layout_.sizeOf(block));
  if (isUnchecked) check(block);
  states_[block].store(State::inMemory, std::memory_order_relaxed);
  if (++countInMemory_ > mostInMemory_) forgetMemory();
}

void CheckedBlocks::check(std::size_t block) const {
  const std::size_t first = block * kBlockBytes, end = first + layout_.sizeOf(block);
  if (checksumOf(content_.subspan(first, end - first)) != checksums_[block]) damaged(blockIsWrong(block));
  const std::size_t from = std::max(first, numbers_.first), to = std::min(end, numbers_.end);
  if (from >= to) return;
  const auto numbers = content_.subspan(from, to - from);
  if (!(numbers_.areDoubles ? areFinite<double>(numbers) : areFinite<float>(numbers)))
    damaged("a coefficient is not finite");
}

void CheckedBlocks::forgetMemory() const {
  countInMemory_ = 0;
  for (std::size_t block = 0; block < layout_.blocks; ++block) {
    State state = State::inMemory;
    if (states_[block].load(std::memory_order_relaxed) == state)
      states_[block].compare_exchange_strong(state, State::checked, std::memory_order_relaxed);
  }
}

void requireBlocks(const CheckedBlocks& blocks, const void* first, std::size_t bytes) {
  blocks.require(std::size_t(static_cast<const std::byte*>(first) - blocks.content().data()), bytes);
}

void BlockWriter::align() { put(paddingAt(position_)); }

void BlockWriter::put(std::span<const std::byte> bytes) {
  forEachPiece(bytes, position_, [&](std::span<const std::byte> piece) {
    block_.add(piece);
    output_.write(piece);
    position_ += piece.size();
    if (position_ % kBlockBytes == 0) finishBlock();
  });
}

void BlockWriter::finishBlock() {
  checksums_.push_back(block_.value());
  block_ = Checksum();
}

void BlockWriter::finish() {
  if (position_ % kBlockBytes != 0) finishBlock();
  const auto table = std::as_bytes(std::span(checksums_));
  output_.write(table);
  output_.write(bytesOf(checksumOf(table)));
  output_.commit();
}

BlockStreamReader::BlockStreamReader(const std::filesystem::path& file, const FileKind& kind)
    : path_(file),
      kind_(kind),
      stream_(file, std::ios::binary),
      layout_(BlockedLayout::of(std::filesystem::file_size(file), file, kind)) {}

void BlockStreamReader::read(std::span<std::byte> bytes) {
  stream_.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  require(bool(stream_), "it cannot be read to its end");
}

void BlockStreamReader::get(std::span<std::byte> bytes) {
  require(bytes.size() <= remaining(), "it ends too early");
  forEachPiece(bytes, position_, [&](std::span<std::byte> piece) {
    read(piece);
    block_.add(piece);
    position_ += piece.size();
    if (position_ % kBlockBytes != 0 && remaining() > 0) return;
    found_.push_back(block_.value());
    block_ = Checksum();
  });
}

void BlockStreamReader::finish() {
  require(remaining() == 0, "it goes on too long");
  std::vector<std::uint64_t> stored(layout_.blocks);
  std::uint64_t ofTable = 0;
  read(std::as_writable_bytes(std::span(stored)));
  read(std::as_writable_bytes(std::span(&ofTable, 1)));
  require(checksumOf(std::as_bytes(std::span(stored))) == ofTable, kTableIsWrong);
  const auto wrong = std::ranges::mismatch(stored, found_).in1;
  if (wrong != stored.end()) damaged(blockIsWrong(std::size_t(wrong - stored.begin())));
}

void MappedBlockReader::get(std::span<std::byte> bytes) {
  require(bytes.size() <= remaining(), "it ends too early");
  // Blocks are read one by one, because the file may be larger than the memory.
  forEachPiece(bytes, position_, [&](std::span<std::byte> piece) {
    blocks_->require(position_, piece.size());
    std::ranges::copy(blocks_->content().subspan(position_, piece.size()), piece.begin());
    position_ += piece.size();
  });
}

}  // namespace hpsdf::detail
