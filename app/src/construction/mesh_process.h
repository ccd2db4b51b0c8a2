#pragma once
// Mesh files are read by a process of their own, this program once more: what brings assimp down, or keeps it busy, is
// an error of one line here.

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "hpsdf/error.h"
#include "hpsdf/mesh_file.h"

namespace hpsdf::app {

/// What the reading of a file may take.
struct ReadingLimits {
  double seconds = 0;       ///< by the clock on the wall
  std::uint64_t bytes = 0;  ///< of memory
};

/// By the file's size (docs/meshes.md), or what HPSDF_IMPORT_SECONDS and HPSDF_IMPORT_BYTES ask for. Throws `Error` for
/// values of these that are none.
ReadingLimits readingLimits(const std::filesystem::path& file);

/// What to run for this program itself; empty where the system does not tell.
std::filesystem::path ownProgram();

/// `importMesh` in a process of its own, which `program` (of this same build) is started as. Throws `Error` naming the
/// file, also when that process dies, answers nonsense or passes a limit, and `Cancelled`. No process is left behind.
ImportedMesh importInSubprocess(const std::filesystem::path& program, const std::filesystem::path& file,
                                const ReadingLimits& limits, const Progress& progress);

/// Whether these words, the program's, ask for the other end of `importInSubprocess`.
bool asksForReading(std::span<const std::string> words);

/// The other end: reads the mesh file that the words name, within their limits, and answers on standard output
/// (mesh_reply.h). The exit status.
int readForOtherProcess(std::span<const std::string> words);

}  // namespace hpsdf::app
