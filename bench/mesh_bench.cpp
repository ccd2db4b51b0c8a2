// Speed of reading mesh files: the bunny of 1.1 million faces in each format, on one thread, from the file cache.

#include <array>
#include <charconv>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <string_view>

#include "hpsdf/mesh_file.h"
#include "scene.h"

namespace hpsdf::bench {
namespace {

namespace fs = std::filesystem;

/// Adds the shortest text from which the same `float` is read back, as most programs write coordinates.
void addNumber(std::string& text, double number) {
  std::array<char, 32> digits;
  text.append(digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), float(number)).ptr);
}

void addLine(std::string& text, std::string_view beginning, const Vector3& v) {
  addNumber(text += beginning, v.x());
  addNumber(text += ' ', v.y());
  addNumber(text += ' ', v.z());
  text += '\n';
}

/// Returns the lines of all vertices and faces, as OBJ, OFF and PLY have them.
std::string lines(const TriangleMesh& mesh, std::string_view vertex, std::string_view face, std::uint32_t firstIndex) {
  std::string text;
  for (const Vector3& v : mesh.vertices) addLine(text, vertex, v);
  for (const Triangle& triangle : mesh.triangles) {
    text += face;
    for (const std::uint32_t v : triangle) text += ' ' + std::to_string(firstIndex + v);
    text += '\n';
  }
  return text;
}

template <typename T>
void addBytes(std::string& bytes, T number) {
  bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
}

std::string plyHeader(const TriangleMesh& mesh, const std::string& format) {
  return "ply\nformat " + format + " 1.0\nelement vertex " + std::to_string(mesh.vertices.size()) +
         "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
         std::to_string(mesh.triangles.size()) + "\nproperty list uchar int vertex_indices\nend_header\n";
}

std::string binaryPly(const TriangleMesh& mesh) {
  std::string bytes = plyHeader(mesh, "binary_little_endian");
  for (const Vector3& v : mesh.vertices)
    for (const double x : v) addBytes(bytes, float(x));
  for (const Triangle& triangle : mesh.triangles) {
    addBytes(bytes, std::uint8_t{3});
    for (const std::uint32_t v : triangle) addBytes(bytes, v);
  }
  return bytes;
}

std::string binaryStl(const TriangleMesh& mesh) {
  std::string bytes(80, ' ');
  addBytes(bytes, std::uint32_t(mesh.triangles.size()));
  for (const Triangle& triangle : mesh.triangles) {
    bytes.append(12, '\0');
    for (const std::uint32_t v : triangle)
      for (const double x : mesh.vertices[v]) addBytes(bytes, float(x));
    bytes.append(2, '\0');
  }
  return bytes;
}

std::string textStl(const TriangleMesh& mesh) {
  std::string text = "solid bunny\n";
  for (const Triangle& triangle : mesh.triangles) {
    text += "facet normal 0.5 0.25 0.125\n outer loop\n";
    for (const std::uint32_t v : triangle) addLine(text, "  vertex ", mesh.vertices[v]);
    text += " endloop\nendfacet\n";
  }
  return text + "endsolid bunny\n";
}

/// Reads a file, which `contentOf` makes, again and again. The benchmark's bytes a second are those of the file.
void read(benchmark::State& state, const std::string& extension,
          const std::function<std::string(const TriangleMesh&)>& contentOf) {
  const fs::path file = fs::temp_directory_path() / ("hpsdf-bench" + extension);
  const std::string content = contentOf(testMesh("large/bunny_1114k_loop2.ply"));
  std::ofstream(file, std::ios::binary) << content;
  for ([[maybe_unused]] auto _ : state) benchmark::DoNotOptimize(readMesh(file));
  state.SetBytesProcessed(std::int64_t(state.iterations()) * std::int64_t(content.size()));
  fs::remove(file);
}

void readBinaryPly(benchmark::State& state) { read(state, ".ply", binaryPly); }
void readBinaryStl(benchmark::State& state) { read(state, ".stl", binaryStl); }
void readTextStl(benchmark::State& state) { read(state, ".stl", textStl); }
void readTextPly(benchmark::State& state) {
  read(state, ".ply", [](const TriangleMesh& m) { return plyHeader(m, "ascii") + lines(m, "", "3", 0); });
}
void readObj(benchmark::State& state) {
  read(state, ".obj", [](const TriangleMesh& m) { return lines(m, "v ", "f", 1); });
}
void readOff(benchmark::State& state) {
  read(state, ".off", [](const TriangleMesh& m) {
    return "OFF\n" + std::to_string(m.vertices.size()) + " " + std::to_string(m.triangles.size()) + " 0\n" +
           lines(m, "", "3", 0);
  });
}

BENCHMARK(readBinaryPly)->Name("mesh/read/binary_ply");
BENCHMARK(readBinaryStl)->Name("mesh/read/binary_stl");
BENCHMARK(readTextPly)->Name("mesh/read/text_ply");
BENCHMARK(readTextStl)->Name("mesh/read/text_stl");
BENCHMARK(readObj)->Name("mesh/read/obj");
BENCHMARK(readOff)->Name("mesh/read/off");

}  // namespace
}  // namespace hpsdf::bench
