#include "gl/field_upload.h"

#include <array>
#include <bit>
#include <string>
#include <vector>

#include "hpsdf/error.h"

namespace hpsdf::render {
namespace {

using NodeTexel = std::array<std::uint32_t, 4>;

constexpr int kOffsetBits = 27;  // beside the 5 of a degree up to 30

void checkFits(std::size_t texels, std::size_t largest, const char* what) {
  if (texels > largest)
    throw Error("the field has " + std::to_string(texels) + " " + what + ", the OpenGL device takes " +
                std::to_string(largest) + ": render with --cpu, or build a coarser field");
}

std::vector<NodeTexel> nodeTexels(const FieldData& field, const std::vector<NodeBounds>& bounds) {
  std::vector<NodeTexel> texels(field.nodes.size());
  for (std::size_t n = 0; n < texels.size(); ++n) {
    const std::uint64_t bits = field.nodes[n];
    const std::uint32_t word = node::isLeaf(bits)
                                   ? std::uint32_t(node::degree(bits)) << kOffsetBits | node::offset(bits)
                                   : node::firstChild(bits);
    texels[n] = {
        word,
        node::isLeaf(bits) ? std::bit_cast<std::uint32_t>(bounds[n].rest) : packOutwards(bounds[n].lo, bounds[n].hi),
        std::bit_cast<std::uint32_t>(bounds[n].bend), std::bit_cast<std::uint32_t>(bounds[n].curve)};
  }
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

FieldUpload::FieldUpload(const FieldData& field, const std::vector<NodeBounds>& bounds) {
  GLint largest = 0;
  glGetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &largest);
  const std::size_t coefficients = std::visit([](const auto& c) { return c.size(); }, field.coefficients);
  checkFits(field.nodes.size(), largest, "nodes");
  checkFits(coefficients, std::min<std::size_t>(largest, std::size_t{1} << kOffsetBits), "coefficients");

  const std::vector<NodeTexel> texels = nodeTexels(field, bounds);
  upload(nodeBuffer_, nodes_, GL_RGBA32UI, texels.data(), texels.size() * sizeof(NodeTexel));
  std::vector<std::array<float, 4>> linearParts;
  for (const NodeBounds& node : bounds) linearParts.push_back(node.linear);
  upload(linearPartBuffer_, linearParts_, GL_RGBA32F, linearParts.data(), linearParts.size() * sizeof linearParts[0]);
  if (const auto* single = std::get_if<std::vector<float>>(&field.coefficients)) {
    upload(coefficientBuffer_, coefficients_, GL_R32F, single->data(), single->size() * sizeof(float));
  } else {
    const auto& dual = std::get<std::vector<double>>(field.coefficients);
    const std::vector<float> rounded(dual.begin(), dual.end());
    upload(coefficientBuffer_, coefficients_, GL_R32F, rounded.data(), rounded.size() * sizeof(float));
  }
}

void FieldUpload::bind() const {
  glBindTextureUnit(0, nodes_.name());
  glBindTextureUnit(1, coefficients_.name());
  glBindTextureUnit(4, linearParts_.name());
}

}  // namespace hpsdf::render
