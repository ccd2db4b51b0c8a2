#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <numbers>
#include <ostream>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "hpsdf/error.h"
#include "hpsdf/mesh_file.h"
#include "mesh/scan/triangulate.h"
#include "support/temporary_directory.h"
#include "support/test_mesh.h"

namespace hpsdf {
namespace mesh_import_test {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

static_assert(std::endian::native == std::endian::little, "the binary files below are written as they lie in memory");

/// The bytes of a binary file, with functions that append numbers.
struct Bytes {
  std::string data;
  template <typename T>
  Bytes& add(T value) {
    data.append(reinterpret_cast<const char*>(&value), sizeof value);
    return *this;
  }
  Bytes& add(const Bytes& other) {
    data += other.data;
    return *this;
  }
};

// A tetrahedron with edges 1, 2, 3 along x, y, z from its right-angled corner at (5, 6, 7). No rotation or reflection
// maps it to itself.
constexpr float kCorners[4][3] = {{5, 6, 7}, {6, 6, 7}, {5, 8, 7}, {5, 6, 10}};
constexpr std::uint16_t kFaces[4][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};

class MeshImport : public ::testing::Test {
 protected:
  fs::path write(const std::string& name, const std::string& content) const {
    std::ofstream(directory_ / name, std::ios::binary) << content;
    return directory_ / name;
  }

  ImportedMesh import(const std::string& name, const std::string& content) const {
    return importMesh(write(name, content));
  }

  std::string errorOf(const fs::path& file) const {
    try {
      importMesh(file);
    } catch (const Error& e) {
      EXPECT_THAT(e.what(), Not(HasSubstr("\n")));
      return e.what();
    }
    return "no error";
  }

  std::string errorOf(const std::string& name, const std::string& content) const {
    return errorOf(write(name, content));
  }

  void expectTetrahedron(const ImportedMesh& imported, const std::string& name) const {
    const auto& [mesh, report] = imported;
    EXPECT_EQ(mesh.name, name);
    EXPECT_EQ(report.vertices, 4u);
    EXPECT_EQ(report.faces, 4u);
    EXPECT_TRUE(report.closed());
    EXPECT_FALSE(report.reversed);
    EXPECT_NEAR(report.volume, 1, 1e-12);
    EXPECT_EQ(report.box.min(), Vector3(5, 6, 7));
    EXPECT_EQ(report.box.max(), Vector3(6, 8, 10));
  }

