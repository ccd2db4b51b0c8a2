#include "parts/part_index.h"

#include <string>

#include "util/checked_file.h"

namespace hpsdf::parts {
namespace {

constexpr detail::Magic kIndexMagic = {'H', 'P', 'S', 'D', 'F', 'P', 'R', 'T'};
constexpr std::uint32_t kIndexVersion = 1;

template <typename Stream, typename BoxType>
void boxItems(Stream& stream, BoxType& box) {
  for (int axis = 0; axis < 3; ++axis) stream.item(box.min()[axis]);
  for (int axis = 0; axis < 3; ++axis) stream.item(box.max()[axis]);
}

/// Writes or reads all numbers of an index but the number of its parts, which are there already.
template <typename Stream, typename Index>
void indexItems(Stream& stream, Index& index) {
  stream.text(index.source.name);
  stream.item(index.source.fingerprint);
  stream.item(index.source.vertices);
  stream.item(index.source.faces);
  boxItems(stream, index.source.box);
  for (auto& part : index.parts) {
    boxItems(stream, part.box);
    stream.item(part.stamp.bytes);
    stream.item(part.stamp.checksum);
  }
}

std::filesystem::path indexFile(const std::filesystem::path& folder) { return folder / "index"; }

}  // namespace

std::filesystem::path partFile(const std::filesystem::path& folder, std::size_t part) {
  return folder / ("part-" + std::to_string(part));
}

void writeIndex(const PartIndex& index, const std::filesystem::path& folder) {
  detail::CheckedWriter writer(indexFile(folder));
  writer.begin(kIndexMagic, kIndexVersion);
  writer.item(std::uint64_t{index.parts.size()});
  indexItems(writer, index);
  writer.finish();
}

PartIndex readIndex(const std::filesystem::path& folder) {
  detail::CheckedReader reader(indexFile(folder), {.name = "index of a mesh's parts",
                                                   .wanted = "a folder of parts",
                                                   .remedy = "remove its folder, and the mesh is divided anew"});
  const auto version = reader.begin(kIndexMagic);
  reader.require(version == kIndexVersion, "is of another version");
  std::uint64_t count = 0;
  reader.item(count);
  constexpr std::uint64_t kBytesOfPart = 8 * sizeof(double);
  reader.require(count <= reader.remaining() / kBytesOfPart, "promises more parts than it has");
  PartIndex index;
  index.parts.resize(count);
  indexItems(reader, index);
  reader.finish();
  index.source.insideTest = InsideTest::pseudonormal;
  return index;
}

}  // namespace hpsdf::parts
