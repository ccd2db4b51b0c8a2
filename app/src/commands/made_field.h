#pragma once
// Commands that make a field share the file it is written to, its construction and the report on it.

#include <filesystem>
#include <functional>
#include <string>

#include "construction/build_field.h"
#include "language/registry.h"
#include "session/session.h"
#include "text/json.h"

namespace hpsdf::app {

/// Returns the parameter for the file of the resulting field.
Parameter fieldOutputParameter();

/// Returns the parameter that asks for a compressed file.
Parameter compressParameter();

/// Throws `Error` if the arguments for the output contradict each other or the file cannot be written.
void checkFieldOutput(const Arguments& arguments);

/// Throws `Error` if the arguments for checkpoints contradict each other.
void checkCheckpoint(const Arguments& arguments);

/// Saves the current field to the output file, which must be given.
void saveCurrent(Session& session, const Arguments& arguments);

/// Saves the current field if an output file is given.
void saveMade(Session& session, const Arguments& arguments);

/// Returns facts about the current field, and the file to which it was saved, as JSON.
Json madeJson(const Session& session, const Arguments& arguments);

/// The source of a construction.
struct BuildSource {
  std::string name;          ///< for messages, and for the field if there is no output file
  std::string surface = {};  ///< the mesh file or shape; empty if the field is made from anything else
};

/// Calls build(checkpoint) and makes its field the current one. Saves and reports it. `checkpoint` is the file in which
/// the construction saves its state, or empty. Throws `Failed` if the field misses an error that was asked for.
void buildAndReport(Session& session, const Arguments& arguments, const BuildSource& from,
                    const std::function<BuiltField(const std::filesystem::path& checkpoint)>& build);

}  // namespace hpsdf::app