  support::TemporaryDirectory directory_;
};

// ---------------------------------------------------------------------------------------------------------------------
// Formats

TEST_F(MeshImport, obj) {
  expectTetrahedron(import("t.obj",
                           "mtllib missing.mtl\nv 5 6 7\nv 6 6 7\nv 5 8 7\nv 5 6 10\nvn 0 0 1\nvt 0 0\n"
                           "f 1 3 2\nf 1/1/1 2/1/1 4/1/1\nf 1//1 4//1 3//1\nf -3 -2 -1\n"),
                    "t.obj");
}

TEST_F(MeshImport, takesExtensionsInAnyCase) {
  expectTetrahedron(import("T.OBJ", "v 5 6 7\nv 6 6 7\nv 5 8 7\nv 5 6 10\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"),
                    "T.OBJ");
}

std::string plyAscii() {
  return "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n"
         "element face 4\nproperty list uchar int vertex_indices\nend_header\n"
         "5 6 7\n6 6 7\n5 8 7\n5 6 10\n0 0 0\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";
}

TEST_F(MeshImport, plyAscii) { expectTetrahedron(import("t.ply", plyAscii()), "t.ply"); }

template <typename Coordinate>
Bytes plyBinary(const std::string& type) {
  Bytes file{"ply\nformat binary_little_endian 1.0\nelement vertex 4\nproperty " + type + " x\nproperty " + type +
             " y\nproperty " + type + " z\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n"};
  for (const auto& corner : kCorners)
    for (const float x : corner) file.add(Coordinate{x});
  for (const auto& face : kFaces) {
    file.add(std::uint8_t{3});
    for (const std::uint16_t v : face) file.add(std::int32_t{v});
  }
  return file;
}

TEST_F(MeshImport, plyBinary) {
  expectTetrahedron(import("t.ply", plyBinary<double>("double").data), "t.ply");
  expectTetrahedron(import("t.ply", plyBinary<float>("float").data), "t.ply");
}

TEST_F(MeshImport, off) {
  expectTetrahedron(import("t.off", "OFF\n4 4 0\n5 6 7\n6 6 7\n5 8 7\n5 6 10\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n"),
                    "t.off");
}

std::string stlAscii() {
  std::string file = "solid t\n";
  for (const auto& face : kFaces) {
    file += "facet normal 0 0 0\nouter loop\n";
    for (const std::uint16_t v : face)
      file += "vertex " + std::to_string(kCorners[v][0]) + " " + std::to_string(kCorners[v][1]) + " " +
              std::to_string(kCorners[v][2]) + "\n";
    file += "endloop\nendfacet\n";
  }
  return file + "endsolid t\n";
}

TEST_F(MeshImport, stlAscii) {
  const ImportedMesh imported = import("t.stl", stlAscii());
  expectTetrahedron(imported, "t.stl");
  EXPECT_EQ(imported.report.weldedVertices, 8u);
}

Bytes stlBinary() {
  Bytes file{std::string(80, ' ')};
  file.add(std::uint32_t{4});
  for (const auto& face : kFaces) {
    for (int i = 0; i < 3; ++i) file.add(0.0f);
    for (const std::uint16_t v : face)
      for (const float x : kCorners[v]) file.add(x);
    file.add(std::uint16_t{0});
  }
  return file;
}

TEST_F(MeshImport, stlBinary) { expectTetrahedron(import("t.stl", stlBinary().data), "t.stl"); }

Bytes chunk3ds(std::uint16_t id, const Bytes& content) {
  return Bytes().add(id).add(static_cast<std::uint32_t>(content.data.size() + 6)).add(content);
}

TEST_F(MeshImport, discreet3dsKeepsTheFilesCoordinates) {
  Bytes vertices, faces;
  vertices.add(std::uint16_t{4});
  for (const auto& corner : kCorners)
    for (const float x : corner) vertices.add(x);
  faces.add(std::uint16_t{4});
  for (const auto& face : kFaces) {
    for (const std::uint16_t v : face) faces.add(v);
    faces.add(std::uint16_t{7});
  }
  const Bytes mesh = chunk3ds(0x4100, chunk3ds(0x4110, vertices).add(chunk3ds(0x4120, faces)));
  const Bytes object = chunk3ds(0x4000, Bytes{std::string("t\0", 2)}.add(mesh));
  expectTetrahedron(import("t.3ds", chunk3ds(0x4d4d, chunk3ds(0x3d3d, object)).data), "t.3ds");
}

TEST_F(MeshImport, installed3dsFile) {
  const fs::path file = "/usr/share/glmark2/models/cube.3ds";
  if (!fs::exists(file)) GTEST_SKIP() << file << " is not installed (package glmark2-data)";
  const MeshReport report = importMesh(file).report;
  EXPECT_EQ(report.faces, 12u);
  EXPECT_TRUE(report.closed());
  EXPECT_NEAR(report.volume, 8, 1e-5);
}

/// Returns the tetrahedron's positions and 16-bit indices as a glTF buffer.
Bytes gltfBuffer() {
  Bytes buffer;
  for (const auto& corner : kCorners)
    for (const float x : corner) buffer.add(x);
  for (const auto& face : kFaces)
    for (const std::uint16_t v : face) buffer.add(v);
  return buffer;
}

/// Returns a glTF file with the tetrahedron as its mesh and with the nodes given as JSON.
std::string gltfScene(const std::string& nodes, const std::string& roots, const std::string& uri = "", int mode = 4) {
  return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[)" + roots + R"(]}],"nodes":[)" + nodes +
         R"(],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"mode":)" + std::to_string(mode) +
         R"(}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[5,6,7],"max":[6,8,10]},
{"bufferView":1,"componentType":5123,"count":12,"type":"SCALAR"}],
"bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":24}],
"buffers":[{"byteLength":72)" +
         (uri.empty() ? "" : R"(,"uri":")" + uri + R"(")") + "}]}";
}

TEST_F(MeshImport, gltf) {
  write("t.bin", gltfBuffer().data);
  expectTetrahedron(import("t.gltf", gltfScene(R"({"mesh":0})", "0", "t.bin")), "t.gltf");
}

TEST_F(MeshImport, glb) {
  std::string json = gltfScene(R"({"mesh":0})", "0");
  json.resize((json.size() + 3) / 4 * 4, ' ');
  const Bytes buffer = gltfBuffer();
  Bytes file{"glTF"};
  file.add(std::uint32_t{2}).add(static_cast<std::uint32_t>(12 + 8 + json.size() + 8 + buffer.data.size()));
  file.add(static_cast<std::uint32_t>(json.size())).add(std::uint32_t{0x4e4f534a}).add(Bytes{json});
  file.add(static_cast<std::uint32_t>(buffer.data.size())).add(std::uint32_t{0x004e4942}).add(buffer);
  expectTetrahedron(import("t.glb", file.data), "t.glb");
}

