#include <cstdint>

#include "mesh/write/mesh_writer.h"

namespace hpsdf::mesh {

void writePly(const TriangleMesh& mesh, const VertexData& data, const WriteBytes& write) {
  ByteStream out(write);
  out.add("ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(mesh.vertices.size()) +
          "\nproperty double x\nproperty double y\nproperty double z\n");
  if (!data.normals.empty()) out.add("property float nx\nproperty float ny\nproperty float nz\n");
  if (!data.colors.empty()) out.add("property uchar red\nproperty uchar green\nproperty uchar blue\n");
  out.add("element face " + std::to_string(mesh.triangles.size()) +
          "\nproperty list uchar uint vertex_indices\nend_header\n");
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    for (const double x : mesh.vertices[i]) out.addBytesOf(x);
    if (!data.normals.empty())
      for (const double x : data.normals[i]) out.addBytesOf(static_cast<float>(x));
    if (!data.colors.empty()) out.addBytesOf(data.colors[i]);
  }
  for (const Triangle& triangle : mesh.triangles) {
    out.addBytesOf(std::uint8_t{3});
    out.addBytesOf(triangle);
  }
  out.finish();
}

}  // namespace hpsdf::mesh
