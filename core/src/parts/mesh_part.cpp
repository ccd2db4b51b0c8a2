#include "parts/mesh_part.h"

#include <array>
#include <bit>
#include <cstring>
#include <span>
#include <vector>

#include "hpsdf/detail/output_file.h"
#include "hpsdf/error.h"
#include "util/checked_file.h"
#include "util/mapped_file.h"

namespace hpsdf::parts {
namespace {

// A part's file holds `Head`, and then the arrays of the part in the order of `forEachMember`, each of them from a
// multiple of kArrayAlignment bytes on. The file belongs to the machine that wrote it: it is read by the same program.
constexpr std::size_t kMembers = 12;

using Head = std::array<std::uint64_t, kMembers>;  ///< the lengths of arrays, and the bits of numbers

template <typename Part, typename Visit>
void forEachMember(Part& part, const Visit& visit) {
  bvh::Hierarchy::forEachMember(part.hierarchy, visit);
  sign::Pseudonormals::forEachMember(part.normals, visit);
  visit(part.faces);
}

std::size_t withPadding(std::size_t bytes) { return bytes + detail::paddingAt(bytes).size(); }

template <typename T>
std::span<const std::byte> contentsOf(const detail::SharedArray<T>& array) {
  return std::as_bytes(std::span<const T>(array));
}

}  // namespace

PartStamp writePart(const MeshPart& part, const std::filesystem::path& file) {
  OutputFile output(file);
  detail::Checksum checksum;
  PartStamp stamp;
  const auto write = [&](std::span<const std::byte> bytes) {
    for (const auto piece : {bytes, detail::paddingAt(bytes.size())}) {
      output.write(piece);
      checksum.add(piece);
      stamp.bytes += piece.size();
    }
  };
  Head head{};
  std::size_t at = 0;
  forEachMember(part, [&](const auto& member) {
    if constexpr (std::is_same_v<decltype(member), const double&>)
      head[at++] = std::bit_cast<std::uint64_t>(member);
    else
      head[at++] = member.size();
  });
  write(std::as_bytes(std::span(head)));
  forEachMember(part, [&](const auto& member) {
    if constexpr (!std::is_same_v<decltype(member), const double&>) write(contentsOf(member));
  });
  output.commit();
  stamp.checksum = checksum.value();
  return stamp;
}

std::shared_ptr<const MeshPart> mapPart(const std::filesystem::path& file, const PartStamp& stamp, bool isTrusted) {
  const auto mapped = std::make_shared<const detail::MappedFile>(file);
  const std::span<const std::byte> bytes = mapped->bytes();
  const auto refuse = [&] {
    throw Error(ErrorKind::file, file.string(),
                "is damaged or another part; remove its folder, and the mesh is divided anew");
  };
  if (bytes.size() != stamp.bytes || bytes.size() < sizeof(Head)) refuse();
  if (!isTrusted) {
    detail::Checksum checksum;
    checksum.add(bytes);
    if (checksum.value() != stamp.checksum) refuse();
  }
  Head head{};
  std::memcpy(head.data(), bytes.data(), sizeof(head));
  std::size_t at = 0, offset = withPadding(sizeof(head));
  auto part = std::make_shared<MeshPart>();
  forEachMember(*part, [&]<typename Member>(Member& member) {
    if constexpr (std::is_same_v<Member, double>) {
      member = std::bit_cast<double>(head[at++]);
    } else {
      using T = std::remove_reference_t<decltype(member[0])>;
      const std::uint64_t count = head[at++];
      if (offset > bytes.size() || count > (bytes.size() - offset) / sizeof(T)) refuse();
      member = Member(mapped, reinterpret_cast<const T*>(bytes.data() + offset), count);
      offset += withPadding(count * sizeof(T));
    }
  });
  return part;
}

}  // namespace hpsdf::parts
