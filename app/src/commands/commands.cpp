#include "commands/commands.h"

#include "batch/index_command.h"
#include "check/check_command.h"
#include "compare/compare_command.h"
#include "explorer/explorer_commands.h"
#include "export/export_command.h"
#include "language/help.h"
#include "pictures/picture_commands.h"
#include "simulate/simulate_command.h"
#include "study/study_command.h"
#include "window/window.h"

namespace hpsdf::app {
Registry makeRegistry() {
  Registry registry;
  addFieldCommands(registry);
  addRebuildCommand(registry);
  addCombineCommand(registry);
  addJumpsCommand(registry);
  addVerifyCommand(registry);
  addPictureCommands(registry);
  addCompareCommand(registry);
  addMotionCommands(registry);
  addFigureCommands(registry);
  addProbeCommand(registry);
  addWhyCommand(registry);
  addContourCommand(registry);
  addExportCommand(registry);
  addSampleCommand(registry);
  addExplorerCommands(registry);
  addUiCommand(registry);
  addWindowCommand(registry);
  addReportCommand(registry);
  addPageCommand(registry);
  addIndexCommand(registry);
  addStudyCommand(registry);
  addSimulateCommand(registry);
  addCheckCommands(registry);
  addToolCommands(registry);
  return registry;
}

}  // namespace hpsdf::app
