#include "hpsdf/triangle_mesh.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>
#include <xxhash.h>

#include <array>
#include <bit>
#include <cmath>
#include <memory>
#include <new>

#include "hpsdf/error.h"
#include "mesh/message_prefix.h"

namespace hpsdf {
namespace {

/// Streams numbers into XXH3 as little-endian bytes, whatever the machine's own order.
class Hasher {
 public:
  Hasher() : state_(XXH3_createState()) {
    if (!state_) throw std::bad_alloc();
    XXH3_64bits_reset(state_.get());
  }

  void add(std::uint64_t bits) { addBytes(bits, 8); }
  void add(std::uint32_t bits) { addBytes(bits, 4); }
  void add(double x) { add(std::bit_cast<std::uint64_t>(x + 0.0)); }  // + 0.0 turns -0.0 into 0.0

  std::uint64_t digest() {
    flush();
    return XXH3_64bits_digest(state_.get());
  }

 private:
  struct Free {
    void operator()(XXH3_state_t* state) const { XXH3_freeState(state); }
  };

  void addBytes(std::uint64_t bits, std::size_t count) {
    if (filled_ + count > buffer_.size()) flush();
    for (std::size_t i = 0; i < count; ++i) buffer_[filled_ + i] = static_cast<unsigned char>(bits >> (8 * i));
    filled_ += count;
  }

  void flush() {
    XXH3_64bits_update(state_.get(), buffer_.data(), filled_);
    filled_ = 0;
  }

  std::unique_ptr<XXH3_state_t, Free> state_;
  std::array<unsigned char, 4096> buffer_;  ///< to come: a call for each number would take longer than the hash
  std::size_t filled_ = 0;
};

/// Throws `Error`, its message after `prefix`, for a surface without finite extent.
double longestSide(const Box& surface, const std::string& prefix) {
  const double longest = surface.isEmpty() ? 0 : surface.sizes().maxCoeff();
  if (!(longest > 0) || !std::isfinite(longest))
    throw Error(prefix + "the surface cannot be normalized, for it has no finite extent; check its vertices");
  return longest;
}

}  // namespace

void requireValidIndices(const TriangleMesh& mesh) {
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f)
    for (const std::uint32_t v : mesh.triangles[f])
      if (v >= mesh.vertices.size())
        throw Error(messagePrefix(mesh.name) + "face " + std::to_string(f + 1) + " refers to vertex " +
                    std::to_string(std::uint64_t{v} + 1) + ", but there are only " +
                    std::to_string(mesh.vertices.size()) + "; repair or export the mesh again");
}

Box boundingBox(const TriangleMesh& mesh) {
  using Range = tbb::blocked_range<std::size_t>;
  return tbb::parallel_reduce(
      Range(0, mesh.triangles.size(), 10'000), Box(),
      [&](const Range& range, Box box) {
        for (std::size_t t = range.begin(); t < range.end(); ++t)
          for (const std::uint32_t v : mesh.triangles[t]) box.extend(mesh.vertices[v]);
        return box;
      },
      [](const Box& a, const Box& b) { return a.merged(b); });
}

double signedVolume(const TriangleMesh& mesh) {
  const Box box = boundingBox(mesh);
  if (box.isEmpty()) return 0;
  // Of tetrahedra between each face and one apex. For a closed mesh any apex will do; the box's centre keeps the terms
  // small, so that a mesh far from the origin loses no digits.
  const Vector3 apex = box.center();
  double six = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vector3 pa = mesh.vertices[a] - apex;
    const Vector3 pb = mesh.vertices[b] - apex;
    const Vector3 pc = mesh.vertices[c] - apex;
    six += pa.dot(pb.cross(pc));
  }
  return six / 6;
}

double surfaceArea(const TriangleMesh& mesh) {
  double twice = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vector3& origin = mesh.vertices[a];
    twice += (mesh.vertices[b] - origin).cross(mesh.vertices[c] - origin).norm();
  }
  return twice / 2;
}

std::uint64_t fingerprint(const TriangleMesh& mesh) {
  Hasher hasher;
  hasher.add(std::uint64_t{mesh.vertices.size()});
  hasher.add(std::uint64_t{mesh.triangles.size()});
  for (const Vector3& v : mesh.vertices)
    for (const double x : v) hasher.add(x);
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t v : triangle) hasher.add(v);
  return hasher.digest();
}

Normalization normalizing(const Box& surface) { return {surface.center(), 2 / longestSide(surface, "")}; }

TriangleMesh normalized(const TriangleMesh& mesh) {
  requireValidIndices(mesh);
  const Box box = boundingBox(mesh);
  const double longest = longestSide(box, messagePrefix(mesh.name));
  TriangleMesh result = mesh;
  // (x - min) - (max - x) is 2(x - centre) without rounding the centre: on the longest side it is -longest at min and
  // longest at max in floating point too, and it never decreases with x, so that nothing leaves [-1, 1].
  for (Vector3& v : result.vertices) v = ((v - box.min()) - (box.max() - v)) / longest;
  return result;
}

}  // namespace hpsdf
