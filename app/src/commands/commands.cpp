#include "commands/commands.h"

#include "check/check_command.h"
#include "explorer/explorer_commands.h"
#include "explorer/ui_command.h"
#include "pictures/figure_commands.h"
#include "pictures/motion_commands.h"
#include "pictures/picture_commands.h"
#include "pictures/report_command.h"
#include "simulate/simulate_command.h"
#include "study/study_command.h"
#include "window/window_command.h"

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
  addExplorerCommands(registry);
  addUiCommand(registry);
  addWindowCommand(registry);
  addReportCommand(registry);
  addStudyCommand(registry);
  addSimulateCommand(registry);
  addCheckCommands(registry);
  addToolCommands(registry);
  return registry;
}

}  // namespace hpsdf::app
