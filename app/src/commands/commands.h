#pragma once

#include "language/registry.h"

namespace hpsdf::app {

/// Returns the registry of all commands of the program.
Registry makeRegistry();

// Each of the following functions adds the commands that are defined in the source file of the same name.
void addCombineCommand(Registry& registry);
void addContourCommand(Registry& registry);
void addFieldCommands(Registry& registry);  ///< build, smooth, blend, bounds, info, load and save; query too
void addJumpsCommand(Registry& registry);
void addProbeCommand(Registry& registry);
void addQueryCommand(Registry& registry);
void addRebuildCommand(Registry& registry);
void addSampleCommand(Registry& registry);
void addToolCommands(Registry& registry);  ///< run, shapes, doctor, set, include, help and docs
void addVerifyCommand(Registry& registry);
void addWhyCommand(Registry& registry);

/// Adds the command `mesh`. The registry must already hold `render`, because `mesh` takes over its camera parameters.
void addMeshCommand(Registry& registry);

}  // namespace hpsdf::app