// ---------------------------------------------------------------------------------------------------------------------
// Scenes

TEST_F(MeshImport, nodeTransformsAreAppliedAndInstancesRepeated) {
  write("t.bin", gltfBuffer().data);
  // The parent scales by 2 and translates; its child rotates by 90° about z: (x, y, z) → (-y, x, z).
  const auto [mesh, report] =
      import("t.gltf", gltfScene(R"({"mesh":0},{"children":[2],"scale":[2,2,2],"translation":[100,0,0]},
                             {"mesh":0,"rotation":[0,0,0.70710678118,0.70710678118]})",
                                 "0,1", "t.bin"));
  EXPECT_EQ(report.vertices, 8u);
  EXPECT_EQ(report.components, 2u);
  EXPECT_TRUE(report.closed());
  EXPECT_NEAR(report.volume, 1 + 8, 1e-4);
  EXPECT_TRUE(report.box.min().isApprox(Vector3(5, 6, 7)));
  EXPECT_TRUE(report.box.max().isApprox(Vector3(100 - 12, 12, 20), 1e-6)) << report.box.max().transpose();
}

TEST_F(MeshImport, mirroringNodesKeepFacesOutward) {
  write("t.bin", gltfBuffer().data);
  const auto [mesh, report] = import("t.gltf", gltfScene(R"({"mesh":0},{"mesh":0,"scale":[-2,1,1]})", "0,1", "t.bin"));
  EXPECT_FALSE(report.reversed);
  EXPECT_TRUE(report.closed());
  EXPECT_NEAR(report.volume, 1 + 2, 1e-12);  // A reflected instance that stays reversed would contribute -2.
  EXPECT_EQ(report.box.min(), Vector3(-12, 6, 7));
}

TEST_F(MeshImport, allMeshesOfASceneAreJoinedAndWelded) {
  const auto [mesh, report] = import("two.obj",
                                     "o a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\n"
                                     "o b\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 5 6 7\n");
  EXPECT_EQ(report.vertices, 4u);
  EXPECT_EQ(report.components, 1u);
  EXPECT_TRUE(report.closed());
}

// ---------------------------------------------------------------------------------------------------------------------
// Polygons

// A prism over an L-shaped polygon, whose caps are not star-shaped about their first corner.
const std::string kPrismCorners =
    "v 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nv 0 0 0\nv 2 0 1\nv 2 1 1\nv 1 1 1\nv 1 2 1\nv 0 2 1\nv 0 0 1\n";
const std::string kPrismSides = "f 1 2 8 7\nf 2 3 9 8\nf 3 4 10 9\nf 4 5 11 10\nf 5 6 12 11\n";

TEST_F(MeshImport, concavePolygons) {
  const auto [mesh, report] =
      import("l.obj", kPrismCorners + kPrismSides + "f 6 1 7 12\nf 7 8 9 10 11 12\nf 6 5 4 3 2 1\n");
  EXPECT_EQ(report.faces, 4u + 4 + 12);
  EXPECT_TRUE(report.closed());
  EXPECT_DOUBLE_EQ(report.volume, 3);
  EXPECT_DOUBLE_EQ(report.area, 3 + 3 + 8);  // Triangles outside the L would add to the area.
}

TEST_F(MeshImport, polygonsWithCornersOnAStraightSideStayClosed) {
  // The caps and two side faces meet at the edge from 6 to 1; they have two more corners on that edge.
  const auto [mesh, report] =
      import("l.obj", kPrismCorners + "v 1 0 0\nv 1 0 1\nv 1.5 0 0\nv 1.5 0 1\n" + kPrismSides +
                          "f 6 13 14 12\nf 13 15 16 14\nf 15 1 7 16\nf 7 8 9 10 11 12 14 16\nf 6 5 4 3 2 1 15 13\n");
  EXPECT_EQ(report.vertices, 16u);
  EXPECT_EQ(report.faces, 2u * 16 - 4);
  EXPECT_TRUE(report.closed());
  EXPECT_DOUBLE_EQ(report.volume, 3);
  EXPECT_DOUBLE_EQ(report.area, 3 + 3 + 8);
}

