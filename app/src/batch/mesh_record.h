#pragma once
// The record that a batch keeps of each mesh: what became of it, and of what its field was made.

#include <filesystem>
#include <string>

#include "console/console.h"
#include "language/registry.h"
#include "text/json.h"

namespace hpsdf::app {

// Keys of a record besides those of the line that a batch prints for the mesh (docs/batch.md).
constexpr const char* kMadeFrom = "made_from";  ///< of what the field was made
constexpr const char* kThen = "then";           ///< the commands of the script that was run for the field

// The words for the status of a mesh. A record has one of the first three; the line that a batch prints has kBuilt,
// kSkipped or kFailed; the index of a folder has all of those of records, and kMissing.
constexpr const char* kBegun = "begun";      ///< a process is at work on the mesh, or has died at it
constexpr const char* kBuilt = "built";      ///< the field and what the script writes are there
constexpr const char* kFailed = "failed";    ///< an error that the record tells
constexpr const char* kSkipped = "skipped";  ///< all was there already
constexpr const char* kMissing = "missing";  ///< there is no record, or no field

/// Returns the record in `file`. Returns null if there is none that can be read. A record that is cut off has the
/// status `kBegun`: a process died while it wrote it.
Json readRecord(const std::filesystem::path& file);

/// Writes a record with the status `kBegun` for a mesh and its field's file. The record is written at its place, not
/// under another name first, so that a process which dies meanwhile leaves nothing that the record does not tell of.
/// Throws `Error` if it cannot be written.
void writeBegun(const std::filesystem::path& file, const std::string& surface, const std::filesystem::path& output,
                const Json& madeFrom);

/// Returns the text with the key `status` of a record, or "" for null.
std::string statusOf(const Json& record);

/// Returns a text that identifies the contents of a mesh file: a hash of the file's bytes. For glTF, whose files may
/// refer to other files, the imported mesh is hashed instead. Returns "" if the file cannot be read.
std::string contentOf(const Console& console, const std::string& surface);

/// Returns of what a field is made: the version of the program, the contents of its mesh (from `contentOf`), the
/// options of the construction, and the checksum of the field's file. Equal values mean that the same field would come
/// out.
Json madeFrom(const std::string& surface, const std::string& content, const Arguments& arguments,
              const std::filesystem::path& field);

}  // namespace hpsdf::app
