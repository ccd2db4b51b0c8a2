#pragma once
// 3DS files that bring the library assimp to its limits.

#include <bit>
#include <cstdint>
#include <string>

namespace hpsdf::support {

static_assert(std::endian::native == std::endian::little, "3DS files are written as they lie in memory");

template <typename T>
std::string bytesOfNumber(T value) {
  return {reinterpret_cast<const char*>(&value), sizeof value};
}

/// Returns a chunk of a 3DS file.
inline std::string chunk3ds(std::uint16_t id, const std::string& content) {
  return bytesOfNumber(id) + bytesOfNumber(std::uint32_t(content.size() + 6)) + content;
}

/// Returns a 3DS file with the tetrahedron of the corners (0,0,0), (1,0,0), (0,1,0), (0,0,1), and with so many animated
/// nodes, each a child of the one before.
inline std::string nodes3ds(int nodes, bool areNamesEqual) {
  constexpr float kCorners[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  constexpr std::uint16_t kFaces[4][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  std::string vertices = bytesOfNumber(std::uint16_t{4}), faces = vertices, tracks;
  for (const auto& corner : kCorners)
    for (const float x : corner) vertices += bytesOfNumber(x);
  for (const auto& face : kFaces) {
    for (const std::uint16_t v : face) faces += bytesOfNumber(v);
    faces += bytesOfNumber(std::uint16_t{7});
  }
  for (int n = 0; n < nodes; ++n) {
    const std::string name = areNamesEqual ? "node" : "node" + std::to_string(n);
    tracks += chunk3ds(0xb002, chunk3ds(0xb010, name + std::string(5, '\0') + bytesOfNumber(std::uint16_t(n))));
  }
  const std::string mesh = chunk3ds(0x4100, chunk3ds(0x4110, vertices) + chunk3ds(0x4120, faces));
  const std::string object = chunk3ds(0x4000, std::string("t\0", 2) + mesh);
  return chunk3ds(0x4d4d, chunk3ds(0x3d3d, object) + (nodes > 0 ? chunk3ds(0xb000, tracks) : ""));
}

inline std::string tetrahedron3ds() { return nodes3ds(0, true); }
/// A file whose nodes assimp visits by recursion until its stack overflows.
inline std::string crashing3ds() { return nodes3ds(40'000, true); }
/// A file that keeps assimp busy for half a minute: it searches all nodes for each of them.
inline std::string slow3ds() { return nodes3ds(40'000, false); }

}  // namespace hpsdf::support
