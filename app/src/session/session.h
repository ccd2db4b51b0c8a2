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

/// An object that lives as long as the session and is told when another field becomes the current one.
class SessionExtension {
 public:
  virtual ~SessionExtension() = default;
  virtual void fieldChanged() = 0;
};

/// What lives from command to command: the current field, its renderer, and what the explorer shows.
class Session {
 public:
  Session(const Registry& registry, Console console);
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  const Registry& registry() const { return registry_; }
  const Console& console() const { return console_; }
  /// Nobody's, with nullptr. Kept by reference.
  void setListener(WorkListener* listener) { console_.listener = listener; }

  bool wantsJson(const Arguments& arguments) const { return json_ || arguments.flag("json"); }
  /// Lets all commands report as JSON; returns the setting before.
  bool setJson(bool json) { return std::exchange(json_, json); }

  /// Scripts that run each other without end are told from deep ones by this count of scripts now running.
  int scriptDepth = 0;

  void setField(CurrentField field);
  /// The current field in another form: what is known of its surface stays.
  void changeField(CurrentField field);
  bool hasField() const { return field_ != nullptr; }
  /// Throws `Error` when there is none, saying how to get one.
  const CurrentField& current() const;
  void setFileBytes(std::uintmax_t bytes);

  /// The current field's jumps: measured when first asked for. Throws `Cancelled` after Ctrl-C.
  const Jumps& jumps();
  bool knowsJumps() const { return jumps_.has_value(); }

  /// The exact distance that the current field was made from: of `surface`, or, where that is empty, of the shape that
  /// the field names or the mesh that it was built from just now; where neither is known, of the surface that was asked
  /// for last. Kept. Throws `Error` when it is not to be had.
  const DistanceFunction& exact(const std::string& surface);
  /// Whether `exact` needs no surface.
  bool knowsExact() const;
  void setExact(std::shared_ptr<const DistanceFunction> exact) { exact_ = std::move(exact); }

  /// The last picture drawn of the current field. Throws `Error` when there is none.
  const render::Drawn& picture() const;
  void setPicture(render::Drawn picture) { picture_ = std::move(picture); }
  /// For pictures that are not drawn by `renderer`.
  void setLastRenderer(std::string description) { lastRenderer_ = std::move(description); }

  /// The session's extension, made from the session when it is first asked for. A session has one, of one type.
  template <typename Extension>
  Extension& extension() {
    if (!extension_) extension_ = std::make_unique<Extension>(*this);
    return static_cast<Extension&>(*extension_);
  }

  /// A field to compare the current one with: read from its file when first asked for, and kept; of two files at most,
  /// one beside the current field and one that it differs from.
  struct Other {
    std::string file;
    Field field;
    std::filesystem::file_time_type written = {};  ///< the file, when it was read
    std::optional<Jumps> jumps = {};
    std::unique_ptr<render::Renderer> renderer = {};
    Backend backend = {};
  };
  const Other& other(const std::string& file);
  /// Forgets those whose files were written since; one that was deleted is kept. Whether there was any.
  bool forgetChangedOthers();
  const Jumps& otherJumps(const std::string& file);
  render::Renderer& otherRenderer(const std::string& file, const Backend& backend);

  /// What pictures with these colours need: for errors the mesh `surface` or what is known, for differences the field
  /// of the file `other`, read once. Good until it is asked for again.
  render::ReferenceData reference(render::ColorBy color, const std::string& surface, const std::string& other = "");

  /// What is wrong with the mesh `surface`, in the units of the current field; "own": the one that it was made from.
  /// Kept. Throws `Error` when it is not to be had.
  const MeshDefects& defects(const std::string& surface);

  /// The renderer of the current field: kept, since its upload takes longer than most pictures.
  render::Renderer& renderer(const Backend& backend);
  /// Description of the one asked for last; "" before that.
  const std::string& lastRenderer() const { return lastRenderer_; }

 private:
  Other& keptOther(const std::string& file);

  const Registry& registry_;
  Console console_;
  bool json_ = false;
  std::unique_ptr<CurrentField> field_;  // the renderer refers to it: it must not move
  std::optional<Jumps> jumps_;           // of the current field
  std::optional<render::Drawn> picture_;
  std::optional<MeshDefects> defects_;
  std::string defectsOf_;                          ///< their mesh, as it was asked for
  std::vector<std::unique_ptr<Other>> others_;     // last asked for first; their renderers refer to them
  std::shared_ptr<const DistanceFunction> exact_;  // of the field's own surface
  std::shared_ptr<const DistanceFunction> given_;  // of a surface that was asked for by its name
  std::string givenSurface_;
  std::unique_ptr<render::Renderer> renderer_;
  Backend backend_;
  std::string lastRenderer_;
  std::unique_ptr<SessionExtension> extension_;
};

}  // namespace hpsdf::app
