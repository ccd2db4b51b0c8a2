#include "grids/vtk_file.h"

#include <zlib.h>

#include <bit>
#include <charconv>
#include <cstdint>
#include <cstring>

#include "util/chunks.h"

namespace hpsdf::grids {
namespace {

static_assert(std::endian::native == std::endian::little, "arrays are written as their numbers are in memory");

/// Bytes that are compressed as one block. Threads compress different blocks.
constexpr std::size_t kBytesOfBlock = std::size_t{1} << 20;
/// The fastest level: the values of a grid hardly get smaller by higher ones.
constexpr int kCompressionLevel = 1;

std::vector<std::byte> compressedBlock(std::span<const std::byte> bytes) {
  uLongf size = compressBound(uLong(bytes.size()));
  std::vector<std::byte> block(size);
  const int result = compress2(reinterpret_cast<Bytef*>(block.data()), &size,
                               reinterpret_cast<const Bytef*>(bytes.data()), uLong(bytes.size()), kCompressionLevel);
  if (result != Z_OK) throw Error(ErrorKind::limit, "", "zlib found no memory to compress an array");
  block.resize(size);
  return block;
}

/// Returns the bytes of an array as the format wants them: the number of blocks, the bytes of a block before
/// compression, those of the last block if it is shorter, the bytes of each compressed block, and the blocks.
std::vector<std::byte> compressedArray(std::span<const std::byte> bytes, const Progress& progress) {
  const std::size_t count = detail::chunksOf(bytes.size(), kBytesOfBlock);
  std::vector<std::vector<std::byte>> blocks(count);
  detail::forEachChunk(bytes.size(), kBytesOfBlock, progress, "compressing",
                       [&](std::size_t block, std::size_t first, std::size_t size) {
                         blocks[block] = compressedBlock(bytes.subspan(first, size));
                       });
  std::vector<std::uint64_t> header = {count, kBytesOfBlock, bytes.size() % kBytesOfBlock};
  for (const auto& block : blocks) header.push_back(block.size());
  const auto headerBytes = std::as_bytes(std::span(header));
  std::vector<std::byte> all(headerBytes.begin(), headerBytes.end());
  for (const auto& block : blocks) all.insert(all.end(), block.begin(), block.end());
  return all;
}

}  // namespace

std::string numbersText(std::span<const double> numbers) {
  std::string text;
  for (const double number : numbers) {
    std::array<char, 32> digits;
    const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr;
    if (!text.empty()) text += ' ';
    text.append(digits.data(), end);
  }
  return text;
}

VtkFile::VtkFile(std::string_view dataSet, std::string_view version, const Progress& progress) : progress_(progress) {
  text_ = "<?xml version=\"1.0\"?>\n";
  open("VTKFile", {{"type", std::string(dataSet)},
                   {"version", std::string(version)},
                   {"byte_order", "LittleEndian"},
                   {"header_type", "UInt64"},
                   {"compressor", "vtkZLibDataCompressor"}});
}

void VtkFile::open(std::string_view element, std::initializer_list<Attribute> attributes) {
  text_.append(2 * open_.size(), ' ') += '<';
  text_ += element;
  for (const auto& [name, value] : attributes) {
    text_ += ' ';
    text_ += name;
    text_ += "=\"" + value + '"';
  }
  text_ += ">\n";
  open_.emplace_back(element);
}

void VtkFile::close() {
  const std::string element = open_.back();
  open_.pop_back();
  text_.append(2 * open_.size(), ' ') += "</" + element + ">\n";
}

void VtkFile::addArray(std::string_view name, std::string_view type, int components, std::span<const std::byte> bytes) {
  open("DataArray", {{"type", std::string(type)},
                     {"Name", std::string(name)},
                     {"NumberOfComponents", std::to_string(components)},
                     {"format", "appended"},
                     {"offset", std::to_string(offset_)}});
  close();
  arrays_.push_back(compressedArray(bytes, progress_));
  offset_ += arrays_.back().size();
}

void VtkFile::array(std::string_view name, NumberType type, std::span<const double> numbers, int components) {
  if (type == NumberType::float64) return array(name, numbers, components);
  const std::vector<float> rounded(numbers.begin(), numbers.end());
  array(name, std::span<const float>(rounded), components);
}

void VtkFile::write(OutputFile& out) {
  while (open_.size() > 1) close();
  text_ += "  <AppendedData encoding=\"raw\">\n_";
  out.write(text_);
  for (const auto& array : arrays_) out.write(array);
  out.write("\n  </AppendedData>\n</VTKFile>\n");
  out.flush();
}

}  // namespace hpsdf::grids