TEST_F(MeshImport, pointsAndLinesAreLeftOut) {
  const auto [mesh, report] = import(
      "t.obj", "v 5 6 7\nv 6 6 7\nv 5 8 7\nv 5 6 10\nv 50 0 0\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\nl 1 5\np 5\n");
  EXPECT_EQ(report.faces, 4u);
  EXPECT_EQ(report.vertices, 4u);
  EXPECT_EQ(report.box.max(), Vector3(6, 8, 10));
}

std::string tetrahedronObj(double size, double offset) {
  std::ostringstream text;
  text.precision(17);
  for (const auto& corner : kCorners) {
    text << "v";
    for (const float x : corner) text << " " << size * x + offset;
    text << "\n";
  }
  text << "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
  return text.str();
}

TEST_F(MeshImport, takesAnySizeUpToTheLargestCoordinate) {
  for (const double size : {1e-90, 1e-40, 1e-6, 1e6, 1e38, 1e98}) {
    const auto [mesh, report] = import("t.obj", tetrahedronObj(size, 0));
    EXPECT_TRUE(report.closed()) << size;
    EXPECT_NEAR(report.volume / size / size / size, 1, 1e-12) << size;
  }
  EXPECT_THAT(errorOf("t.obj", tetrahedronObj(1e100, 0)), HasSubstr("not a finite number (or beyond 1e100)"));
  EXPECT_EQ(import("t.obj", tetrahedronObj(1, 1e9)).report.volume, 1) << "no digit is lost far from the origin";
}

// ---------------------------------------------------------------------------------------------------------------------
// Refused files

TEST_F(MeshImport, refusesPathsThatAreNoRegularFiles) {
  EXPECT_EQ(errorOf(directory_ / "mesh.obj"), (directory_ / "mesh.obj").string() + ": no such file; check the path");
  fs::create_directory(directory_ / "folder.obj");
  EXPECT_THAT(errorOf(directory_ / "folder.obj"), HasSubstr("folder.obj: a directory, not a file"));
  ASSERT_EQ(::mkfifo((directory_ / "pipe.obj").c_str(), 0600), 0);
  EXPECT_THAT(errorOf(directory_ / "pipe.obj"), HasSubstr("pipe.obj: not a regular file"));
  EXPECT_THAT(errorOf("empty.obj", ""), HasSubstr("empty.obj: the file is empty"));
  EXPECT_THAT(errorOf(fs::path()), HasSubstr("the name of the file is empty"));
}

TEST_F(MeshImport, refusesUnreadableFiles) {
  if (::geteuid() == 0) GTEST_SKIP() << "root may read every file";
  const fs::path file = write("secret.obj", "v 0 0 0\n");
  fs::permissions(file, fs::perms::none);
  EXPECT_THAT(errorOf(file), HasSubstr("secret.obj: cannot be read; check its permissions"));
}

TEST_F(MeshImport, unknownFormatsNameTheKnownOnes) {
  for (const std::string name : {"mesh.fbx", "mesh", "mesh.glb.gz", "mesh.gz", "mesh.hpsdf"})
    EXPECT_THAT(errorOf(name, "v 0 0 0\n"),
                AllOf(HasSubstr("/" + name + ": "),
                      HasSubstr("ends in one of .obj, .ply, .stl, .off, .gltf, .glb, .3ds, .obj.gz, .ply.gz")));
}

TEST_F(MeshImport, refusesContentThatIsNoMesh) {
  for (const std::string extension : {"obj", "ply", "stl", "off", "3ds", "gltf", "glb"})
    for (const std::string& content :
         {std::string("Dear diary,\nnothing happened.\n"), std::string(1, '\0'), std::string(1000, '\xff')}) {
      const std::string name = "bad." + extension;
      EXPECT_THAT(errorOf(name, content), HasSubstr("/" + name + ": "));
    }
}

