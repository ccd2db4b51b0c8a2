#pragma once
// The explorer: a picture of the current field with panels around it. It draws its frame without a window, so that a
// script and a person get the same pixels. Every widget does its work by running a command of the registry.

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "explorer/view_state.h"
#include "pictures/build_preview.h"
#include "pictures/readout.h"
#include "session/session.h"
#include "widgets/file_dialog.h"
#include "widgets/ui.h"

namespace hpsdf::app {

/// The rectangles of the parts of a frame, in pixels. The rectangle of a part is empty if the part is closed
/// or has no room.
struct Layout {
  UiRect bar, left, right, readout;
  UiRect canvas;  ///< picture of the current field
  UiRect beside;  ///< picture of a second field beside the current one
};

/// Computes the layout of a frame, which depends only on the state `view`.
Layout layoutOf(const ViewState& view);

/// Returns the same layout in points, the unit in which the panels are drawn.
Layout layoutInPoints(const ViewState& view);

/// Returns options with which the field can be built again as it was, as far as its metadata tells. For a field that
/// was built within a tolerance and changed afterwards, they have the default target error.
BuildOptions rebuildOptions(const Field& field);

/// Removes the position in a script from the beginning of an error message if the explorer itself has made the script,
/// because the users of a window do not know it.
std::string withoutPosition(std::string message);

class Explorer final : public SessionExtension {
 public:
  explicit Explorer(Session& session);

  const ViewState& view() const { return view_; }
  /// Makes `next` the explorer's state. `undo` returns to the previous state. Undo treats all changes of one
  /// mouse gesture as one change, and never changes the frame size, the renderer or the list of keys. If `next` shows
  /// the triangles of a contour that is not known yet, the contour is made first, unless a mouse gesture lasts;
  /// `Cancelled` is thrown if this is cancelled, and the triangles are hidden if it fails.
  void change(ViewState next);
  /// Runs a line of script whose commands change the state, as one change. If one of them fails, the state is as
  /// before.
  void changeBy(const std::string& line);
  /// Returns to the state before the last change. `undo` and `redo` return false if there is no state to return
  /// to.
  bool undo() { return goBack(undone_, redone_); }
  bool redo() { return goBack(redone_, undone_); }
  bool canUndo() const { return !undone_.empty(); }
  bool canRedo() const { return !redone_.empty(); }

  /// Returns the settings for the next construction of the field: names of `build` parameters and their values as text.
  /// The value of `mesh` is the name of the surface.
  const std::map<std::string, std::string>& settings() const { return settings_; }
  /// Sets a setting for the next `rebuild`, in place of those that exclude it.
  void setSetting(const std::string& name, const std::string& value);
  /// Builds the field again with `settings()`. If `maxSteps` is given, the construction ends after that many
  /// refinement steps. If `keeps` is true, the field before it is kept and shown beside the new one. Throws `Error` if
  /// neither the settings nor the field name a surface.
  void rebuild(std::optional<int> maxSteps, bool keeps);
  /// The number of refinement steps of the complete construction, even if the current field was built with fewer;
  /// std::nullopt if unknown.
  std::optional<std::uint64_t> allSteps() const { return allSteps_; }

  /// Handles one mouse or keyboard event: draws the panels, then runs the commands that the widgets request. The
  /// contour of shown triangles is made once a gesture of the mouse has ended; if this is cancelled, the gesture is
  /// undone. Exceptions of commands are passed on to the caller. While long work runs, an event can only cancel
  /// the work or, if there is no field yet, change the view of what is shown in its stead.
  void input(const Input& event);
  /// Ends all input that a recorded script cannot reproduce: releases the mouse buttons, closes open lists and discards
  /// a text that is being typed. The pointer keeps its position. Ignores errors of commands that run as a result.
  void releaseInput();

  /// Returns the widgets of the present frame by their paths, such as "bar/undo".
  const std::map<std::string, Widget>& widgets();
  const Ui& ui() const { return ui_; }
  void setClipboard(const std::string& text) { ui_.setClipboard(text); }

