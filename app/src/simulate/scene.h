#pragma once
// The paper's simulations (sec. 4, Figs. 1, 7, 8, 9): what is there at the start, and what comes when.

#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>

#include <deque>
#include <memory>
#include <string>

#include "hpsdf/field.h"
#include "hpsdf/physics/world.h"
#include "hpsdf/triangle_mesh.h"
#include "session/session.h"
#include "simulate/scene_request.h"

namespace hpsdf::app {

/// What bodies of one mesh share.
struct BodyKind {
  BodyKind(TriangleMesh bodyMesh, Field bodyField, std::size_t samples, double margin);

  TriangleMesh mesh;
  Field field;
  physics::FieldCollider collider;
  physics::SurfaceSamples surface;
  physics::MassProperties mass;
  physics::FieldShape shape;
};

class Scene {
 public:
  explicit Scene(const SceneRequest& request, double slop = 0)
      : world_({.step = request.step, .solverIterations = request.iterations, .slop = slop}) {}
  virtual ~Scene() = default;

  physics::World& world() { return world_; }
  const physics::World& world() const { return world_; }
  /// Lets in what is due, before each step.
  void admit();

  /// A body that comes at some time.
  struct Drop {
    double seconds;
    btCollisionShape* shape;
    double mass;
    Eigen::Isometry3d worldFromBody;
    physics::Material material;
  };
  const std::deque<Drop>& drops() const { return drops_; }  ///< still to come
  const std::deque<BodyKind>& kinds() const { return kinds_; }
  /// Below this height a body is lost.
  double floor() const { return floor_; }
  std::size_t lost() const;                              ///< bodies, and soft bodies of which some node is
  std::size_t moving() const;                            ///< bodies that are in, and move or may move
  std::size_t waiting() const { return drops_.size(); }  ///< bodies that come later
  /// What bodies are compared with: a marble's radius, or the size of a body.
  double bodySize() const { return bodySize_; }

 protected:
  /// With the mesh's field, as `sceneField` has it.
  BodyKind& addKind(const Console& console, const SceneRequest& request, TriangleMesh mesh, std::size_t samples,
                    double margin);
  void stand(BodyKind& kind, const Eigen::Isometry3d& worldFromMesh, const physics::Material& material = {});
  /// In the order of time.
  void drop(Drop drop) { drops_.push_back(std::move(drop)); }

  // before the world, which refers to them
  std::deque<BodyKind> kinds_;
  std::deque<std::unique_ptr<btCollisionShape>> shapes_;
  physics::World world_;
  std::deque<Drop> drops_;
  double floor_ = 0;
  double bodySize_ = 1;
};

/// Throws `Error` for what cannot be made, naming it.
std::unique_ptr<Scene> makeScene(const Console& console, const std::string& name, const SceneRequest& request);

/// The mesh of a file or shape, z up, its middle at the origin and its longest side `size`, or as it is for 0. Warns of
/// one that is not closed. Throws `Error` naming it, also where it has no volume.
TriangleMesh sceneMesh(const Console& console, const std::string& name, bool fileIsYUp, double size);

/// The field of a mesh: from the cache's folder if it is there, or else built, by the threads of the caller's TBB
/// arena, and kept there. Throws `Error` for a folder that cannot be used and for a file in it that is not this field.
Field sceneField(const Console& console, const TriangleMesh& mesh, const SceneRequest& request);

/// What stands upright around the axis z, its middle at the origin.
TriangleMesh poleMesh(double radius, double height);
TriangleMesh slabMesh(const Vector3& size);

}  // namespace hpsdf::app
