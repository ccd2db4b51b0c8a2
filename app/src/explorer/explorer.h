#pragma once
// The explorer: a picture of the current field with panels around it. It draws its frame without a window, the same
// whether a script or a person leads it; whatever a widget does is a command of the registry.

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

/// Where the parts of a frame stand; follows from the state alone. A part that is closed, or for which there is no
/// room, is empty.
struct Layout {
  UiRect bar, left, right, readout;
  UiRect canvas;  ///< of the picture
  UiRect beside;  ///< of the other field's
};
Layout layoutOf(const ViewState& view);

class Explorer final : public SessionExtension {
 public:
  explicit Explorer(Session& session);

  const ViewState& view() const { return view_; }
  /// What was shown before can be had back by `undo`; changes of one gesture by one. The frame's size and the renderer
  /// are not: they stay.
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

  /// What a person does: a frame of the panels, then the commands that they ask for. Throws what those throw. While
  /// work is under way, all that can be done is to cancel it.
  void input(const Input& event);
  /// Lets go of the mouse's buttons, closes lists, gives up a text that is being typed: what no script leads to. The
  /// pointer stays where it is. Mistakes in what is given up are passed over.
  void letGo();

  /// Of the panels as they stand now.
  const std::map<std::string, Widget>& widgets();
  const Ui& ui() const { return ui_; }
  void setClipboard(const std::string& text) { ui_.setClipboard(text); }

  /// Draws the picture, if anything changed, and the panels. `shrink` draws the picture at so many times fewer pixels
  /// along each axis: for the moment while the mouse moves. While work is under way the picture stays as it was.
  render::Image frame(int shrink = 1);
  /// Whether the last frame's picture was shrunk, or no longer is what `view` says.
  bool isStale() const { return !picture_ || shrunk_ != 1 || drawnFor_ != pictureKey(); }

  /// Runs a line of script as a widget does.
  void run(const std::string& line);
  /// Called with each such line, and whether it takes the place of the one before, of the same gesture: then running
  /// the last alone has the same effect.
  std::function<void(const std::string& line, bool replaces)> onCommand;
  /// Whether such a line is running.
  bool running() const { return running_; }

  /// The field is another one.
  void fieldChanged() override;

  /// Long work under way: shown by the panels, which take no other input meanwhile.
  struct Work {
    std::string task;
    double fraction = 0;
    bool cancellable = false;
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
  render::Drawn drawn(render::Renderer& renderer, const Field& field, const render::ReferenceData& reference,
                      const render::ScaleOptions& scale, int shrink) const;
  void drawPanels(const Input* event, std::vector<std::string>& commands);
  void settle();
  void inputWhileWorking(const Input& event);
  void runAll(const std::vector<std::string>& commands);
  std::optional<std::string> canvasCommand(const Input& event);

  Session& session_;
  Ui ui_;
  ViewState view_;
  std::vector<ViewState> undone_, redone_;
  /// As it was before the last line that took no other's place.
  struct History {
    ViewState view;
    std::size_t undone = 0;
    std::vector<ViewState> redone;
  };
  History before_;
  std::map<std::string, std::string> settings_;
  std::string lastKind_;  ///< of the gesture's last line, see `run`
  bool running_ = false;
  bool replaces_ = false;  ///< the line that is running takes the place of the one before

  std::optional<std::uint64_t> allSteps_;
  enum class Rebuilding : std::uint8_t { no, whole, steps };  ///< steps: the field becomes another state of itself
  Rebuilding rebuilding_ = Rebuilding::no;

  std::optional<FieldStatistics> figures_;
  std::vector<std::size_t> worst_;
  std::optional<JumpKind> worstBy_;  ///< of worst_

  std::optional<render::Drawn> picture_;
  std::optional<render::Drawn> beside_;  ///< of the other field
  std::vector<render::Image> shown_;     ///< what they looked like last
  std::string drawnFor_;
  int shrunk_ = 1;
  std::size_t fields_ = 0;  ///< counts the fields there have been

  std::optional<int> dragged_;  ///< button that was pressed over the canvas
  std::array<double, 2> dragFrom_ = {};
  ViewState viewAtPress_;
};

/// The session's explorer, made when first asked for.
inline Explorer& explorerOf(Session& session) { return session.extension<Explorer>(); }

/// The panels; adds the commands that the person asks for.
void drawPanels(Ui& ui, Explorer& explorer, std::vector<std::string>& commands);

}  // namespace hpsdf::app