  /// Draws and returns the whole frame. Redraws the picture in it only if the picture is out of date. `coarseness` lets
  /// drawing keep up with a moving mouse: 0 draws all samples of each pixel, 1 draws one, and a greater number also
  /// divides the picture's resolution along each axis. During long work the last picture is shown again or, if there is
  /// no field yet, what stands for it.
  render::Image frame(int coarseness = 0);
  /// Draws and returns what the canvas shows: the picture or both pictures, with names and marks, but without panels,
  /// tooltips and the axes that take clicks.
  render::Image canvasImage();
  /// True while `canvasImage` draws.
  bool drawsCanvasOnly() const { return drawsCanvasOnly_; }
  /// True if the picture must be redrawn: there is none yet, or the last one was coarse or drawn for another state of
  /// the explorer.
  bool isStale() const;
  /// True if `frame` would draw the picture anew: not in place of an up-to-date picture that is less coarse.
  bool redraws(int coarseness) const;
  /// The coarseness of the last picture.
  int coarseness() const { return coarseness_; }

  /// Runs one line of script, as one step of `undo`. Widgets act by calling this function.
  void run(const std::string& line);
  /// Runs the line of script that loads or builds the first field, without calling `onCommand` for it.
  void open(const std::string& line);
  /// Loads the field's file or builds the field of the surface `name`, and looks at the whole of it: cuts, marks and
  /// the field beside it are taken back. A field that is built is shown as it grows. If it fails or is cancelled, the
  /// explorer is as before.
  void openFile(const std::string& name);
  /// Called after each line of script that `run` has run. `replaces` is true if this line alone has the same
  /// effect as the previous line followed by this line, as during a drag of a slider. A recording may then drop
  /// the previous line.
  std::function<void(const std::string& line, bool replaces)> onCommand;
  /// True while `run` or `open` is running a line of script.
  bool running() const { return running_; }

  void fieldChanged() override;

  /// True while there is no field yet, and while `openFile` makes another one.
  bool isOpening() const { return opening_ || !session_.hasField(); }
  /// While a field is being opened, long work shows this mesh in its stead. `domain` is the domain of the field.
  void showMesh(const TriangleMesh& mesh, const Box& domain);
  /// The same with an unfinished state of the field.
  void showUnfinished(Field field);
  /// True once the field is shown as it grows.
  bool showsUnfinished() const { return showsPreview() && preview_.field() != nullptr; }

  /// Long work that is now running, such as a construction. The panels show its progress. Only the button that cancels
  /// the work takes input.
  struct Work {
    std::string task;
    double fraction = 0;  ///< completed share of the work, 0 to 1
    bool cancellable = false;
    std::optional<Forecast> forecast = {};
  };
  std::optional<Work> work;
  /// The panels set this to true when the user cancels the long work.
  bool cancelWanted = false;

  /// Files that were opened before, the last one first. The window sets them; scripts do not read them, so that their
  /// frames are always the same.
  std::vector<std::string> recentFiles;

  /// The dialog that asks for files. While it is open, the panels take no input.
  FileDialog files;

  /// The text that the readout panel shows until the next command or press of the mouse.
  struct Message {
    std::string text;
    bool isProblem = false;  ///< an error or a warning, not a result
  };
  Message message;
  /// Tells why something failed, without the position in a script of the explorer.
  void tellProblem(const std::string& text);
  Session& session() const { return session_; }
  /// The last picture of the field, without the panels.
  const std::optional<render::Drawn>& picture() const { return picture_; }
  /// The last picture of the second field, which is shown beside the current one.
  const std::optional<render::Drawn>& pictureBeside() const { return beside_; }
  /// Returns statistics of the current field. They are computed at the first call for this field.
  const FieldStatistics& figures();
  /// Returns the indices of the cell interfaces with the greatest jumps of the field, in descending order of the jump:
  /// of all interfaces, or of those at the surface, as `view` has it. Returns `count` indices or more, unless there are
  /// fewer interfaces.
  const std::vector<std::size_t>& worst(std::size_t count);
  /// Returns the contour whose triangles the picture shows, or nullptr if it shows none or if the contour is not known
  /// yet.
  const Contour* shownContour() const;
  /// Returns the field's values at the mouse pointer, or std::nullopt if the pointer is not over the field.
  std::optional<Readout> readout();

