#include "gl/field_upload.h"

#include <algorithm>
#include <array>
#include <bit>
#include <string>
#include <vector>

#include "hpsdf/detail/triangle_list.h"
#include "hpsdf/render/renderer.h"
#include "view/exact_leaf.h"

namespace hpsdf::render {
namespace {

using NodeTexel = std::array<std::uint32_t, 4>;

constexpr int kOffsetBits = 27;  // bits of a coefficient's index; the other 5 bits hold a degree up to 30
constexpr int kLowDegree = 4;    // highest degree evaluated without loops; same value as kLowDegree in field.glsl

void checkFits(std::size_t texels, std::size_t largest, const char* what) {
  if (texels > largest)
    throw GlError("the field has " + std::to_string(texels) + " " + what + ", the OpenGL device takes " +
                  std::to_string(largest) + ": build a coarser field");
}

/// The number of coefficients that a leaf of this degree takes on the device, a multiple of four.
std::size_t uploadedCount(int degree) {
  if (degree == kExactDegree) return 0;
  return (coefficientCount(std::max(degree, kLowDegree - 1)) + 3) / 4 * 4;
}

std::size_t uploadedCount(const FieldData& field) {
  std::size_t count = 0;
  for (const std::uint64_t bits : field.nodes)
    if (node::isLeaf(bits)) count += uploadedCount(node::degree(bits));
  return count;
}

/// Writes the coefficients of a leaf to `out`; entries for coefficients that the leaf lacks remain zero. A leaf of
/// degree kLowDegree stores its terms of this degree last, so that its other terms have the same order as in leaves of
/// lower degree.
template <typename T>
void uploadLeaf(const T* c, int degree, float* out) {
  const int all = std::max(degree, kLowDegree - 1);
  float* lower = out;
  float* last = out + coefficientCount(kLowDegree - 1);
  for (int i = 0; i <= all; ++i)
    for (int j = 0; j <= all - i; ++j)
      for (int k = 0; k <= all - i - j; ++k) {
        float*& next = degree == kLowDegree && i + j + k == kLowDegree ? last : lower;
        if (i + j + k <= degree) *next = static_cast<float>(*c++);
        ++next;
      }
}

/// The coefficients of all leaves, in the order of the nodes.
std::vector<float> uploadedCoefficients(const FieldData& field) {
  std::vector<float> uploaded(uploadedCount(field), 0.0F);
  float* out = uploaded.data();
  for (const std::uint64_t bits : field.nodes) {
    if (!node::isLeaf(bits) || node::isExact(bits)) continue;
    const int degree = node::degree(bits);
    withCoefficients(field, bits, [&](const auto* c) { uploadLeaf(c, degree, out); });
    out += uploadedCount(degree);
  }
  return uploaded;
}

std::uint32_t bitsOf(float x) { return std::bit_cast<std::uint32_t>(x); }

std::vector<NodeTexel> nodeTexels(const FieldData& field, const std::vector<SurfaceBounds>& bounds) {
  std::vector<NodeTexel> texels(field.nodes.size());
  std::uint32_t offset = 0;
  for (std::size_t n = 0; n < texels.size(); ++n) {
    const std::uint64_t bits = field.nodes[n];
    const SurfaceBounds& bound = bounds[n];
    NodeTexel& texel = texels[n];
    texel[3] = bitsOf(bound.secondDerivative);
    if (node::isExact(bits)) {
      const std::uint32_t* runs = TriangleListView(field.exact, bits).runs();
      texel[0] =
          std::uint32_t(kExactDegree) << kOffsetBits | static_cast<std::uint32_t>(runs - field.exact.lists.data());
      texel[1] = bitsOf(bound.valueDeviation);
      texel[3] = (texel[3] & ~std::uint32_t{3}) | std::uint32_t(node::exactSign(bits));
    } else if (node::isLeaf(bits)) {
      const int degree = node::degree(bits);
      texel[0] = std::uint32_t(degree) << kOffsetBits | offset;
      texel[1] = bitsOf(bound.valueDeviation);
      offset += static_cast<std::uint32_t>(uploadedCount(degree));
    } else {
      texel[0] = node::firstChild(bits);
      texel[1] = packOutwards(bound.lo, bound.hi);
    }
    texel[2] = bitsOf(bound.gradientDeviation);
  }
  return texels;
}

std::vector<NodeTexel> zoneTexels(const std::vector<BlendZoneBounds>& zones,
                                  const std::vector<std::uint32_t>& blendExtents) {
  std::vector<NodeTexel> texels(zones.size());
  for (std::size_t n = 0; n < zones.size(); ++n)
    texels[n] = {blendExtents[n], bitsOf(zones[n].valueDifference), bitsOf(zones[n].gradientDifference),
                 bitsOf(zones[n].extent)};
  return texels;
}

/// Three texels for each triangle, see `FieldUpload`.
std::vector<std::array<float, 4>> cornerTexels(const FieldData& field) {
  std::vector<std::array<float, 4>> texels;
  texels.reserve(3 * field.exact.triangles.size());
  for (std::uint32_t triangle = 0; triangle < field.exact.triangles.size(); ++triangle) {
    const std::array<Vector3, 3> corners = cornersOf(field.exact, triangle);
    const Vector3 normal = unitNormal(field.exact, triangle);
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3f corner = (corners[k] - field.domain.min()).cast<float>();
      texels.push_back({corner.x(), corner.y(), corner.z(), static_cast<float>(normal[k])});
    }
  }
  return texels;
}

template <typename T>
void upload(const GlBuffer& buffer, const GlBufferTexture& texture, GLenum format, const std::vector<T>& data) {
  if (data.empty()) return upload(buffer, texture, format, std::vector<T>(1));  // a buffer cannot be empty
  const std::size_t bytes = data.size() * sizeof(T);
  // Discard OpenGL errors of earlier calls.
  while (glGetError() != GL_NO_ERROR) {
  }
  glNamedBufferStorage(buffer.name(), static_cast<GLsizeiptr>(bytes), data.data(), 0);
  if (glGetError() != GL_NO_ERROR)
    throw GlError("the OpenGL device has no room for " + std::to_string(bytes >> 20) +
                  " MiB of the field: build a coarser field");
  glTextureBuffer(texture.name(), format, buffer.name());
}

}  // namespace