TEST_F(MeshImport, refusesTruncatedFiles) {
  Bytes stl{std::string(80, ' ')};
  stl.add(std::uint32_t{1000}).add(0.0f);
  EXPECT_THAT(errorOf("cut.stl", stl.data),
              HasSubstr("/cut.stl: it promises 1000 faces of 50 bytes, but only 4 bytes"));
  EXPECT_THAT(errorOf("huge.ply",
                      "ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty float x\n"
                      "property float y\nproperty float z\nend_header\n"),
              HasSubstr("/huge.ply: its header promises 4000000000 vertices, but only 0 bytes follow"));
  EXPECT_THAT(errorOf("huge.off", "OFF # by hand\n# counts\n4000000000 1 0\n0 0 0\n"),
              HasSubstr("/huge.off: its header promises 4000000000 vertices"));
  EXPECT_THAT(errorOf("huge.off", "COFF 1 4000000000 0\n0 0 0\n"),
              HasSubstr("/huge.off: its header promises 4000000000 faces"));
  expectTetrahedron(
      import("edges.off", "OFF\n4 4 600000\n5 6 7\n6 6 7\n5 8 7\n5 6 10\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n"),
      "edges.off");
  const std::string header = "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\n";
  for (const char* end : {"", "end_", "end_header"})
    EXPECT_THAT(errorOf("cut.ply", header + end), HasSubstr("/cut.ply: its header, or a line of it, does not end"))
        << end;
  EXPECT_THAT(errorOf("cut.ply", header + "end_headers\n"), HasSubstr("line 5: unknown word 'end_headers'"));
  EXPECT_THAT(errorOf("few.off", "OFF\n4 4 0\n0 0 0\n"), HasSubstr("/few.off: "));
  EXPECT_THAT(errorOf("alone.gltf", gltfScene(R"({"mesh":0})", "0", "missing.bin")), HasSubstr("/alone.gltf: "));
}

TEST_F(MeshImport, refusesFilesWithoutFaces) {
  EXPECT_THAT(errorOf("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n"), HasSubstr("/points.obj: "));
  EXPECT_THAT(errorOf("lines.obj", "v 0 0 0\nv 1 0 0\nl 1 2\n"), HasSubstr("/lines.obj: no faces"));
  write("t.bin", gltfBuffer().data);
  EXPECT_THAT(errorOf("points.gltf", gltfScene(R"({"mesh":0})", "0", "t.bin", 0)), HasSubstr("/points.gltf: no faces"));
  EXPECT_THAT(errorOf("hidden.gltf", gltfScene(R"({"name":"nothing"})", "0", "t.bin")),
              HasSubstr("/hidden.gltf: no faces"));
  EXPECT_THAT(errorOf("flat.obj", "v 0 0 0\nv 1 1 1\nv 2 2 2\nf 1 2 3\nf 1 1 2\n"),
              HasSubstr("/flat.obj: no face with an area (2 faces are degenerate)"));
}

TEST_F(MeshImport, refusesAMeshThatItsNodeFlattens) {
  write("t.bin", gltfBuffer().data);
  EXPECT_THAT(errorOf("t.gltf", gltfScene(R"({"mesh":0,"scale":[1,0,0]})", "0", "t.bin")),
              HasSubstr("/t.gltf: no face with an area (4 faces are degenerate)"));
}

/// All messages count faces and vertices from 1, whatever the format counts from.
TEST_F(MeshImport, refusesIndicesOutOfRange) {
  const std::string problem = "face 2 refers to vertex 78, but there are only 3";
  EXPECT_THAT(errorOf("far.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 78\n"),
              HasSubstr("/far.obj: line 5: " + problem));
  EXPECT_THAT(errorOf("far.off", "OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 0 1 77\n"),
              HasSubstr("/far.off: line 7: " + problem));
  EXPECT_THAT(
      errorOf("far.ply",
              "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
              "element face 2\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
              "3 0 1 77\n"),
      HasSubstr("/far.ply: line 14: " + problem));
  Bytes ply = plyBinary<float>("float");
  ply.data[ply.data.size() - 4] = 77;
  EXPECT_THAT(errorOf("far.ply", ply.data), HasSubstr("/far.ply: face 4 refers to vertex 78, but there are only 4"));
  ply.data[ply.data.size() - 1] = '\xff';
  EXPECT_THAT(errorOf("far.ply", ply.data), HasSubstr("/far.ply: face 4 has a negative index, -16777139"));
  Bytes buffer = gltfBuffer();
  buffer.data[buffer.data.size() - 2] = 9;
  write("t.bin", buffer.data);
  EXPECT_THAT(errorOf("far.gltf", gltfScene(R"({"mesh":0})", "0", "t.bin")),
              HasSubstr("meshes[0].primitives[0] refers to vertex 10, but there are only 4"));
}

