// Writes level sets as files of OpenVDB.
#include <openvdb/io/Archive.h>

#include <cstdint>
#include <cstdio>
#include <string>
#include <string_view>

#include "level_set_grid.h"

namespace hpsdf::vdb {
namespace {

/// Writes grids to a stream in memory, with the offsets by which a reader finds each of them. Those of OpenVDB's
/// classes that write offsets write files only, of which a part would be left where the disk is full.
class MemoryArchive : public openvdb::io::Archive {
 public:
  std::string bytesOf(const openvdb::GridBase::ConstPtr& grid) const {
    std::ostringstream stream(std::ios::binary);
    const bool isSeekable = true;
    Archive::write(stream, openvdb::GridCPtrVec{grid}, isSeekable);
    return std::move(stream).str();
  }
};

/// Returns the 64-bit FNV-1a hash of bytes, from another start for each `seed`.
std::uint64_t hashOf(std::string_view bytes, std::uint64_t seed) {
  std::uint64_t hash = 0xcbf29ce484222325 ^ seed;
  for (const char c : bytes) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3;
  return hash;
}

/// Replaces the random identifier in a file's header by one that depends on the grid alone, so that equal grids give
/// equal files. The identifier follows the magic number (8 bytes), three version numbers (4 bytes each) and one byte.
void makeReproducible(std::string& file) {
  constexpr std::size_t kIdentifier = 21, kLength = 36;
  const std::string_view rest = std::string_view(file).substr(kIdentifier + kLength);
  const std::uint64_t high = hashOf(rest, 0), low = hashOf(rest, 1);
  std::string text(kLength + 1, '\0');
  std::snprintf(text.data(), text.size(), "%08x-%04x-4%03x-8%03x-%012llx", unsigned(high >> 32),
                unsigned(high >> 16 & 0xffff), unsigned(high >> 4 & 0xfff), unsigned(low >> 48 & 0xfff),
                static_cast<unsigned long long>(low & 0xffffffffffff));
  file.replace(kIdentifier, kLength, text.data(), kLength);
}

}  // namespace

LevelSetFigures writeVdb(const Field& field, const LevelSetOptions& options, OutputFile& out,
                         const Progress& progress) {
  const openvdb::FloatGrid::Ptr grid = makeLevelSet(field, options, progress);
  progress.update("writing", 0);
  std::string bytes = MemoryArchive().bytesOf(grid);
  makeReproducible(bytes);
  out.write(bytes);
  out.flush();
  return figuresOf(*grid);
}

}  // namespace hpsdf::vdb
