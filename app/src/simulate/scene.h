#pragma once
// The scenes of the paper's simulations (sec. 4, Figs. 1, 7, 8, 9). A scene holds the bodies that are present
// at the start, and the bodies that are dropped later.

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

/// The mesh, field and other data that all bodies of the same kind share.
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
  /// Adds the scheduled bodies whose time has come to the world. Must be called before each simulation step.
  void admit();

  /// A body that is added to the world during the simulation.
  struct Drop {
    double seconds;  ///< simulated time at which the body is added
    btCollisionShape* shape;
    double mass;
    Eigen::Isometry3d worldFromBody;
    physics::Material material;
  };
  const std::deque<Drop>& drops() const { return drops_; }  ///< bodies not added yet, in the order of their times
  const std::deque<BodyKind>& kinds() const { return kinds_; }
  std::size_t lost() const;    ///< number of bodies below `floor_`: centre of a rigid body or lowest node of a soft one
  std::size_t moving() const;  ///< number of rigid bodies in the world that are not static
  std::size_t waiting() const { return drops_.size(); }  ///< number of bodies not added yet
  /// Returns the reference length for penetration depths: the radius of a marble, the size of a body or the collision
  /// margin of a cloth.
  double bodySize() const { return bodySize_; }

 protected:
  /// Loads the mesh of a file or shape, with z up. Unless `size` is 0, the mesh is centred at the origin and
  /// scaled so that its longest side is `size`. Warns if the mesh is not closed. Throws `Error` naming the mesh
  /// if it cannot be read or has no volume.
  TriangleMesh meshOf(const std::string& name, double size) const;
  /// Adds a kind of body for the mesh. Loads the mesh's field from the cache folder. If the folder does not hold the
  /// field, builds it with the threads of the caller's TBB arena and saves it in the folder. `samples` is the number of
  /// surface samples. `margin` is the collision margin in world units. Throws `Error` if the folder cannot be used, or
  /// if the mesh's file in the folder holds another field.
  BodyKind& addKind(TriangleMesh mesh, std::size_t samples, double margin);
  /// Adds a static body of this kind to the world.
  void addStatic(BodyKind& kind, const Eigen::Isometry3d& worldFromMesh, const physics::Material& material = {});
  /// Adds a static horizontal plane at this height to the world.
  void addLevelGround(double height, double friction);
  /// Schedules a body to enter the world later. Calls must come in ascending order of `seconds`.
  void drop(Drop drop) { drops_.push_back(std::move(drop)); }

  // The kinds and shapes are declared before the world, because the world refers to them.
  std::deque<BodyKind> kinds_;
  std::deque<std::unique_ptr<btCollisionShape>> shapes_;
  physics::World world_;
  std::deque<Drop> drops_;
  double floor_ = 0;  ///< height below which a body counts as lost, world units
  double bodySize_ = 1;
  SceneRequest request_;

 private:
  Console console_;  ///< its streams are used only while the scene is made
};

/// Makes the scene of this name. Throws `Error` naming the mesh or field that cannot be made.
std::unique_ptr<Scene> makeScene(const Console& console, const std::string& name, const SceneRequest& request);

/// Returns the mesh of a prism with 24 sides that approximates a cylinder around the z axis, centred at the
/// origin.
TriangleMesh poleMesh(double radius, double height);
/// A mesh of a box with the edge lengths `size`, centred at the origin.
TriangleMesh slabMesh(const Vector3& size);

}  // namespace hpsdf::app
