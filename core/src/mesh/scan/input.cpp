#include "mesh/scan/input.h"

#include <fcntl.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <system_error>
#include <utility>

#include "hpsdf/detail/text.h"

namespace hpsdf::mesh {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kWindow = std::size_t{1} << 18;  ///< fits into a processor's second-level cache
static_assert(kWindow >= 2 * Input::kLongestPiece);

/// The greatest number of bytes into which one byte of a file that gzip has compressed can expand.
constexpr std::uint64_t kGreatestExpansion = 1032;

void requireReadable(const fs::path& file) {
  const std::string name = file.string();
  const auto refuse = [&](const std::string& problem) { throw Error(ErrorKind::file, name, problem); };
  if (name.empty()) refuse("the name of the file is empty; give one");
  std::error_code error;
  const fs::file_status status = fs::status(file, error);
  if (status.type() == fs::file_type::not_found) refuse("no such file; check the path");
  if (!fs::exists(status)) refuse("cannot be read (" + error.message() + "); check the path");
  if (fs::is_directory(status)) refuse("a directory, not a file; name a file in it");
  if (!fs::is_regular_file(status)) refuse("not a regular file; name one");
  const std::uintmax_t size = fs::file_size(file, error);
  if (!error && size == 0) refuse("the file is empty; export it again");
  std::ifstream stream(file, std::ios::binary);
  if (!stream || stream.peek() == std::ifstream::traits_type::eof()) refuse("cannot be read; check its permissions");
}

}  // namespace

/// The open file: a descriptor or, for a file whose name ends in .gz, a stream of zlib.
struct Input::Source {
  explicit Source(const fs::path& file)
      : size(fs::file_size(file)), descriptor(open(file.c_str(), O_RDONLY | O_CLOEXEC)) {
    if (descriptor >= 0 && lowerExtension(file) == ".gz") stream = gzdopen(descriptor, "rb");
  }
  ~Source() {
    if (stream)
      gzclose(stream);  // closes the descriptor too
    else if (descriptor >= 0)
      close(descriptor);
  }
  Source(const Source&) = delete;
  Source& operator=(const Source&) = delete;

  std::uint64_t size;  ///< bytes of the file as it lies on the disk
  int descriptor;
  gzFile stream = nullptr;
};

Input::Input(const fs::path& file, const Progress& progress) : file_(file), progress_(progress) {
  requireReadable(file);
  source_ = std::make_unique<Source>(file);
  if (source_->descriptor < 0) refuse("cannot be read; check its permissions");
  window_ = std::make_unique_for_overwrite<char[]>(kWindow);
  at_ = end_ = window_.get();
}

Input::Input(std::string_view bytes, const fs::path& file, const Progress& progress)
    : file_(file),
      progress_(progress),
      at_(bytes.data()),
      end_(bytes.data() + bytes.size()),
      windowEnd_(bytes.size()) {}

Input::~Input() = default;

void Input::refuse(const std::string& problem) const { throw Error(ErrorKind::file, file_.string(), problem); }

/// Reads up to `count` bytes of the file, decompressed. Returns 0 at its end.
std::size_t Input::readPart(char* bytes, std::size_t count) {
  if (source_->stream) {
    const int read = gzread(source_->stream, bytes, unsigned(count));
    int error = Z_OK;
    const std::string reason = gzerror(source_->stream, &error);
    if (read < 0 || (read == 0 && error != Z_OK))
      refuse("its compressed data are damaged or cut off (" +
             (error == Z_BUF_ERROR ? "unexpected end of file" : reason) + "); compress or copy the file again");
    return std::size_t(read);
  }
  for (;;) {
    const ssize_t read = ::read(source_->descriptor, bytes, count);
    if (read >= 0) return std::size_t(read);
    if (errno != EINTR) refuse(std::string("cannot be read (") + std::strerror(errno) + "); check the disk");
  }
}

bool Input::refill(std::size_t count) {
  if (!source_) return false;
  progress_.update("Reading the mesh", share());
  std::size_t filled = std::size_t(end_ - at_);
  std::memmove(window_.get(), at_, filled);
  at_ = window_.get();
  while (filled < count) {
    const std::size_t read = readPart(window_.get() + filled, kWindow - filled);
    if (read == 0) break;
    filled += read;
    windowEnd_ += read;
  }
  end_ = at_ + filled;
  return filled >= count;
}

std::uint64_t Input::mostLeft() const {
  const auto waiting = std::uint64_t(end_ - at_);
  if (!source_) return waiting;
  if (source_->stream) return waiting + kGreatestExpansion * source_->size;
  return waiting + source_->size - std::min(source_->size, windowEnd_);
}

double Input::share() const {
  if (!source_) return windowEnd_ == 0 ? 1 : double(offset()) / double(windowEnd_);
  const auto position = source_->stream ? double(gzoffset(source_->stream)) : double(windowEnd_);
  return std::clamp(position / double(source_->size), 0.0, 1.0);
}

}  // namespace hpsdf::mesh
