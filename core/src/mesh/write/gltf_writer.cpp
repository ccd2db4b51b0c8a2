#include <cmath>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>

#include "hpsdf/error.h"
#include "mesh/write/mesh_writer.h"

namespace hpsdf::mesh {
namespace {

// Numbers of the glTF 2.0 specification.
constexpr std::uint32_t kGlbMagic = 0x46546c67, kGlbVersion = 2, kJsonChunk = 0x4e4f534a, kBinaryChunk = 0x004e4942;
constexpr int kUnsignedShort = 5123, kUnsignedInt = 5125, kFloat = 5126;
constexpr int kVertexBuffer = 34962, kIndexBuffer = 34963;
constexpr std::size_t kChunkHeader = 8, kFileHeader = 12;

/// Converts a channel of an sRGB colour to linear light (IEC 61966-2-1), in which glTF has colours of vertices, as a
/// 16-bit number. With 8 bits, dark colours would be rounded visibly.
std::uint16_t linearChannel(std::uint8_t channel) {
  const double c = channel / 255.0;
  const double linear = c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
  return static_cast<std::uint16_t>(std::lround(65535 * linear));
}

/// The description of a file with one mesh, and the bytes of its binary part.
class Document {
 public:
  Document(const TriangleMesh& mesh, const VertexData& data) {
    const std::size_t vertices = mesh.vertices.size();
    nlohmann::ordered_json attributes;
    attributes["POSITION"] = addAccessor(kFloat, "VEC3", vertices, 12, kVertexBuffer);
    addBounds(mesh);
    if (!data.normals.empty()) attributes["NORMAL"] = addAccessor(kFloat, "VEC3", vertices, 12, kVertexBuffer);
    if (!data.colors.empty()) {
      attributes["COLOR_0"] = addAccessor(kUnsignedShort, "VEC4", vertices, 8, kVertexBuffer);
      json_["accessors"].back()["normalized"] = true;
    }
    const int indices = addAccessor(kUnsignedInt, "SCALAR", 3 * mesh.triangles.size(), 4, kIndexBuffer);
    json_["asset"] = {{"version", "2.0"}, {"generator", "hpsdf"}};
    json_["scene"] = 0;
    json_["scenes"] = {{{"nodes", {0}}}};
    json_["nodes"] = {{{"mesh", 0}}};
    nlohmann::ordered_json primitive = {{"attributes", attributes}, {"indices", indices}};
    if (!data.colors.empty()) {
      // Without a material, glTF's default is metal, whose colours viewers show as dark reflections.
      json_["materials"] = {{{"pbrMetallicRoughness", {{"metallicFactor", 0}, {"roughnessFactor", 0.8}}}}};
      primitive["material"] = 0;
    }
    json_["meshes"] = {{{"primitives", {primitive}}}};
    json_["buffers"] = {{{"byteLength", bytes_}}};
  }

  std::size_t bytes() const { return bytes_; }

  /// Returns the description, padded with blanks to a multiple of four bytes.
  std::string text() const {
    std::string text = json_.dump();
    text.resize((text.size() + 3) / 4 * 4, ' ');
    return text;
  }

 private:
  int addAccessor(int type, const char* shape, std::size_t count, std::size_t bytesOfEach, int target) {
    json_["bufferViews"].push_back(
        {{"buffer", 0}, {"byteOffset", bytes_}, {"byteLength", count * bytesOfEach}, {"target", target}});
    json_["accessors"].push_back(
        {{"bufferView", json_["bufferViews"].size() - 1}, {"componentType", type}, {"count", count}, {"type", shape}});
    bytes_ += count * bytesOfEach;
    return static_cast<int>(json_["accessors"].size() - 1);
  }

  /// Adds the box of the positions, which glTF demands, as the floats that are written.
  void addBounds(const TriangleMesh& mesh) {
    const Box box = boundingBox(mesh);
    for (int axis = 0; axis < 3; ++axis) {
      json_["accessors"].back()["min"].push_back(static_cast<float>(box.min()[axis]));
      json_["accessors"].back()["max"].push_back(static_cast<float>(box.max()[axis]));
    }
  }

  nlohmann::ordered_json json_;
  std::size_t bytes_ = 0;
};

}  // namespace

void writeGlb(const TriangleMesh& mesh, const VertexData& data, const WriteBytes& write) {
  const Document document(mesh, data);
  const std::string text = document.text();
  const std::size_t size = kFileHeader + 2 * kChunkHeader + text.size() + document.bytes();
  if (size > std::numeric_limits<std::uint32_t>::max())
    throw Error(ErrorKind::limit, "", "a .glb file holds at most 4 GB; write .ply, or allow a greater tolerance");
  ByteStream out(write);
  for (const std::uint32_t number :
       {kGlbMagic, kGlbVersion, static_cast<std::uint32_t>(size), static_cast<std::uint32_t>(text.size()), kJsonChunk})
    out.addBytesOf(number);
  out.add(text);
  out.addBytesOf(static_cast<std::uint32_t>(document.bytes()));
  out.addBytesOf(kBinaryChunk);
  const auto addVectors = [&](std::span<const Vector3> vectors) {
    for (const Vector3& x : vectors)
      for (const double coordinate : x) out.addBytesOf(static_cast<float>(coordinate));
  };
  addVectors(mesh.vertices);
  addVectors(data.normals);
  for (const auto& [red, green, blue] : data.colors)
    for (const std::uint8_t channel : {red, green, blue, std::uint8_t{255}}) out.addBytesOf(linearChannel(channel));
  for (const Triangle& triangle : mesh.triangles) out.addBytesOf(triangle);
  out.finish();
}

}  // namespace hpsdf::mesh