TEST_F(MeshImport, refusesNonFiniteCoordinates) {
  for (const std::string bad : {"nan", "inf", "-inf", "1e400"}) {
    EXPECT_THAT(errorOf("bad.obj", "v 0 0 0\nv 1 0 " + bad + "\nv 0 1 0\nf 1 2 3\n"),
                HasSubstr("/bad.obj: line 2: '" + bad + "' is not a finite number"));
    EXPECT_THAT(
        errorOf("bad.ply",
                "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
                "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 " +
                    bad + "\n0 1 0\n3 0 1 2\n"),
        HasSubstr("/bad.ply: line 11: '" + bad + "' is not a finite number"));
    EXPECT_THAT(errorOf("bad.off", "OFF\n3 1 0\n0 0 0\n1 0 " + bad + "\n0 1 0\n3 0 1 2\n"),
                HasSubstr("/bad.off: line 4: '" + bad + "' is not a finite number"));
  }
  Bytes ply = plyBinary<float>("float"), stl = stlBinary();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::memcpy(ply.data.data() + ply.data.find("end_header\n") + 11 + 12, &nan, 4);
  EXPECT_THAT(errorOf("bad.ply", ply.data),
              HasSubstr("a coordinate is not a finite number, at number 2 of 4 of the element 'vertex'"));
  std::memcpy(stl.data.data() + 84 + 50 + 12, &nan, 4);
  EXPECT_THAT(errorOf("bad.stl", stl.data), HasSubstr("a coordinate is not a finite number, in face 2 of 4"));
}

TEST_F(MeshImport, printsNothing) {
  ::testing::internal::CaptureStdout();
  ::testing::internal::CaptureStderr();
  errorOf("bad.obj", "v 0 0 0\nv 1 0 0\nf 1 2 9\nfoo\n");
  errorOf("bad.gltf", "{");
  errorOf("bad.3ds", "no file of 3D Studio");
  EXPECT_EQ(::testing::internal::GetCapturedStdout(), "");
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

// ---------------------------------------------------------------------------------------------------------------------

TEST_F(MeshImport, loadMeshTakesFilesAndShapes) {
  const fs::path file = write("t.obj", "v 5 6 7\nv 6 6 7\nv 5 8 7\nv 5 6 10\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  EXPECT_EQ(loadMesh(file.string()).triangles.size(), 4u);
  EXPECT_EQ(loadMesh("builtin:box,width=3").name, "builtin:box,width=3");
  EXPECT_THROW(loadMesh("builtin:bax,width=3"), Error);
  EXPECT_THROW(loadMesh("box"), Error);  // Without "builtin:", the name is that of a file, which does not exist here.
  try {
    loadMesh("analytic:torus,major=1");
    FAIL();
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), AllOf(HasSubstr("a mesh is expected here"), HasSubstr("builtin:torus,major=1")));
  }
}

// ---------------------------------------------------------------------------------------------------------------------
// Triangulation

struct TriangulationArea {
  double sum = 0;    ///< sum of the triangles' areas, signed by the polygon's orientation
  double least = 0;  ///< least signed area of a triangle
};

TriangulationArea areaOf(const std::vector<Vector3>& polygon, const Vector3& normal) {
  const auto triangles = mesh::triangulate(polygon);
  EXPECT_EQ(triangles.size(), polygon.size() - 2);
  TriangulationArea area{0, std::numeric_limits<double>::infinity()};
  for (const auto& [a, b, c] : triangles) {
    const double one = (polygon[b] - polygon[a]).cross(polygon[c] - polygon[a]).dot(normal) / 2;
    area.sum += one;
    area.least = std::min(area.least, one);
  }
  return area;
}

TEST(Triangulate, triangulatesConcavePolygonsInAnyPlane) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int trial = 0; trial < 300; ++trial) {
    const int n = 4 + trial % 40;
    const Eigen::Quaterniond turn =
        Eigen::Quaterniond(uniform(random), uniform(random) - 0.5, uniform(random) - 0.5, uniform(random) - 0.5)
            .normalized();
    const Vector3 offset = 10 * Vector3(uniform(random), uniform(random), uniform(random));
    std::vector<Vector3> polygon;
    double expected = 0;
    std::vector<double> radii;
    for (int i = 0; i < n; ++i) radii.push_back(0.2 + uniform(random));
    const double step = 2 * std::numbers::pi / n;
    for (int i = 0; i < n; ++i) {
      const Vector3 flat = radii[i] * Vector3(std::cos(step * i), std::sin(step * i), 0);
      polygon.push_back((turn * flat + offset).cast<float>().cast<double>());
      expected += radii[i] * radii[(i + 1) % n] * std::sin(step) / 2;
    }
    const auto area = areaOf(polygon, turn * Vector3::UnitZ());
    EXPECT_NEAR(area.sum, expected, 1e-5) << n;
    EXPECT_GT(area.least, 0) << n;
  }
}

