#pragma once
// The reply of the process that reads a mesh file, as bytes; docs/meshes.md explains why it is a separate process.
// The reader of a reply trusts none of its bytes, since the file may have corrupted the process that wrote them.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>

#include "hpsdf/error.h"
#include "hpsdf/mesh_file.h"

namespace hpsdf::app {

struct MeshReply {
  enum class Kind : std::uint64_t { mesh, refusal, outOfMemory };
  Kind kind = Kind::mesh;
  ImportedMesh imported;  ///< for `mesh`: the mesh, without a name
  std::string refusal;    ///< for `refusal`: the reason in one line
};

/// Thrown for bytes that are no reply. The message tells why.
class DamagedReply : public Error {
 public:
  using Error::Error;
};

/// Length of the header with which every reply begins.
extern const std::size_t kReplyHeaderBytes;

/// The length of the whole reply, read from at least the first `kReplyHeaderBytes` bytes of it. Throws
/// `DamagedReply` for fewer bytes, and for bytes that are not a header.
std::uint64_t replyBytes(std::span<const std::byte> beginning);

/// Parses a whole reply. It allocates memory only for elements that are there, and checks a mesh's indices,
/// coordinates, box and checksum. Throws `DamagedReply`.
MeshReply parseReply(std::span<const std::byte> bytes);

/// Receives the bytes of a reply in pieces.
using ReplySink = std::function<void(std::span<const std::byte>)>;

/// Write a reply. They allocate no memory, so that they work when none is left.
void writeMesh(const ImportedMesh& imported, const ReplySink& sink);
void writeRefusal(std::string_view reason, const ReplySink& sink);  ///< a very long reason is cut off
void writeOutOfMemory(const ReplySink& sink);

}  // namespace hpsdf::app
