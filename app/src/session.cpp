#include "session.h"

#include <utility>

#include "hpsdf/error.h"
#include "long_work.h"

namespace hpsdf::app {

void Session::setField(CurrentField field) {
  renderer_.reset();
  jumps_.reset();
  field_ = std::make_unique<CurrentField>(std::move(field));
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

render::Renderer& Session::renderer(const Backend& backend) {
  const Field& field = current().field;
  if (renderer_ && backend_ == backend) return *renderer_;
  renderer_.reset();
  renderer_ = backend.cpu ? render::makeCpuRenderer(field) : render::makeGlRenderer(field, backend.gl);
  backend_ = backend;
  return *renderer_;
}

}  // namespace hpsdf::app
