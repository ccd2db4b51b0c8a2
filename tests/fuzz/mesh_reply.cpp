// Fuzz target: an accepted reply of the process that reads mesh files keeps its content when it is written again.
#include "construction/mesh_reply.h"

#include <xxhash.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <optional>
#include <vector>

#include "target.h"

namespace {

using namespace hpsdf;

using Bytes = std::vector<std::byte>;

app::ReplySink into(Bytes& bytes) {
  return [&bytes](std::span<const std::byte> piece) { bytes.insert(bytes.end(), piece.begin(), piece.end()); };
}

Bytes written(const app::MeshReply& reply) {
  Bytes bytes;
  if (reply.kind == app::MeshReply::Kind::mesh)
    app::writeMesh(reply.imported, into(bytes));
  else if (reply.kind == app::MeshReply::Kind::refusal)
    app::writeRefusal(reply.refusal, into(bytes));
  else
    app::writeOutOfMemory(into(bytes));
  return bytes;
}

/// Corrects the checksum of the header, vertices, triangles and text, as far as the input contains them.
void mendChecksum(std::uint8_t* data, std::size_t size) {
  constexpr std::size_t kChecksumAt = 8, kSummedFrom = 16, kCountsAt = 24;
  const std::size_t header = app::kReplyHeaderBytes;
  if (size < header) return;
  std::array<std::uint64_t, 3> counts;  // of vertices, of triangles, and of bytes of text
  std::memcpy(counts.data(), data + kCountsAt, sizeof counts);
  constexpr std::array<std::uint64_t, 3> kEach = {24, 12, 1};
  XXH64_hash_t sum = XXH3_64bits_withSeed(data + kSummedFrom, header - kSummedFrom, 0);
  std::size_t at = header;
  for (std::size_t n = 0; n < counts.size(); ++n) {
    const std::size_t bytes = kEach[n] * std::min<std::uint64_t>(counts[n], (size - at) / kEach[n]);
    sum = XXH3_64bits_withSeed(data + at, bytes, sum);
    at += bytes;
  }
  std::memcpy(data + kChecksumAt, &sum, sizeof sum);
}

}  // namespace

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t maxSize,
                                               unsigned seed) {
  size = LLVMFuzzerMutate(data, size, maxSize);
  if (seed % 8 != 0) mendChecksum(data, size);
  return size;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto bytes = std::as_bytes(std::span(data, size));
  std::optional<app::MeshReply> reply;
  if (!fuzz::reads([&] { reply = app::parseReply(bytes); })) return 0;
  fuzz::require(app::replyBytes(bytes) == size, "a reply is as long as it says");
  const Bytes again = written(*reply);
  if (reply->kind == app::MeshReply::Kind::mesh) {
    fuzz::require(std::ranges::equal(again, bytes), "a mesh is written as it was");
    return 0;
  }
  fuzz::require(app::parseReply(again).refusal == reply->refusal, "a refusal says the same");
  fuzz::require(std::ranges::none_of(reply->refusal, [](unsigned char c) { return c < ' ' || c == 127; }),
                "a refusal is one line");
  return 0;
}