TEST(Triangulate, cornersOnStraightSidesGetTrianglesWithAnArea) {
  // Each side of the square has nine more corners at multiples of 1/3; rounded to float, they leave the side.
  std::vector<Vector3> polygon;
  const Vector3 corners[4] = {{0, 0, 0}, {1, 0.3, 0}, {0.7, 1.3, 0}, {-0.3, 1, 0}};
  for (int side = 0; side < 4; ++side)
    for (int i = 0; i < 10; ++i)
      polygon.push_back(
          (corners[side] + (corners[(side + 1) % 4] - corners[side]) * i / 10).cast<float>().cast<double>());
  const auto area = areaOf(polygon, Vector3::UnitZ());
  EXPECT_NEAR(area.sum, 1.09, 1e-6);
  EXPECT_GT(area.least, 1e-3);
}

TEST(Triangulate, doesNotFillTheGapsOfAComb) {
  std::vector<Vector3> polygon;
  for (int tooth = 0; tooth < 20; ++tooth)
    for (const double y : {5.0, 1.0}) {
      polygon.emplace_back(-2 * tooth - (y == 5 ? 0 : 1), y, 0);
      polygon.emplace_back(-2 * tooth - (y == 5 ? 1 : 2), y, 0);
    }
  polygon.emplace_back(-40, 0, 0);
  polygon.emplace_back(0, 0, 0);
  const auto area = areaOf(polygon, Vector3::UnitZ());
  EXPECT_NEAR(area.sum, 40 + 20 * 4, 1e-12);
  EXPECT_GT(area.least, 0);
}

/// The spiral winds around twice and returns at a distance of a thousandth of its radius. An algorithm that tests all
/// pairs of its corners would take minutes.
TEST(Triangulate, triangulatesASpiralOfManyCornersQuickly) {
  constexpr int kAlong = 50000;
  std::vector<Vector3> polygon;
  const auto add = [&](int i, double radius) {
    const double angle = 4 * std::numbers::pi * i / kAlong;
    polygon.emplace_back(radius * std::cos(angle), radius * std::sin(angle), 0);
  };
  for (int i = 0; i < kAlong; ++i) add(i, 1.001 + double(i) / kAlong);
  for (int i = kAlong; i-- > 0;) add(i, 1 + double(i) / kAlong);
  double expected = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector3& next = polygon[(i + 1) % polygon.size()];
    expected += (polygon[i].x() * next.y() - polygon[i].y() * next.x()) / 2;
  }
  const auto area = areaOf(polygon, Vector3::UnitZ());
  EXPECT_NEAR(area.sum, expected, 1e-9);
  EXPECT_GT(area.least, 0);
}

TEST(Triangulate, triangulatesAPolygonWithASlitToItsHole) {
  const std::vector<Vector3> polygon = {{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0}, {0, 0, 0},
                                        {1, 1, 0}, {1, 3, 0}, {3, 3, 0}, {3, 1, 0}, {1, 1, 0}};
  const auto area = areaOf(polygon, Vector3::UnitZ());
  EXPECT_DOUBLE_EQ(area.sum, 12);
  EXPECT_GE(area.least, 0);
}

TEST(Triangulate, yieldsTrianglesForDegeneratePolygons) {
  areaOf({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {1.5, 0, 0}}, Vector3::UnitZ());
  areaOf(std::vector<Vector3>(6, Vector3::Zero()), Vector3::UnitZ());
  areaOf({{0, 0, 0}, {2, 2, 0}, {2, 0, 0}, {0, 2, 0}, {1, 3, 0}}, Vector3::UnitZ());
}

// ---------------------------------------------------------------------------------------------------------------------
// Real meshes

/// A mesh of the test folder and its counts after welding, before degenerate faces are dropped. The counts were
/// determined without this reader.
struct KnownMesh {
  std::string file;
  std::size_t vertices, faces;
  bool closed;
  std::size_t parts, boundaryEdges, nonManifoldEdges, degenerateFaces, flippedFaces, duplicateFaces;
  bool turned;

  friend void PrintTo(const KnownMesh& mesh, std::ostream* out) { *out << mesh.file; }
};

class KnownMeshes : public ::testing::TestWithParam<KnownMesh> {};

TEST_P(KnownMeshes, haveTheKnownCounts) {
  HPSDF_SKIP_WITHOUT_MESHES();
  const KnownMesh& known = GetParam();
  const MeshReport report = importMesh(support::testMesh(known.file)).report;
  EXPECT_EQ(report.vertices, known.vertices);
  EXPECT_EQ(report.faces + report.degenerateFaces + report.duplicateFaces, known.faces);
  EXPECT_EQ(report.closed(), known.closed);
  EXPECT_EQ(report.components, known.parts);
  EXPECT_EQ(report.boundaryEdges, known.boundaryEdges);
  EXPECT_EQ(report.nonManifoldEdges, known.nonManifoldEdges);
  EXPECT_EQ(report.degenerateFaces, known.degenerateFaces);
  EXPECT_EQ(report.flippedFaces, known.flippedFaces);
  EXPECT_EQ(report.duplicateFaces, known.duplicateFaces);
  EXPECT_EQ(report.reversed, known.turned);
}

