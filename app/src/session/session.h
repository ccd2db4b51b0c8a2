#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "console/console.h"
#include "hpsdf/field.h"
#include "hpsdf/jumps.h"
#include "hpsdf/output/contour.h"
#include "hpsdf/render/picture.h"
#include "hpsdf/render/renderer.h"
#include "language/registry.h"
#include "session/backend.h"
#include "session/current_field.h"

namespace hpsdf::app {

struct ReferenceSurface;

/// An object that lives as long as the session. It is notified each time another field becomes the current
/// field.
class SessionExtension {
 public:
  virtual ~SessionExtension() = default;
  virtual void fieldChanged() = 0;
};

/// The choices for a contour of the current field. Lengths are in the field's units.
struct ContourChoice {
  double offset = 0;
  double tolerance = 0;
  bool simplify = false;
  bool operator==(const ContourChoice&) const = default;
};

/// The state that is kept between commands: the current field, its renderer, and data that was computed for
/// the field.
class Session {
 public:
  Session(const Registry& registry, Console console);
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  const Registry& registry() const { return registry_; }
  const Console& console() const { return console_; }
  /// Sets the observer of long work. The observer must outlive all work that the session does with it. Null
  /// removes the observer.
  void setListener(WorkListener* listener) { console_.listener = listener; }

  bool wantsJson(const Arguments& arguments) const { return json_ || arguments.flag("json"); }
  /// Sets whether all commands write their reports as JSON. Returns the previous setting.
  bool setJson(bool json) { return std::exchange(json_, json); }

  /// Number of nested scripts that are running now. The command `run` limits this number, to stop scripts that run
  /// themselves.
  int scriptDepth = 0;

  void setField(CurrentField field);
  /// Replaces the current field by `field`, a post-processed version of it. Keeps the exact distance function.
  void changeField(CurrentField field);
  bool hasField() const { return field_ != nullptr; }
  /// Returns the current field. Throws `Error` if the session has no field.
  const CurrentField& current() const;
  void setFileBytes(std::uintmax_t bytes);

  /// Returns the jumps of the current field across cell faces. The first call measures them. Throws `Cancelled` after
  /// Ctrl-C.
  const Jumps& jumps();
  /// Returns the totals of these jumps. If the jumps are not known, measures the totals alone, and does not keep them.
  JumpTotals jumpTotals(int threads);
  bool knowsJumps() const { return jumps_.has_value(); }

  /// Returns the exact distance to `surface` and keeps it for later calls. If `surface` is empty, takes the surface
  /// from which the field was made, provided that it is a shape or that the field was built in this session. If neither
  /// holds, takes the surface of the previous call. Throws `Error` if no surface is known or if it cannot be read.
  const DistanceFunction& exact(const std::string& surface);
  /// Returns the surface from which the current field was made, and keeps it for later calls. If `surface` is empty,
  /// takes that of the previous call, or finds it as `surfaceOf` does. Throws `Error` for another surface, and if it
  /// cannot be read.
  const ReferenceSurface& referenceSurface(const std::string& surface);
  /// True if `referenceSurface` can be called with an empty `surface`.
  bool knowsSurface() const;
  /// True if `exact` can be called with an empty `surface`.
  bool knowsExact() const;
  /// Forgets surfaces that were loaded by name, because a name may stand for another one now.
  void forgetSurfaces();
  void setExact(std::shared_ptr<const DistanceFunction> exact) { exact_ = std::move(exact); }

  /// Returns the last picture of the current field. Throws `Error` if no picture has been drawn.
  const render::Drawn& picture() const;
  void setPicture(render::Drawn picture) { picture_ = std::move(picture); }
  /// Records the description of the renderer that drew the last picture. Needed only for a renderer other than the one
  /// that the function `renderer` returns.
  void setLastRenderer(std::string description) { lastRenderer_ = std::move(description); }

  /// Returns the session's extension. The first call creates it. All calls must use the same type `Extension`.
  template <typename Extension>
  Extension& extension() {
    if (!extension_) extension_ = std::make_unique<Extension>(*this);
    return static_cast<Extension&>(*extension_);
  }

  /// The last answer of `why` about the current field. The explorer shows it.
  struct Explanation {
    Vector3 point;
    std::vector<std::string> lines;
  };
  const std::optional<Explanation>& explanation() const { return explanation_; }
  void setExplanation(std::optional<Explanation> explanation) { explanation_ = std::move(explanation); }

