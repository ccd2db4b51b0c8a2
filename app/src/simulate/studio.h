#pragma once
// Draws pictures of a simulation.

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "hpsdf/render/picture.h"
#include "session/backend.h"
#include "session/session.h"
#include "simulate/scene.h"
#include "simulate/shot.h"

namespace hpsdf::app {

/// Draws the present state of a scene. One body is drawn by tracing rays to its field's surface: the first
/// static body whose field is only translated, not rotated. The pictures are in the coordinates of that field.
/// All other bodies are drawn as meshes, without detail below the size of a pixel.
class Studio {
 public:
  /// Prepares pictures of the scene. `look` gives their camera, size and samples per pixel, as in `SimulationCamera`.
  /// The camera is aimed only once, at all bodies of the scene, including those that are still to be added. Throws
  /// `Error` if no renderer is available.
  Studio(const Scene& scene, std::string name, render::SurfacePicture look, const Backend& backend);

  /// Draws a picture of the present state of the scene.
  SimulationShot shot();

 private:
  /// The body that is drawn by tracing rays to its field's surface.
  struct Ground {
    std::size_t body;  ///< index of the body in the physics world
    const Field* field;
    Eigen::Isometry3d fieldFromWorld;  ///< a translation, so that z stays up
  };
  /// The mesh that represents a collision shape in pictures.
  struct Model {
    std::uint32_t mesh;  ///< index of the mesh in the body renderer
    Eigen::Isometry3d bodyFromMesh;
  };

  static Ground groundOf(const Scene& scene);
  std::vector<TriangleMesh> makeModels();
  void moveSoftBodies();
  std::vector<render::Body> bodies() const;
  render::Caption caption() const;

  const Scene& scene_;
  std::string name_;
  render::SurfacePicture look_;
  Ground ground_;
  std::map<const btCollisionShape*, Model> models_;  ///< meshes of the rigid bodies' shapes
  std::uint32_t firstSoft_ = 0;                      ///< index of the first soft body's mesh; the others follow
  std::size_t rigid_;  ///< number of rigid bodies that will move; the colours of soft bodies begin at this index
  std::unique_ptr<render::Renderer> renderer_;
  std::unique_ptr<render::BodyRenderer> bodyRenderer_;
  std::string description_;
};

}  // namespace hpsdf::app
