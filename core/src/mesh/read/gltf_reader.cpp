#include "mesh/read/gltf_reader.h"

#include <draco/compression/decode.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <map>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "mesh/read/gltf_document.h"
#include "mesh/scan/mesh_builder.h"
#include "mesh/scan/word_text.h"

namespace hpsdf::mesh {
namespace {

using Transform = Eigen::Affine3d;

/// The vertices and triangles of a primitive.
struct Primitive {
  std::vector<Vector3> positions;
  std::vector<std::uint32_t> corners;  ///< indices of positions, three for each triangle
};

/// Vertices of the mesh that is read, which were added for a primitive.
struct AddedVertices {
  std::uint32_t first = 0;
  std::size_t count = 0;
};

constexpr std::uint64_t kTriangles = 4, kStrip = 5,
                        kFan = 6;  ///< modes of a primitive; those below are points and lines
constexpr const char* kInstancing = "EXT_mesh_gpu_instancing";

std::vector<Vector3> vectorsOf(const std::vector<double>& numbers) {
  std::vector<Vector3> vectors(numbers.size() / 3);
  for (std::size_t i = 0; i < vectors.size(); ++i) vectors[i] = Vector3(&numbers[3 * i]);
  return vectors;
}

/// Turns the indices of a primitive into three for each triangle, as its mode says.
std::vector<std::uint32_t> trianglesOf(const std::vector<std::uint32_t>& indices, std::uint64_t mode) {
  std::vector<std::uint32_t> corners;
  if (mode == kTriangles) return indices;
  for (std::size_t i = 2; i < indices.size(); ++i) {
    const bool isStrip = mode == kStrip, isTurned = isStrip && i % 2 == 1;
    const std::uint32_t a = isStrip ? indices[i - 2] : indices[0], b = indices[i - 1], c = indices[i];
    if (a == b || b == c || c == a) continue;
    corners.insert(corners.end(), {isTurned ? b : a, isTurned ? a : b, c});
  }
  return corners;
}

Primitive decodeDraco(GltfDocument& document, const GltfValue& compressed) {
  if (!document.namesDraco()) compressed.refuse("is an extension whose name is written with escaped letters");
  const auto bytes = document.view(compressed.whole("bufferView"));
  draco::DecoderBuffer buffer;
  buffer.Init(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  draco::Decoder decoder;
  const auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
  if (!decoded.ok())
    compressed.refuse("cannot be decompressed (" + wordText(decoded.status().error_msg_string()) + ")");
  const draco::Mesh& mesh = *decoded.value();
  const std::uint64_t id = compressed.get("attributes").whole("POSITION");
  const draco::PointAttribute* const positions =
      id <= std::numeric_limits<std::uint32_t>::max() ? mesh.GetAttributeByUniqueId(std::uint32_t(id)) : nullptr;
  if (!positions || positions->num_components() != 3) compressed.refuse("has no positions");
  Primitive primitive;
  for (draco::PointIndex i(0); i < mesh.num_points(); ++i) {
    std::array<double, 3> v{};
    if (!positions->ConvertValue<double, 3>(positions->mapped_index(i), v.data()))
      compressed.refuse("has positions that cannot be read");
    primitive.positions.emplace_back(v.data());
  }
  for (draco::FaceIndex f(0); f < mesh.num_faces(); ++f)
    for (const draco::PointIndex& corner : mesh.face(f)) primitive.corners.push_back(corner.value());
  return primitive;
}

/// Returns the rotation of a quaternion x, y, z, w, whose length may differ from 1 by rounding. `object` is named in
/// errors.
Eigen::Quaterniond rotationOf(const GltfValue& object, const double* q) {
  const Eigen::Quaterniond rotation(q[3], q[0], q[1], q[2]);
  if (!(rotation.norm() > 0)) object.refuse("has a rotation by a quaternion of length 0");
  return rotation.normalized();
}

/// Returns the transform of a node relative to its parent.
Transform transformOf(const GltfValue& node) {
  Transform transform = Transform::Identity();
  if (node.has("matrix")) {
    transform.matrix() = Eigen::Map<const Eigen::Matrix4d>(node.get("matrix").numbers(16).data());
    return transform;
  }
  if (node.has("translation")) transform.translate(Vector3(node.get("translation").numbers(3).data()));
  if (node.has("rotation")) transform.rotate(rotationOf(node, node.get("rotation").numbers(4).data()));
  if (node.has("scale")) transform.scale(Vector3(node.get("scale").numbers(3).data()));
  return transform;
}

class GltfReader {
 public:
  explicit GltfReader(Input& input) : progress_(input.progress()), document_(input), builder_(input) {}

  TriangleMesh read() {
    struct Pending {
      std::uint64_t node;
      Transform worldFromParent;
    };
    std::vector<Pending> pending;
    for (const std::uint64_t root : roots()) pending.push_back({root, Transform::Identity()});
    std::ranges::reverse(pending);
    std::vector<bool> isVisited(document_.root().size("nodes"));
    while (!pending.empty()) {
      progress_.throwIfCancelled();
      const auto [index, worldFromParent] = pending.back();
      pending.pop_back();
      const GltfValue node = document_.item("nodes", index);
      if (isVisited[index]) node.refuse("occurs twice in the scene");
      isVisited[index] = true;
      const Transform worldFromNode = worldFromParent * transformOf(node);
      addNode(node, worldFromNode);
      for (std::size_t c = node.size("children"); c-- > 0;)
        pending.push_back({node.get("children").at(c).whole(), worldFromNode});
    }
    return builder_.finish();
  }

 private:
  /// Returns the nodes at which the scene begins: those of the file's default scene, of its first one or, without
  /// scenes, all nodes that are no children of others.
  std::vector<std::uint64_t> roots() const {
    const GltfValue root = document_.root();
    std::vector<std::uint64_t> found;
    if (root.size("scenes") > 0) {
      const GltfValue scene = document_.item("scenes", root.whole("scene", 0));
      for (std::size_t i = 0; i < scene.size("nodes"); ++i) found.push_back(scene.get("nodes").at(i).whole());
      return found;
    }
    const std::size_t nodes = root.size("nodes");
    std::vector<bool> isChild(nodes);
    for (std::size_t n = 0; n < nodes; ++n) {
      const GltfValue node = document_.item("nodes", n);
      for (std::size_t c = 0; c < node.size("children"); ++c)
        if (const std::uint64_t child = node.get("children").at(c).whole(); child < nodes) isChild[child] = true;
    }
    for (std::size_t n = 0; n < nodes; ++n)
      if (!isChild[n]) found.push_back(n);
    return found;
  }

  void addNode(const GltfValue& node, const Transform& worldFromNode) {
    if (!node.has("mesh")) return;
    const GltfValue mesh = document_.item("meshes", node.whole("mesh"));
    if (!node.has("extensions") || !node.get("extensions").has(kInstancing)) return addMesh(mesh, worldFromNode);
    for (const Transform& instance : instancesOf(node.get("extensions").get(kInstancing).get("attributes")))
      addMesh(mesh, worldFromNode * instance);
  }

  std::vector<Transform> instancesOf(const GltfValue& attributes) {
    const auto numbers = [&](const char* name, std::size_t components) {
      return attributes.has(name) ? document_.numbers(attributes.whole(name), components) : std::vector<double>();
    };
    const std::vector<Vector3> translations = vectorsOf(numbers("TRANSLATION", 3)),
                               scales = vectorsOf(numbers("SCALE", 3));
    const std::vector<double> rotations = numbers("ROTATION", 4);
    const std::size_t count = std::max({translations.size(), scales.size(), rotations.size() / 4});
    for (const std::size_t size : {translations.size(), scales.size(), rotations.size() / 4})
      if (size != 0 && size != count) attributes.refuse("differ in their numbers of instances");
    std::vector<Transform> instances(count, Transform::Identity());
    for (std::size_t i = 0; i < count; ++i) {
      if (!translations.empty()) instances[i].translate(translations[i]);
      if (!rotations.empty()) instances[i].rotate(rotationOf(attributes, &rotations[4 * i]));
      if (!scales.empty()) instances[i].scale(scales[i]);
    }
    return instances;
  }

  void addMesh(const GltfValue& mesh, const Transform& worldFromMesh) {
    std::map<std::uint64_t, AddedVertices> added;  // primitives of one mesh often share their vertices
    for (std::size_t p = 0; p < mesh.size("primitives"); ++p) {
      progress_.throwIfCancelled();
      addPrimitive(mesh.get("primitives").at(p), worldFromMesh, added);
    }
  }

  void addPrimitive(const GltfValue& primitive, const Transform& worldFromMesh,
                    std::map<std::uint64_t, AddedVertices>& added) {
    const std::uint64_t mode = primitive.whole("mode", kTriangles);
    if (mode > kFan) primitive.refuse("has an unknown mode");
    if (mode < kTriangles || !primitive.get("attributes").has("POSITION")) return;  // points, lines, or nothing
    if (primitive.has("extensions") && primitive.get("extensions").has(kDracoExtension.data())) {
      const Primitive decoded = decodeDraco(document_, primitive.get("extensions").get(kDracoExtension.data()));
      return addTriangles(primitive, decoded.corners, addVertices(primitive, decoded.positions, worldFromMesh),
                          worldFromMesh);
    }
    const std::uint64_t accessor = primitive.get("attributes").whole("POSITION");
    if (!added.contains(accessor))
      added[accessor] = addVertices(primitive, vectorsOf(document_.numbers(accessor, 3)), worldFromMesh);
    const AddedVertices vertices = added.at(accessor);
    const std::vector<std::uint32_t> indices = indicesOf(primitive, vertices.count);
    if (mode == kTriangles && indices.size() % 3 != 0)
      primitive.refuse("has " + std::to_string(indices.size()) + " corners, no multiple of three");
    addTriangles(primitive, trianglesOf(indices, mode), vertices, worldFromMesh);
  }

  std::vector<std::uint32_t> indicesOf(const GltfValue& primitive, std::size_t vertices) {
    std::vector<std::uint32_t> indices;
    if (!primitive.has("indices")) {
      indices.resize(vertices);
      std::iota(indices.begin(), indices.end(), 0);
      return indices;
    }
    for (const double index : document_.indices(primitive.whole("indices"))) {
      if (!(index >= 0 && index < double(vertices))) refuseIndex(primitive, index, vertices);
      indices.push_back(std::uint32_t(index));
    }
    return indices;
  }

  [[noreturn]] static void refuseIndex(const GltfValue& primitive, double index, std::size_t vertices) {
    primitive.refuse("refers to vertex " + std::to_string(index >= 0 ? std::int64_t(index) + 1 : 0) +
                     ", but there are only " + std::to_string(vertices));
  }

  AddedVertices addVertices(const GltfValue& primitive, const std::vector<Vector3>& positions,
                            const Transform& worldFromMesh) {
    const AddedVertices added = {std::uint32_t(builder_.vertices()), positions.size()};
    for (std::size_t i = 0; i < positions.size(); ++i) {
      const Vector3 v = worldFromMesh * positions[i];
      if (!v.allFinite())
        primitive.refuse("has a coordinate that is not a finite number, at vertex " + std::to_string(i + 1));
      builder_.addVertex(v);
    }
    return added;
  }

  void addTriangles(const GltfValue& primitive, const std::vector<std::uint32_t>& corners,
                    const AddedVertices& vertices, const Transform& worldFromMesh) {
    const bool isMirrored = worldFromMesh.linear().determinant() < 0;  // A reflection reverses all orientations.
    for (std::size_t i = 0; i + 2 < corners.size(); i += 3) {
      const std::uint32_t a = corners[i], b = corners[i + (isMirrored ? 2 : 1)], c = corners[i + (isMirrored ? 1 : 2)];
      if (const std::uint32_t most = std::max({a, b, c}); most >= vertices.count)
        refuseIndex(primitive, most, vertices.count);
      builder_.addTriangle({vertices.first + a, vertices.first + b, vertices.first + c}, 0);
    }
  }

  const Progress& progress_;
  GltfDocument document_;
  MeshBuilder builder_;
};

}  // namespace

TriangleMesh readGltf(Input& input) { return GltfReader(input).read(); }

}  // namespace hpsdf::mesh
