#include "construction/mesh_reply.h"

#include <xxhash.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>

#include "text/printable.h"

namespace hpsdf::app {
namespace {

constexpr std::array<char, 8> kMagic = {'h', 'p', 's', 'd', 'f', 'm', 's', 'h'};
constexpr std::uint64_t kMostVertices = std::uint64_t{1} << 32;  // indices have 32 bits
constexpr std::uint64_t kMostTriangles = std::uint64_t{1} << 40;
constexpr std::uint64_t kLongestText = 1 << 16;

using Triangle = std::array<std::uint32_t, 3>;
static_assert(sizeof(Vector3) == 3 * sizeof(double) && sizeof(Triangle) == 12, "arrays are sent as they lie in memory");

/// The beginning of a reply; vertices, triangles and text follow. It needs neither a version nor a byte order, since
/// one program on one machine writes and reads it.
struct Header {
  std::array<char, 8> magic = kMagic;
  std::uint64_t checksum = 0;  ///< of all bytes after it
  std::uint64_t kind = 0;
  std::uint64_t vertices = 0;
  std::uint64_t triangles = 0;
  std::uint64_t textBytes = 0;
  // The following members of the report cannot be derived from the mesh.
  std::uint64_t parts = 0;
  std::uint64_t boundaryEdges = 0;
  std::uint64_t nonManifoldEdges = 0;
  std::uint64_t inconsistentEdges = 0;
  std::uint64_t unbalancedEdges = 0;
  std::uint64_t weldedVertices = 0;
  std::uint64_t unreferencedVertices = 0;
  std::uint64_t degenerateFaces = 0;
  std::uint64_t flippedFaces = 0;
  std::uint64_t duplicateFaces = 0;
  std::array<double, 3> degeneratePosition = {};
  std::array<double, 3> duplicatePosition = {};
  std::uint64_t turned = 0;
  double volume = 0;
  double area = 0;
};
static_assert(std::is_trivially_copyable_v<Header> && sizeof(Header) == 25 * 8, "padding would be sent uninitialised");
static_assert(sizeof(MeshReport) == 27 * 8, "a new member of the report must be sent too");

constexpr std::size_t kUnsummedBytes = offsetof(Header, kind);

std::uint64_t checksumOf(std::uint64_t before, std::span<const std::byte> bytes) {
  return XXH3_64bits_withSeed(bytes.data(), bytes.size(), before);
}

/// Sums up piece by piece, so that the pieces need not be copied into one array.
std::uint64_t checksumOf(const Header& header, std::span<const std::byte> vertices,
                         std::span<const std::byte> triangles, std::span<const std::byte> text) {
  std::uint64_t sum = checksumOf(0, std::as_bytes(std::span(&header, 1)).subspan(kUnsummedBytes));
  for (const auto bytes : {vertices, triangles, text}) sum = checksumOf(sum, bytes);
  return sum;
}

void write(Header header, std::span<const std::byte> vertices, std::span<const std::byte> triangles,
           std::span<const std::byte> text, const ReplySink& sink) {
  header.checksum = checksumOf(header, vertices, triangles, text);
  sink(std::as_bytes(std::span(&header, 1)));
  for (const auto bytes : {vertices, triangles, text})
    if (!bytes.empty()) sink(bytes);
}

Header headerOf(std::span<const std::byte> bytes) {
  Header header;
  if (bytes.size() < sizeof header) throw DamagedReply("it ends too early");
  std::memcpy(&header, bytes.data(), sizeof header);
  if (header.magic != kMagic) throw DamagedReply("it does not begin like one");
  const bool isMesh = header.kind == std::uint64_t(MeshReply::Kind::mesh);
  const bool mayHaveText = header.kind == std::uint64_t(MeshReply::Kind::refusal);
  if (header.kind > std::uint64_t(MeshReply::Kind::outOfMemory)) throw DamagedReply("its kind is unknown");
  if (header.vertices > kMostVertices || header.triangles > kMostTriangles || header.textBytes > kLongestText)
    throw DamagedReply("its counts are too large");
  if (isMesh != (header.triangles > 0) || (!isMesh && header.vertices > 0) || (!mayHaveText && header.textBytes > 0))
    throw DamagedReply("its counts do not fit its kind");
  return header;
}

Vector3 vectorOf(const std::array<double, 3>& numbers) { return {numbers[0], numbers[1], numbers[2]}; }
std::array<double, 3> numbersOf(const Vector3& v) { return {v.x(), v.y(), v.z()}; }

MeshReport reportOf(const Header& header) {
  if (header.turned > 1) throw DamagedReply("a flag is neither 0 nor 1");
  if (!std::isfinite(header.volume) || !std::isfinite(header.area) ||
      !vectorOf(header.degeneratePosition).allFinite() || !vectorOf(header.duplicatePosition).allFinite())
    throw DamagedReply("a figure is not finite");
  return {.vertices = header.vertices,
          .faces = header.triangles,
          .components = header.parts,
          .boundaryEdges = header.boundaryEdges,
          .nonManifoldEdges = header.nonManifoldEdges,
          .inconsistentEdges = header.inconsistentEdges,
          .unbalancedEdges = header.unbalancedEdges,
          .weldedVertices = header.weldedVertices,
          .unreferencedVertices = header.unreferencedVertices,
          .degenerateFaces = header.degenerateFaces,
          .flippedFaces = header.flippedFaces,
          .duplicateFaces = header.duplicateFaces,
          .degeneratePosition = vectorOf(header.degeneratePosition),
          .duplicatePosition = vectorOf(header.duplicatePosition),
          .reversed = header.turned == 1,
          .volume = header.volume,
          .area = header.area,
          .box = {}};
}

template <typename T>
std::vector<T> arrayOf(std::span<const std::byte> bytes) {
  std::vector<T> values(bytes.size() / sizeof(T));
  std::ranges::copy(bytes, std::as_writable_bytes(std::span(values)).begin());
  return values;
}

bool isInRange(const Vector3& v) { return (v.cwiseAbs().array() <= kLargestCoordinate).all(); }

TriangleMesh meshOf(std::span<const std::byte> vertices, std::span<const std::byte> triangles) {
  TriangleMesh mesh;
  mesh.vertices = arrayOf<Vector3>(vertices);
  mesh.triangles = arrayOf<Triangle>(triangles);
  if (!std::ranges::all_of(mesh.vertices, isInRange)) throw DamagedReply("a coordinate is not finite, or too large");
  for (const Triangle& triangle : mesh.triangles)
    if (std::ranges::max(triangle) >= mesh.vertices.size()) throw DamagedReply("an index is out of range");
  return mesh;
}

}  // namespace

const std::size_t kReplyHeaderBytes = sizeof(Header);

std::uint64_t replyBytes(std::span<const std::byte> beginning) {
  const Header header = headerOf(beginning);
  return sizeof header + header.vertices * sizeof(Vector3) + header.triangles * sizeof(Triangle) + header.textBytes;
}

MeshReply parseReply(std::span<const std::byte> bytes) {
  const std::uint64_t expected = replyBytes(bytes);
  if (bytes.size() != expected)
    throw DamagedReply(bytes.size() < expected ? "it ends too early" : "it goes on too long");
  const Header header = headerOf(bytes);
  const auto vertices = bytes.subspan(sizeof header, header.vertices * sizeof(Vector3));
  const auto triangles = bytes.subspan(sizeof header + vertices.size(), header.triangles * sizeof(Triangle));
  const auto text = bytes.last(header.textBytes);
  if (header.checksum != checksumOf(header, vertices, triangles, text)) throw DamagedReply("its checksum is wrong");
  MeshReply reply;
  reply.kind = MeshReply::Kind(header.kind);
  reply.refusal = printable({reinterpret_cast<const char*>(text.data()), text.size()});
  if (reply.kind != MeshReply::Kind::mesh) return reply;
  reply.imported.report = reportOf(header);
  reply.imported.mesh = meshOf(vertices, triangles);
  reply.imported.report.box = boundingBox(reply.imported.mesh);
  return reply;
}

void writeMesh(const ImportedMesh& imported, const ReplySink& sink) {
  const auto& [mesh, report] = imported;
  Header header;
  header.kind = std::uint64_t(MeshReply::Kind::mesh);
  header.vertices = mesh.vertices.size();
  header.triangles = mesh.triangles.size();
  header.parts = report.components;
  header.boundaryEdges = report.boundaryEdges;
  header.nonManifoldEdges = report.nonManifoldEdges;
  header.inconsistentEdges = report.inconsistentEdges;
  header.unbalancedEdges = report.unbalancedEdges;
  header.weldedVertices = report.weldedVertices;
  header.unreferencedVertices = report.unreferencedVertices;
  header.degenerateFaces = report.degenerateFaces;
  header.flippedFaces = report.flippedFaces;
  header.duplicateFaces = report.duplicateFaces;
  header.degeneratePosition = numbersOf(report.degeneratePosition);
  header.duplicatePosition = numbersOf(report.duplicatePosition);
  header.turned = report.reversed;
  header.volume = report.volume;
  header.area = report.area;
  write(header, std::as_bytes(std::span(mesh.vertices)), std::as_bytes(std::span(mesh.triangles)), {}, sink);
}

void writeRefusal(std::string_view reason, const ReplySink& sink) {
  reason = reason.substr(0, kLongestText);
  Header header;
  header.kind = std::uint64_t(MeshReply::Kind::refusal);
  header.textBytes = reason.size();
  write(header, {}, {}, std::as_bytes(std::span(reason)), sink);
}

void writeOutOfMemory(const ReplySink& sink) {
  Header header;
  header.kind = std::uint64_t(MeshReply::Kind::outOfMemory);
  write(header, {}, {}, {}, sink);
}

}  // namespace hpsdf::app