INSTANTIATE_TEST_SUITE_P(
    Closed, KnownMeshes,
    ::testing::Values(KnownMesh{"paper/bunny_69k.obj", 34817, 69630, true, 1, 0, 0, 0, 0, 0, false},
                      KnownMesh{"paper/dragon_80k.obj", 39994, 79988, true, 1, 0, 0, 0, 0, 0, false},
                      KnownMesh{"paper/armadillo_100k.obj", 49990, 99976, true, 1, 0, 0, 0, 0, 0, false},
                      KnownMesh{"paper/finger_skeletonhand_part.ply", 2046, 4088, true, 1, 0, 0, 0, 0, 0, false},
                      KnownMesh{"cad/fandisk.obj", 6475, 12946, true, 1, 0, 0, 0, 0, 0, false},
                      KnownMesh{"cad/rocker-arm.obj", 10044, 20088, true, 1, 0, 0, 0, 0, 0, false},
                      KnownMesh{"cad/cube_12.obj", 8, 12, true, 1, 0, 0, 0, 0, 0, false},
                      KnownMesh{"cad/wingnut.obj", 3047, 6090, true, 1, 0, 0, 0, 0, 0, false},
                      KnownMesh{"cad/1002_tray_bottom.STL", 2216, 4520, true, 1, 0, 0, 0, 0, 0, false},
                      KnownMesh{"large/bunny_1114k_loop2.ply", 557042, 1114080, true, 1, 0, 0, 0, 0, 0, false},
                      KnownMesh{"broken/hand_flesh_76k_inverted.obj", 38218, 76438, true, 1, 0, 0, 2, 0, 0, true},
                      KnownMesh{"broken/self_intersectA.obj", 8582, 17160, true, 1, 0, 0, 0, 0, 0, false},
                      KnownMesh{"broken/Generic_Twin_7081_left.obj", 9874, 19704, true, 12, 0, 0, 0, 0, 0, false}));

// Dropping degenerate faces removes vertices and opens edges. The teapot has three components if parts that touch at a
// corner count as one component.
INSTANTIATE_TEST_SUITE_P(
    Broken, KnownMeshes,
    ::testing::Values(KnownMesh{"broken/bun_zipper.ply", 34834, 69451, false, 1, 223, 0, 0, 0, 0, false},
                      KnownMesh{"broken/teapot.obj", 3241, 6320, false, 4, 160, 0, 0, 0, 0, false},
                      KnownMesh{"broken/suzanne.obj", 505, 968, false, 3, 42, 0, 0, 0, 0, false},
                      KnownMesh{"broken/mp_bed.obj", 7113, 14042, false, 11, 187, 10, 2, 41, 0, false},
                      KnownMesh{"broken/chair_model.obj", 3158, 12756, false, 3, 10, 51, 0, 0, 6382, true},
                      KnownMesh{"broken/joined_tetrahedra.obj", 5, 8, false, 1, 0, 3, 0, 0, 0, false},
                      KnownMesh{"broken/boxNotManifold.obj", 9, 12, false, 1, 4, 0, 0, 0, 0, false},
                      KnownMesh{"broken/featuretype.STL", 2010, 3476, false, 1, 576, 0, 0, 0, 0, false},
                      KnownMesh{"broken/wallhole.obj", 35, 66, true, 1, 0, 0, 0, 0, 0, false},
                      KnownMesh{"broken/assimp_spider.obj", 722, 1368, false, 18, 72, 0, 56, 0, 0, false},
                      KnownMesh{"broken/soup.stl", 300, 100, false, 100, 300, 0, 0, 0, 0, true}));

TEST_F(MeshImport, refusedMeshes) {
  HPSDF_SKIP_WITHOUT_MESHES();
  EXPECT_THAT(errorOf(support::testMesh("broken/assimp_pond.0.ply")),
              HasSubstr("its header promises 70051 vertices, but only 2171512 bytes follow"));
  EXPECT_THAT(errorOf(support::testMesh("broken/assimp_invalid.off")),
              HasSubstr("line 3: '.1' follows the number 0 (the number of edges)"));
}

}  // namespace mesh_import_test
}  // namespace hpsdf
