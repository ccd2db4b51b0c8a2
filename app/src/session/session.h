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
#include "hpsdf/render/picture.h"
#include "hpsdf/render/renderer.h"
#include "language/registry.h"
#include "session/backend.h"
#include "session/current_field.h"

namespace hpsdf::app {

/// An object that lives as long as the session and is notified when another field becomes the current one.
class SessionExtension {
 public:
  virtual ~SessionExtension() = default;
  virtual void fieldChanged() = 0;
};

/// The state that lives from command to command: the current field, its renderer, and data that was computed for it.
class Session {
 public:
  Session(const Registry& registry, Console console);
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  const Registry& registry() const { return registry_; }
  const Console& console() const { return console_; }
  /// Sets the observer of long work, which must outlive its use; null removes it.
  void setListener(WorkListener* listener) { console_.listener = listener; }

  bool wantsJson(const Arguments& arguments) const { return json_ || arguments.flag("json"); }
  /// Sets whether all commands report as JSON and returns the previous setting.
  bool setJson(bool json) { return std::exchange(json_, json); }

  /// Number of scripts that run each other at present. `run` limits it, which ends scripts that run themselves.
  int scriptDepth = 0;

  void setField(CurrentField field);
  /// Replaces the current field by another form of it. The exact distance to its surface is kept.
  void changeField(CurrentField field);
  bool hasField() const { return field_ != nullptr; }
  /// Throws `Error` where there is no field.
  const CurrentField& current() const;
  void setFileBytes(std::uintmax_t bytes);

  /// Returns the jumps of the current field, which the first call measures. Throws `Cancelled` after Ctrl-C.
  const Jumps& jumps();
  bool knowsJumps() const { return jumps_.has_value(); }

  /// Returns the exact distance to `surface`. If `surface` is empty, the surface is the one from which the field was
  /// made, if that is a shape or the field was built in this session, and otherwise the surface of the previous
  /// call. The result is kept. Throws `Error` where no surface is known or it cannot be read.
  const DistanceFunction& exact(const std::string& surface);
  /// True where `exact` can be called with an empty surface.
  bool knowsExact() const;
  void setExact(std::shared_ptr<const DistanceFunction> exact) { exact_ = std::move(exact); }

  /// Returns the last picture of the current field. Throws `Error` where none was drawn.
  const render::Drawn& picture() const;
  void setPicture(render::Drawn picture) { picture_ = std::move(picture); }
  /// Records the description of the renderer of a picture that was not drawn by `renderer`.
  void setLastRenderer(std::string description) { lastRenderer_ = std::move(description); }

  /// Returns the extension, which the first call creates. All calls must ask for the same type.
  template <typename Extension>
  Extension& extension() {
    if (!extension_) extension_ = std::make_unique<Extension>(*this);
    return static_cast<Extension&>(*extension_);
  }

  /// A second field, with which the current one is compared. It is read from its file at first use and kept. Two are
  /// kept at most: one that is shown beside the current field, and one whose difference from it is shown.
  struct Other {
    std::string file;
    Field field;
    std::filesystem::file_time_type written = {};  ///< modification time of the file when it was read
    std::optional<Jumps> jumps = {};
    std::unique_ptr<render::Renderer> renderer = {};
    Backend backend = {};
  };
  Other& other(const std::string& file);
  /// Forgets the second fields whose files were modified, and returns whether there were any. A field whose file was
  /// deleted is kept.
  bool forgetChangedOthers();
  const Jumps& otherJumps(const std::string& file);
  render::Renderer& otherRenderer(const std::string& file, const Backend& backend);

  /// Returns the data that a colouring needs: jumps, the exact distance to `surface` (see `exact`) for errors, or the
  /// field of the file `other` for differences. The result is valid until the next call.
  render::ReferenceData reference(render::ColorBy color, const std::string& surface, const std::string& other = "");

  /// Returns the defects of the mesh `surface` in the units of the current field. "own" stands for the mesh from which
  /// the field was made. The result is kept. Throws `Error` where the mesh is unknown or cannot be read.
  const MeshDefects& defects(const std::string& surface);

  /// Returns the renderer of the current field. It is kept, because its upload takes longer than most pictures.
  render::Renderer& renderer(const Backend& backend);
  /// Returns the description of the renderer that was used last; "" before its first use.
  const std::string& lastRenderer() const { return lastRenderer_; }

 private:
  const Registry& registry_;
  Console console_;
  bool json_ = false;
  std::unique_ptr<CurrentField> field_;  // the renderer refers to it: it must not move
  std::optional<Jumps> jumps_;           // jumps of the current field
  std::optional<render::Drawn> picture_;
  std::optional<MeshDefects> defects_;
  std::string defectsOf_;                                    // surface argument of the call that computed `defects_`
  std::vector<std::unique_ptr<Other>> others_;               // most recently used first; their renderers refer to them
  std::shared_ptr<const DistanceFunction> exact_;            // distance to the field's own surface
  std::shared_ptr<const DistanceFunction> exactOfArgument_;  // distance to `surfaceArgument_`
  std::string surfaceArgument_;
  std::unique_ptr<render::Renderer> renderer_;
  Backend backend_;
  std::string lastRenderer_;
  std::unique_ptr<SessionExtension> extension_;
};

}  // namespace hpsdf::app
