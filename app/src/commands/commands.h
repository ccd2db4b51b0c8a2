#pragma once

#include "language/registry.h"

namespace hpsdf::app {

/// All commands of the program.
Registry makeRegistry();

void addFieldCommands(Registry& registry);  ///< build, smooth, load, save, info, query
void addJumpsCommand(Registry& registry);
void addVerifyCommand(Registry& registry);
void addPictureCommands(Registry& registry);  ///< slice, render
void addMotionCommands(Registry& registry);   ///< turntable, frames: after those above, whose parameters they share
void addFigureCommands(Registry& registry);   ///< pick, expect
void addProbeCommand(Registry& registry);
void addExportCommand(Registry& registry);
void addReportCommand(Registry& registry);
void addStudyCommand(Registry& registry);
void addSimulateCommand(Registry& registry);
void addViewCommands(Registry& registry);  ///< what the explorer shows: show, camera, plane, color, panel, …
void addUiCommand(Registry& registry);
void addViewCommand(Registry& registry);    ///< the window
void addCheckCommands(Registry& registry);  ///< check, accept
void addToolCommands(Registry& registry);   ///< run, set, include, mesh, shapes, doctor, help, docs

/// The parameter `field` of commands that look at a field, and what they do with it: load it, or keep the current one.
Parameter fieldParameter();
void useField(Session& session, const Arguments& arguments);
void loadField(Session& session, const std::string& file);

/// --cpu and --gl.
std::vector<Parameter> backendParameters();

}  // namespace hpsdf::app
