#pragma once
// The explorer: a picture of the current field with panels around it. It draws its frame without a window, the same
// whether a script or a person leads it; whatever a widget does is a command of the registry.

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "explorer/readout.h"
#include "explorer/ui.h"
#include "explorer/view_state.h"
#include "session.h"

namespace hpsdf::app {

/// Where the parts of a frame stand; follows from the state alone. A part that is closed, or for which there is no
/// room, is empty.
struct Layout {
  UiRect bar, left, right, readout;
  UiRect canvas;  ///< of the picture
  UiRect beside;  ///< of the other field's
};
Layout layoutOf(const ViewState& view);

class Explorer {
 public:
  explicit Explorer(Session& session);

  const ViewState& view() const { return view_; }
  /// What was shown before can be had back by `undo`; changes of one gesture by one.
  void change(ViewState next);
  /// False where nothing is left to undo or to do again.
  bool undo();
  bool redo();
  bool canUndo() const { return !undone_.empty(); }
  bool canRedo() const { return !redone_.empty(); }

  /// Settings for the next construction, by names and texts of `build`'s parameters; `mesh` among them.
  const std::map<std::string, std::string>& settings() const { return settings_; }
  void setSetting(const std::string& name, const std::string& value) { settings_[name] = value; }
  /// Builds with them, up to so many steps of the refinement, if that is given. Throws `Error` where no mesh is known.
  void rebuild(std::optional<int> maxSteps);
  /// Steps of the whole refinement, of which the field may be an earlier state; nothing where they are not known.
  std::optional<std::uint64_t> allSteps() const { return allSteps_; }

  /// What a person does: a frame of the panels, then the commands that they ask for. Throws what those throw.
  void input(const Input& event);

  /// Of the panels as they stand now.
  const std::map<std::string, Widget>& widgets();
  const Ui& ui() const { return ui_; }
  void setClipboard(const std::string& text) { ui_.setClipboard(text); }

  /// Draws the picture, if anything changed, and the panels. `shrink` draws the picture at so many times fewer pixels
  /// along each axis: for the moment while the mouse moves.
  render::Image frame(int shrink = 1);
  /// Whether the last frame's picture was shrunk, or no longer is what `view` says.
  bool isStale() const { return !picture_ || shrunk_ != 1 || drawnFor_ != pictureKey(); }

  /// Runs a line of script as a widget does.
  void run(const std::string& line);
  /// Called with each such line, and whether it takes the place of the one before, of the same gesture.
  std::function<void(const std::string& line, bool replaces)> onCommand;

  /// The field is another one.
  void fieldChanged();

  /// A construction under way: shown by the panels.
  struct Work {
    std::string task;
    double fraction = 0;
  };
  std::optional<Work> work;
  /// Set by the panels when a person wants it to end.
  bool cancelWanted = false;

  std::string message;  ///< shown below until the next command: what went wrong, or what was done
  Session& session() const { return session_; }
  /// As it was drawn last: the view alone.
  const std::optional<render::Drawn>& picture() const { return picture_; }
  /// Of the current field; kept.
  const FieldStatistics& figures();
  /// The worst interfaces by the view's measure, at least `count` of them where there are so many.
  const std::vector<std::size_t>& worst(std::size_t count);
  /// What the pointer is over, if that is part of the field.
  std::optional<Readout> readout();

 private:
  std::string pictureKey() const;
  /// `build`'s parameters that made the current field, as far as it tells.
  std::map<std::string, std::string> settingsOfField() const;
  void drawPicture(int shrink);
  render::Drawn drawn(render::Renderer& renderer, const Field& field, const render::Evidence& evidence,
                      const render::ScaleOptions& scale, int shrink) const;
  void drawPanels(const Input* event, std::vector<std::string>& commands);
  void settle();
  void runAll(const std::vector<std::string>& commands);
  std::optional<std::string> canvasCommand(const Input& event);

  Session& session_;
  Ui ui_;
  ViewState view_;
  std::vector<ViewState> undone_, redone_;
  bool gestureKept_ = false;  ///< the state before the gesture is in undone_ already
  bool byWidget_ = false;     ///< while a command runs that a person's gesture asked for
  std::map<std::string, std::string> settings_;
  std::string lastVerb_;  ///< of the gesture

  std::optional<std::uint64_t> allSteps_;
  bool keepsAllSteps_ = false;  ///< while the field becomes an earlier or later state of itself

  std::optional<FieldStatistics> figures_;
  std::vector<std::size_t> worst_;
  std::optional<JumpKind> worstBy_;  ///< of worst_

  std::optional<render::Drawn> picture_;
  std::optional<render::Drawn> beside_;  ///< of the other field
  std::string drawnFor_;
  int shrunk_ = 1;
  std::size_t fields_ = 0;  ///< counts the fields there have been

  std::optional<int> dragged_;  ///< button that was pressed over the canvas
  std::array<double, 2> dragFrom_ = {};
  ViewState viewAtPress_;
};

/// The panels; adds the commands that the person asks for.
void drawPanels(Ui& ui, Explorer& explorer, std::vector<std::string>& commands);

}  // namespace hpsdf::app
