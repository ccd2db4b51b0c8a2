#pragma once
// Mesh files that the libraries assimp or Draco take part in reading are read in a separate process, which runs this
// same program with a hidden command. If a file crashes a library, or keeps it busy for too long, the only effect is an
// error message of one line.

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "hpsdf/error.h"
#include "hpsdf/mesh_file.h"

namespace hpsdf::app {

/// The limits of time and memory for reading one mesh file.
struct ReadingLimits {
  double seconds = 0;       ///< wall-clock time
  std::uint64_t bytes = 0;  ///< bytes of memory
};

/// Returns the limits for reading a file. They are computed from the size of the file (docs/meshes.md),
/// unless the environment variables HPSDF_IMPORT_SECONDS and HPSDF_IMPORT_BYTES set other limits. Throws
/// `Error` if one of these variables is not a number above 0.
ReadingLimits readingLimits(const std::filesystem::path& file);

/// Returns the path of the running program's executable file, or an empty path if it cannot be found out.
std::filesystem::path ownProgram();

/// Reads a mesh file in a separate process, as `importMesh` does in this one. The process runs `program`, which must
/// come from the same build as this program. Throws `Error` naming the file if the file cannot be read, or if the
/// process dies, answers with something else than a mesh, or exceeds a limit. Throws `Cancelled` on cancellation. When
/// the function returns or throws, the process has ended.
ImportedMesh importInSubprocess(const std::filesystem::path& program, const std::filesystem::path& file,
                                const ReadingLimits& limits, const Progress& progress);

/// True if the command-line words are the hidden command that reads a mesh file. `importInSubprocess` starts a process
/// with this command.
bool asksForReading(std::span<const std::string> words);

/// Runs in the separate process: reads a mesh file, and writes the mesh to standard output as a PLY file, or the reason
/// why there is none. `words` hold the name of the file and the limits of time and memory. Returns the exit status.
int readForOtherProcess(std::span<const std::string> words);

}  // namespace hpsdf::app
