#include "mesh/read/assimp_reader.h"

#include <assimp/scene.h>

#include <Eigen/Geometry>
#include <assimp/Importer.hpp>
#include <cctype>
#include <exception>
#include <string>
#include <utility>
#include <vector>

#include "hpsdf/detail/text.h"
#include "mesh/scan/mesh_builder.h"
#include "mesh/scan/word_text.h"

namespace hpsdf::mesh {
namespace {

Eigen::Affine3d toEigen(const aiMatrix4x4& m) {
  Eigen::Affine3d result;
  result.matrix() << m.a1, m.a2, m.a3, m.a4, m.b1, m.b2, m.b3, m.b4, m.c1, m.c2, m.c3, m.c4, 0, 0, 0, 1;
  return result;
}

/// Reads the scene of the file. The scene belongs to `importer`.
const aiScene& readScene(Assimp::Importer& importer, const Input& input) {
  std::string reason;
  try {
    const aiScene* const scene = importer.ReadFile(input.file().string(), 0);
    if (scene && scene->mRootNode) return *scene;
    reason = importer.GetErrorString();
  } catch (const std::exception& error) {
    reason = error.what();
  }
  input.refuse("cannot be read as a mesh (" + wordText(trimmed(reason)) + "); check or export the file again");
}

void addPart(MeshBuilder& builder, const Input& input, const aiMesh& part, const Eigen::Affine3d& worldFromPart) {
  const auto first = std::uint32_t(builder.vertices());
  for (unsigned v = 0; v < part.mNumVertices; ++v) {
    const aiVector3D& p = part.mVertices[v];
    const Vector3 position = worldFromPart * Vector3(p.x, p.y, p.z);
    if (!position.allFinite())
      input.refuse("vertex " + std::to_string(std::size_t{first} + v + 1) +
                   " has a coordinate that is not a finite number; repair or export the mesh again");
    builder.addVertex(position);
  }
  const bool isMirrored = worldFromPart.linear().determinant() < 0;  // A reflection reverses all orientations.
  std::vector<std::uint32_t> corners;
  for (unsigned f = 0; f < part.mNumFaces; ++f) {
    const aiFace& face = part.mFaces[f];
    corners.clear();
    for (unsigned i = 0; i < face.mNumIndices; ++i) {
      const unsigned v = face.mIndices[isMirrored ? face.mNumIndices - 1 - i : i];
      if (v >= part.mNumVertices) builder.refuseVertex(std::int64_t{first} + v + 1, 0);
      corners.push_back(first + v);
    }
    builder.addFace(corners, 0);
  }
}

}  // namespace

TriangleMesh readByAssimp(Input& input) {
  Assimp::Importer importer;
  const aiScene& scene = readScene(importer, input);
  // Undo assimp's rotation of 3DS scenes from z-up to y-up, to restore the coordinates of the file.
  Eigen::Affine3d worldFromRoot = Eigen::Affine3d::Identity();
  worldFromRoot.linear() << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  MeshBuilder builder(input);
  std::vector<std::pair<const aiNode*, Eigen::Affine3d>> pending = {{scene.mRootNode, worldFromRoot}};
  while (!pending.empty()) {
    const auto [node, worldFromParent] = pending.back();
    pending.pop_back();
    const Eigen::Affine3d worldFromNode = worldFromParent * toEigen(node->mTransformation);
    for (unsigned m = 0; m < node->mNumMeshes; ++m)
      addPart(builder, input, *scene.mMeshes[node->mMeshes[m]], worldFromNode);
    for (unsigned c = node->mNumChildren; c-- > 0;) pending.emplace_back(node->mChildren[c], worldFromNode);
  }
  return builder.finish();
}

}  // namespace hpsdf::mesh
