#pragma once
// Mesh files are read in a separate process, which runs this program with another command. A file that crashes
// assimp, or keeps it busy for too long, then causes only an error message of one line.

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "hpsdf/error.h"
#include "hpsdf/mesh_file.h"

namespace hpsdf::app {

/// Time and memory that reading a file may take.
struct ReadingLimits {
  double seconds = 0;       ///< wall-clock time
  std::uint64_t bytes = 0;  ///< bytes of memory
};

/// The limits for a file. They follow from its size (docs/meshes.md), unless the environment variables
/// HPSDF_IMPORT_SECONDS and HPSDF_IMPORT_BYTES set others. Throws `Error` where a variable is not a number above
/// 0.
ReadingLimits readingLimits(const std::filesystem::path& file);

/// The file of the running program; empty where the system does not tell it.
std::filesystem::path ownProgram();

/// Calls `importMesh` in a separate process of `program`, which must be of this same build. Throws `Error` naming the
/// file, also when that process dies, sends a damaged reply or exceeds a limit, and `Cancelled`. No process is left
/// behind.
ImportedMesh importInSubprocess(const std::filesystem::path& program, const std::filesystem::path& file,
                                const ReadingLimits& limits, const Progress& progress);

/// Tells whether the words of the command line start the reading process of `importInSubprocess`.
bool asksForReading(std::span<const std::string> words);

/// Runs the reading process: reads the mesh file that the words name, within their limits, and replies on standard
/// output (mesh_reply.h). Returns the exit status.
int readForOtherProcess(std::span<const std::string> words);

}  // namespace hpsdf::app
