#include "arrays/npy.h"

#include <zlib.h>

#include <algorithm>
#include <bit>

#include "util/chunks.h"

namespace hpsdf::arrays {
namespace {

static_assert(std::endian::native == std::endian::little, "arrays are written as their numbers are in memory");

/// Returns the bytes in front of an array's numbers in a .npy file (NumPy's documentation, numpy.lib.format). Their
/// number is a multiple of 64, so that the numbers of a mapped file are aligned.
std::string npyHeader(const ArrayView& array) {
  constexpr std::size_t kAlignment = 64, kBeforeText = 10;
  std::string text = "{'descr': '";
  text += array.type;
  text += "', 'fortran_order': False, 'shape': (";
  for (std::size_t i = 0; i < array.shape.size(); ++i) {
    if (i > 0) text += ' ';
    text += std::to_string(array.shape[i]);
    if (i == 0 || i + 1 < array.shape.size()) text += ',';
  }
  text += "), }";
  const std::size_t size = (kBeforeText + text.size() + 1 + kAlignment - 1) / kAlignment * kAlignment;
  text.resize(size - kBeforeText - 1, ' ');
  text += '\n';
  std::string header = "\x93NUMPY";
  header += '\x01';
  header += '\x00';
  header += static_cast<char>(text.size() % 256);
  header += static_cast<char>(text.size() / 256);
  return header + text;
}

/// Returns the CRC-32 of bytes, which threads compute piece by piece.
std::uint32_t crcOf(std::span<const std::byte> bytes) {
  constexpr std::size_t kPieceOfCrc = std::size_t{1} << 20;
  std::vector<uLong> parts(detail::chunksOf(bytes.size(), kPieceOfCrc));
  detail::forEachChunk(bytes.size(), kPieceOfCrc, [&](std::size_t chunk, std::size_t first, std::size_t count) {
    parts[chunk] = crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()) + first, count);
  });
  uLong all = 0;
  for (std::size_t chunk = 0; chunk < parts.size(); ++chunk)
    all = crc32_combine(all, parts[chunk],
                        static_cast<z_off_t>(std::min(kPieceOfCrc, bytes.size() - chunk * kPieceOfCrc)));
  return static_cast<std::uint32_t>(all);
}

/// The records of a zip archive (PKWARE's APPNOTE.TXT, sections 4.3 and 4.5), built number by number.
class Record {
 public:
  Record& u16(std::uint64_t value) { return number(value, 2); }
  Record& u32(std::uint64_t value) { return number(value, 4); }
  Record& u64(std::uint64_t value) { return number(value, 8); }
  Record& text(std::string_view value) {
    bytes_ += value;
    return *this;
  }
  const std::string& bytes() const { return bytes_; }

 private:
  Record& number(std::uint64_t value, int size) {
    for (int i = 0; i < size; ++i) bytes_ += static_cast<char>(value >> (8 * i) & 0xff);
    return *this;
  }

  std::string bytes_;
};

constexpr std::uint64_t kZip64 = 0xffffffff;  ///< stands for a number that is in a zip64 field because it may not fit
constexpr std::uint64_t kZip64Count = 0xffff;
constexpr std::uint64_t kVersion = 20, kVersionOfZip64 = 45;  ///< versions 2.0 and 4.5 of the format
constexpr std::uint64_t kFirstOfJanuary1980 = 0x21;  ///< the date of all files, so that equal arrays give equal bytes

/// A file of the archive.
struct ZipEntry {
  std::string name;
  std::uint32_t crc;
  std::uint64_t size, offset;

  bool isLarge() const { return size >= kZip64 || offset >= kZip64; }

  /// Appends the fields that both records of a file have in common: from the version to the lengths.
  void describe(Record& record, bool large, std::size_t extra) const {
    record.u16(large ? kVersionOfZip64 : kVersion).u16(0).u16(0).u16(0).u16(kFirstOfJanuary1980).u32(crc);
    record.u32(large ? kZip64 : size).u32(large ? kZip64 : size).u16(name.size()).u16(extra);
  }

  /// Returns the record in front of the file's bytes.
  std::string localHeader() const {
    const bool large = size >= kZip64;
    Record record;
    record.u32(0x04034b50);
    describe(record, large, large ? 20 : 0);
    record.text(name);
    if (large) record.u16(1).u16(16).u64(size).u64(size);
    return record.bytes();
  }

  /// Returns the file's record in the directory at the end of the archive.
  std::string directoryHeader() const {
    const bool large = isLarge();
    Record record;
    record.u32(0x02014b50).u16(large ? kVersionOfZip64 : kVersion);
    describe(record, large, large ? 28 : 0);
    record.u16(0).u16(0).u16(0).u32(0).u32(large ? kZip64 : offset).text(name);
    if (large) record.u16(1).u16(24).u64(size).u64(size).u64(offset);
    return record.bytes();
  }
};

/// Returns the records behind the directory, which tell where it is.
std::string endOfDirectory(std::uint64_t files, std::uint64_t offset, std::uint64_t size) {
  Record record;
  if (offset + size >= kZip64 || files >= kZip64Count) {
    record.u32(0x06064b50).u64(44).u16(kVersionOfZip64).u16(kVersionOfZip64).u32(0).u32(0);
    record.u64(files).u64(files).u64(size).u64(offset);
    record.u32(0x07064b50).u32(0).u64(offset + size).u32(1);
    files = kZip64Count;
    size = offset = kZip64;
  }
  record.u32(0x06054b50).u16(0).u16(0).u16(files).u16(files).u32(size).u32(offset).u16(0);
  return record.bytes();
}

void writeText(std::string_view text, const WriteBytes& write) { write(std::as_bytes(std::span(text))); }

}  // namespace

void writeNpy(const ArrayView& array, const WriteBytes& write) {
  writeText(npyHeader(array), write);
  write(array.bytes);
}

void writeNpz(std::span<const NamedArray> arrays, const WriteBytes& write) {
  std::uint64_t written = 0;
  const WriteBytes count = [&](std::span<const std::byte> bytes) {
    write(bytes);
    written += bytes.size();
  };
  std::string directory;
  for (const auto& [name, array] : arrays) {
    const std::string header = npyHeader(array);
    const std::uint32_t ofHeader = crcOf(std::as_bytes(std::span(header)));
    const ZipEntry entry{
        .name = name + ".npy",
        .crc = static_cast<std::uint32_t>(
            crc32_combine(ofHeader, crcOf(array.bytes), static_cast<z_off_t>(array.bytes.size()))),
        .size = header.size() + array.bytes.size(),
        .offset = written,
    };
    writeText(entry.localHeader(), count);
    writeNpy(array, count);
    directory += entry.directoryHeader();
  }
  const std::uint64_t start = written;
  writeText(directory, count);
  writeText(endOfDirectory(arrays.size(), start, directory.size()), count);
}

}  // namespace hpsdf::arrays
