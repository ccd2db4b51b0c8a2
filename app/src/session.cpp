#include "session.h"

#include <utility>

#include "building.h"
#include "explorer/explorer.h"
#include "hpsdf/error.h"
#include "hpsdf/field_file.h"
#include "long_work.h"

namespace hpsdf::app {

Session::Session(const Registry& registry, Console console) : registry_(registry), console_(console) {}
Session::~Session() = default;

Explorer& Session::explorer() {
  if (!explorer_) explorer_ = std::make_unique<Explorer>(*this);
  return *explorer_;
}

void Session::setField(CurrentField field) {
  renderer_.reset();
  jumps_.reset();
  exact_.reset();
  picture_.reset();
  field_ = std::make_unique<CurrentField>(std::move(field));
  if (explorer_) explorer_->fieldChanged();
}

const CurrentField& Session::current() const {
  if (!field_) throw Error("there is no field yet; 'build MESH' or 'load FIELD' comes first");
  return *field_;
}

void Session::setFileBytes(std::uintmax_t bytes) { field_->fileBytes = bytes; }

const Jumps& Session::jumps() {
  const Field& field = current().field;
  if (!jumps_) jumps_ = withProgress(console_, [&](const Progress& progress) { return findJumps(field, 0, progress); });
  return *jumps_;
}

bool Session::knowsExact() const { return exact_ || isShape(current().field.metadata().source.name); }

const DistanceFunction& Session::exact(const std::string& surface) {
  const Source& source = current().field.metadata().source;
  if (exact_ && (surface.empty() || surface == exactSurface_)) return *exact_;
  if (surface.empty() && !knowsExact())
    throw Error("errors need the mesh that the field was made from: give mesh=" +
                (source.name.empty() ? "FILE" : source.name));
  exact_ = exactDistance(console_, surface.empty() ? source.name : surface, source);
  exactSurface_ = surface;
  return *exact_;
}

const render::Drawn& Session::picture() const {
  if (!picture_) throw Error("there is no picture yet; 'slice' or 'render' comes first");
  return *picture_;
}

render::Evidence Session::evidence(render::ColorBy color, const std::string& surface, const std::string& other) {
  render::Evidence evidence;
  if (color == render::ColorBy::valueJump || color == render::ColorBy::gradientJump) evidence.jumps = &jumps();
  if (color == render::ColorBy::error) evidence.exact = &exact(surface);
  if (color == render::ColorBy::difference) {
    if (!other_ || otherFile_ != other) other_ = std::make_unique<Field>(load(other));
    otherFile_ = other;
    evidence.other = other_.get();
  }
  return evidence;
}

render::Renderer& Session::renderer(const Backend& backend) {
  const Field& field = current().field;
  if (renderer_ && backend_ == backend) return *renderer_;
  renderer_.reset();
  renderer_ = backend.cpu ? render::makeCpuRenderer(field) : render::makeGlRenderer(field, backend.gl);
  backend_ = backend;
  lastRenderer_ = renderer_->description();
  return *renderer_;
}

}  // namespace hpsdf::app
