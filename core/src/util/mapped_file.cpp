#include "util/mapped_file.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "hpsdf/error.h"

namespace hpsdf::detail {
namespace {

[[noreturn]] void refuseToMap(const std::filesystem::path& file) {
  const int error = errno;
  throw Error(ErrorKind::file, file.string(),
              "cannot be mapped into memory: " + std::generic_category().message(error) +
                  (error == ENOMEM ? "; raise the limit of the address space (ulimit -v)" : ""));
}

/// A file that is open until the end of the scope.
struct OpenFile {
  explicit OpenFile(const std::filesystem::path& file) : descriptor(::open(file.c_str(), O_RDONLY | O_CLOEXEC)) {}
  ~OpenFile() {
    if (descriptor >= 0) ::close(descriptor);
  }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;

  int descriptor;
};

}  // namespace

MappedFile::MappedFile(const std::filesystem::path& file) {
  const OpenFile open(file);
  struct stat status {};
  if (open.descriptor < 0 || ::fstat(open.descriptor, &status) != 0) refuseToMap(file);
  if (!S_ISREG(status.st_mode)) throw Error(ErrorKind::file, file.string(), "is not a regular file");
  if (status.st_size == 0) return;
  const auto size = static_cast<std::size_t>(status.st_size);
  void* const first = ::mmap(nullptr, size, PROT_READ, MAP_PRIVATE, open.descriptor, 0);
  if (first == MAP_FAILED) refuseToMap(file);
  bytes_ = {static_cast<const std::byte*>(first), size};
}

MappedFile::~MappedFile() {
  if (!bytes_.empty()) ::munmap(const_cast<std::byte*>(bytes_.data()), bytes_.size());
}

void MappedFile::readAnywhere() const {
  ::madvise(const_cast<std::byte*>(bytes_.data()), bytes_.size(), MADV_RANDOM);  // A failure only costs time.
}

void MappedFile::readSoon(std::size_t first, std::size_t size) const {
  static const auto kPage = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
  const std::size_t start = first / kPage * kPage;
  ::madvise(const_cast<std::byte*>(bytes_.data()) + start, first + size - start, MADV_WILLNEED);
}

}  // namespace hpsdf::detail
