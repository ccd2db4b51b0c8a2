#pragma once
// Draws the pictures of a simulation.

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

/// Draws the present state of a scene. One field's surface is traced: that of the first static body whose
/// transform is a pure translation. The pictures are in the coordinates of this field. All other bodies are drawn
/// as meshes, without detail below the size of a pixel.
class Studio {
 public:
  /// `look` as in `SimulationCamera`. The camera is aimed once, at all bodies of the scene and those that are still to
  /// be added. Throws `Error` when no renderer is available.
  Studio(const Scene& scene, std::string name, render::SurfacePicture look, const Backend& backend);

  /// A picture of the scene as it is now.
  SimulationShot shot();

 private:
  /// The body whose field is traced.
  struct Ground {
    std::size_t body;  ///< index in the world
    const Field* field;
    Eigen::Isometry3d fieldFromWorld;  ///< a translation, so that z stays up
  };
  /// The mesh that is drawn for a collision shape.
  struct Model {
    std::uint32_t mesh;  ///< index in the body renderer
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
  std::uint32_t firstSoft_ = 0;                      ///< mesh of the first soft body; the other soft bodies follow
  std::size_t rigid_;  ///< number of rigid bodies that will move; the colours of soft bodies follow theirs
  std::unique_ptr<render::Renderer> renderer_;
  std::unique_ptr<render::BodyRenderer> bodyRenderer_;
  std::string description_;
};

}  // namespace hpsdf::app
