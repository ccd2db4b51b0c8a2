#include "field/io/byte_streams.h"

#include <zstd.h>

#include <cstring>
#include <new>

#include "hpsdf/error.h"

namespace hpsdf::io {
namespace {

// The level of zstd. Higher levels take much more memory for a few bytes; docs/performance.md compares some.
constexpr int kLevel = 19;
// The greatest number of bytes that one byte of a frame can stand for: a block of four bytes repeats a byte up to 2^17
// times (RFC 8878, sections 3.1.1.2.2 and 3.1.1.2.4).
constexpr std::uint64_t kGreatestRatio = (1u << 17) / 4;

/// Throws `Error` if a function of zstd failed.
std::size_t checked(std::size_t result) {
  if (ZSTD_isError(result) != 0)
    throw Error(ErrorKind::limit, "", std::string("zstd cannot compress the field: ") + ZSTD_getErrorName(result));
  return result;
}

}  // namespace

void StreamsWriter::Free::operator()(ZSTD_CCtx_s* context) const { ZSTD_freeCCtx(context); }
void StreamsReader::Free::operator()(ZSTD_DCtx_s* context) const { ZSTD_freeDCtx(context); }

StreamsWriter::StreamsWriter() : context_(ZSTD_createCCtx()) {
  if (!context_) throw std::bad_alloc();
  checked(ZSTD_CCtx_setParameter(context_.get(), ZSTD_c_compressionLevel, kLevel));
}

void StreamsWriter::add(std::span<const std::uint8_t> bytes) {
  if (bytes.empty()) return;
  const std::size_t before = packed_.size(), start = before + sizeof(std::uint64_t);
  packed_.resize(start + ZSTD_compressBound(bytes.size()));
  const std::uint64_t length = checked(
      ZSTD_compress2(context_.get(), packed_.data() + start, packed_.size() - start, bytes.data(), bytes.size()));
  std::memcpy(packed_.data() + before, &length, sizeof length);
  packed_.resize(start + length);
}

StreamsReader::StreamsReader(detail::CheckedReader& file) : file_(&file), context_(ZSTD_createDCtx()) {
  if (!context_) throw std::bad_alloc();
}

Bytes StreamsReader::read(std::uint64_t size) {
  if (size == 0) return {};
  std::uint64_t length = 0;
  file_->item(length);
  require(length <= file_->remaining(), "it ends too early");
  require(size / kGreatestRatio <= length, "a compressed array is too short for its size");
  Bytes packed;
  file_->array(packed, length);
  require(ZSTD_getFrameContentSize(packed.data(), packed.size()) == size, "a compressed array has another size");
  Bytes bytes(size);
  const std::size_t found =
      ZSTD_decompressDCtx(context_.get(), bytes.data(), bytes.size(), packed.data(), packed.size());
  require(found == size, "an array cannot be decompressed");  // an error of zstd is greater than any size
  return bytes;
}

}  // namespace hpsdf::io
