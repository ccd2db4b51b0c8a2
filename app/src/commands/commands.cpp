#include "commands/commands.h"

#include "version.h"

namespace hpsdf::app {

Registry makeRegistry() {
  Registry registry;
  addFieldCommands(registry);
  addJumpsCommand(registry);
  addVerifyCommand(registry);
  addPictureCommands(registry);
  addMotionCommands(registry);
  addFigureCommands(registry);
  addProbeCommand(registry);
  addExportCommand(registry);
  addViewCommands(registry);
  addUiCommand(registry);
  addViewCommand(registry);
  addReportCommand(registry);
  addStudyCommand(registry);
  addSimulateCommand(registry);
  addCheckCommands(registry);
  addToolCommands(registry);
  return registry;
}

std::string versionText() { return "hpsdf " HPSDF_VERSION; }

}  // namespace hpsdf::app
