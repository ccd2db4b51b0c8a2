#pragma once
// Converts the reply of the process that reads a mesh file to bytes and back. docs/meshes.md explains why a separate
// process reads the file. The code that parses a reply trusts none of its bytes, since the mesh file may have
// corrupted the process that wrote them.

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
  ImportedMesh imported;  ///< if `kind` is `mesh`: the mesh, without a name
  std::string refusal;    ///< if `kind` is `refusal`: the reason in one line
};

/// Thrown for bytes that are not a valid reply. The message gives the reason.
class DamagedReply : public Error {
 public:
  using Error::Error;
};

/// Length of the reply header in bytes. Every reply begins with this header.
extern const std::size_t kReplyHeaderBytes;

/// Returns the length in bytes of a whole reply, which the reply's header states. `beginning` holds at least the first
/// `kReplyHeaderBytes` bytes of the reply. Throws `DamagedReply` if there are fewer bytes or if they are not a header.
std::uint64_t replyBytes(std::span<const std::byte> beginning);

/// Parses a whole reply. Memory is allocated only for elements that are present in `bytes`. The indices, coordinates,
/// box and checksum of a mesh are checked. Throws `DamagedReply` if a check fails.
MeshReply parseReply(std::span<const std::byte> bytes);

/// A function that receives the bytes of a reply in pieces.
using ReplySink = std::function<void(std::span<const std::byte>)>;

/// Writes a mesh as a reply. `writeMesh`, `writeRefusal` and `writeOutOfMemory` allocate no memory, so that they work
/// even when none is left.
void writeMesh(const ImportedMesh& imported, const ReplySink& sink);
void writeRefusal(std::string_view reason, const ReplySink& sink);  ///< a very long reason is cut off
void writeOutOfMemory(const ReplySink& sink);

}  // namespace hpsdf::app
