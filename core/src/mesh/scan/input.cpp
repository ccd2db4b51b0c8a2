#include "mesh/scan/input.h"

#include <fcntl.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <limits>
#include <system_error>
#include <utility>

namespace hpsdf::mesh {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kWindow = std::size_t{1} << 18;  ///< fits into a processor's second-level cache
static_assert(kWindow >= 2 * Input::kLongestPiece);

/// The greatest number of bytes into which one byte of a file that gzip has compressed can expand.
constexpr std::uint64_t kGreatestExpansion = 1032;

}  // namespace

void requireReadable(const fs::path& file) {
  const std::string name = file.string();
  const auto refuse = [&](const std::string& problem) { throw Error(ErrorKind::file, name, problem); };
  if (name.empty()) refuse("the mesh file's name is empty; give a file name");
  std::error_code error;
  const fs::file_status status = fs::status(file, error);
  if (status.type() == fs::file_type::not_found) refuse("no such file; check the path");
  if (!fs::exists(status)) refuse("cannot be read (" + error.message() + "); check the path");
  if (fs::is_directory(status)) refuse("a directory, not a file; name a mesh file in it");
  if (!fs::is_regular_file(status)) refuse("not a regular file; name a mesh file");
  const std::uintmax_t size = fs::file_size(file, error);
  if (!error && size == 0) refuse("the file is empty; export the mesh again");
  std::ifstream stream(file, std::ios::binary);
  if (!stream || stream.peek() == std::ifstream::traits_type::eof()) refuse("cannot be read; check its permissions");
}

/// The open file. The library zlib reads it, which passes files that are not compressed on as they are.
struct Input::Source {
  explicit Source(const fs::path& file) : size(fs::file_size(file)), stream(gzopen(file.c_str(), "rbe")) {}
  ~Source() {
    if (stream) gzclose(stream);
  }
  Source(const Source&) = delete;
  Source& operator=(const Source&) = delete;

  std::uint64_t size;  ///< bytes of the file as it lies on the disk
  gzFile stream;
};

Input::Input(const fs::path& file, const Progress& progress) : file_(file), progress_(progress) {
  requireReadable(file);
  source_ = std::make_unique<Source>(file);
  if (!source_->stream) refuse("cannot be read; check its permissions");
  gzbuffer(source_->stream, kWindow / 4);
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

bool Input::refill(std::size_t count) {
  if (!source_) return false;
  progress_.update("Reading the mesh", share());
  const auto kept = std::size_t(end_ - at_);
  std::memmove(window_.get(), at_, kept);
  at_ = window_.get();
  std::size_t filled = kept;
  while (filled < count) {
    const int read = gzread(source_->stream, window_.get() + filled, unsigned(kWindow - filled));
    int error = Z_OK;
    const char* reason = gzerror(source_->stream, &error);
    if (read < 0 || (read == 0 && error != Z_OK))
      refuse(error == Z_ERRNO ? std::string("cannot be read (") + std::strerror(errno) + "); check the disk"
                              : std::string("its compressed data are damaged or cut off (") +
                                    (error == Z_BUF_ERROR ? "unexpected end of file" : reason) +
                                    "); compress or copy the file again");
    if (read == 0) break;
    filled += std::size_t(read);
    windowEnd_ += std::uint64_t(read);
  }
  end_ = at_ + filled;
  return filled >= count;
}

std::uint64_t Input::mostLeft() const {
  const auto waiting = std::uint64_t(end_ - at_);
  if (!source_) return waiting;
  if (gzdirect(source_->stream) == 1) return waiting + source_->size - std::min(source_->size, windowEnd_);
  return waiting + kGreatestExpansion * source_->size;
}

double Input::share() const {
  if (!source_) return windowEnd_ == 0 ? 1 : double(offset()) / double(windowEnd_);
  const z_off_t position = gzoffset(source_->stream);
  return position < 0 ? 0 : std::min(1.0, double(position) / double(source_->size));
}

}  // namespace hpsdf::mesh
