#include "session/session.h"

#include <algorithm>

#include "console/long_work.h"
#include "construction/reference_surface.h"
#include "construction/surface.h"
#include "hpsdf/continuity.h"
#include "hpsdf/error.h"
#include "hpsdf/field_file.h"
#include "session/field_operands.h"
#include "session/field_surface.h"

namespace hpsdf::app {
namespace {

/// Returns the jumps of the field across cell faces. If `known` is empty, measures the jumps and stores them in
/// `known`.
const Jumps& jumpsOf(const Field& field, std::optional<Jumps>& known, const Console& console) {
  if (!known) known = withProgress(console, [&](const Progress& progress) { return findJumps(field, 0, progress); });
  return *known;
}

}  // namespace

Session::Session(const Registry& registry, Console console) : registry_(registry), console_(console) {}
Session::~Session() = default;

void Session::setField(CurrentField field) {
  renderer_.reset();
  defects_.reset();
  operands_.reset();
  blended_.reset();
  contour_.reset();
  jumps_.reset();
  exact_.reset();
  exactOfArgument_.reset();
  reference_.reset();
  picture_.reset();
  explanation_.reset();
  field_ = std::make_unique<CurrentField>(std::move(field));
  if (extension_) extension_->fieldChanged();
}

void Session::changeField(CurrentField field) {
  auto exact = std::move(exact_);
  auto exactOfArgument = std::move(exactOfArgument_);
  setField(std::move(field));
  exact_ = std::move(exact);
  exactOfArgument_ = std::move(exactOfArgument);
}

const CurrentField& Session::current() const {
  if (!field_) throw Error("there is no field yet; 'build MESH' or 'load FIELD' comes first");
  return *field_;
}

void Session::setFileBytes(std::uintmax_t bytes) { field_->fileBytes = bytes; }

const Jumps& Session::jumps() { return jumpsOf(current().field, jumps_, console_); }

JumpTotals Session::jumpTotals(int threads) {
  if (jumps_) return *jumps_;
  return withProgress(console_,
                      [&](const Progress& progress) { return measureJumps(current().field, threads, progress); });
}

bool Session::knowsExact() const {
  return exact_ || exactOfArgument_ || isShape(current().field.metadata().source.name);
}

const DistanceFunction& Session::exact(const std::string& surface) {
  const Source& source = current().field.metadata().source;
  if (surface.empty()) {
    if (!knowsExact())
      throw Error("errors need the mesh that the field was made from: give mesh=" +
                  (source.name.empty() ? "FILE" : source.name));
    if (!exact_ && isShape(source.name)) exact_ = exactDistance(console_, source.name, source);
    return exact_ ? *exact_ : *exactOfArgument_;
  }
  if (!exactOfArgument_ || surface != surfaceArgument_) {
    exactOfArgument_ = exactDistance(console_, surface, source);
    surfaceArgument_ = surface;
  }
  return *exactOfArgument_;
}

bool Session::knowsSurface() const { return reference_ || findsSurface(current()); }

const ReferenceSurface& Session::referenceSurface(const std::string& surface) {
  if (surface.empty() && reference_) return *reference_;
  const std::string name = surface.empty() ? surfaceOf(current(), "mesh") : surface;
  if (!reference_ || name != referenceName_) {
    auto reference = std::make_unique<const ReferenceSurface>(
        app::referenceSurface(console_, name, current().field.metadata().source));
    refuseForeign(current(), *reference, name);
    reference_ = std::move(reference);
    referenceName_ = name;
  }
  return *reference_;
}

void Session::forgetSurfaces() {
  exactOfArgument_.reset();
  reference_.reset();
  defects_.reset();
  operands_.reset();
}

const render::Drawn& Session::picture() const {
  if (!picture_) throw Error("there is no picture yet; 'slice' or 'render' comes first");
  return *picture_;
}

render::ReferenceData Session::reference(render::ColorBy color, const std::string& surface, const std::string& other) {
  render::ReferenceData reference;
  if (color == render::ColorBy::valueJump || color == render::ColorBy::gradientJump) reference.jumps = &jumps();
  if (color == render::ColorBy::error) reference.exact = &exact(surface);
  if (color == render::ColorBy::difference) {
    forgetChangedOthers();
    reference.other = &this->other(other).field;
  }
  return reference;
}

const MeshDefects& Session::defects(const std::string& surface) {
  if (!defects_ || surface != defectsOf_) {
    const bool own = surface == "own";
    defects_ =
        meshDefects(console_, own ? surfaceOf(current(), "defects=MESH") : surface, current().field.metadata().source);
    defectsOf_ = surface;
  }
  return *defects_;
}

const std::vector<render::OutlinedSolid>& Session::operands(const std::string& expression) {
  if (!operands_ || expression != operandsOf_) {
    operands_ = loadedOperands(console_, current(), expression);
    operandsOf_ = expression;
  }
  return *operands_;
}

const Field& Session::fieldOfContour(double offset) {
  const Field& field = current().field;
  if (!mayHaveSteps(field, offset)) return field;
  if (!blended_) blended_ = blended(field);
  return *blended_;
}

const Contour& Session::contour(const ContourChoice& choice) {
  if (!knowsContour(choice)) {
    const Field& field = fieldOfContour(choice.offset);
    contour_ = withProgress(console_, [&](const Progress& progress) {
      const ContourOptions options{.offset = choice.offset, .tolerance = choice.tolerance, .simplify = choice.simplify};
      return hpsdf::contour(field, options, progress);
    });
    contourOf_ = choice;
  }
  return *contour_;
}

void Session::keep(Field field) { kept_ = std::make_unique<Other>(Other{kKept, std::move(field)}); }

Session::Other& Session::other(const std::string& file) {
  if (file == kKept) {
    if (!kept_) throw Error("no field is kept; 'apply keep=true' keeps the field before it");
    return *kept_;
  }
  const auto found = std::ranges::find(others_, file, &Other::file);
  if (found != others_.end()) {
    std::rotate(others_.begin(), found, found + 1);
  } else {
    std::error_code unknown;
    const auto written =
        std::filesystem::last_write_time(file, unknown);  // read before loading, so that later changes are noticed
    others_.insert(others_.begin(), std::make_unique<Other>(Other{file, loadOrMap(file), written}));
    if (others_.size() > 2) others_.pop_back();
  }
  return *others_.front();
}

bool Session::forgetChangedOthers() {
  return std::erase_if(others_, [](const std::unique_ptr<Other>& other) {
           std::error_code missing;
           const auto written = std::filesystem::last_write_time(other->file, missing);
           return !missing && written != other->written;
         }) > 0;
}

const Jumps& Session::otherJumps(const std::string& file) {
  Other& other = this->other(file);
  return jumpsOf(other.field, other.jumps, console_);
}

const FieldStatistics& Session::otherFigures(const std::string& file) {
  Other& other = this->other(file);
  if (!other.figures) other.figures = statistics(other.field);
  return *other.figures;
}

render::Renderer& Session::otherRenderer(const std::string& file, const Backend& backend) {
  Other& other = this->other(file);
  if (!other.renderer || other.backend != backend) other.renderer = makeRenderer(other.field, backend);
  other.backend = backend;
  return *other.renderer;
}

render::Renderer& Session::renderer(const Backend& backend) {
  const Field& field = current().field;
  if (renderer_ && backend_ == backend) return *renderer_;
  renderer_.reset();
  renderer_ = makeRenderer(field, backend);
  backend_ = backend;
  lastRenderer_ = renderer_->description();
  return *renderer_;
}

}  // namespace hpsdf::app
