#include "util/checked_file.h"

#include <xxhash.h>

#include <algorithm>
#include <new>
#include <system_error>

#include "hpsdf/error.h"

namespace hpsdf::detail {
namespace {

constexpr std::size_t kChecksumBytes = 8;

}  // namespace

void throwDamaged(const std::filesystem::path& file, const FileKind& kind, const std::string& how) {
  throw Error(ErrorKind::file, file.string(),
              "the " + std::string(kind.name) + " is damaged: " + how + "; " + std::string(kind.remedy));
}

void Checksum::Free::operator()(XXH3_state_s* state) const { XXH3_freeState(state); }

Checksum::Checksum() : state_(XXH3_createState()) {
  if (!state_) throw std::bad_alloc();
  XXH3_64bits_reset(state_.get());
}

void Checksum::add(std::span<const std::byte> bytes) { XXH3_64bits_update(state_.get(), bytes.data(), bytes.size()); }

std::uint64_t Checksum::value() const { return XXH3_64bits_digest(state_.get()); }

void CheckedWriter::put(std::span<const std::byte> bytes) {
  checksum_.add(bytes);
  output_.write(bytes);
}

void CheckedWriter::finish() {
  output_.write(bytesOf(checksum_.value()));
  output_.commit();
}

CheckedReader::CheckedReader(const std::filesystem::path& file, const FileKind& kind) : file_(file), kind_(kind) {
  std::error_code problem;
  const auto status = std::filesystem::status(file, problem);
  const std::string wanted = "; give " + std::string(kind.wanted);
  if (!std::filesystem::exists(status)) refuse("no such file; check the path");
  if (std::filesystem::is_directory(status)) refuse("is a folder" + wanted);
  if (!std::filesystem::is_regular_file(status)) refuse("is not a regular file" + wanted);
  stream_.open(file, std::ios::binary);
  if (!stream_) refuse("cannot be opened; check its permissions");
  size_ = std::filesystem::file_size(file, problem);
  if (problem) size_ = 0;
}

std::optional<std::uint32_t> CheckedReader::begin(const Magic& magic) {
  Magic found;
  if (remaining() < found.size()) return std::nullopt;
  for (char& c : found) item(c);
  if (found != magic) return std::nullopt;
  std::uint32_t version = 0;
  item(version);
  return version;
}

void CheckedReader::get(std::span<std::byte> bytes) {
  require(bytes.size() <= remaining(), "it ends too early");
  stream_.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  require(bool(stream_), "it cannot be read to its end");
  checksum_.add(bytes);
  position_ += bytes.size();
}

void CheckedReader::finish() {
  const std::uint64_t expected = checksum_.value();
  std::uint64_t stored = 0;
  if (remaining() != kChecksumBytes)
    damaged(remaining() < kChecksumBytes ? "it ends too early" : "it goes on too long");
  item(stored);
  require(stored == expected, "its checksum is wrong");
}

void CheckedReader::require(bool holds, const char* how) const {
  if (!holds) damaged(how);
}

void CheckedReader::damaged(const std::string& how) const { throwDamaged(file_, kind_, how); }

void CheckedReader::refuse(const std::string& why) const { throw Error(ErrorKind::file, file_.string(), why); }

}  // namespace hpsdf::detail
