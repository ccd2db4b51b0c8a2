#pragma once
// From a scene to its picture.

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

/// Draws a scene as it is, and leaves it as it is. The surface of one field is traced, that of the first body that
/// stands upright, in whose coordinates pictures are; all else are meshes, without detail that is below a pixel.
class Studio {
 public:
  /// `look` as in `SimulationCamera`: what is in view is decided now, by what is in and what is still to come. Throws
  /// `Error` when no device serves.
  Studio(const Scene& scene, std::string name, render::SurfacePicture look, const Backend& backend);

  SimulationShot shot();

 private:
  /// The body whose field is traced.
  struct Ground {
    std::size_t body;
    const Field* field;
    Eigen::Isometry3d fieldFromWorld;  // a translation: what is up stays so
  };
  /// What bodies of a shape look like.
  struct Model {
    std::uint32_t mesh;
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
  std::map<const btCollisionShape*, Model> models_;  // of rigid bodies
  std::uint32_t firstSoft_ = 0;                      // mesh of the first soft body; the others follow
  std::size_t rigid_;                                // how many will move, so that colours of soft ones are others
  std::unique_ptr<render::Renderer> renderer_;
  std::unique_ptr<render::BodyRenderer> bodyRenderer_;
  std::string description_;
};

}  // namespace hpsdf::app
