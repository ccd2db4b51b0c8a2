#pragma once
// The scenes of the paper's simulations (sec. 4, Figs. 1, 7, 8, 9): their bodies at the start, and those that are
// dropped later.

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

/// The data that all bodies of one mesh share.
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
  Scene(const Console& console, const SceneRequest& request, double slop = 0)
      : world_({.step = request.step, .solverIterations = request.iterations, .slop = slop}),
        request_(request),
        console_(console) {}
  virtual ~Scene() = default;

  physics::World& world() { return world_; }
  const physics::World& world() const { return world_; }
  /// Adds the bodies whose time has come to the world. Called before each step.
  void admit();

  /// A body that is added to the world during the simulation.
  struct Drop {
    double seconds;  ///< simulated time at which the body is added
    btCollisionShape* shape;
    double mass;
    Eigen::Isometry3d worldFromBody;
    physics::Material material;
  };
  const std::deque<Drop>& drops() const { return drops_; }  ///< bodies not added yet, by ascending time
  const std::deque<BodyKind>& kinds() const { return kinds_; }
  std::size_t lost() const;    ///< number of bodies, soft or rigid, with a part below `floor_`
  std::size_t moving() const;  ///< number of rigid bodies in the world that are not static
  std::size_t waiting() const { return drops_.size(); }  ///< number of bodies not added yet
  /// Length that penetration depths are compared with: a marble's radius, or the size of a body.
  double bodySize() const { return bodySize_; }

 protected:
  /// The mesh of a file or shape with z up. It is centred at the origin and scaled to a longest side of `size`, unless
  /// that is 0. Warns of a mesh that is not closed. Throws `Error` naming a mesh that cannot be read or has no volume.
  TriangleMesh meshOf(const std::string& name, double size) const;
  /// Adds a kind of body with the mesh's field, which is loaded from the cache's folder, or else built by the threads
  /// of the caller's TBB arena and saved there. `samples` is the number of surface samples and `margin` the collision
  /// margin in world units. Throws `Error` for a folder that cannot be used, and for a file in it that is another
  /// field.
  BodyKind& addKind(TriangleMesh mesh, std::size_t samples, double margin);
  /// Adds a static body.
  void addStatic(BodyKind& kind, const Eigen::Isometry3d& worldFromMesh, const physics::Material& material = {});
  /// Adds a static plane at a height.
  void addLevelGround(double height, double friction);
  /// Schedules a body. Calls must come in ascending order of time.
  void drop(Drop drop) { drops_.push_back(std::move(drop)); }

  // These are declared before the world, which refers to them.
  std::deque<BodyKind> kinds_;
  std::deque<std::unique_ptr<btCollisionShape>> shapes_;
  physics::World world_;
  std::deque<Drop> drops_;
  double floor_ = 0;  ///< height below which a body counts as lost, world units
  double bodySize_ = 1;
  SceneRequest request_;

 private:
  Console console_;  ///< the streams that it refers to are used only while the scene is made
};

/// Makes the scene of that name. Throws `Error` naming a mesh or field that cannot be made.
std::unique_ptr<Scene> makeScene(const Console& console, const std::string& name, const SceneRequest& request);

/// A cylinder of 24 sides around the z axis, centred at the origin.
TriangleMesh poleMesh(double radius, double height);
/// A box of these extents, centred at the origin.
TriangleMesh slabMesh(const Vector3& size);

}  // namespace hpsdf::app
