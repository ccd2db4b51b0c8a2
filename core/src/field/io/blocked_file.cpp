#include "field/io/blocked_file.h"

#include <algorithm>
#include <array>
#include <cstring>

#include "hpsdf/detail/memory.h"

namespace hpsdf::detail {
namespace {

constexpr std::size_t kSequence = 16;  // number of blocks, read one after the other, after which as many are read ahead
constexpr std::size_t kHashBytes = sizeof(std::uint64_t);

std::uint64_t checksumOf(std::span<const std::byte> bytes) {
  Checksum checksum;
  checksum.add(bytes);
  return checksum.value();
}

/// Returns the number of zeros that are needed to go on to a multiple of `BlockWriter::kAlignment`.
std::size_t paddingAt(std::size_t position) {
  return (BlockWriter::kAlignment - position % BlockWriter::kAlignment) % BlockWriter::kAlignment;
}

}  // namespace

CheckedBlocks::CheckedBlocks(const std::filesystem::path& file, const FileKind& kind, ReadOrder order)
    : path_(file), kind_(kind), file_(file), mostInMemory_(std::size_t(allowedMemory() / 4) / kBlockBytes) {
  const std::span<const std::byte> all = file_.bytes();
  if (all.size() < 2 * kHashBytes) damaged("it ends too early");
  // Each block adds its bytes and its checksum to the length of the file, the last one at least one byte.
  const std::size_t withBlocks = all.size() - kHashBytes;
  const std::size_t count = (withBlocks + kBlockBytes + kHashBytes - 1) / (kBlockBytes + kHashBytes);
  if (withBlocks - (count - 1) * (kBlockBytes + kHashBytes) <= kHashBytes) damaged("its length is wrong");
  content_ = all.first(withBlocks - count * kHashBytes);
  const auto table = all.subspan(content_.size(), count * kHashBytes);
  std::uint64_t ofTable = 0;
  std::memcpy(&ofTable, all.data() + withBlocks, kHashBytes);
  if (checksumOf(table) != ofTable) damaged("its checksums are damaged, or its length is wrong");
  checksums_.resize(count);
  std::memcpy(checksums_.data(), table.data(), table.size());
  states_ = std::make_unique<std::atomic<State>[]>(count);
  if (order == ReadOrder::any) file_.readAnywhere();
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
  if (isInSequence(block))
    file_.readSoon(first, std::min(kSequence * kBlockBytes, content_.size() - first));
  else if (isUnchecked)
    file_.readSoon(first, sizeOf(block));
  if (isUnchecked && checksumOf(content_.subspan(first, sizeOf(block))) != checksums_[block])
    damaged("its checksum of the block at byte " + std::to_string(first) + " is wrong");
  states_[block].store(State::inMemory, std::memory_order_relaxed);
  if (++countInMemory_ > mostInMemory_) forgetMemory();
}

void CheckedBlocks::forgetMemory() const {
  countInMemory_ = 0;
  for (std::size_t block = 0; block < checksums_.size(); ++block) {
    State state = State::inMemory;
    states_[block].compare_exchange_strong(state, State::checked, std::memory_order_relaxed);
  }
}

void requireBlocks(const CheckedBlocks& blocks, const void* first, std::size_t bytes) {
  blocks.require(std::size_t(static_cast<const std::byte*>(first) - blocks.content().data()), bytes);
}

void BlockWriter::align() {
  static constexpr std::array<std::byte, kAlignment> kZeros{};
  put(std::span(kZeros).first(paddingAt(position_)));
}

void BlockWriter::put(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const std::size_t left = CheckedBlocks::kBlockBytes - position_ % CheckedBlocks::kBlockBytes;
    const auto piece = bytes.first(std::min(left, bytes.size()));
    block_.add(piece);
    output_.write(piece);
    position_ += piece.size();
    bytes = bytes.subspan(piece.size());
    if (piece.size() == left) finishBlock();
  }
}

void BlockWriter::finishBlock() {
  checksums_.push_back(block_.value());
  block_ = Checksum();
}

void BlockWriter::finish() {
  if (position_ % CheckedBlocks::kBlockBytes != 0) finishBlock();
  const auto table = std::as_bytes(std::span(checksums_));
  output_.write(table);
  output_.write(bytesOf(checksumOf(table)));
  output_.commit();
}

void BlockReader::align() {
  std::array<std::byte, BlockWriter::kAlignment> padding;
  const auto read = std::span(padding).first(paddingAt(position_));
  get(read);
  require(std::ranges::all_of(read, [](std::byte b) { return b == std::byte{0}; }), "its padding is not 0");
}

void BlockReader::get(std::span<std::byte> bytes) {
  require(bytes.size() <= remaining(), "it ends too early");
  blocks_->require(position_, bytes.size());
  std::ranges::copy(blocks_->content().subspan(position_, bytes.size()), bytes.begin());
  position_ += bytes.size();
}

}  // namespace hpsdf::detail