  /// A second field, with which the current field is compared. It is read from its file at first use. The two most
  /// recently used second fields are kept: one may be drawn beside the current field, one subtracted from it.
  struct Other {
    std::string file;
    Field field;
    std::filesystem::file_time_type written = {};  ///< modification time of the file when it was read
    std::optional<Jumps> jumps = {};
    std::optional<FieldStatistics> figures = {};
    std::unique_ptr<render::Renderer> renderer = {};
    Backend backend = {};
  };
  /// Returns the second field of this file, or the one that `keep` has kept for the name `kKept`.
  Other& other(const std::string& file);
  /// Keeps a field as a second field of the name `kKept`, in place of the one that was kept before.
  void keep(Field field);
  static constexpr const char* kKept = "kept";
  /// Forgets the second fields whose files have been modified since they were read. Returns whether there were any. A
  /// second field whose file was deleted is kept.
  bool forgetChangedOthers();
  const Jumps& otherJumps(const std::string& file);
  const FieldStatistics& otherFigures(const std::string& file);
  render::Renderer& otherRenderer(const std::string& file, const Backend& backend);

  /// Returns the data that a colour mode needs in addition to the field: the jumps, the exact distance to `surface` for
  /// errors, or the field of the file `other` for differences. The returned data is valid until the next call of
  /// `reference`.
  render::ReferenceData reference(render::ColorBy color, const std::string& surface, const std::string& other = "");

  /// Returns the defects of the mesh `surface`, in the units of the current field. The name "own" stands for
  /// the mesh from which the current field was made. The defects are kept for later calls. Throws `Error` if
  /// the mesh is unknown or cannot be read.
  const MeshDefects& defects(const std::string& surface);

  /// Returns the solids whose outlines slices show: the operands of an expression, or of the current field's own
  /// expression for the word "own". They are kept for later calls. Throws as `loadedOperands` does.
  const std::vector<render::OutlinedSolid>& operands(const std::string& expression);

  /// Returns the field whose contour at this offset the command `contour` writes unless it keeps jumps: the current
  /// field, or a blended copy if the contour may have steps between cells. The copy is kept until the field changes.
  const Field& fieldOfContour(double offset);

  /// Returns the contour that the command `contour` would write: of `fieldOfContour`.
  /// The last one is kept. Throws as `hpsdf::contour` does.
  const Contour& contour(const ContourChoice& choice);
  /// True if `contour` would return the contour that is kept.
  bool knowsContour(const ContourChoice& choice) const { return contour_ && contourOf_ == choice; }

  /// Returns a renderer of the current field. The renderer is kept for later calls, because uploading the field
  /// takes longer than drawing most pictures.
  render::Renderer& renderer(const Backend& backend);
  /// Returns the description of the renderer that was used last, or "" if no renderer has been used.
  const std::string& lastRenderer() const { return lastRenderer_; }

 private:
  const Registry& registry_;
  Console console_;
  bool json_ = false;
  std::unique_ptr<CurrentField> field_;  // on the heap: the renderer keeps a reference to it
  std::optional<Jumps> jumps_;           // jumps of the current field
  std::optional<render::Drawn> picture_;
  std::optional<Explanation> explanation_;
  std::optional<MeshDefects> defects_;
  std::string defectsOf_;  // surface argument of the call that computed `defects_`
  std::optional<std::vector<render::OutlinedSolid>> operands_;
  std::string operandsOf_;        // argument of the call that loaded `operands_`
  std::optional<Field> blended_;  // copy of the current field, for contours
  std::optional<Contour> contour_;
  ContourChoice contourOf_;                                  // choices for `contour_`
  std::vector<std::unique_ptr<Other>> others_;               // most recently used first; renderers keep references
  std::unique_ptr<Other> kept_;                              // the one of the name kKept
  std::shared_ptr<const DistanceFunction> exact_;            // distance to the field's own surface
  std::shared_ptr<const DistanceFunction> exactOfArgument_;  // distance to `surfaceArgument_`
  std::string surfaceArgument_;
  std::unique_ptr<const ReferenceSurface> reference_;  // surface of the current field
  std::string referenceName_;
  std::unique_ptr<render::Renderer> renderer_;
  Backend backend_;
  std::string lastRenderer_;
  std::unique_ptr<SessionExtension> extension_;
};

/// While this object lives, the session counts one more running script, and `json` decides whether commands report as
/// JSON.
class ScriptScope {
 public:
  ScriptScope(Session& session, bool json) : session_(session), jsonBefore_(session.setJson(json)) {
    ++session_.scriptDepth;
  }
  ~ScriptScope() {
    --session_.scriptDepth;
    session_.setJson(jsonBefore_);
  }
  ScriptScope(const ScriptScope&) = delete;
  ScriptScope& operator=(const ScriptScope&) = delete;

 private:
  Session& session_;
  bool jsonBefore_;
};

}  // namespace hpsdf::app
