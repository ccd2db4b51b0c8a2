#include <cstdint>

#include "mesh/write/mesh_writer.h"

namespace hpsdf::mesh {

void writeStl(const TriangleMesh& mesh, const WriteBytes& write) {
  constexpr std::size_t kHeader = 80;
  ByteStream out(write);
  std::string header = "binary STL";  // A header that begins with "solid" would be taken for text.
  header.resize(kHeader, ' ');
  out.add(header);
  out.addBytesOf(static_cast<std::uint32_t>(mesh.triangles.size()));
  const auto addVector = [&](const Vector3& x) {
    for (const double coordinate : x) out.addBytesOf(static_cast<float>(coordinate));
  };
  for (const Triangle& triangle : mesh.triangles) {
    const auto [a, b, c] = cornersOf(mesh, triangle);
    addVector((b - a).cross(c - a).stableNormalized());
    for (const Vector3& corner : {a, b, c}) addVector(corner);
    out.addBytesOf(std::uint16_t{0});
  }
  out.finish();
}

}  // namespace hpsdf::mesh
