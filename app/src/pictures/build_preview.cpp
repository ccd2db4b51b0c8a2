#include "pictures/build_preview.h"

#include <utility>
#include <vector>

#include "hpsdf/error.h"
#include "pictures/picture_arguments.h"

namespace hpsdf::app {

void BuildPreview::showMesh(const TriangleMesh& mesh, const Box& domain, const Backend& backend) {
  const auto make = [&](std::vector<TriangleMesh> meshes) { return makeBodyRenderer(std::move(meshes), backend); };
  try {
    mesh_ = render::meshView(make, mesh, domain);
  } catch (const Error&) {
    return;  // the construction tells better than a picture what is wrong with the mesh
  }
  unfinished_.reset();
  domain_ = domain;
  ++changes_;
}

void BuildPreview::showField(Field field, const Backend& backend) {
  auto next = std::make_unique<Unfinished>(Unfinished{std::move(field), nullptr});
  unfinished_.reset();  // its memory, on the graphics card too, is not needed beside that of the next state
  next->renderer = makeRenderer(next->field, backend);
  unfinished_ = std::move(next);
  mesh_ = {};
  domain_ = unfinished_->field.domain();
  ++changes_;
}

}  // namespace hpsdf::app
