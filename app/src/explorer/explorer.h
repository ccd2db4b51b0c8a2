#pragma once
// The explorer: a picture of the current field with panels around it. It draws its frame without a window, so that a
// script and a person get the same pixels. Every widget does its work by running a command of the registry.

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "explorer/ui.h"
#include "explorer/view_state.h"
#include "pictures/readout.h"
#include "session/session.h"

namespace hpsdf::app {

/// The rectangles of a frame's parts, in pixels. A part is empty where it is closed or has no room.
struct Layout {
  UiRect bar, left, right, readout;
  UiRect canvas;  ///< the picture of the current field
  UiRect beside;  ///< the picture of the other field
};

/// The layout depends on the state alone.
Layout layoutOf(const ViewState& view);

class Explorer final : public SessionExtension {
 public:
  explicit Explorer(Session& session);

  const ViewState& view() const { return view_; }
  /// Shows another state. `undo` returns to the state before, and counts the changes of one mouse gesture as one. Undo
  /// never changes the frame's size and the renderer.
  void change(ViewState next);
  /// `undo` and `redo` return false when there is no state to go to.
  bool undo() { return goBack(undone_, redone_); }
  bool redo() { return goBack(redone_, undone_); }
  bool canUndo() const { return !undone_.empty(); }
  bool canRedo() const { return !redone_.empty(); }

  /// The settings of the next construction as texts, by the names of `build`'s parameters; `mesh` stands for the
  /// surface.
  const std::map<std::string, std::string>& settings() const { return settings_; }
  void setSetting(const std::string& name, const std::string& value) { settings_[name] = value; }
  /// Builds the field again with `settings()`, and ends after `maxSteps` refinement steps where that is given.
  /// Throws `Error` when neither the settings nor the field name a surface.
  void rebuild(std::optional<int> maxSteps);
  /// The number of refinement steps of the complete construction, if known; the current field may have fewer.
  std::optional<std::uint64_t> allSteps() const { return allSteps_; }

  /// Handles one event of mouse or keyboard: draws the panels, then runs the commands that their widgets ask for,
  /// and passes on the exceptions of these commands. During long work the only effect of an event is to cancel the
  /// work.
  void input(const Input& event);
  /// Ends everything that a recorded script cannot reproduce: releases the mouse buttons, closes open lists and
  /// discards a text that is being typed. The pointer keeps its position. Errors of the commands that run because of
  /// this are ignored.
  void releaseInput();

  /// The widgets of the present frame, by their paths.
  const std::map<std::string, Widget>& widgets();
  const Ui& ui() const { return ui_; }
  void setClipboard(const std::string& text) { ui_.setClipboard(text); }

  /// Draws the panels, and the picture if it has changed. `shrink` divides the picture's resolution along each axis, so
  /// that it keeps up with a moving mouse. During long work the last picture is shown again.
  render::Image frame(int shrink = 1);
  /// True when the last picture was drawn with fewer pixels, or for another state than `view`.
  bool isStale() const { return !picture_ || shrunk_ != 1 || drawnFor_ != pictureKey(); }

  /// Runs one line of script, as widgets do.
  void run(const std::string& line);
  /// Called after each line that `run` has run. `replaces` is true if the line alone has the same effect as the
  /// previous line followed by it, as during one drag of a slider. A recording may then drop the previous line.
  std::function<void(const std::string& line, bool replaces)> onCommand;
  /// True while `run` runs a line.
  bool running() const { return running_; }

  void fieldChanged() override;

  /// Long work that is running. The panels show it, and only the button that cancels it takes input.
  struct Work {
    std::string task;
    double fraction = 0;  ///< done, 0 to 1
    bool cancellable = false;
  };
  std::optional<Work> work;
  /// Set by the panels when a person cancels the work.
  bool cancelWanted = false;

  std::string message;  ///< error or result, shown in the readout panel until the next command
  Session& session() const { return session_; }
  /// The last picture, without panels.
  const std::optional<render::Drawn>& picture() const { return picture_; }
  /// Statistics of the current field, computed at the first call.
  const FieldStatistics& figures();
  /// Indices of the interfaces with the greatest jumps, the greatest first: `count` of them or more, unless the field
  /// has fewer.
  const std::vector<std::size_t>& worst(std::size_t count);
  /// The values at the pointer, if it is over the field.
  std::optional<Readout> readout();

 private:
  /// Returns to the last state of `from`, and keeps the present one in `to`.
  bool goBack(std::vector<ViewState>& from, std::vector<ViewState>& to);
  std::string pictureKey() const;
  /// The parameters of `build` that made the current field, as far as its metadata record them.
  std::map<std::string, std::string> settingsOfField() const;
  void drawPicture(int shrink);
  render::Drawn drawn(render::Renderer& renderer, const Field& field, const render::ReferenceData& reference,
                      const render::ScaleOptions& scale, int shrink) const;
  void drawPanels(const Input* event, std::vector<std::string>& commands);
  void settlePanels();
  void inputWhileWorking(const Input& event);
  std::optional<std::string> canvasCommand(const Input& event);
  std::string wheelCommand(double notches) const;
  std::string dragCommand(double dx, double dy) const;
  render::Drawn drawBeside(const Field& other, render::ReferenceData reference, const render::ScaleOptions& scale,
                           int shrink);

  Session& session_;
  Ui ui_;
  ViewState view_;
  std::vector<ViewState> undone_, redone_;
  /// The state and the history before the gesture, to which a line that replaces the previous one returns.
  struct History {
    ViewState view;
    std::size_t undone = 0;  ///< size of undone_
    std::vector<ViewState> redone;
  };
  History before_;
  std::map<std::string, std::string> settings_;
  std::string lastKind_;  ///< kind of the gesture's last line, see `kindOf`
  bool running_ = false;
  bool replaces_ = false;  ///< the running line replaces the previous one, see onCommand

  std::optional<std::uint64_t> allSteps_;
  enum class Rebuilding : std::uint8_t { no, whole, steps };  ///< steps: ends early, after a given number of steps
  Rebuilding rebuilding_ = Rebuilding::no;

  std::optional<FieldStatistics> figures_;
  std::vector<std::size_t> worst_;
  std::optional<JumpKind> worstBy_;  ///< measure by which worst_ is sorted

  std::optional<render::Drawn> picture_;
  std::optional<render::Drawn> beside_;  ///< picture of the other field
  std::vector<render::Image> shown_;     ///< images of picture_ and beside_
  std::string drawnFor_;
  int shrunk_ = 1;
  std::size_t fields_ = 0;  ///< number of fields so far; distinguishes each field from the next

  std::optional<int> dragged_;           ///< mouse button that was pressed over the picture and is held
  std::array<double, 2> dragFrom_ = {};  ///< pointer when the button was pressed, pixels
  ViewState viewAtPress_;
};

/// The session's explorer, which is made at the first call.
inline Explorer& explorerOf(Session& session) { return session.extension<Explorer>(); }

/// Draws the panels and appends the lines of script that their widgets ask for. Called within `Ui::frame`.
void drawPanels(Ui& ui, Explorer& explorer, std::vector<std::string>& commands);

}  // namespace hpsdf::app
