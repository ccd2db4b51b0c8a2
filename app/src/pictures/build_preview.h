#pragma once
// The preview of a field: pictures of its mesh or of the unfinished field while it is being built.

#include <cstddef>
#include <memory>

#include "hpsdf/field.h"
#include "hpsdf/render/mesh_picture.h"
#include "hpsdf/render/renderer.h"
#include "hpsdf/triangle_mesh.h"
#include "session/backend.h"

namespace hpsdf::app {

/// Stands in for a field that is being built: holds its mesh or, once there is one, the field as it is so far.
class BuildPreview {
 public:
  /// Shows a mesh. `domain` is the domain of its field. A mesh that cannot be drawn is not shown.
  void showMesh(const TriangleMesh& mesh, const Box& domain, const Backend& backend);
  /// Shows an unfinished field in place of the mesh, or of an earlier state of the field.
  void showField(Field field, const Backend& backend);

  bool isEmpty() const { return !mesh_ && !unfinished_; }
  /// Number of times that something else was to be shown.
  std::size_t changes() const { return changes_; }
  /// The domain of the field. The preview must not be empty.
  const Box& domain() const { return domain_; }

  /// Returns the unfinished field, or nullptr while there is none.
  const Field* field() const { return unfinished_ ? &unfinished_->field : nullptr; }
  /// The renderer of the unfinished field, which there must be.
  render::Renderer& renderer() const { return *unfinished_->renderer; }
  /// Draws the mesh, which must have been shown last.
  render::Image drawMesh(const render::OrbitCamera& camera, int width, int height) const {
    return mesh_(camera, width, height);
  }

 private:
  struct Unfinished {
    Field field;
    std::unique_ptr<render::Renderer> renderer;  // refers to the field
  };

  Box domain_;
  render::DrawView mesh_;
  std::unique_ptr<Unfinished> unfinished_;
  std::size_t changes_ = 0;
};

}  // namespace hpsdf::app
