#include "commands/commands.h"

#include "check/check_command.h"
#include "commands/export_command.h"
#include "commands/field_commands.h"
#include "commands/jumps_command.h"
#include "commands/probe_command.h"
#include "commands/tool_commands.h"
#include "commands/verify_command.h"
#include "explorer/explorer_commands.h"
#include "language/help.h"
#include "pictures/picture_commands.h"
#include "simulate/simulate_command.h"
#include "study/study_command.h"
#include "window/window.h"

namespace hpsdf::app {
namespace {

constexpr std::string_view kAsked = "What you ask for", kResult = "What you get", kSurface = "The surface",
                           kConstruction = "How it is built", kPaper = "The paper's settings", kFiles = "Files",
                           kCamera = "Camera", kColours = "Colours", kDrawn = "What is drawn", kPicture = "Picture";
constexpr Audience kAdvanced = Audience::advanced;

/// Groups, audiences and second spellings of options that occur in several commands. A parameter that names its group
/// in its own table keeps that group.
constexpr ParameterPresentation kPresentation[] = {
    // The construction asks for one of these.
    {"target-error", kAsked},
    {"near-error", kAsked},
    {"far-error", kAsked},
    {"near-distance", kAsked, kAdvanced},
    {"max-error", kAsked},
    {"max-bytes", kAsked},
    {"max-steps", kAsked, kAdvanced},
    // The result has these properties.
    {"domain", kResult},
    {"margin", kResult},
    {"band", kResult, kAdvanced},
    {"normalize", kResult},
    {"coefficients", kResult, kAdvanced},
    {"continuity", kResult},
    {"continuity-weight", kResult, kAdvanced},
    {"blend-width", kResult, kAdvanced},
    {"bounds", kResult},
    // The inside of the mesh is decided by these.
    {"sign", kSurface},
    {"thickness", kSurface, kAdvanced},
    {"hull", kSurface, Audience::common, "outer-hull"},
    // The algorithm has these settings.
    {"grid", kConstruction},
    {"criterion", kConstruction},
    {"nearness", kConstruction, kAdvanced},
    {"nearness-kind", kConstruction, kAdvanced},
    {"estimator", kConstruction, kAdvanced},
    {"strategy", kConstruction, kAdvanced},
    {"max-degree", kConstruction, kAdvanced},
    {"max-depth", kConstruction, kAdvanced},
    {"quadrature", kConstruction, kAdvanced},
    {"cubature", kConstruction, kAdvanced},
    {"enrich", kConstruction, kAdvanced},
    {"memory-limit", kConstruction, kAdvanced},
    {"paper", kPaper},
    {"checkpoint", kFiles},
    {"checkpoint-seconds", kFiles, kAdvanced},
    // Pictures have these.
    {"camera", kCamera},
    {"view", kCamera},
    {"target", kCamera},
    {"up", kCamera, kAdvanced},
    {"projection", kCamera, kAdvanced},
    {"color", kColours},
    {"range", kColours},
    {"scale", kColours, kAdvanced},
    {"levels", kColours, kAdvanced},
    {"clip", kDrawn},
    {"clip-offset", kDrawn},
    {"cracks", kDrawn, kAdvanced},
    {"defects", kDrawn, kAdvanced},
    {"surface", kDrawn, kAdvanced},
    {"plane-offset", kDrawn, kAdvanced},
    {"cells", kDrawn},
    {"degrees", kDrawn, kAdvanced},
    {"depths", kDrawn, kAdvanced},
    {"arrows", kDrawn, kAdvanced},
    {"size", kPicture},
    {"samples", kPicture},
    {"cpu", kPicture},
    {"gl", kPicture, kAdvanced},
    // Most commands have these.
    {"seed", kGeneralGroup, kAdvanced},
    {"threads", kGeneralGroup},
    {"json", kGeneralGroup},
};

}  // namespace

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
  registry.present(kPresentation);
  return registry;
}

}  // namespace hpsdf::app