FieldUpload::FieldUpload(const Field& whole, const std::vector<SurfaceBounds>& bounds,
                         const std::vector<BlendZoneBounds>& zones) {
  const FieldData& field = whole.data();
  GLint largest = 0;
  glGetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &largest);
  checkFits(field.nodes.size(), largest, "nodes");
  checkFits(uploadedCount(field), std::min<std::size_t>(largest, std::size_t{1} << kOffsetBits), "coefficients");

  upload(nodeBuffer_, nodes_, GL_RGBA32UI, nodeTexels(field, bounds));
  std::vector<std::array<float, 4>> linearParts;
  for (const SurfaceBounds& node : bounds) linearParts.push_back(node.linear);
  upload(linearPartBuffer_, linearParts_, GL_RGBA32F, linearParts);
  upload(coefficientBuffer_, coefficients_, GL_R32F, uploadedCoefficients(field));
  glTextureBuffer(coefficientQuads_.name(), GL_RGBA32F, coefficientBuffer_.name());
  uploadExact(field, largest);
  if (!zones.empty()) upload(zoneBuffer_, zones_, GL_RGBA32UI, zoneTexels(zones, whole.lookupGrid().blendExtents));
}

void FieldUpload::uploadExact(const FieldData& field, GLint largest) {
  const ExactTriangles& exact = field.exact;
  if (exact.empty()) return;
  checkFits(exact.lists.size(), std::min<std::size_t>(largest, std::size_t{1} << kOffsetBits), "runs of triangles");
  checkFits(3 * exact.triangles.size(), largest, "corners of triangles");
  upload(exactListBuffer_, exactLists_, GL_R32UI, field.exact.lists);
  upload(exactCornerBuffer_, exactCorners_, GL_RGBA32F, cornerTexels(field));
}

void FieldUpload::bind() const {
  glBindTextureUnit(0, nodes_.name());
  glBindTextureUnit(1, coefficients_.name());
  glBindTextureUnit(4, linearParts_.name());
  glBindTextureUnit(5, coefficientQuads_.name());
  glBindTextureUnit(6, zones_.name());
  glBindTextureUnit(7, exactLists_.name());
  glBindTextureUnit(8, exactCorners_.name());
}

}  // namespace hpsdf::render
