#pragma once
// What the process that reads a mesh file answers, as bytes (docs/meshes.md says why it is one of its own). Whoever
// reads them trusts none: the file may have had its way with that process.

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
  ImportedMesh imported;  ///< of `mesh`; without a name
  std::string refusal;    ///< of `refusal`: why, one line
};

/// Bytes that are no reply. The message says how.
class DamagedReply : public Error {
 public:
  using Error::Error;
};

/// Of every reply, at its beginning.
extern const std::size_t kReplyHeaderBytes;

/// How long the reply is as a whole, by its first `kReplyHeaderBytes` or more. Throws `DamagedReply` when they are
/// fewer, or belong to none.
std::uint64_t replyBytes(std::span<const std::byte> beginning);

/// The reply that is all of `bytes`. Memory is taken only for what is there; a mesh has the indices, the finite
/// coordinates, the box and the checksum that it should. Throws `DamagedReply`.
MeshReply parseReply(std::span<const std::byte> bytes);

/// Takes the bytes of a reply, piece by piece.
using ReplySink = std::function<void(std::span<const std::byte>)>;

/// These take no memory, so that they can tell that there is none.
void writeMesh(const ImportedMesh& imported, const ReplySink& sink);
void writeRefusal(std::string_view reason, const ReplySink& sink);  ///< cut off where it is very long
void writeOutOfMemory(const ReplySink& sink);

}  // namespace hpsdf::app
