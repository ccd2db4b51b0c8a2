#include "parts/face_list.h"

#include <array>
#include <cstring>

#include "hpsdf/detail/text.h"
#include "mesh/read/ply_header.h"
#include "mesh/scan/input.h"
#include "util/refuse.h"

namespace hpsdf::parts {
namespace {

using mesh::PlyElement;
using mesh::PlyHeader;
using mesh::PlyType;

constexpr std::size_t kFaceBytes = 1 + 3 * sizeof(std::uint32_t);

/// Returns the bytes from a vertex to its x, if x, y and z follow each other with the same type, float or double.
std::optional<std::size_t> coordinateOf(const PlyElement& vertex, bool& isSingle) {
  const auto x = vertex.find("x"), y = vertex.find("y"), z = vertex.find("z");
  if (!x || !y || !z || *y != *x + 1 || *z != *x + 2 || vertex.hasList()) return std::nullopt;
  const PlyType type = vertex.properties[*x].type;
  if (type != vertex.properties[*y].type || type != vertex.properties[*z].type) return std::nullopt;
  if (type != PlyType::float32 && type != PlyType::float64) return std::nullopt;
  isSingle = type == PlyType::float32;
  std::size_t bytes = 0;
  for (std::size_t i = 0; i < *x; ++i) bytes += sizeOf(vertex.properties[i].type);
  return bytes;
}

bool isOfIndicesOnly(const PlyElement& face) {
  if (face.properties.size() != 1 || !face.properties[0].count) return false;
  const auto& [name, type, count] = face.properties[0];
  return (name == "vertex_indices" || name == "vertex_index") && sizeOf(*count) == 1 && sizeOf(type) == 4 &&
         type != PlyType::float32;
}

}  // namespace

std::unique_ptr<const FacesOfPly> FacesOfPly::open(const std::filesystem::path& file, const Progress& progress) {
  if (lowerExtension(file) != ".ply") return nullptr;
  mesh::Input input(file, progress);
  const PlyHeader header = mesh::readPlyHeader(input);
  if (header.format != PlyHeader::Format::littleEndian || header.elements.size() < 2) return nullptr;
  const PlyElement &vertex = header.elements[0], &face = header.elements[1];
  if (vertex.name != "vertex" || face.name != "face" || !isOfIndicesOnly(face)) return nullptr;

  std::unique_ptr<FacesOfPly> list(new FacesOfPly(file));
  const auto coordinate = coordinateOf(vertex, list->isSingle_);
  if (!coordinate) return nullptr;
  list->coordinate_ = *coordinate;
  list->vertexBytes_ = vertex.leastBytes();
  list->firstVertex_ = input.offset();
  const std::uint64_t left = list->file_.bytes().size() - list->firstVertex_;
  if (vertex.count > left / list->vertexBytes_ || face.count > (left - vertex.count * list->vertexBytes_) / kFaceBytes)
    input.refuse("holds less than its header promises, or has faces of fewer than three corners");
  const std::uint64_t end = list->firstVertex_ + vertex.count * list->vertexBytes_ + face.count * kFaceBytes;
  if (header.elements.size() == 2 && end != list->file_.bytes().size())
    input.refuse("holds other faces than its header promises: more, or some that are not triangles");
  list->vertices_ = vertex.count;
  list->faces_ = face.count;
  list->firstFace_ = list->firstVertex_ + vertex.count * list->vertexBytes_;
  return list;
}

Vector3 FacesOfPly::vertex(std::size_t index) const {
  const std::byte* const at = file_.bytes().data() + firstVertex_ + index * vertexBytes_ + coordinate_;
  Vector3 position;
  if (isSingle_) {
    std::array<float, 3> single;
    std::memcpy(single.data(), at, sizeof(single));
    position << double(single[0]), double(single[1]), double(single[2]);
  } else {
    std::memcpy(position.data(), at, 3 * sizeof(double));
  }
  return position;
}

Triangle FacesOfPly::face(std::size_t index) const {
  const std::byte* const at = file_.bytes().data() + firstFace_ + index * kFaceBytes;
  if (at[0] != std::byte{3})
    detail::refuseMesh(name_, "face ", index + 1,
                       " is not a triangle; only triangles are taken from a mesh that is not in memory");
  Triangle corners;
  std::memcpy(corners.data(), at + 1, sizeof(corners));
  return corners;
}

}  // namespace hpsdf::parts
