#include "construction/mesh_reply.h"

#include <xxhash.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <iterator>
#include <type_traits>

#include "text/text.h"

namespace hpsdf::app {
namespace {

constexpr std::array<char, 8> kMagic = {'h', 'p', 's', 'd', 'f', 'm', 's', 'h'};
constexpr std::uint64_t kMostVertices = std::uint64_t{1} << 32;  // indices have 32 bits
constexpr std::uint64_t kMostTriangles = std::uint64_t{1} << 40;
constexpr std::uint64_t kLongestText = 1 << 16;

using Triangle = std::array<std::uint32_t, 3>;
static_assert(sizeof(Vector3) == 3 * sizeof(double) && sizeof(Triangle) == 12, "arrays are sent as they lie in memory");

/// The counts in a `MeshReport` that cannot be recomputed from the received mesh and are therefore sent with it.
constexpr std::size_t MeshReport::*kCounts[] = {&MeshReport::components,           &MeshReport::boundaryEdges,
                                                &MeshReport::nonManifoldEdges,     &MeshReport::inconsistentEdges,
                                                &MeshReport::unbalancedEdges,      &MeshReport::weldedVertices,
                                                &MeshReport::unreferencedVertices, &MeshReport::degenerateFaces,
                                                &MeshReport::flippedFaces,         &MeshReport::duplicateFaces};

/// The header of a reply, with which a separate process returns the contents of a mesh file. Vertices, triangles and
/// text follow the header. The header needs neither a version nor a byte order, since the same program on the same
/// machine writes and reads it.
struct Header {
  std::array<char, 8> magic = kMagic;
  std::uint64_t checksum = 0;  ///< checksum of all bytes that follow this member
  std::uint64_t kind = 0;
  std::uint64_t vertices = 0;
  std::uint64_t triangles = 0;
  std::uint64_t textBytes = 0;
  // The following members are copies of members of the `MeshReport`.
  std::array<std::uint64_t, std::size(kCounts)> counts = {};
  std::array<double, 3> degeneratePosition = {};
  std::array<double, 3> duplicatePosition = {};
  std::uint64_t reversed = 0;
  double volume = 0;
  double area = 0;
};
static_assert(std::is_trivially_copyable_v<Header> && sizeof(Header) == 25 * 8, "padding would be sent uninitialised");
static_assert(sizeof(MeshReport) == 27 * 8, "a new member of the report must be sent too");

constexpr std::size_t kUnsummedBytes = offsetof(Header, kind);

std::uint64_t checksumOf(std::uint64_t before, std::span<const std::byte> bytes) {
  return XXH3_64bits_withSeed(bytes.data(), bytes.size(), before);
}

/// Computes the checksum of a reply from its parts one by one, so that the parts need not be copied into one
/// array.
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

MeshReport reportOf(const Header& header) {
  MeshReport report{.vertices = header.vertices,
                    .faces = header.triangles,
                    .degeneratePosition = Vector3(header.degeneratePosition.data()),
                    .duplicatePosition = Vector3(header.duplicatePosition.data()),
                    .reversed = header.reversed == 1,
                    .volume = header.volume,
                    .area = header.area,
                    .box = {}};
  for (std::size_t n = 0; n < header.counts.size(); ++n) report.*kCounts[n] = header.counts[n];
  if (header.reversed > 1) throw DamagedReply("a flag is neither 0 nor 1");
  if (!std::isfinite(report.volume) || !std::isfinite(report.area) || !report.degeneratePosition.allFinite() ||
      !report.duplicatePosition.allFinite())
    throw DamagedReply("a figure is not finite");
  return report;
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
  for (std::size_t n = 0; n < header.counts.size(); ++n) header.counts[n] = report.*kCounts[n];
  Vector3::Map(header.degeneratePosition.data()) = report.degeneratePosition;
  Vector3::Map(header.duplicatePosition.data()) = report.duplicatePosition;
  header.reversed = report.reversed;
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