 private:
  /// Restores the last state of the undo or redo list `from`, and appends the present state to `to`. Returns false if
  /// `from` is empty.
  bool goBack(std::vector<ViewState>& from, std::vector<ViewState>& to);
  std::string pictureKey() const;
  /// True if the frame shows `preview_` in place of a picture of the field.
  bool showsPreview() const { return work && isOpening() && !preview_.isEmpty(); }
  /// The domain of the picture that is shown, and the field in it. While there is only a mesh, there is no field.
  const Box& shownDomain() const;
  const Field& shownField() const;
  std::string perform(const std::string& line);
  std::string resultOf(const Command& command, const Arguments& arguments) const;
  void tellLater();
  void drawPreview(int coarseness);
  /// Returns 0 for a coarseness that is none, since the view has one sample for each pixel.
  int coarsenessOf(int coarseness) const { return coarseness == 1 && view_.samples == 1 ? 0 : coarseness; }
  /// Returns the `build` parameters that made the current field, as far as the field's metadata record them.
  std::map<std::string, std::string> settingsOfField() const;
  void removeWithoutEffect(std::map<std::string, std::string>& settings) const;
  void drawPicture(int coarseness);
  render::Drawn drawn(render::Renderer& renderer, const Field& field, const render::ReferenceData& reference,
                      const render::ScaleOptions& scale, int coarseness) const;
  void drawPanels(const Input* event, std::vector<std::string>& commands);
  void runCommandsOf(const Input& event, const std::vector<std::string>& commands);
  void settlePanels();
  void inputWhileWorking(const Input& event);
  void runOnPreview(const std::string& line);
  std::optional<std::string> canvasCommand(const Input& event);
  std::optional<std::string> clickCommand();
  std::optional<std::string> keyCommand(const Input& event) const;
  std::optional<std::string> typedCommand(const std::string& text) const;
  std::string wheelCommand(double notches) const;
  std::string dragCommand(double dx, double dy) const;
  render::ShownMesh contourToDraw() const;
  bool lacksContour(const ViewState& view) const;
  void makeContour(ViewState& view);
  void hideTriangles(ViewState& view, const std::string& why);
  void finishGesture();
  render::Drawn drawBeside(const Field& other, render::ReferenceData reference, const render::ScaleOptions& scale,
                           int coarseness);
  /// Draws the pictures of the current field and of the second field, if there is one, in a common colour scale.
  std::pair<render::Drawn, std::optional<render::Drawn>> drawBoth(const Field* other, int coarseness);

  Session& session_;
  Ui ui_;
  ViewState view_;
  std::vector<ViewState> undone_, redone_;
  /// The explorer's state and undo history before a mouse gesture. A command of the gesture that replaces the previous
  /// command first restores this history. One undo therefore reverts the whole gesture.
  struct History {
    ViewState view;
    std::size_t undone = 0;  ///< number of states in `undone_`
    std::vector<ViewState> redone;
  };
  History before_;
  std::map<std::string, std::string> settings_;
  std::vector<std::string> later_;  ///< lines that ran within another one and are still to be told to `onCommand`
  std::string lastKind_;            ///< command and parameter names in the gesture's last line of script
  bool running_ = false;
  bool opening_ = false;  ///< true while `openFile` makes a field
  bool drawsCanvasOnly_ = false;
  bool replaces_ = false;  ///< true if the running command replaces the previous one

  std::optional<std::uint64_t> allSteps_;
  enum class Rebuilding : std::uint8_t { no, whole, steps };  ///< `steps`: ends after a given number of steps
  Rebuilding rebuilding_ = Rebuilding::no;

  std::optional<FieldStatistics> figures_;
  std::vector<std::size_t> worst_;
  std::size_t worstAsked_ = 0;       ///< number of interfaces that were asked for when `worst_` was made
  std::optional<JumpKind> worstBy_;  ///< kind of jump by which `worst_` is sorted
  bool worstOnSurface_ = false;      ///< `worst_` has only interfaces at the surface

  BuildPreview preview_;
  std::optional<render::Drawn> picture_;
  std::optional<render::Drawn> beside_;  ///< picture of the second field, beside the current one
  std::vector<render::Image> shown_;     ///< images of picture_ and beside_
  std::string drawnFor_;
  int coarseness_ = 0;
  std::size_t fields_ = 0;  ///< number of fields so far, which identifies the current field

  std::optional<int> dragged_;           ///< mouse button that was pressed over the picture and is held
  std::array<double, 2> dragFrom_ = {};  ///< pointer position when the button was pressed, pixels
  ViewState viewAtPress_;
};

/// Returns the session's explorer, which the first call creates.
inline Explorer& explorerOf(Session& session) { return session.extension<Explorer>(); }

/// Draws the panels and appends to `commands` the lines of script that their widgets ask for. Must be called
/// within `Ui::frame`.
void drawPanels(Ui& ui, Explorer& explorer, std::vector<std::string>& commands);

}  // namespace hpsdf::app
