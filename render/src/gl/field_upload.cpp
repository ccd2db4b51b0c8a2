#include "gl/field_upload.h"

#include <algorithm>
#include <array>
#include <bit>
#include <string>
#include <vector>

#include "hpsdf/error.h"

namespace hpsdf::render {
namespace {

using NodeTexel = std::array<std::uint32_t, 4>;

constexpr int kOffsetBits = 27;  // beside the 5 of a degree up to 30
constexpr int kStraight = 4;     // highest degree that is evaluated in straight code; as in field.glsl

void checkFits(std::size_t texels, std::size_t largest, const char* what) {
  if (texels > largest)
    throw Error("the field has " + std::to_string(texels) + " " + what + ", the OpenGL device takes " +
                std::to_string(largest) + ": render with --cpu, or build a coarser field");
}

/// Coefficients of a leaf on the device: whole texels of four.
std::size_t uploadedCount(int degree) { return (coefficientCount(std::max(degree, kStraight - 1)) + 3) / 4 * 4; }

std::size_t uploadedCount(const FieldData& field) {
  std::size_t count = 0;
  for (const std::uint64_t bits : field.nodes)
    if (node::isLeaf(bits)) count += uploadedCount(node::degree(bits));
  return count;
}

/// In the order of the leaves. Those for straight code have their terms below its degree first, with zeros for those
/// that they lack, then the terms of that degree.
std::vector<float> uploadedCoefficients(const FieldData& field) {
  std::vector<float> uploaded(uploadedCount(field), 0.0F);
  std::visit(
      [&](const auto& coefficients) {
        float* out = uploaded.data();
        for (const std::uint64_t bits : field.nodes) {
          if (!node::isLeaf(bits)) continue;
          const int degree = node::degree(bits);
          const int all = std::max(degree, kStraight - 1);
          const auto* c = coefficients.data() + node::offset(bits);
          float* low = out;
          float* high = out + coefficientCount(kStraight - 1);
          for (int i = 0; i <= all; ++i)
            for (int j = 0; j <= all - i; ++j)
              for (int k = 0; k <= all - i - j; ++k) {
                float*& next = degree == kStraight && i + j + k == kStraight ? high : low;
                if (i + j + k <= degree) *next = static_cast<float>(*c++);
                ++next;
              }
          out += uploadedCount(degree);
        }
      },
      field.coefficients);
  return uploaded;
}

std::vector<NodeTexel> nodeTexels(const FieldData& field, const std::vector<NodeBounds>& bounds) {
  std::vector<NodeTexel> texels(field.nodes.size());
  std::uint32_t offset = 0;
  for (std::size_t n = 0; n < texels.size(); ++n) {
    const std::uint64_t bits = field.nodes[n];
    const NodeBounds& bound = bounds[n];
    NodeTexel& texel = texels[n];
    if (node::isLeaf(bits)) {
      const int degree = node::degree(bits);
      texel[0] = std::uint32_t(degree) << kOffsetBits | offset;
      texel[1] = std::bit_cast<std::uint32_t>(bound.rest);
      offset += static_cast<std::uint32_t>(uploadedCount(degree));
    } else {
      texel[0] = node::firstChild(bits);
      texel[1] = packOutwards(bound.lo, bound.hi);
    }
    texel[2] = std::bit_cast<std::uint32_t>(bound.bend);
    texel[3] = std::bit_cast<std::uint32_t>(bound.curve);
  }
  return texels;
}

std::vector<NodeTexel> zoneTexels(const std::vector<ZoneBounds>& zones, const std::vector<std::uint32_t>& reaches) {
  std::vector<NodeTexel> texels(zones.size());
  const auto bits = [](float x) { return std::bit_cast<std::uint32_t>(x); };
  for (std::size_t n = 0; n < zones.size(); ++n)
    texels[n] = {reaches[n], bits(zones[n].apart), bits(zones[n].twist), bits(zones[n].reach)};
  return texels;
}

void upload(const GlBuffer& buffer, const GlBufferTexture& texture, GLenum format, const void* data,
            std::size_t bytes) {
  while (glGetError() != GL_NO_ERROR) {
  }
  glNamedBufferStorage(buffer.name(), static_cast<GLsizeiptr>(bytes), data, 0);
  if (glGetError() != GL_NO_ERROR)
    throw Error("the OpenGL device has no room for " + std::to_string(bytes >> 20) +
                " MiB of the field: render with --cpu, or build a coarser field");
  glTextureBuffer(texture.name(), format, buffer.name());
}

}  // namespace

FieldUpload::FieldUpload(const Field& whole, const std::vector<NodeBounds>& bounds,
                         const std::vector<ZoneBounds>& zones) {
  const FieldData& field = whole.data();
  GLint largest = 0;
  glGetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &largest);
  checkFits(field.nodes.size(), largest, "nodes");
  checkFits(uploadedCount(field), std::min<std::size_t>(largest, std::size_t{1} << kOffsetBits), "coefficients");

  const std::vector<NodeTexel> ofNodes = nodeTexels(field, bounds);
  upload(nodeBuffer_, nodes_, GL_RGBA32UI, ofNodes.data(), ofNodes.size() * sizeof(NodeTexel));
  std::vector<std::array<float, 4>> linearParts;
  for (const NodeBounds& node : bounds) linearParts.push_back(node.linear);
  upload(linearPartBuffer_, linearParts_, GL_RGBA32F, linearParts.data(), linearParts.size() * sizeof linearParts[0]);
  const std::vector<float> coefficients = uploadedCoefficients(field);
  upload(coefficientBuffer_, coefficients_, GL_R32F, coefficients.data(), coefficients.size() * sizeof(float));
  glTextureBuffer(coefficientQuads_.name(), GL_RGBA32F, coefficientBuffer_.name());
  if (zones.empty()) return;
  const std::vector<NodeTexel> ofZones = zoneTexels(zones, whole.lookupGrid().blendExtents);
  upload(zoneBuffer_, zones_, GL_RGBA32UI, ofZones.data(), ofZones.size() * sizeof(NodeTexel));
}

void FieldUpload::bind() const {
  glBindTextureUnit(0, nodes_.name());
  glBindTextureUnit(1, coefficients_.name());
  glBindTextureUnit(4, linearParts_.name());
  glBindTextureUnit(5, coefficientQuads_.name());
  glBindTextureUnit(6, zones_.name());
}

}  // namespace hpsdf::render
